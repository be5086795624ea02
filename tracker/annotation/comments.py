"""Comments on a person in a frame and, optionally, on a limb."""

from typing import NamedTuple

from tracker.errors import TrackerError
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.annotator import annotator
from tracker.session.store.edit_tree import now
from tracker.session.store.identities import new_uid
from tracker.session.store.task_log import CommentRow


class Comment(NamedTuple):
    """A comment, and whether it is resolved."""

    row: CommentRow
    resolved: bool
    resolved_by: str
    """Name of the person who resolved it; empty while it is open."""


def add_comment(
    store: AnnotationStore, at: tuple[str, int], text: str, limb: str = "", author: str | None = None
) -> str:
    """Comment on a person in a frame; returns the identity of the comment.

    Args:
        store: annotations of the session.
        at: person and frame.
        text: the comment.
        limb: name of a limb (`tracker.body.limbs`); empty for the whole body.
        author: of the comment; by default the annotator of this process.

    Raises:
        TrackerError: the text is empty.
    """
    if not text.strip():
        raise TrackerError("expected a comment, found an empty text; write what is to be done")
    row = CommentRow(new_uid(), "", *at, limb, text.strip(), 0, _by(author), now())
    store.tasks.add(comments=[row])
    return row.uid


def resolve_comment(store: AnnotationStore, start: str, resolved: bool = True, author: str | None = None) -> Comment:
    """Resolve a comment, or open it again; returns it as it was.

    Args:
        store: annotations of the session.
        start: its identity, or enough of its first digits.
        resolved: False opens it again.
        author: of the change; by default the annotator of this process.

    Raises:
        TrackerError: no comment or several begin so.
    """
    named = [comment for comment in read_comments(store) if start and comment.row.uid.startswith(start)]
    if len(named) != 1:
        raise TrackerError(
            f"expected the first digits of one comment, found {len(named)} that begin with '{start}'; list the comments"
        )
    row = named[0].row
    change = row._replace(uid=new_uid(), about=row.uid, text="", resolved=int(resolved), author=_by(author), time=now())
    store.tasks.add(comments=[change])
    return named[0]


def read_comments(store: AnnotationStore) -> list[Comment]:
    """Return all comments, earliest first; of changes of one comment the last one counts."""
    rows = store.tasks.comments()
    last = {row.about: row for row in rows if row.about}
    return [
        Comment(row, bool(state and state.resolved), state.author if state and state.resolved else "")
        for row in rows
        if not row.about
        for state in [last.get(row.uid)]
    ]


def _by(author: str | None) -> str:
    return annotator() if author is None else author
