"""The tracking run: frame after frame from the one shown, watched, paused, saved as one entry of the history."""

import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from app.control.session.session_state import Screen
from app.runtime.jobs import Job
from app.state.state import Shown, TrackState, finite_or_none
from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.evidence.observer import Observer
from tracker.geometry.arrays import Array
from tracker.tracking import confidence
from tracker.tracking.chamfer.backward_pass import Followed, Tracked, follow_back
from tracker.tracking.chamfer.settings import TrackSettings
from tracker.tracking.chamfer.tracker import track_chamfer
from tracker.tracking.confidence import Status
from tracker.tracking.estimate import PoseEstimate

_SAVE_S = 0.5
"""A running tracker is on disk at least this often, and writes no more often of its own accord."""


@dataclass(eq=False)
class _Run:
    """One run: what it was told, and what is not on disk yet."""

    label: str
    """What the history says."""
    people: tuple[int, ...]
    """Whom it tracks."""
    settings: TrackSettings
    fixed: Mapping[int, Mapping[int, Array]]
    """Keyframes on its way, by frame and person."""
    job: Job[PoseEstimate | Followed] = field(init=False)
    statuses: dict[int, tuple[Status, ...]] = field(default_factory=dict)
    """Of each frame that it has tracked, everybody's."""
    waiting: list[PoseEstimate] = field(default_factory=list)
    """Found, but not yet on disk."""
    edit: int | None = None
    """Its entry of the history; None before the first save."""


class Tracking:
    """At most one tracking run, which is at work or paused."""

    def __init__(self, screen: Screen) -> None:
        """Track on this screen."""
        self._screen = screen
        self._run: _Run | None = None

    @property
    def running(self) -> bool:
        """Whether a run is at work."""
        return self._run is not None and self._run.job.running

    def start(self, backward: bool, until: int | None) -> None:
        """Begin a run from the poses shown; one that stands must have been forgotten.

        Args:
            backward: towards the first frame.
            until: last frame to track; None for the end of the recording.

        Raises:
            TrackerError: nobody has been placed, or there is no frame to track.
        """
        screen = self._screen
        with screen.lock:
            state, saver = screen.state, screen.saver
            models = screen.present
            people = tuple(i for i in range(len(models)) if saver.frames(i))
            if not people:
                raise TrackerError("expected a person who has been placed, found none; pose the body here first")
            frames = self._frames(backward, until, people)
            way, settings, poses = "backward" if backward else "forward", state.settings, screen.present_poses()
            run = _Run(f"track {way} from frame {frames[0]}", people, settings, saver.keyframes(frames))
            fixed = {frame: dict(held) for frame, held in run.fixed.items()}
            free = [screen.free(person) for person in range(len(models))]
            run.job = Job(
                lambda: _both_passes(screen.frames.observer, models, poses, frames, settings, fixed, people, free),
                lambda found, seconds: self._stepped(run, found, seconds),
                lambda error: self._ended(run, error),
                lambda: self._paused(run),
            )
            self._run, screen.edit_of = run, None
            track = TrackState(running=True, first=frames[0], last=frames[-1], total=len(frames))
            screen.set(track=track, follow=True)
            run.job.run()

    def go_on(self) -> None:
        """Go on with a run that is paused; nothing where none is."""
        with self._screen.lock:
            if self._run is not None and not self._run.job.running:
                self._screen.set(track=replace(self._screen.state.track, running=True))
                self._run.job.run()

    def halt(self, stay: bool = False) -> None:
        """Pause a run that is at work; must not be called holding the lock, which its last step takes.

        Args:
            stay: show what is shown now, whatever the last step finds: a hand is about to change it.
        """
        run = self._run
        if run is not None:
            if stay and run.job.running:
                self._screen.set(follow=False)
            run.job.stop()

    def forget(self) -> None:
        """End a run that has been halted: what it found stays, and it goes on no more. The last message is over."""
        with self._screen.lock:
            if self._run is not None:
                self._end(self._run, "stopped")
            elif self._screen.state.track.message:
                self._screen.set(track=TrackState())

    def flush(self) -> None:
        """Bring on disk what a run has found, so that every frame can be looked at."""
        with self._screen.lock:
            if self._run is not None:
                self._save(self._run)

    def follow(self, follow: bool) -> None:
        """Show each frame as it is tracked, from the last one on; or stay where the user looks."""
        with self._screen.lock:
            self._screen.set(follow=follow)
            at = self._screen.state.track.at
            if follow and at is not None and at != self._screen.state.frame:
                self.flush()
                self._screen.show(at)

    def _frames(self, backward: bool, until: int | None, people: Sequence[int]) -> range:
        """Frames to track in their order: from the one shown where somebody has no stored pose on it, else the next."""
        screen, step = self._screen, -1 if backward else 1
        last = screen.session.n_frames - 1
        end = (0 if backward else last) if until is None else min(max(0, until), last)
        state = screen.state
        first = state.frame if any(state.people[i].source is None for i in people) else state.frame + step
        frames = range(first, end + step, step)
        if not frames:
            raise TrackerError(
                f"expected frames to track {'before' if backward else 'after'} frame {state.frame}, found none up to "
                f"frame {end}; go elsewhere or track the other way"
            )
        return frames

    def _stepped(self, run: _Run, found: PoseEstimate | Followed, seconds: float) -> None:
        with self._screen.lock:
            if run is self._run:
                if isinstance(found, Followed):
                    self._followed(run, found, seconds)
                else:
                    self._tracked(run, found, seconds)

    def _followed(self, run: _Run, step: Followed, seconds: float) -> None:
        """Take a step of the second pass; at the end of a stretch what is better takes its place, on disk at once."""
        screen = self._screen
        self._save(run)
        if step.better:
            self._write(run, step.better, (step.person,))
        run.statuses |= {found.frame: found.statuses for found in step.better}
        track = screen.state.track
        if step.better:  # not at every step: there may be many frames
            worst = Counter(confidence.worst([s[i] for i in run.people]) for s in run.statuses.values())
            track = replace(track, doubtful=worst["doubtful"], lost=worst["lost"])
        steps = len(run.statuses) + step.done
        screen.set(track=replace(
            track, running=run.job.running, back=True, done=step.done, total=step.total,
            per_second=steps / max(1e-6, seconds),
        ))  # fmt: skip
        if screen.state.frame in {found.frame for found in step.better}:
            screen.show(screen.state.frame, follow=screen.state.follow)

    def _tracked(self, run: _Run, found: PoseEstimate, seconds: float) -> None:
        screen = self._screen
        run.waiting.append(found)
        run.statuses[found.frame] = found.statuses
        worst = confidence.worst([found.statuses[i] for i in run.people])
        track = screen.state.track
        done = track.done + 1
        track = replace(
            track, running=run.job.running, at=found.frame, done=done, per_second=done / max(1e-6, seconds),
            doubtful=track.doubtful + (worst == "doubtful"), lost=track.lost + (worst == "lost"),
        )  # fmt: skip
        if screen.state.follow or screen.state.frame == found.frame:
            screen.set(track=track, **self._found(run, found))
        else:
            screen.set(track=track)
        if time.monotonic() - screen.last_save > _SAVE_S:
            self._save(run)

    def _found(self, run: _Run, found: PoseEstimate) -> dict[str, object]:
        """The state's fields that show a tracked frame."""
        held = run.fixed.get(found.frame, {})
        people = []
        for i, shown in enumerate(self._screen.state.people):
            stored = self._screen.saver.pose(i, found.frame) if i in held or i not in run.people else None
            if stored is not None:
                people.append(stored)
            elif i not in run.people:
                people.append(Shown(shown.values, None, revision=self._screen.state.revisions[i]))
            else:
                parts_px = tuple(finite_or_none(c) for c in found.parts_px[i])
                people.append(Shown(found.poses[i], "tracked", found.statuses[i], found.remarks[i], parts_px))
        models, revisions = self._screen.bodies(people)
        return {
            "frame": found.frame,
            "people": tuple(people),
            "models": models,
            "revisions": revisions,
            "cost_px": finite_or_none(found.cost_px),
            "view_costs_px": tuple(finite_or_none(c) for c in found.views_px),
        }

    def _save(self, run: _Run) -> None:
        """Write what waits. Where writing fails the state says why, and it is tried again."""
        if not run.waiting:
            return
        self._write(run, run.waiting, run.people)
        run.waiting.clear()

    def _write(self, run: _Run, found: Sequence[PoseEstimate], people: Sequence[int]) -> None:
        screen = self._screen
        run.edit = screen.saver.save_tracked(found, people, run.fixed, run.settings, run.label, run.edit)
        screen.last_save = time.monotonic()
        screen.refresh_saving()

    def _paused(self, run: _Run) -> None:
        with self._screen.lock:
            if run is self._run:
                self._save(run)
                self._screen.set(track=replace(self._screen.state.track, running=False))
                self._screen.request_evidence()

    def _ended(self, run: _Run, error: Exception | None) -> None:
        with self._screen.lock:
            if run is not self._run:
                return
            if error is None:
                how = "done"
            else:
                why = str(error) if isinstance(error, TrackerError) else f"the tracker failed: {error}"
                how = f"stopped, because {why}"
            self._end(run, how, error is not None)
            self._screen.request_evidence()

    def _end(self, run: _Run, how: str, failed: bool = False) -> None:
        self._save(run)
        track = self._screen.state.track
        self._run = None
        self._screen.set(track=TrackState(message=f"{how}: {_summary(len(run.statuses), track)}", failed=failed))


def _both_passes(
    observer: Observer, models: Sequence[BodyModel], start: Sequence[Array], frames: Sequence[int],
    settings: TrackSettings, fixed: Mapping[int, Mapping[int, Array]], people: Sequence[int],
    free: Sequence[NDArray[np.bool_]],
) -> Iterator[PoseEstimate | Followed]:  # fmt: skip
    """Track frame by frame, then follow back whoever was lost; arguments as of `track_chamfer`."""
    tracked = []
    for found in track_chamfer(observer, models, start, frames, settings, fixed, people, free):
        tracked.append(Tracked.of(found))
        yield found
    if settings.second_pass:
        yield from follow_back(observer, models, tracked, settings, fixed, people, free)


def _summary(frames: int, track: TrackState) -> str:
    """What a run has done, for people to read."""
    odd = [f"{n} {what}" for n, what in ((track.doubtful, "doubtful"), (track.lost, "lost")) if n]
    return ", ".join([f"{frames} frame{'' if frames == 1 else 's'}", *odd])
