"""Try again by itself to write edits that wait, so that a folder that comes back is written without a restart."""

import threading

from app.control.session.session_state import SessionState
from app.state.state import State

_FIRST_S, _LONGEST_S = 2.0, 30.0
"""Time before the first attempt, doubled after each up to the longest."""


class SaveRetry:
    """Writes the queued edits of one session as soon as that is possible."""

    def __init__(self, session_state: SessionState) -> None:
        """Wait for an edit that cannot be written."""
        self._session_state = session_state
        self._timer: threading.Timer | None = None
        self._rest_s = _FIRST_S
        self._closed = False
        session_state.subscribe(self._watch, "save_error")

    def close(self) -> None:
        """Make no more attempts."""
        with self._session_state.lock:
            self._closed = True
            if self._timer is not None:
                self._timer.cancel()

    def _watch(self, state: State) -> None:
        """Plan an attempt; called under the lock."""
        if state.save_error is None:
            self._rest_s = _FIRST_S
        elif self._timer is None and not self._closed:
            self._timer = threading.Timer(self._rest_s, self._try)
            self._timer.daemon = True
            self._timer.start()

    def _try(self) -> None:
        session_state = self._session_state
        with session_state.lock:
            self._timer = None
            self._rest_s = min(2 * self._rest_s, _LONGEST_S)
            if not self._closed and session_state.state.save_error is not None:
                session_state.saver.retry(patient=False)  # nobody asked: the lock is not held for long
                session_state.refresh_saving()
