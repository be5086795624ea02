"""Hold what all savers of one open session share: queued edits, bodies, the index of frames, turns."""

from collections.abc import Callable, Collection, Sequence
from contextlib import suppress

from app.storage.frame_index import FrameIndex
from app.storage.retry_queue import RetryQueue
from app.storage.revisions import ModelRevisions
from app.storage.turns import Turns
from tracker.errors import SessionError
from tracker.session.session import Session
from tracker.session.store.annotation_store import AnnotationStore

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
        self.turns = Turns()
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
