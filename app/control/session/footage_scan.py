"""Watch the indexing of the footage, and show frames as soon as they are indexed."""

import threading

from app.control.session.session_state import SessionState
from app.state.progress import FootageState
from tracker.errors import TrackerError

_POLL_S = 0.2


class FootageScan:
    """Watches in its own thread until all frames of all videos are indexed."""

    def __init__(self, session_state: SessionState) -> None:
        """Start to watch."""
        self._session_state = session_state
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        if self._update():
            self._thread = threading.Thread(target=self._watch, name="listing", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """Stop watching."""
        self._closing.set()
        if self._thread:
            self._thread.join()

    def _watch(self) -> None:
        while not self._closing.wait(_POLL_S):
            if not self._update():
                return

    def _update(self) -> bool:
        """Update the state; returns whether frames are missing."""
        session_state = self._session_state
        try:
            share, error = session_state.frames.listed_share, None
        except TrackerError as failure:
            share, error = None, str(failure)
        found = FootageState(share, error)
        if found != session_state.state.footage:
            with session_state.lock:
                session_state.set(footage=found)
                session_state.request_evidence()
        return share is not None
