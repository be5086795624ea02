"""Read the frames of a session from which its cameras are judged."""

from collections.abc import Mapping, Sequence

import numpy as np

from tracker.acquisition.from_contours import learn_static_edges
from tracker.calibration.seen_frames import SeenFrame, spread_poses, velocity
from tracker.compute.progress import Report, unreported
from tracker.errors import Remedy, TrackerError
from tracker.evidence.observer import Observer
from tracker.session.session import Session
from tracker.store.stored_poses import StoredPose, read_stored_poses
from tracker.tracking.view_regions import regions

N_FRAMES = 20
"""Frames of diverse poses that a check uses."""


def read_seen_frames(
    session: Session, observer: Observer, frames: Sequence[int] | None = None, n: int = N_FRAMES,
    report: Report = unreported,
) -> list[SeenFrame]:  # fmt: skip
    """Read frames of diverse poses on which everybody has a credible pose.

    Raises:
        TrackerError: there are fewer than three of them.
    """
    stored = [read_stored_poses(session.annotations_path, p.name, p.model) for p in session.people]
    stored = [s for s in stored if s]
    usable = credible_frames(stored, frames)
    if len(usable) < 3:
        raise TrackerError(
            f"expected at least 3 frames with poses that are not lost, and poses on the frames around them, found "
            f"{len(usable)}; track the recording first",
            Remedy("place_body"),
        )
    joints = np.array([np.concatenate([s[k].body.points_world for s in stored]) for k in usable])
    chosen = [usable[i] for i in spread_poses(joints, n)]
    bodies = {k: tuple(s[k].body for s in stored) for k in chosen}
    static_edges = learn_static_edges(observer, bodies)
    out = []
    for i, k in enumerate(chosen):
        report("reading contours", i / len(chosen))
        views = observer.evidence(k, regions(observer.working_cameras, bodies[k]), None, static_edges)
        velocities = tuple(
            velocity(s[k].body.model, [s[j].body.values for j in range(k - 2, k + 3)], session.fps) for s in stored
        )
        out.append(SeenFrame(k, views, bodies[k], velocities))
    return out


def credible_frames(stored: Sequence[Mapping[int, StoredPose]], frames: Sequence[int] | None) -> list[int]:
    """Return the frames on which everybody has a pose that is not lost, and poses in the same body around it."""

    def is_credible(own: Mapping[int, StoredPose], k: int) -> bool:
        around = [own.get(j) for j in range(k - 2, k + 3)]
        same = all(a is not None and a.body.model is own[k].body.model for a in around)
        return same and own[k].record.status != "lost"

    posed = set.intersection(*(set(s) for s in stored)) if stored else set()
    wanted = posed if frames is None else posed & set(frames)
    return [k for k in sorted(wanted) if all(is_credible(own, k) for own in stored)]
