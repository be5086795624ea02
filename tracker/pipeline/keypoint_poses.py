"""Poses from key points alone: a body fitted frame by frame, and smoothed. Pictures are not looked at."""

from collections.abc import Sequence

import numpy as np

from tracker.acquisition.from_keypoints import fit_to_keypoints, learn_seen_body
from tracker.body.model import BodyModel, PosedBody
from tracker.errors import TrackerError
from tracker.evidence.keypoints import PersonKeypoints
from tracker.fitting.gauss_newton import Fit, PosePrior, ResidualBlock, covariance, solve, weak_pull
from tracker.fitting.interpenetration import SelfPenetration
from tracker.fitting.keypoints import KeypointBlock
from tracker.formats.model_toml import format_model
from tracker.geometry.cameras import Camera
from tracker.motion.smoothing import PoseTrack, smooth_poses
from tracker.observations.body_points import BodyPoints
from tracker.pipeline.keypoint_evidence import read_points
from tracker.session.session import Session
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import PoseChange, PoseRecord


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
    points, cameras = read_points(session, name), [c.camera for c in session.cameras]
    changes, counts = list[PoseChange](), dict[int, int]()
    for i in (i for i in people if i in points):
        person = session.people[i]
        revision = store.add_model_revision(person.name, format_model(person.model))
        held = {k for k, r in store.poses(person.name, range(session.n_frames)).items() if r.keyframe}
        found = keypoint_poses(person.model, points[i], cameras, session.fps)
        poses = {k: body for k, body in found.items() if k in frames and k not in held}
        for k, body in poses.items():
            sources = ("imported",) * len(body.values)
            changes.append(PoseChange(person.name, k, PoseRecord(body.values, sources, revision, remark=f"by {name}")))
        counts[i] = len(poses)
    if not changes:
        raise TrackerError(f"expected a frame with four joints of a person in '{name}', found none; import other files")
    store.commit(f"poses of {name}", changes)
    return counts


def keypoint_poses(model: BodyModel, points: BodyPoints, cameras: Sequence[Camera], fps: float) -> dict[int, PosedBody]:
    """Fit a body to the key points of all views on each frame, robustly, and smooth its motion.

    Args:
        model: the body; its sizes stay.
        points: the key points.
        cameras: of the session, in its order.
        fps: frames per second.

    Returns:
        The body by frame.
    """
    first = fit_to_keypoints(model, points)
    if not first:
        return {}
    seen = learn_seen_body(first, points, cameras).keypoints(model, points)
    fits = {k: _fit(body, seen, k, cameras) for k, body in first.items()}
    frames, n = sorted(fits), model.n_dofs
    track = PoseTrack(
        model, np.array(frames) / fps, np.array([fits[k].pose for k in frames]),
        np.array([covariance(model, fits[k]) for k in frames]), np.zeros(len(frames), np.bool_),
        np.ones((len(frames), n), np.bool_),
    )  # fmt: skip
    return {k: PosedBody(model, pose) for k, pose in zip(frames, smooth_poses(track), strict=True)}


def _fit(body: PosedBody, seen: PersonKeypoints, frame: int, cameras: Sequence[Camera]) -> Fit:
    views = [(c.pinhole, seen.in_view(frame, v, c.pinhole)) for v, c in enumerate(cameras)]
    model = body.model
    blocks: list[ResidualBlock] = [
        KeypointBlock.of(views), PosePrior.of_spreads(model), SelfPenetration(), weak_pull(model, body.values)
    ]  # fmt: skip
    return solve(model, body.values, blocks)
