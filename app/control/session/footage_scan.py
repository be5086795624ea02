"""The controller's part that watches how far the footage has been listed, and lets frames be shown once they are."""

import threading

from app.control.session.session_state import Screen
from app.state.state import FootageState
from tracker.errors import TrackerError

_LOOK_S = 0.2


class Listing:
    """Watches, in a thread of its own, until all frames of all videos are listed."""

    def __init__(self, screen: Screen) -> None:
        """Begin to watch."""
        self._screen = screen
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
        screen = self._screen
        try:
            share, error = screen.frames.listed_share, None
        except TrackerError as failure:
            share, error = None, str(failure)
        found = FootageState(share, error)
        if found != screen.state.footage:
            with screen.lock:
                screen.set(footage=found)
                screen.request_evidence()
        return share is not None
