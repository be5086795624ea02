"""Assess one stored pose again: compare it with all others that it may be, over the frames around it."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.body.motion.history import HISTORY_FRAMES
from tracker.compute.progress import Report, mapped, result_of, unreported
from tracker.errors import TrackerError
from tracker.estimation.by_frame.settings import EstimationSettings
from tracker.estimation.runs.frame_hypotheses import Proposal
from tracker.estimation.runs.path_assessment import RunPose
from tracker.estimation.runs.run_estimate import RunFrames, estimate_run
from tracker.estimation.tracking.tracker import Subjects
from tracker.evidence.observer import Observer
from tracker.geometry.arrays import Array
from tracker.pipeline.tracked_changes import assessed_by_run
from tracker.session.session import Session
from tracker.session.store.records import PoseRecord


@dataclass(frozen=True, eq=False)
class PoseInRun:
    """A pose of one person, and the poses around it."""

    frame: int
    person: int
    """Index of the person."""
    known: Mapping[int, Sequence[Array]]
    """Poses of all people in their present bodies, (n_values,) each, by frame: on this frame, and on those of
    `frames_around`."""
    alternatives: Sequence[Array] = ()
    """Stored alternatives of the pose, (n_values,) each. They are proposed, too."""
    active_dofs: NDArray[np.bool_] | None = None
    """Degrees of freedom of the person that may move, (n_dofs,); None: all."""


def frames_around(frame: int, posed: Sequence[int]) -> list[int]:
    """Return a frame and those around it by which its pose is assessed, ascending, as many to each side as a tracker
    remembers, up to the next one without a pose.

    Frames that a run has left out by its stride are left out here, too.

    Args:
        frame: the frame.
        posed: frames on which everybody has a pose, ascending.
    """
    stretch, there = {frame}, set(posed)
    for beside in (*[k for k in posed if k < frame][-1:], *[k for k in posed if k > frame][:1]):
        step = beside - frame
        way = itertools.takewhile(lambda k: k in there, (frame + i * step for i in range(1, HISTORY_FRAMES + 1)))
        stretch.update(way)
    return sorted(stretch)


def compared_pose(
    session: Session, observer: Observer, settings: EstimationSettings, pose: PoseInRun, report: Report = unreported
) -> RunPose:
    """Return what the frames around say about a pose, which stays. It is compared as any other, also if set by hand.

    Args:
        session: the session.
        observer: of its recording.
        settings: of the tracker.
        pose: the pose.
        report: shows progress. An exception that it raises ends the work.

    Raises:
        TrackerError: there is one view, or no pose on the frames around.
    """
    frames, n_views = frames_around(pose.frame, sorted(pose.known)), len(observer.cameras)
    if n_views < 2 or len(frames) < 2:
        raise TrackerError(
            "expected two cameras or more and a pose on a frame before or after, to assess a pose, found "
            f"{n_views} cameras and poses on {len(frames) - 1} frames around; it stays without a status"
        )
    models = [p.model for p in session.people]
    active = [pose.active_dofs if i == pose.person else None for i in range(len(models))]
    subjects = Subjects.of(models, (pose.person,), active)
    known = {k: pose.known[k] for k in frames}
    others = {(pose.frame, pose.person): [Proposal(values, "alternative") for values in pose.alternatives]}
    steps = estimate_run(RunFrames(observer, subjects, settings, session.fps, known, others, stays=True))
    estimate = result_of(mapped(steps, lambda step: report("comparing poses", step.done / step.total)))
    return estimate[pose.person][pose.frame]


def checked_pose(model: BodyModel, record: PoseRecord, found: RunPose) -> PoseRecord:
    """Return a stored pose with its errors, status and reason, by what the frames around say; see `compared_pose`."""
    return assessed_by_run(model, replace(record, remark=""), found)
