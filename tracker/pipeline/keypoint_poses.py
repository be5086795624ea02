"""Poses from key points alone: a body fitted frame by frame, and smoothed. Pictures are not looked at."""

from collections.abc import Mapping, Sequence

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.compute.progress import Report, part_of, result_of, unreported
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_keypoints import PersonObservations, fit_to_keypoints, learn_seen_body
from tracker.estimation.fitting.gauss_newton import Fit, PosePrior, ResidualBlock, solve, weak_pull
from tracker.estimation.fitting.interpenetration import SelfPenetration
from tracker.estimation.fitting.keypoints import KeypointBlock
from tracker.estimation.trajectory.solve import PosedPath, solve_path
from tracker.evidence.keypoints import PersonKeypoints
from tracker.formats.model_toml import format_model
from tracker.geometry.cameras import Camera
from tracker.pipeline.keypoint_evidence import read_points
from tracker.session.session import Session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord


def store_keypoint_poses(
    session: Session, store: AnnotationStore, people: Sequence[int], frames: Sequence[int], name: str
) -> dict[int, int]:
    """Store poses of people by key points alone, as one entry of the history; keyframes stay.

    Args:
        session: the session, which this process has locked.
        store: its annotations.
        people: indices of the people.
        frames: that get a pose.
        name: of the observations.

    Returns:
        Number of poses of each person, by index.

    Raises:
        TrackerError: the observations have no frame with four joints of anybody.
    """
    changes, counts = list[PoseChange](), dict[int, int]()
    for i, found in poses_of(session, people, name).items():
        person = session.people[i]
        revision = store.add_model_revision(person.name, format_model(person.model))
        held = {k for k, r in store.poses(person.name, range(session.n_frames)).items() if r.keyframe}
        own = imported_changes(person.name, found, revision, name)
        own = [c for c in own if c.frame in frames and c.frame not in held]
        changes += own
        counts[i] = len(own)
    if not changes:
        raise TrackerError(f"expected a frame with four joints of a person in '{name}', found none; import other files")
    store.commit(f"poses of {name}", changes)
    return counts


def poses_of(
    session: Session, people: Sequence[int], name: str, report: Report = unreported
) -> dict[int, dict[int, PosedBody]]:
    """Return poses of people by key points alone, by index of the person and frame.

    Args:
        session: the session; nothing is stored.
        people: indices of the people; those of whom there are no key points are left out.
        name: of the observations.
        report: shows progress. An exception that it raises ends the work.
    """
    points, cameras = read_points(session, name), [c.camera for c in session.cameras]
    known = [i for i in people if i in points]
    out = dict[int, dict[int, PosedBody]]()
    for number, i in enumerate(known):
        of_person = part_of(report, number / len(known), (number + 1) / len(known))
        out[i] = keypoint_poses(session.people[i].model, points[i], cameras, session.fps, of_person)
    return out


def imported_changes(person: str, poses: Mapping[int, PosedBody], revision: int, name: str) -> list[PoseChange]:
    """Return what stores poses by key points, in a revision of the body of a person."""
    return [
        PoseChange(person, k, PoseRecord(b.values, ("imported",) * len(b.values), revision, remark=f"by {name}"))
        for k, b in poses.items()
    ]


def keypoint_poses(
    model: BodyModel, points: PersonObservations, cameras: Sequence[Camera], fps: float, report: Report = unreported
) -> dict[int, PosedBody]:
    """Fit a body to the key points of all views on each frame, robustly, and smooth its motion.

    Args:
        model: the body; its sizes stay.
        points: the key points.
        cameras: of the session, in its order.
        fps: frames per second.
        report: shows progress. An exception that it raises ends the work.

    Returns:
        The body by frame.
    """
    first = fit_to_keypoints(model, points)
    if not first:
        return {}
    # No other evidence decides where the views disagree: less weight there made `fast_arms` 3 mm worse.
    seen = learn_seen_body(first, points, cameras).keypoints(model, points, ())
    fits = dict[int, Fit]()
    for k, body in first.items():
        report("fitting poses to key points", len(fits) / len(first))
        fits[k] = _fit(body, seen, k, cameras)
    frames = sorted(fits)
    path = PosedPath(
        model, np.array(frames) / fps, np.array([fits[k].pose for k in frames]),
        lambda t: _blocks(model, seen, frames[t], cameras), np.zeros(len(frames), np.bool_),
    )  # fmt: skip
    solved = result_of(solve_path(path))
    return {k: PosedBody(model, pose) for k, pose in zip(frames, solved.poses, strict=True)}


def _fit(body: PosedBody, seen: PersonKeypoints, frame: int, cameras: Sequence[Camera]) -> Fit:
    model = body.model
    return solve(model, body.values, [*_blocks(model, seen, frame, cameras), weak_pull(model, body.values)])


def _blocks(model: BodyModel, seen: PersonKeypoints, frame: int, cameras: Sequence[Camera]) -> list[ResidualBlock]:
    views = [(c.pinhole, seen.in_view(frame, v, c.pinhole)) for v, c in enumerate(cameras)]
    return [KeypointBlock.of(views), PosePrior.of_spreads(model), SelfPenetration()]
