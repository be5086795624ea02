"""Watch the footage: show frames as soon as they are indexed, and say which cannot be read until they can."""

import threading

from app.control.session.session_state import SessionState
from app.remedies import page_text
from app.state.progress import FootageState
from tracker.errors import TrackerError

_POLL_S = 0.2
"""Time between two looks while frames are being indexed."""
_RETRY_S = 1.0
"""Time between two attempts to read footage that could not be read."""
_GATHER_S = 0.1
"""Time until a failure is shown: a drive that is gone takes several cameras with it, and one notice names them all."""


class FootageScan:
    """Watches in its own thread."""

    def __init__(self, session_state: SessionState) -> None:
        """Start to watch."""
        self._session_state = session_state
        self._closing, self._failed = threading.Event(), threading.Event()
        session_state.frames.on_unreadable = self._failed.set
        pause_s = self._update()
        self._thread = threading.Thread(target=self._watch, args=(pause_s,), name="footage", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop watching."""
        self._closing.set()
        self._failed.set()
        self._thread.join(_RETRY_S)  # a network drive that is gone may hold it for minutes

    def _watch(self, pause_s: float | None) -> None:
        while True:
            if self._failed.wait(pause_s):
                self._failed.clear()
                if self._closing.wait(_GATHER_S):
                    return
            pause_s = self._update()

    def _update(self) -> float | None:
        """Update the state; returns the time until the next look, s, or None to wait for a failure."""
        session_state = self._session_state
        before = session_state.state.footage
        try:
            share = session_state.frames.listed_share
            error = session_state.frames.problem()
        except TrackerError as failure:
            share, error = None, page_text(failure)
        recovered = before.error is not None and error is None
        found = FootageState(share, error, before.recoveries + recovered)
        if found != before:
            with session_state.lock:
                # The evidence may have been computed by the attempt to read it again.
                session_state.set(footage=found, **vars(session_state.costs(session_state.state.poses)))
                session_state.request_evidence()
        if error is not None:
            return _RETRY_S
        return None if share is None else _POLL_S
