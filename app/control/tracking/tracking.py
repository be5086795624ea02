"""The tracking run: frame after frame from the one shown, watched, paused, saved as one entry of the history."""

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from app.runtime.jobs import Job
from app.state.people import ShownPose
from app.state.progress import TrackState
from app.state.state import StateChanges, finite_or_none
from tracker.errors import TrackerError
from tracker.pipeline.methods import make_tracker
from tracker.pipeline.track_session import Step, TrackSession
from tracker.pipeline.tracked_changes import StoredPerson
from tracker.store.records import PoseChange
from tracker.tracking import confidence
from tracker.tracking.estimate import BackwardStep, PoseEstimate
from tracker.tracking.subjects import Subjects
from tracker.tracking.tracker import TrackingRun

_SAVE_S = 0.5
"""A running tracker is on disk at least this often, and writes no more often of its own accord."""


class _Run(NamedTuple):
    """A tracking run and the job that drives it in a worker thread."""

    session: TrackSession
    job: Job[Step]

    @property
    def subjects(self) -> Subjects:
        """The people whom it tracks, and their keyframes."""
        return self.session.run.subjects


class _SaverSink:
    """Saves the poses of a run through the saver, which retries failed writes."""

    def __init__(self, screen: SessionState) -> None:
        self._screen = screen

    def write(self, label: str, changes: Sequence[PoseChange], edit: int | None) -> int | None:
        """See `Sink.write`. Where writing fails the state has the reason."""
        found = self._screen.saver.write(label, changes, edit, by_program=True)
        self._screen.last_save = time.monotonic()
        self._screen.refresh_saving()
        return found


class Tracking:
    """At most one tracking run, which is at work or paused."""

    def __init__(self, screen: SessionState, activities: Activities) -> None:
        """Track nothing yet.

        Args:
            screen: holds the state.
            activities: ends searches and gestures before a run.
        """
        self._screen, self._activities = screen, activities
        activities.add_job(self, on_shown_frame=True)
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
        with self._activities.editing():
            state, saver = screen.state, screen.saver
            models = screen.present
            people = tuple(i for i in range(len(models)) if saver.frames(i))
            if not people:
                raise TrackerError("expected a person who has been placed, found none; pose the body here first")
            frames = self._frames(backward, until, people)
            way = "backward" if backward else "forward"
            free = [screen.active_dofs(person) for person in range(len(models))]
            session = TrackSession(
                make_tracker(state.settings),
                TrackingRun(
                    screen.frames.observer,
                    Subjects.of(models, people, free, saver.keyframes(frames)),
                    screen.present_poses(),
                    frames,
                ),
                [StoredPerson(p.name, saver.revision(i)) for i, p in enumerate(screen.session.people)],
                _SaverSink(screen),
                f"track {way} from frame {frames[0]}",
            )
            job = Job(
                session.steps,
                lambda step, seconds: self._stepped(run, step, seconds),
                lambda error: self._ended(run, error),
                lambda: self._paused(run),
            )
            run = _Run(session, job)
            self._run, screen.open_edit_owner = run, None
            track = TrackState(running=True, first=frames[0], last=frames[-1], total=len(frames))
            screen.set(track=track, follow=True)
            run.job.run()

    def resume(self) -> None:
        """Continue a paused run, if there is one."""
        with self._activities.starting(self):
            if self._run is not None and not self._run.job.running:
                self._screen.set(track=replace(self._screen.state.track, running=True))
                self._run.job.run()

    def pause(self) -> None:
        """Pause a running run with its results on disk. The caller must not hold the lock: the last step takes it."""
        run = self._run
        if run is not None:
            run.job.stop()

    def halt(self) -> None:
        """Pause a running run, and keep the shown frame: it is about to be changed. See `pause`."""
        if self.running:
            self._screen.set(follow=False)
        self.pause()

    def stop(self) -> None:
        """End the run; its results stay. The caller must not hold the lock."""
        self.halt()
        self.forget()

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
                self._run.session.save()

    def follow(self, follow: bool) -> None:
        """Show each frame as it is tracked, from the last one on; or stay where the user looks."""
        with self._screen.lock:
            self._screen.set(follow=follow)
            at = self._screen.state.track.at
            if follow and at is not None and at != self._screen.state.frame:
                self.flush()
                self._screen.show_frame(at)

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

    def _stepped(self, run: _Run, step: Step, seconds: float) -> None:
        with self._screen.lock:
            if run is self._run:
                run.session.take(step)
                if isinstance(step, BackwardStep):
                    self._show_improved(run, step, seconds)
                else:
                    self._show_tracked(run, step, seconds)

    def _show_improved(self, run: _Run, step: BackwardStep, seconds: float) -> None:
        """Show the progress of the second pass, and what it improved at the end of an interval."""
        screen, tracked = self._screen, run.session.tracked
        track = screen.state.track
        if step.better:  # not at every step: there may be many frames
            worst = Counter(confidence.worst([f.statuses[i] for i in run.subjects.tracked]) for f in tracked.values())
            track = replace(track, doubtful=worst["doubtful"], lost=worst["lost"])
        steps = len(tracked) + step.done
        screen.set(track=replace(
            track, running=run.job.running, back=True, done=step.done, total=step.total,
            per_second=steps / max(1e-6, seconds),
        ))  # fmt: skip
        if screen.state.frame in {found.frame for found in step.better}:
            screen.show_frame(screen.state.frame, follow=screen.state.follow)

    def _show_tracked(self, run: _Run, found: PoseEstimate, seconds: float) -> None:
        """Show the progress of the first pass, and the frame if it is shown or followed."""
        screen = self._screen
        worst = confidence.worst([found.statuses[i] for i in run.subjects.tracked])
        track = screen.state.track
        done = track.done + 1
        track = replace(
            track, running=run.job.running, at=found.frame, done=done, per_second=done / max(1e-6, seconds),
            doubtful=track.doubtful + (worst == "doubtful"), lost=track.lost + (worst == "lost"),
        )  # fmt: skip
        if screen.state.follow or screen.state.frame == found.frame:
            changes = self._found(run, found)
            changes["track"] = track
            screen.set(**changes)
        else:
            screen.set(track=track)
        if time.monotonic() - screen.last_save > _SAVE_S:
            run.session.save()

    def _found(self, run: _Run, found: PoseEstimate) -> StateChanges:
        """Return the fields of the state that show a tracked frame."""
        keyframes, tracked = run.subjects.keyframes_at(found.frame), run.subjects.tracked
        people = []
        for i, shown in enumerate(self._screen.state.people):
            stored = self._screen.saver.pose(i, found.frame) if i in keyframes or i not in tracked else None
            if stored is not None:
                people.append(stored)
            elif i not in tracked:
                people.append(ShownPose(shown.values, None, revision=self._screen.state.revisions[i]))
            else:
                part_costs_px = tuple(finite_or_none(c) for c in found.part_costs_px[i])
                people.append(ShownPose(found.poses[i], "tracked", found.statuses[i], found.notes[i], part_costs_px))
        models, revisions = self._screen.bodies(people)
        return {
            "frame": found.frame,
            "people": tuple(people),
            "models": models,
            "revisions": revisions,
            "cost_px": finite_or_none(found.cost_px),
            "view_costs_px": tuple(finite_or_none(c) for c in found.view_costs_px),
        }

    def _paused(self, run: _Run) -> None:
        with self._screen.lock:
            if run is self._run:
                run.session.save()
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
        run.session.save()
        track = self._screen.state.track
        self._run = None
        self._screen.set(track=TrackState(message=f"{how}: {_summary(len(run.session.tracked), track)}", failed=failed))


def _summary(frames: int, track: TrackState) -> str:
    """What a run has done, for people to read."""
    odd = [f"{n} {what}" for n, what in ((track.doubtful, "doubtful"), (track.lost, "lost")) if n]
    return ", ".join([f"{frames} frame{'' if frames == 1 else 's'}", *odd])
