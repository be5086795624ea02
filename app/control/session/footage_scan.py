"""The controller's part that watches how far the footage has been listed, and lets frames be shown once they are."""

import threading

from app.control.session.session_state import SessionState
from app.state.progress import FootageState
from tracker.errors import TrackerError

_LOOK_S = 0.2


class FootageScan:
    """Watches, in a thread of its own, until all frames of all videos are listed."""

    def __init__(self, session_state: SessionState) -> None:
        """Begin to watch."""
        self._session_state = session_state
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        if self._look():
            self._thread = threading.Thread(target=self._watch, name="listing", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """Stop watching."""
        self._over.set()
        if self._thread:
            self._thread.join()

    def _watch(self) -> None:
        while not self._over.wait(_LOOK_S):
            if not self._look():
                return

    def _look(self) -> bool:
        """Bring the state up to date; says whether there is more to come."""
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
