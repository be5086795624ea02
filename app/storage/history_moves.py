"""Move along the history of a session: through all entries, or one's own where several people work on it."""

from collections.abc import Iterable

from app.storage.shared_storage import SharedStorage
from tracker.errors import SessionError
from tracker.session.session import Session
from tracker.session.store.records import HistoryEntry

_ALL = 1 << 30
"""More entries than any history has."""


class HistoryMoves:
    """Undo and redo of one person. The caller holds the session's lock."""

    def __init__(self, session: Session, shared: SharedStorage, author: str) -> None:
        """Move along the history of a session.

        Args:
            session: the open session.
            shared: its annotations.
            author: whose edits are undone where several people work on it.
        """
        self._people = [p.name for p in session.people]
        self._shared, self._store, self._author = shared, shared.store, author
        self.moved_edits: tuple[int, ...] = ()
        """Entries of the history that the last move reverted or reapplied, in that order."""
        self.is_undone = False
        """Whether it reverted them: a move has one direction."""

    def undo(self) -> list[int]:
        """Revert the last entry of the history, or of one's own; returns its frames, ascending.

        Raises:
            SessionError: a queued edit still cannot be written, or others have changed the same poses since.
            TurnError: somebody works on one of its poses.
        """
        return self._move(undo=True)

    def redo(self) -> list[int]:
        """Reapply the entry that was reverted last; returns its frames, ascending. Raises as `undo` does."""
        return self._move(undo=False)

    def go_to(self, edit: int | None) -> list[int]:
        """Undo or redo until an edit is the last one applied; returns the changed frames, ascending.

        Args:
            edit: the entry; None reverts all.

        Raises:
            SessionError: a queued edit still cannot be written, or entries of others lie between.
        """
        self._write_all()
        if self._shared.has_several:
            self._require_own(edit)
        moved = self._store.go_to(edit)
        self.is_undone = edit not in moved
        return self._moved(moved)

    def _require_own(self, edit: int | None) -> None:
        """Check that a move to an entry passes entries of one's own only, on whose poses nobody works.

        Raises:
            SessionError: others made one.
            TurnError: somebody works on a pose.
        """
        entries = self._store.history(_ALL)
        at = next((i for i, e in enumerate(entries) if e.edit == edit), len(entries))
        present = sum(e.undone for e in entries)
        passed = entries[present:at] if at >= present else entries[at:present]
        if any(e.author != self._author for e in passed):
            raise SessionError(
                "expected entries of your own on the way, found some of others, which would go along; "
                "undo your own edits one by one"
            )
        for entry in passed:
            self._require_turns(entry.edit)

    def entries(self, limit: int) -> list[HistoryEntry]:
        """Return the entries that redo and undo can reach, latest first, at most `limit` of each."""
        return self._store.history(limit)

    def labels(self) -> tuple[str | None, str | None]:
        """Return the labels of the entries that undo would revert and redo reapply."""
        if self._shared.has_several:
            own = self._store.own_labels(self._author)
            return own.undo, own.redo
        entries = self._store.history(1)
        done, undone = ([e.label for e in entries if e.undone is was] for was in (False, True))
        return next(iter(done), None), next(iter(undone), None)

    def _move(self, undo: bool) -> list[int]:
        self._write_all()
        self.is_undone = undo
        if not self._shared.has_several:
            entry = next((e for e in self._store.history(1) if e.undone is not undo), None)
            if entry is None:
                return self._moved([])
            (self._store.undo if undo else self._store.redo)()
            return self._moved([entry.edit])
        own = self._store.own_labels(self._author)
        edit = own.undo_edit if undo else own.redo_edit
        if edit is None:
            return self._moved([])
        self._require_turns(edit)
        move = (self._store.undo_own if undo else self._store.redo_own)(self._author, in_tree=False)
        return self._moved([] if move is None else [move.edit])

    def _require_turns(self, edit: int) -> None:
        indices = {name: i for i, name in enumerate(self._people)}
        poses = ((indices[name], frame) for name, frame in self._store.poses_of(edit) if name in indices)
        self._shared.turns.require(self, poses)

    def _moved(self, edits: Iterable[int]) -> list[int]:
        """Note which entries were moved over; returns their frames, ascending."""
        self.moved_edits = tuple(edits)
        frames = sorted({frame for edit in self.moved_edits for frame in self._store.frames_of(edit)})
        self._shared.changed(self, frames)
        return frames

    def _write_all(self) -> None:
        """Write the queued edits before the history moves.

        Raises:
            SessionError: one still cannot be written.
        """
        self._shared.changed(self, self._shared.queue.retry())
        if (error := self._shared.queue.error) is not None:
            raise SessionError(f"the history cannot move while an edit is not saved: {error}")
