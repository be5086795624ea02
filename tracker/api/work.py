"""Find people, acquire their sizes, and track them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from tracker.api.sessions import PersonName, SessionOrFolder, frames_of, opened, people_of, person_of
from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_contours import Acquisition, AcquisitionSettings
from tracker.estimation.initialization.frame_trials import Trying
from tracker.estimation.tracking.method import OptionValue
from tracker.pipeline.automatic_run import ChainPlan, StoredSession, find_and_track, unplaced
from tracker.pipeline.body_acquisition import acquire_body
from tracker.pipeline.find_people import FindSettings, find_people, sentences
from tracker.pipeline.methods import method_named
from tracker.pipeline.stored_run import TrackPlan
from tracker.pipeline.track_session import Step, TrackSession
from tracker.session.matching import check_names

Progress: TypeAlias = Callable[[str, float], None]
"""Receives the kind of work and the share that is done, 0 to 1. Raise to stop; what was stored stays."""


@dataclass(frozen=True)
class Found:
    """People who were found."""

    frame: int | None
    """The frame of their first poses; None if nobody was missing."""
    people: tuple[str, ...]
    """Names of those who were found."""
    sentences: tuple[str, ...] = ()
    """How each was found, and what is in doubt."""


@dataclass(frozen=True)
class Tracked:
    """The result of a tracking run."""

    frames: int
    """Number of frames tracked."""
    statuses: Mapping[str, Mapping[str, int]]
    """Number of frames by person and status: good, doubtful, lost."""
    mean_cost_px: float
    """Mean chamfer cost, px of the footage; NaN if none is known."""
    first_frame: int | None
    """The frame that the run went out from in both directions."""
    contradiction: str
    """A sentence on a camera that seems off; empty without one."""


def find(
    session: SessionOrFolder,
    people: Sequence[str] | None = None,
    frames: Sequence[int] | None = None,
    *,
    keypoints: str | None = None,
    progress: Progress | None = None,
) -> Found:
    """Find the first poses of the people who have none, all on one frame, and store them.

    Args:
        session: the session or its folder.
        people: names; all by default. Those who have a pose are left alone.
        frames: that may be used; all by default.
        keypoints: name of observations that show the people; by default those of the session, or the silhouettes.
        progress: receives the progress.

    Raises:
        TrackerError: no frame shows the people well enough, or another program has the session open.
    """
    with opened(session) as stored:
        missing = unplaced(stored, people_of(stored.session, people))
        if not missing:
            return Found(None, ())
        used, settings = frames_of(stored.session, frames), FindSettings(keypoints=keypoints)
        sink = ProgressSink(progress)
        first_poses = find_people(stored.session, stored.observer, missing, used, settings, sink.report)
        stored.store_found(first_poses)
        names = tuple(stored.session.people[i].name for i in first_poses.poses)
        return Found(first_poses.frame, names, tuple(sentences(stored.session, first_poses)))


def acquire(
    session: SessionOrFolder,
    person: PersonName = None,
    frames: Sequence[int] | None = None,
    *,
    n_frames: int = AcquisitionSettings.n_frames,
    progress: Progress | None = None,
) -> Acquisition:
    """Acquire the sizes of a person's body from the contours, and make it the present body if it fits better.

    Args:
        session: the session or its folder.
        person: name; needed in a session of several people, who need a pose on one frame.
        frames: that may be used; all by default.
        n_frames: number of frames that the sizes are fitted to.
        progress: receives the progress.

    Returns:
        The body, its standard deviations, and the costs before and after. `is_better` says whether it was stored.

    Raises:
        TrackerError: the person has no pose, the views show nothing of them, or another program has the session open.
    """
    with opened(session) as stored:
        index = person_of(stored.session, person)
        used, settings = frames_of(stored.session, frames), AcquisitionSettings(n_frames=n_frames)
        report = ProgressSink(progress).report
        acquired = acquire_body(stored.session, stored.observer, index, used, settings, report)
        if acquired.is_better:
            stored.store_body(index, acquired, acquired.frames[0])
        return acquired


def track(
    session: SessionOrFolder,
    people: Sequence[str] | None = None,
    frames: Sequence[int] | None = None,
    *,
    method: str = "chamfer",
    options: Mapping[str, OptionValue] | None = None,
    cameras: Sequence[str] = (),
    find_missing: bool = False,
    acquire_sizes: bool = False,
    keypoints: str | None = None,
    progress: Progress | None = None,
) -> Tracked:
    """Track people out from the frame on which they have a pose, and store the poses as one entry of the history.

    The same call goes on where it was stopped.

    Args:
        session: the session or its folder.
        people: names; all by default.
        frames: at one distance from one another; all by default.
        method: chamfer, contour or voxel.
        options: of the method, by name, as `quadrille track --help` lists them.
        cameras: names of the cameras to track with; all by default.
        find_missing: find people who have no pose first.
        acquire_sizes: acquire the sizes of people whose bodies have those of a preset before.
        keypoints: name of imported observations that are evidence too.
        progress: receives the progress.

    Raises:
        TrackerError: somebody has no pose, or an option is not one of the method.
    """
    with opened(session) as stored:
        used, chosen = frames_of(stored.session, frames), people_of(stored.session, people)
        plan = track_plan(chosen, used, method, options, keypoints)
        views = check_names(cameras, list(stored.session.camera_names), "camera", "cameras")
        find_settings = FindSettings(keypoints=keypoints) if find_missing else None
        chain = ChainPlan(replace(plan, cameras=tuple(views)), find_settings, chosen if acquire_sizes else ())
        find_and_track(chain, stored, ProgressSink(progress))
        return tracked_of(stored)


def track_plan(
    people: tuple[int, ...],
    frames: Sequence[int],
    method: str,
    options: Mapping[str, OptionValue] | None,
    keypoints: str | None,
) -> TrackPlan:
    """Return a plan with the settings of a method; see `track` for its arguments.

    Raises:
        TrackerError: the frames are not at one distance from one another, or an option is not one of the method.
    """
    if not isinstance(frames, range):
        raise TrackerError("expected frames at one distance from one another, found others; give a range")
    by = method_named(method)
    names = {option.name for option in by.options}
    if unknown := sorted(set(options or {}) - names):
        raise TrackerError(f"expected options among {', '.join(sorted(names))}, found '{unknown[0]}'; correct it")
    settings = by.at_stride(by.with_options(by.settings(), dict(options or {})), frames.step)
    return TrackPlan(frames, people, settings, keypoints=keypoints)


def tracked_of(stored: StoredSession) -> Tracked:
    """Return the result of the last run of a session."""
    plan, run = stored.plan, stored.run
    assert plan is not None
    assert run is not None
    costs = [c for c in run.costs_px.values() if np.isfinite(c)]
    counts = zip(plan.people, run.status_counts(), strict=True)
    statuses = {stored.session.people[i].name: {str(s): n for s, n in own.items()} for i, own in counts}
    mean = float(np.mean(costs)) if costs else float("nan")
    return Tracked(len(run.costs_px), statuses, mean, plan.start, run.contradiction or "")


class ProgressSink:
    """The sink of a chain that reports to a function."""

    def __init__(self, progress: Progress | None) -> None:
        """Report to a function, or to nobody."""
        self._progress = progress or (lambda stage, share: None)

    def report(self, stage: str, share: float, text: str = "", /) -> None:
        """See `Sink.report`."""
        self._progress(stage, share)

    def show(self, trying: Trying) -> None:
        """See `Sink.show`."""

    def take(self, run: TrackSession, step: Step) -> None:
        """See `Sink.take`."""
        total = max(1, len(run.frames))
        self._progress("tracking", min(1.0, len(run.costs_px) / total))
