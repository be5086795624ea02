"""The history of a session: back and forth along it, by one entry or many; what is not on disk tried again."""

from collections.abc import Callable
from contextlib import AbstractContextManager

from app.control.session.session_state import Screen
from tracker.store.records import HistoryEntry


class History:
    """Moves along the history of one session."""

    def __init__(
        self, screen: Screen, editing: Callable[[], AbstractContextManager[None]], follow: Callable[[], None]
    ) -> None:
        """Move along the history behind this screen.

        Args:
            screen: what is shown.
            editing: gives a block in which nothing else changes anything.
            follow: lets what is kept beside the poses follow a move (`Sizing.follow`).
        """
        self._screen, self._editing, self._follow = screen, editing, follow

    def entries(self, limit: int) -> list[HistoryEntry]:
        """Entries that redo and undo can reach, latest first; at most `limit` of each."""
        with self._screen.lock:
            return self._screen.saver.history(limit)

    def undo(self) -> None:
        """Take back the last entry, after stopping what stands on it.

        Raises:
            TrackerError: something waits to be written and still cannot be.
        """
        self._move(self._screen.saver.undo)

    def redo(self) -> None:
        """Do again what was taken back last.

        Raises:
            TrackerError: something waits to be written and still cannot be.
        """
        self._move(self._screen.saver.redo)

    def go_to(self, edit: int | None) -> None:
        """Undo or redo until an entry is the last one that is done; None takes back all.

        Raises:
            TrackerError: the history does not lead there any more, or something still cannot be written.
        """
        self._move(lambda: self._screen.saver.go_to(edit))

    def save(self) -> None:
        """Try again to write what is not on disk; the state says whether that has worked."""
        with self._screen.lock:
            self._screen.saver.retry()
            self._screen.refresh_saving()

    def _move(self, move: Callable[[], list[int]]) -> None:
        with self._editing():
            here = self._screen.state.frame
            try:
                changed = move()
            finally:
                self._screen.refresh_saving()
            try:
                self._follow()
            finally:
                self._screen.show(min(changed, key=lambda frame: abs(frame - here), default=here))
