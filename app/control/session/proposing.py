"""The next best click, in the background, and the gain of the one that was taken."""

import logging
from dataclasses import replace
from typing import Any

from app.control.session.session_state import SessionState
from app.remedies import page_sentence
from app.runtime.jobs import LatestWinsWorker
from app.state.state import State
from tracker.annotation.expected_error import contradicted_keyframes
from tracker.annotation.next_click import Proposals, propose
from tracker.errors import TrackerError
from tracker.session.store.stored_poses import read_stored_poses

_LOG = logging.getLogger(__name__)
_REST_S = 1.0
"""Minimum time between two computations, which take up to a second: the gain follows edits at leisure."""
_NEW, _GAIN = "new", "gain"
"""The next click, and the expected error since the last one."""


class Proposing:
    """Proposes the next best click when a page asks, and follows the expected error from then on."""

    def __init__(self, session_state: SessionState) -> None:
        """Wait for a request.

        Args:
            session_state: holds the state.
        """
        self._session_state = session_state
        self._followed: int | None = None  # version of the timeline of the last result; None before the first
        self._latest: LatestWinsWorker[str] = LatestWinsWorker(self._work, "next best click", _REST_S)
        fields = ("timeline_version", "drag", "is_pin_held", "track", "search", "annotation")
        session_state.subscribe(self._changed, *fields)

    def close(self) -> None:
        """End the thread."""
        self._latest.close()

    def start(self) -> None:
        """Begin to look for the next best click; the state has the answer soon."""
        self._set(running=True, message="")
        self._latest.offer(_NEW)

    def _changed(self, state: State) -> None:
        """Measure the gain once poses have changed, when nothing changes them any more."""
        busy = state.is_dragging or state.track.running or state.search.running or state.annotation.proposed.running
        if self._followed is not None and state.timeline_version != self._followed and not busy:
            self._followed = state.timeline_version
            self._latest.offer(_GAIN)

    def _work(self, kind: str) -> None:
        version = self._session_state.state.timeline_version
        found, message = None, ""
        try:
            found = self._propose(1 if kind == _NEW else 0)
        except Exception as error:
            if not isinstance(error, TrackerError):
                _LOG.exception("no click could be proposed")
            message = page_sentence(error)
        if kind == _GAIN:
            if found is not None and not self._session_state.state.annotation.proposed.running:
                self._set(after_mm=found.error_mm)
            return
        self._followed = None if found is None else version
        number = self._session_state.state.annotation.proposed.number + 1
        self._set(number=number, running=False, found=found, message=message, after_mm=None)

    def _propose(self, n: int) -> Proposals:
        session_state = self._session_state
        session, store = session_state.session, session_state.saver.store
        poses = [read_stored_poses(session.annotations_path, p.name, p.model) for p in session.people]
        contradicted = [contradicted_keyframes(store, p.name) for p in session.people]
        return propose(session, poses, n, contradicted=contradicted)

    def _set(self, **changes: Any) -> None:
        with self._session_state.lock:
            before = self._session_state.state.annotation
            self._session_state.set(annotation=replace(before, proposed=replace(before.proposed, **changes)))
