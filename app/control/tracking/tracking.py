"""Track from the shown frame in a worker thread: show progress, pause, resume, and save as one history entry."""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from app.control.tracking import track_settings
from app.control.tracking.run_display import RunDisplay
from app.remedies import page_text
from app.runtime.jobs import Job
from app.state.progress import TrackState
from app.state.run_choices import RunChoices
from app.storage.edit_claims import EditClaimError
from tracker.errors import Remedy, TrackerError
from tracker.estimation.tracking.confidence import Status
from tracker.estimation.tracking.tracker import PoseEstimate, Subjects, TrackedFrame, TrackerSettings, TrackingRun
from tracker.evidence.observer import Observer
from tracker.geometry.ground_plane import GroundPlane, floor_plane
from tracker.pipeline.methods import make_tracker
from tracker.pipeline.track_session import Leg, Step, TrackSession, outward
from tracker.pipeline.tracked_changes import RunChange, StoredPerson

_SAVE_S = 0.5
"""Shortest time between two saves of a running tracker, seconds."""


class _Run(NamedTuple):
    """A tracking run and the job that drives it in a worker thread."""

    session: TrackSession
    job: Job[Step]
    display: RunDisplay
    on_end: Callable[[bool], None]
    """Is told at its end whether it did all its work."""


class _SaverWriter:
    """Saves the poses of a run through the saver, which retries failed writes."""

    def __init__(self, session_state: SessionState, edit: int | None) -> None:
        """Add to an entry of the history, or make one at the first write if `edit` is None."""
        self._session_state, self._first_edit = session_state, edit

    def write(self, label: str, changes: Sequence[RunChange], edit: int | None) -> int | None:
        """See `PoseWriter.write`. Poses that cannot be written wait in the saver's queue."""
        self._session_state.last_save = time.monotonic()
        amended = self._first_edit if edit is None else edit
        return self._session_state.saver.write(label, changes, amended, by_program=True)


class Tracking:
    """Controls the tracking run. There is at most one, running or paused."""

    def __init__(self, session_state: SessionState, activities: Activities) -> None:
        """Restore the settings of the session, and track nothing yet.

        Args:
            session_state: holds the state.
            activities: ends searches and gestures before a run.
        """
        self._session_state, self._activities = session_state, activities
        activities.add_job(self, on_shown_frame=True)
        kept = session_state.saver.setting(track_settings.SETTING)
        choices = track_settings.restored(kept, session_state.session.camera_names)
        session_state.set(settings=track_settings.changed(session_state.state.settings, choices), run_choices=choices)
        self._run: _Run | None = None
        self.after_run: Callable[[range], None] = lambda frames: None
        """Called with the frames of each run that ended; must return quickly."""
        session_state.unwritten.append(lambda: self._run is not None and self._run.session.has_unsaved)

    @property
    def running(self) -> bool:
        """Whether a run is running."""
        return self._run is not None and self._run.job.running

    def store_settings(self) -> None:
        """Keep the present settings of the tracker with the session; on disk when this returns.

        Raises:
            TrackerError: the session's settings cannot be written.
        """
        settings = track_settings.stored(self._session_state.state.run_choices)
        self._session_state.saver.store_setting(track_settings.SETTING, settings)

    def choose(self, choices: RunChoices) -> None:
        """Choose method, frames and cameras of the next run."""
        self._session_state.set(run_choices=choices)

    def start(self, backward: bool, until: int | None, from_shown: bool = False) -> None:
        """Begin a run from the shown poses; a former run must have been ended.

        Args:
            backward: towards the first frame.
            until: last frame to track; None for the end of the recording.
            from_shown: whether to track the shown frame, too, even if everybody has a pose there.

        Raises:
            TrackerError: no person has been placed, or there is no frame to track.
        """
        with self._activities.editing():
            people = self._placed()
            shown = self._session_state.state.people
            from_shown = from_shown or any(shown[i].source is None for i in people)
            frames = self._frames(backward, until, from_shown)
            if not from_shown and self._begins_at_keyframe(people, frames):
                frames = self._frames(backward, until, True)
            run = TrackingRun(
                self.observer(),
                self._subjects(people, frames),
                self._session_state.present_poses(),
                frames,
                *self._clock_and_floor(),
            )
            way = "backward" if backward else "forward"
            self._begin([Leg(run)], f"track {way} from frame {frames[0]}", None, lambda is_done: None)

    def start_outward(
        self,
        start: int,
        people: tuple[int, ...],
        edit: int | None,
        on_end: Callable[[bool], None],
        within: range | None = None,
        observer: Observer | None = None,
    ) -> None:
        """Begin a run over all frames, or some, that goes out from the poses of one frame in both directions.

        Args:
            start: the frame.
            people: indices of those to track; they have a pose there.
            edit: entry of the history that the run belongs to; None for one of its own.
            on_end: called at the end with whether the run did all its work; must return quickly.
            within: frames that it may track; None for all.
            observer: `observer` with more evidence; None without.
        """
        session_state = self._session_state
        with self._activities.editing():
            session_state.show_frame(frame=start)
            stride = session_state.state.run_choices.stride
            every = range(session_state.session.n_frames) if within is None else within
            frames = range(start - (start - every.start) // stride * stride, every.stop, stride)
            subjects, poses = self._subjects(people, frames), session_state.present_poses()
            observer = observer or self.observer()
            trusted: Status = "good"
            known = TrackedFrame(start, tuple(poses), (trusted,) * len(poses))
            legs = [
                Leg(TrackingRun(observer, subjects, poses, leg, *self._clock_and_floor()), [known], start)
                for leg in outward(frames, start)
            ]
            if len(frames) < 2:
                on_end(True)
                return
            self._begin(legs, f"track out from frame {start}", edit, on_end)

    def _placed(self) -> tuple[int, ...]:
        """Return the people who have a pose.

        Raises:
            TrackerError: nobody has.
        """
        session_state = self._session_state
        people = tuple(i for i in range(len(session_state.present)) if session_state.saver.index.frames(i))
        if not people:
            raise TrackerError("expected a person who has been placed, found none; pose the body here first")
        return people

    def _begins_at_keyframe(self, people: tuple[int, ...], frames: Sequence[int]) -> bool:
        """Return whether the shown frame is a keyframe of all people, and some of the given frames are keyframes, too.

        They are then tracked both ways. Where all of the frames are keyframes, there is nothing to track.
        """
        shown, saver = self._session_state.state.frame, self._session_state.saver
        keyframes = saver.keyframes({shown, *frames})
        return set(people) <= keyframes.pop(shown, {}).keys() and 0 < len(keyframes) < len(frames)

    def _subjects(self, people: tuple[int, ...], frames: Sequence[int]) -> Subjects:
        session_state, models = self._session_state, self._session_state.present
        active = [session_state.active_dofs(person) for person in range(len(models))]
        return Subjects.of(models, people, active, session_state.saver.keyframes(frames))

    @property
    def _settings(self) -> TrackerSettings:
        """The settings of a run that begins now."""
        state = self._session_state.state
        return track_settings.of_run(state.settings, state.run_choices)

    def _clock_and_floor(self) -> tuple[float, GroundPlane | None]:
        session = self._session_state.session
        return session.fps, floor_plane(session.up, session.floor)

    def _begin(self, legs: Sequence[Leg], label: str, edit: int | None, on_end: Callable[[bool], None]) -> None:
        """Begin a run in a worker thread; the caller is editing."""
        session_state, saver = self._session_state, self._session_state.saver
        session_state.require_editable(None, [k for leg in legs for k in leg.run.frames])
        session = TrackSession(
            make_tracker(self._settings),
            legs,
            [StoredPerson(p.name, saver.revisions.current(i)) for i, p in enumerate(session_state.session.people)],
            _SaverWriter(session_state, edit),
            label,
        )
        job = Job(
            session.steps,
            lambda step, seconds: self._stepped(run, step, seconds),
            lambda error: self._ended(run, error),
            lambda: self._paused(run),
        )
        run = _Run(session, job, RunDisplay(session_state, session, lambda: job.running), on_end)
        self._run, session_state.open_edit_owner = run, None
        frames = session.frames
        track = TrackState(running=True, first=frames[0], last=session.ends(frames[0])[1], total=len(frames))
        session_state.set(track=track, follow=True)
        run.job.run()

    def resume(self) -> None:
        """Continue a paused run, if there is one.

        Raises:
            TurnError: somebody else works on one of its frames; it stays paused.
        """
        with self._activities.starting(self):
            run = self._run
            if run is not None and not run.job.running:
                self._session_state.require_editable(None, run.session.frames)  # later stages write all of them again
                self._session_state.set(track=replace(self._session_state.state.track, running=True))
                run.job.run()

    def pause(self) -> None:
        """Pause a running run with its results on disk. The caller must not hold the lock: the last step takes it."""
        run = self._run
        if run is not None:
            run.job.stop()

    def halt(self) -> None:
        """Pause a running run, and keep the shown frame: it is about to be changed. See `pause`."""
        if self.running:
            self._session_state.set(follow=False)
        self.pause()

    def stop(self) -> None:
        """End the run; its results stay. The caller must not hold the lock."""
        self.halt()
        self.forget()

    def forget(self) -> None:
        """End a paused run, or remove the message of an ended one. Its results stay."""
        with self._session_state.lock:
            if self._run is not None:
                self._end(self._run, "stopped")
            elif self._session_state.state.track.message:
                self._session_state.set(track=TrackState())

    def follow_history(self) -> None:
        """Say that a move along the history took a run back, or brought it back."""
        moves = self._session_state.saver.moves
        label = moves.labels()[moves.is_undone] or ""
        if label.startswith("track ") and len(moves.moved_edits) == 1:
            how = "taken back: {}, Redo brings it back" if moves.is_undone else "brought back: {}"
            self._session_state.set(track=TrackState(message=how.format(label)))

    def flush(self) -> None:
        """Save the results of the run, so that every tracked frame can be shown."""
        with self._session_state.lock:
            if self._run is not None:
                self._save(self._run)

    def follow(self, follow: bool) -> None:
        """Show each frame as it is tracked, beginning with the last one; or keep the shown frame."""
        with self._session_state.lock:
            self._session_state.set(follow=follow)
            at = self._session_state.state.track.at
            if follow and at is not None and at != self._session_state.state.frame:
                self.flush()
                self._session_state.show_frame(frame=at)

    def observer(self) -> Observer:
        """Return the observer of the chosen cameras."""
        observer, cameras = (
            self._session_state.frames.observer.at_nearest_times(),
            self._session_state.state.run_choices.cameras,
        )
        chosen = [i for i, c in enumerate(observer.cameras) if c.camera.name in cameras]
        return observer.with_cameras(chosen) if chosen else observer

    def _frames(self, backward: bool, until: int | None, from_shown: bool) -> range:
        """Return the frames to track, from the shown one on or from the next."""
        session_state = self._session_state
        step = session_state.state.run_choices.stride * (-1 if backward else 1)
        last = session_state.session.n_frames - 1
        end = (0 if backward else last) if until is None else min(max(0, until), last)
        state = session_state.state
        first = state.frame if from_shown else state.frame + step
        frames = range(first, end + (-1 if backward else 1), step)
        if not frames:
            raise TrackerError(
                f"expected frames to track {'before' if backward else 'after'} frame {state.frame}, found none up to "
                f"frame {end}; show another frame or track in the other direction"
            )
        return frames

    def _stepped(self, run: _Run, step: Step, seconds: float) -> None:
        with self._session_state.lock:
            if run is self._run:
                run.session.take(step)
                run.display.show(step, seconds)
                if isinstance(step, PoseEstimate) and time.monotonic() - self._session_state.last_save > _SAVE_S:
                    self._save(run)

    def _paused(self, run: _Run) -> None:
        with self._session_state.lock:
            if run is self._run:
                with suppress(EditClaimError):  # saved again when the run ends, which reports the error
                    self._save(run)
                self._session_state.set(track=replace(self._session_state.state.track, running=False))
                self._session_state.request_evidence()

    def _ended(self, run: _Run, error: Exception | None) -> None:
        with self._session_state.lock:
            if run is not self._run:
                return
            if error is None:
                how = "done"
            else:
                why = page_text(error) if isinstance(error, TrackerError) else f"the tracker failed: {error}"
                how = f"stopped, because {why}"
            self._end(run, how, error is not None)
            self._session_state.request_evidence()

    def _save(self, run: _Run) -> None:
        """Save the tracked frames; a shown frame of the run is one of them."""
        run.session.save()
        self._session_state.note_stored()
        self._session_state.refresh_saving()

    def _end(self, run: _Run, how: str, failed: bool = False) -> None:
        """End a run, and tell how; poses that somebody else's work keeps from being saved are lost."""
        try:
            self._save(run)
        except EditClaimError as error:
            how, failed = f"stopped, because {page_text(error)}", True
            self._session_state.show_frame()  # the stored poses: a shown one may be lost
        summary = run.display.summary()
        self._run = None
        tracked = run.session.tracked
        run.job.discard()
        if tracked:
            self.after_run(range(min(tracked), max(tracked) + 1))
        message = f"{how}: {summary}"
        text = run.session.contradiction
        notice = f"{page_text(text[:1].upper() + text[1:], Remedy('check_cameras'))}." if text else failed * message
        self._session_state.set(track=TrackState(message=message, failed=failed, notice=notice))
        run.on_end(how == "done")
