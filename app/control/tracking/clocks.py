"""Nudge the clocks of the cameras, estimate them, and find a moment to compare them by."""

from collections.abc import Sequence
from typing import Any

from app.control.session.activities import Activities
from app.control.session.background_work import BackgroundWork
from app.control.session.session_state import SessionState
from app.control.tracking.calibrating import Calibrating
from app.state.calibration import ClocksState
from tracker.errors import TrackerError
from tracker.pipeline.calibration_revisions import change_calibration, starts_by_motion
from tracker.pipeline.fast_moment import find_fast_moment
from tracker.session.session import Session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.synchronize import FoundStart, find_starts, with_starts


class Clocks:
    """The clocks of the cameras. Each change is an entry of the history; at most one estimate is at work."""

    def __init__(self, session_state: SessionState, activities: Activities, calibrating: Calibrating) -> None:
        """Estimate nothing yet.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before the cameras change.
            calibrating: exchanges cameras, and finds their clocks by the motion of people.
        """
        self._session_state, self._activities, self._calibrating = session_state, activities, calibrating
        self._work = BackgroundWork(session_state, "clocks", "work on the clocks")
        self.stop = self._work.stop
        self._nudged: tuple[int | None, int] | None = None  # the camera and the entry of the history that go on

    def nudge(self, camera: int, frames: float) -> None:
        """Let a camera show pictures of a later time, frames; negative for an earlier one.

        Successive nudges of a camera are one entry of the history.

        Raises:
            TrackerError: its footage has no such picture, a check of the cameras is under way, or another person works.
        """
        source = self._session_state.session.cameras[camera]
        to = FoundStart(source.camera.name, source.start_frames + frames, None, None, True)
        self._change(to, f"clock of {to.camera}", camera)
        self._work.set(found=(), notes=(), way="", message="")  # they were relative to the former clock

    def estimate(self, way: str) -> None:
        """Begin to estimate the clocks by `motion`, `sound`, `flash` or `time code`; nothing changes.

        Raises:
            TrackerError: other work on the clocks is under way.
        """
        state = self._session_state.state.clocks
        self._work.start(lambda: self._estimate(way), ClocksState(way=way, views=state.views, moment=state.moment))

    def take(self, camera: int) -> None:
        """Give a camera the clock that was estimated.

        Raises:
            TrackerError: there is no clear estimate of it; otherwise as `nudge`.
        """
        name, state = self._session_state.session.camera_names[camera], self._session_state.state.clocks
        found = next((f for f in state.found if f.camera == name and f.is_clear), None)
        if found is None:
            raise TrackerError(f"expected a clear estimate of the clock of '{name}', found none; estimate it first")
        self._change(found, f"clock of {name} by {state.way}")

    def find_moment(self, views: Sequence[int]) -> None:
        """Begin to look for a moment at which something moves fast in two views, by their indices.

        Raises:
            TrackerError: other work on the clocks is under way.
        """
        self._work.start(lambda: self._find_moment(views), self._session_state.state.clocks)

    def _change(self, found: FoundStart, label: str, nudged: int | None = None) -> None:
        """Give a camera another clock; `nudged` is its index if successive changes are one entry of the history."""
        rates = {} if found.rate is None else {found.camera: found.rate}

        def change(session: Session, store: AnnotationStore) -> Session:
            last = tuple(e.edit for e in store.history(1))  # one that is undone, too
            amends = last[0] if nudged is not None and self._nudged == (nudged, *last) else None
            changed = with_starts(session, {found.camera: found.start_frames or 0.0}, rates)
            changed = change_calibration(session, store, changed, label, amends)
            self._nudged = nudged, store.history(1)[-1].edit
            return changed

        with self._activities.editing(alone=True):
            self._calibrating.require_free()
            self._work.require_free()
            self._calibrating.exchange_cameras(self._session_state.saver.change_cameras(change), "")

    def _estimate(self, way: str) -> dict[str, Any]:
        session, report = self._session_state.session, self._work.report
        if way != "motion":
            found, notes = find_starts(session, way, report)
            return {"found": tuple(found), "notes": tuple(notes)}
        _, check = self._calibrating.check(report)
        return {"found": tuple(starts_by_motion(session, check)), "notes": check.notes}

    def _find_moment(self, views: Sequence[int]) -> dict[str, Any]:
        session, recording = self._session_state.session, self._session_state.frames.observer.recording
        return {"moment": find_fast_moment(session, recording, views, self._work.report), "views": tuple(views)}
