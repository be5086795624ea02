"""Hold what all savers of one open session share: queued edits, bodies, the index of frames, turns."""

from collections.abc import Callable, Collection, Sequence

from app.storage.frame_index import FrameIndex
from app.storage.retry_queue import RetryQueue
from app.storage.revisions import ModelRevisions
from app.storage.turns import Turns
from tracker.session.session import Session
from tracker.store.annotation_store import AnnotationStore


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
        self.authors: set[str] = set()
        """Names of those who have joined since the program began."""
        self.listeners: list[Callable[[object, Collection[int]], None]] = []
        """Called after each change with who made it and its frames."""

    @property
    def has_several(self) -> bool:
        """Whether more than one person has joined: each undoes only their own edits then."""
        return len(self.authors) > 1

    def changed(self, owner: object, frames: Sequence[int]) -> None:
        """Read frames again that somebody has changed, ascending."""
        self.index.update(frames)
        for listener in self.listeners:
            listener(owner, frames)
