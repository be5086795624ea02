"""Assess one stored pose again: track towards it from both sides without each camera in turn, and compare."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tracker.compute.progress import Report, unreported
from tracker.errors import TrackerError
from tracker.evidence.observer import Observer
from tracker.fitting.consensus import agreement
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import floor_plane
from tracker.pipeline.assessed_poses import assessed_by_tracks
from tracker.pipeline.methods import make_tracker
from tracker.session.session import Session
from tracker.store.records import PoseRecord
from tracker.tracking.person_memory import HISTORY_FRAMES
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackerSettings, TrackingRun
from tracker.tracking.view_tracks import FrameTracks, left_out, tracks_without_views


@dataclass(frozen=True, eq=False)
class PoseInRun:
    """A stored pose of one person, and the poses around it."""

    frame: int
    person: int
    """Index of the person."""
    record: PoseRecord
    """The pose."""
    known: Mapping[int, Sequence[Array]]
    """Poses of all people in their present bodies, (n_values,) each, by frame: on this frame, and on those of
    `frames_around`."""
    active_dofs: NDArray[np.bool_] | None = None
    """Degrees of freedom of the person that may move, (n_dofs,); None: all."""


def frames_around(frame: int, posed: Sequence[int]) -> list[range]:
    """Return the frames of tracks that come to a frame from before and from after, in their order.

    They begin where tracks have the time to come apart, or at the first frame without a pose on the way. Frames that a
    run has left out by its stride are left out here, too.

    Args:
        frame: the frame.
        posed: frames on which everybody has a pose, ascending.
    """
    out, there = [], set(posed)
    beside = [*[k for k in posed if k < frame][-1:], *[k for k in posed if k > frame][:1]]
    for first in beside:
        step = frame - first
        while abs(frame - first) < HISTORY_FRAMES * abs(step) and first - step in there:
            first -= step
        out.append(range(first, frame + step, step))
    return out


def checked_pose(
    session: Session, observer: Observer, settings: TrackerSettings, pose: PoseInRun, report: Report = unreported
) -> PoseRecord:
    """Return a pose with its errors, status and reason, by tracks that come to it from the frames around.

    The audit of a run assesses poses by the same tracks (`tracker.pipeline.audit`). These have not seen the pose: one
    that was set by hand is compared with them as any other. Alternatives do not make it doubtful.

    Args:
        session: the session.
        observer: of its recording.
        settings: of the tracker.
        pose: the pose.
        report: shows progress. An exception that it raises ends the work.

    Raises:
        TrackerError: there are fewer than three views, or no pose on the frames around.
    """
    ways, names = frames_around(pose.frame, sorted(pose.known)), [c.camera.name for c in observer.cameras]
    if not left_out(len(names)) or not ways:
        raise TrackerError(
            "expected three cameras or more and a pose on a frame before or after, to assess a pose by tracks, found "
            f"{len(names)} cameras and poses on {len(ways)} sides; it stays without a status"
        )
    models, found, done = [p.model for p in session.people], list[FrameTracks](), 0
    active = [pose.active_dofs if i == pose.person else None for i in range(len(models))]
    subjects = Subjects.of(models, (pose.person,), active, _others(pose))
    for way in ways:
        run = TrackingRun(
            observer, subjects, [[p, p] for p in pose.known[way[0]]], way, session.fps,
            floor_plane(session.up, session.floor),
        )  # fmt: skip
        for frame, tracks in tracks_without_views(make_tracker(settings), run, pose.known):
            done += 1
            report("checking each camera", done / sum(map(len, ways)))
            if frame == pose.frame:
                found.append(tracks[pose.person])
    joined = FrameTracks(
        np.concatenate([f.poses for f in found]), np.concatenate([f.trust for f in found]),
        tuple(name for f in found for name in f.without),
    )  # fmt: skip
    model, record = models[pose.person], replace(pose.record, remark="")
    spread = agreement(model, record.values, joined.poses, joined.trust)
    return assessed_by_tracks(model, record, spread, joined, is_ambiguous=False)


def _others(pose: PoseInRun) -> dict[int, dict[int, Array]]:
    """Return the poses of the other people, who stay there, by frame and index of the person."""
    return {k: {i: p for i, p in enumerate(poses) if i != pose.person} for k, poses in pose.known.items()}
