"""The history of a session: back and forth along it, by one entry or many; what is not on disk tried again."""

from collections.abc import Callable

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from tracker.store.records import HistoryEntry


class History:
    """Moves along the history of one session."""

    def __init__(self, session_state: SessionState, activities: Activities, follow: Callable[[], None]) -> None:
        """Move along the history behind this screen.

        Args:
            screen: what is shown.
            activities: ends jobs and gestures before an edit.
            follow: lets what is kept beside the poses follow a move (`BodySizeEditing.follow`).
        """
        self._session_state, self._activities, self._follow = session_state, activities, follow

    def entries(self, limit: int) -> list[HistoryEntry]:
        """Entries that redo and undo can reach, latest first; at most `limit` of each."""
        with self._session_state.lock:
            return self._session_state.saver.history(limit)

    def undo(self) -> None:
        """Take back the last entry, after stopping what stands on it.

        Raises:
            TrackerError: something waits to be written and still cannot be.
        """
        self._move(self._session_state.saver.undo)

    def redo(self) -> None:
        """Do again what was taken back last.

        Raises:
            TrackerError: something waits to be written and still cannot be.
        """
        self._move(self._session_state.saver.redo)

    def go_to(self, edit: int | None) -> None:
        """Undo or redo until an entry is the last one that is done; None takes back all.

        Raises:
            TrackerError: the history does not lead there any more, or something still cannot be written.
        """
        self._move(lambda: self._session_state.saver.go_to(edit))

    def save(self) -> None:
        """Try again to write what is not on disk; the state says whether that has worked."""
        with self._session_state.lock:
            self._session_state.saver.retry()
            self._session_state.refresh_saving()

    def _move(self, move: Callable[[], list[int]]) -> None:
        with self._activities.editing():
            here = self._session_state.state.frame
            try:
                changed = move()
            finally:
                self._session_state.refresh_saving()
            try:
                self._follow()
            finally:
                self._session_state.show_frame(min(changed, key=lambda frame: abs(frame - here), default=here))
