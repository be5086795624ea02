"""Hold what all savers of one open session share: queued edits, bodies, the index of frames, turns.

Queue edits for the store: an edit that cannot be written waits, in order, and is tried again.

A full disk or a lost network drive must not cost the user any work. Queued edits are shown as if they were stored,
and are written with the next edit or on request.
"""

from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass

from app.remedies import page_text
from app.storage.edit_claims import EditClaims
from app.storage.frame_index import FrameIndex
from app.storage.rescue_file import UnsavedEdit
from app.storage.revisions import ModelRevisions
from tracker.errors import OvertakenEditError, SessionError, TrackerError
from tracker.session.session import Session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import Change, PinChange, PoseChange

_TOGETHER = "worked_together"
"""Setting of the session."""


class SharedStorage:
    """The annotations of one open session, for everybody who works on it. The caller holds the session's lock."""

    def __init__(self, session: Session, store: AnnotationStore) -> None:
        """List the frames that have poses, and store the present bodies as revisions.

        Args:
            session: the open session.
            store: its annotations.
        """
        self.store, self.queue = store, RetryQueue(store)
        self.revisions = ModelRevisions(session, store)
        """The bodies that poses were made with."""
        self.index = FrameIndex(store, [p.name for p in session.people])
        """The frames that have poses."""
        self.turns = EditClaims()
        """Those who work on it."""
        self.has_several = store.setting(_TOGETHER, False) is True
        """Whether several people have worked on the session at a time: each undoes only their own edits since."""
        self.listeners: list[Callable[[object, Collection[int]], None]] = []
        """Called after each change with who made it and its frames."""

    def note_several(self) -> None:
        """Note that a second person joins who may change poses. A restart knows it, too."""
        if self.has_several:
            return
        self.has_several = True
        with suppress(SessionError):  # its drive may be gone
            self.store.set_setting(_TOGETHER, True)

    def changed(self, owner: object, frames: Sequence[int]) -> None:
        """Read frames again that somebody has changed, ascending."""
        self.index.update(frames)
        for listener in self.listeners:
            listener(owner, frames)


@dataclass
class _QueuedEdit:
    """An edit, or an addition to one, that is not on disk."""

    ticket: int
    """Stands for the edit's id until it has one; negative."""
    label: str
    changes: list[Change]
    amend: int | None
    """The edit on disk to add to; None makes a new one."""
    by_program: bool
    author: str


class RetryQueue:
    """Writes edits to the store of one session. The caller holds the session's lock."""

    def __init__(self, store: AnnotationStore) -> None:
        """Write to the store of a session."""
        self._store = store
        self._queue: list[_QueuedEdit] = []
        self._edits: dict[int, int] = {}  # tickets -> ids of the edits that were made of them
        self._last_ticket = 0
        self.error: str | None = None
        """Why the last edit is not on disk; None if all are."""

    def write(
        self, label: str, changes: Sequence[Change], amend: int | None, by_program: bool, author: str
    ) -> tuple[int, list[int]]:
        """Write changes after all queued edits.

        Args:
            label: of the entry of the history.
            changes: of poses, their marks, or pins.
            amend: the result of an earlier call for the edit to add to; None makes a new edit.
            by_program: leave keyframes unchanged.
            author: of a new edit.

        Returns:
            The edit that later calls can amend, and the frames written now, ascending.
        """
        last = self._queue[-1] if self._queue else None
        amend = self._edits.get(amend, amend) if amend is not None else None
        if last is not None and last.ticket == amend and last.by_program == by_program:
            last.changes += changes
        else:
            self._last_ticket -= 1
            on_disk = amend if amend is not None and amend > 0 else None
            last = _QueuedEdit(self._last_ticket, label, list(changes), on_disk, by_program, author)
            self._queue.append(last)
        written = self.retry()
        return self._edits.get(last.ticket, last.ticket), written

    @property
    def edits(self) -> list[UnsavedEdit]:
        """The queued edits, in order."""
        return [UnsavedEdit(e.label, e.changes, e.amend, e.by_program, e.author) for e in self._queue]

    def retry(self, patient: bool = True) -> list[int]:
        """Write queued edits until one fails. An edit that others have overtaken goes on as a new one.

        Args:
            patient: wait for another program that has locked the file.

        Returns:
            The frames written, ascending.
        """
        if patient:
            return self._retry()
        with self._store.impatient():
            return self._retry()

    def _retry(self) -> list[int]:
        frames: set[int] = set()
        self.error = None
        while self._queue:
            first = self._queue[0]
            try:
                edit = self._written(first)
            except TrackerError as error:
                self.error = page_text(error)
                break
            self._edits[first.ticket] = edit
            frames.update(change.frame for change in first.changes)
            self._queue.pop(0)
        return sorted(frames)

    def _written(self, queued: _QueuedEdit) -> int:
        """Write an edit, and return its number."""
        if queued.amend is not None:
            with suppress(OvertakenEditError):
                self._store.amend(queued.amend, queued.changes, queued.by_program)
                return queued.amend
        return self._store.commit(queued.label, queued.changes, queued.author, queued.by_program).edit

    def pose(self, person: str, frame: int) -> PoseChange | None:
        """Return the queued pose of a person on a frame, if there is one."""
        for queued in reversed(self._queue):
            for change in reversed(queued.changes):
                if isinstance(change, PoseChange) and (change.person, change.frame) == (person, frame):
                    return change
        return None

    def pins(self, person: str, frame: int) -> list[PinChange]:
        """Return the queued changes of a person's pins on a frame, in order."""
        return [
            change
            for queued in self._queue
            for change in queued.changes
            if isinstance(change, PinChange) and (change.person, change.frame) == (person, frame)
        ]
