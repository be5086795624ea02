"""Edits on their way to the store: what cannot be written now waits, in order, and is tried again.

A full disk or a lost network drive must cost nobody an hour of work: what waits is shown as if it were stored, and goes
to the disk with the next edit or when the user says so.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from tracker.errors import TrackerError
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import Change, PinChange, PoseChange


@dataclass
class _Waiting:
    """An edit, or what is to be added to one, that is not on disk."""

    ticket: int
    """Stands for the edit's id until it has one; negative."""
    label: str
    changes: list[Change]
    amend: int | None
    """The edit on disk to add to; None makes a new one."""
    by_program: bool


class RetryQueue:
    """Writes edits to the store of one session. Not locked by itself: the controller's lock guards it."""

    def __init__(self, store: AnnotationStore, author: str) -> None:
        """Write to a store.

        Args:
            store: of the session.
            author: who makes the edits.
        """
        self._store, self._author = store, author
        self._waiting: list[_Waiting] = []
        self._edits: dict[int, int] = {}  # tickets -> ids of the edits that they became
        self._tickets = 0
        self.error: str | None = None
        """Why the last edit is not on disk; None where all is."""

    def write(
        self, label: str, changes: Sequence[Change], amend: int | None, by_program: bool
    ) -> tuple[int, list[int]]:
        """Write changes after all that waits.

        Args:
            label: what the history says.
            changes: of poses, their marks, or pins.
            amend: what an earlier call returned for the edit to add to; None makes a new edit.
            by_program: leave keyframes as they are.

        Returns:
            What later calls add to, and the frames that are on disk now and were not before, ascending.
        """
        last = self._waiting[-1] if self._waiting else None
        amend = self._edits.get(amend, amend) if amend is not None else None
        if last is not None and last.ticket == amend and last.by_program == by_program:
            last.changes += changes
        else:
            self._tickets -= 1
            on_disk = amend if amend is not None and amend > 0 else None
            last = _Waiting(self._tickets, label, list(changes), on_disk, by_program)
            self._waiting.append(last)
        written = self.retry()
        return self._edits.get(last.ticket, last.ticket), written

    def retry(self) -> list[int]:
        """Write what waits, as far as that is possible; returns the frames written, ascending."""
        frames: set[int] = set()
        self.error = None
        while self._waiting:
            first = self._waiting[0]
            try:
                if first.amend is None:
                    edit = self._store.commit(first.label, first.changes, self._author, first.by_program).edit
                else:
                    self._store.amend(first.amend, first.changes, first.by_program)
                    edit = first.amend
            except TrackerError as error:
                self.error = str(error)
                break
            self._edits[first.ticket] = edit
            frames.update(change.frame for change in first.changes)
            self._waiting.pop(0)
        return sorted(frames)

    def pose(self, person: str, frame: int) -> PoseChange | None:
        """What waits to become the pose of a person on a frame, if anything does."""
        for waiting in reversed(self._waiting):
            for change in reversed(waiting.changes):
                if isinstance(change, PoseChange) and (change.person, change.frame) == (person, frame):
                    return change
        return None

    def pins(self, person: str, frame: int) -> list[PinChange]:
        """Pins of a person on a frame that wait to be set or cleared, in order."""
        return [
            change
            for waiting in self._waiting
            for change in waiting.changes
            if isinstance(change, PinChange) and (change.person, change.frame) == (person, frame)
        ]
