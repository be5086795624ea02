"""Move along the history of a session, by one entry or many, and retry failed saves."""

from collections.abc import Callable, Sequence

from app.control.session.activities import Activities
from app.control.session.session_state import SessionState
from tracker.errors import TrackerError
from tracker.session.store.records import HistoryEntry


class History:
    """Moves along the history of one session."""

    def __init__(
        self, session_state: SessionState, activities: Activities, follow: Sequence[Callable[[], None]]
    ) -> None:
        """Move along the history of this session.

        Args:
            session_state: holds the state.
            activities: ends jobs and gestures before an edit.
            follow: functions that restore body models and cameras after a move.
        """
        self._session_state, self._activities, self._follow = session_state, activities, follow

    def entries(self, limit: int) -> list[HistoryEntry]:
        """Return the entries that redo and undo can reach, latest first, at most `limit` of each."""
        with self._session_state.lock:
            return self._session_state.saver.moves.entries(limit)

    def undo(self) -> None:
        """Revert the last entry, after ending the job or gesture that made it.

        Raises:
            TrackerError: a queued edit still cannot be written.
        """
        self._move(self._session_state.saver.moves.undo)

    def redo(self) -> None:
        """Reapply the entry that was reverted last.

        Raises:
            TrackerError: a queued edit still cannot be written.
        """
        self._move(self._session_state.saver.moves.redo)

    def go_to(self, edit: int | None) -> None:
        """Undo or redo until an entry is the last applied one; None reverts all.

        Raises:
            TrackerError: the history no longer contains the entry, or a queued edit still cannot be written.
        """
        self._move(lambda: self._session_state.saver.moves.go_to(edit))

    def save(self) -> None:
        """Try again to write queued edits; the state has the result."""
        with self._session_state.lock:
            self._session_state.saver.retry()
            self._session_state.refresh_saving()

    def _move(self, move: Callable[[], list[int]]) -> None:
        with self._activities.editing():
            here = self._session_state.state.frame
            try:
                changed = move()
            except TrackerError:
                self._session_state.refresh_saving()
                raise
            self._session_state.note_moved()
            try:
                for follow in self._follow:
                    follow()
            finally:
                self._session_state.show_frame(frame=min(changed, key=lambda frame: abs(frame - here), default=here))
                self._session_state.refresh_saving()
