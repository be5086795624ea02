"""Undo and redo the edits of one annotator, among those of others.

The last edit of all is undone in the tree. An earlier one is taken back by a new edit, which shows again what the
earlier one replaced. Poses and pins that are no longer as the earlier edit left them stay; if all are, it is refused.
"""

import json
import sqlite3
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from tracker.errors import SessionError
from tracker.session.store import rows
from tracker.session.store.connection import Connection
from tracker.session.store.edit_tree import KEYS, EditTree, head, redo_edit, show_change, undo_edit

TAKEN_BACK = "taken_back"
"""Setting: for each edit that took back an earlier one, the number of that one."""
_BY_NUMBER = ("sizes_edits", "calibration_edits")
"""Settings that name the edits that changed bodies or cameras, which a new edit cannot restore."""


class OwnMove(NamedTuple):
    """An edit that was undone or redone."""

    label: str
    edit: int
    """The edit that was undone or redone in the tree, or the new one that takes back another."""
    in_tree: bool
    n_kept: int
    """Number of poses and pins that stay as somebody else changed them since."""


class OwnLabels(NamedTuple):
    """The edits that an annotator's undo and redo would move over: labels and numbers; None for no such edit."""

    undo: str | None
    redo: str | None
    undo_edit: int | None
    redo_edit: int | None


def undo_own(connection: Connection, tree: EditTree, author: str, in_tree: bool = True) -> OwnMove | None:
    """Undo the last edit of an annotator that still holds; returns None if there is none.

    Args:
        connection: to the store.
        tree: its edits.
        author: the annotator.
        in_tree: whether the last edit of all is undone in the tree, where a later edit of anybody ends what can be
            redone. An edit of bodies or cameras always is.

    Raises:
        SessionError: others have changed all that it changed, or it changed bodies or cameras and is not the last.
    """
    with connection.transaction() as db:
        edit = _last_own(db, author)
        return None if edit is None else _take_back(db, tree, edit, author, in_tree)


def redo_own(connection: Connection, tree: EditTree, author: str, in_tree: bool = True) -> OwnMove | None:
    """Redo the last edit of an annotator that was undone; returns None if there is none.

    Args:
        connection: to the store.
        tree: its edits.
        author: the annotator.
        in_tree: as for `undo_own`.

    Raises:
        SessionError: as for `undo_own`.
    """
    with connection.transaction() as db:
        undone = _undone_own(db, author)
        if undone is not None:
            redo_edit(db, undone[0])
            return OwnMove(undone[1], undone[0], True, 0)
        edit = _last_own_taker(db, author)
        return None if edit is None else _take_back(db, tree, edit, author, in_tree)


def own_labels(connection: Connection, author: str) -> OwnLabels:
    """Return what an annotator can undo and redo; the latest edits are read, up to their last that holds."""
    with connection.snapshot():
        db = connection.db
        undo, undone = _last_own(db, author), _undone_own(db, author)
        redo = None if undone is not None else _last_own_taker(db, author)
        takers = _takers(db)
        redone = (redo, None if redo is None else _label(db, redo, takers)) if undone is None else undone
        return OwnLabels(None if undo is None else _label(db, undo, takers), redone[1], undo, redone[0])


def held_edits(db: sqlite3.Connection) -> set[int]:
    """Return the edits that are done and that nobody has taken back."""
    return {edit for edit, _ in _held(db, _takers(db))}


def _undone_own(db: sqlite3.Connection, author: str) -> tuple[int, str] | None:
    """Return the edit that redo in the tree would reach, and its label; None if it is not the annotator's."""
    edit = db.execute(
        "SELECT id, label, author FROM edits WHERE parent IS (SELECT edit FROM head) ORDER BY id DESC LIMIT 1"
    ).fetchone()
    is_own = edit is not None and edit[2] == author and edit[0] not in _takers(db)
    return (int(edit[0]), str(edit[1])) if is_own else None


def _last_own(db: sqlite3.Connection, author: str) -> int | None:
    """Return the last edit of an annotator that holds and changed poses by itself."""
    takers = _takers(db)
    return next((e for e in _own_held(db, author, takers) if e not in takers), None)


def _last_own_taker(db: sqlite3.Connection, author: str) -> int | None:
    """Return the last edit of an annotator that holds and takes back an edit, as undo does.

    A redo must follow its undo: an edit made after a taker ends what could be redone.
    """
    takers = _takers(db)
    for edit in _own_held(db, author, takers) if takers else ():
        if edit not in takers:
            return None
        if _depth(edit, takers)[0] % 2:
            made = (int(e) for (e,) in db.execute("SELECT id FROM edits WHERE id > ? AND author = ?", (edit, author)))
            return None if any(e not in takers for e in made) else edit
    return None


def _own_held(db: sqlite3.Connection, author: str, takers: Mapping[int, int]) -> Iterator[int]:
    """Yield the edits of an annotator among those of `_held`; nothing before the annotator's first edit is read."""
    (first,) = db.execute("SELECT min(id) FROM edits WHERE author = ?", (author,)).fetchone()
    return iter(()) if first is None else (edit for edit, by in _held(db, takers, first) if by == author)


def _held(db: sqlite3.Connection, takers: Mapping[int, int], first: int = 0) -> Iterator[tuple[int, str]]:
    """Yield the edits that are done and not taken back, the latest first, with their authors, back to one of them.

    No more of the history is read than is asked for.
    """
    sql = (
        "WITH RECURSIVE line (id, parent, author) AS (SELECT id, parent, author FROM head JOIN edits ON id = edit "
        "UNION ALL SELECT e.id, e.parent, e.author FROM line JOIN edits e ON e.id = line.parent WHERE e.id >= ?) "
        "SELECT id, author FROM line"  # joined to another table, all of the line would be read first
    )
    taken: set[int] = set()
    for edit, author in db.execute(sql, (first,)):  # a parent is older than its child
        if edit not in taken:
            if edit in takers:
                taken.add(takers[edit])
            yield int(edit), str(author)


def _takers(db: sqlite3.Connection) -> dict[int, int]:
    """Return the edits that take back others, each with the one that it takes back."""
    return {int(taker): taken for taker, taken in _setting(db, TAKEN_BACK).items()}


def _label(db: sqlite3.Connection, edit: int, takers: Mapping[int, int]) -> str:
    """Return the label of the edit that changed poses by itself, from which a chain of undo and redo goes out."""
    (label,) = db.execute("SELECT label FROM edits WHERE id = ?", (_depth(edit, takers)[1],)).fetchone()
    return str(label)


def _depth(edit: int, takers: Mapping[int, int]) -> tuple[int, int]:
    """Return how many edits take back one another, from one on, odd for an undo, even for a redo; and the first."""
    depth = 0
    while edit in takers:
        edit, depth = takers[edit], depth + 1
    return depth, edit


def _take_back(db: sqlite3.Connection, tree: EditTree, edit: int, author: str, in_tree: bool) -> OwnMove:
    taken, takers = _setting(db, TAKEN_BACK), _takers(db)
    depth, label = _depth(edit, takers)[0], _label(db, edit, takers)
    is_numbered = any(str(edit) in _setting(db, name) for name in _BY_NUMBER)
    if head(db) == edit and (in_tree or is_numbered):
        undo_edit(db, edit)
        return OwnMove(label, edit, True, 0)
    if is_numbered:
        raise SessionError(
            f"expected an edit of poses, found '{label}', which others have worked on since; "
            "go back in the history before it, or change sizes or cameras again"
        )
    changes = [(kind, *change) for kind in KEYS for change in _last_changes(db, kind, edit)]
    free = [(kind, change, before) for kind, change, before, is_current in changes if is_current]
    if not free:
        whose = _changed_by(db, edit)
        raise SessionError(
            f"expected '{label}' as you left it, found that {whose} changed it since; set the pose again"
        )
    added = tree.add(db, f"{'redo' if depth % 2 else 'undo'}: {label}", author)
    for kind, change, before in free:
        _show_again(db, kind, added, change, before)
    taken = {**taken, str(added): edit}
    db.execute("INSERT OR REPLACE INTO settings (key, value) VALUES (?, ?)", (TAKEN_BACK, json.dumps(taken)))
    return OwnMove(label, added, False, len(changes) - len(free))


def _last_changes(db: sqlite3.Connection, kind: str, edit: int) -> list[tuple[int, int | None, bool]]:
    """Return for each pose or pin that an edit changed the last change, the one before the edit, and if it holds."""
    key, content = KEYS[kind]
    pairs = db.execute(
        f"SELECT max(c.id), p.previous FROM {kind}_changes c JOIN (SELECT min(id) AS first, {key} FROM {kind}_changes "
        f"WHERE edit = ?1 GROUP BY {key}) f USING ({key}) JOIN {kind}_changes p ON p.id = f.first "
        f"WHERE c.edit = ?1 GROUP BY f.first",
        (edit,),
    ).fetchall()
    columns = _copied(db, kind)
    changes = []
    for last, before in pairs:
        sql = f"SELECT {columns} FROM {kind}_changes WHERE {content} IS NOT NULL AND id = "
        left = db.execute(f"{sql} ?", (last,)).fetchone()
        of = f"({key}) = (SELECT {key} FROM {kind}_changes WHERE id = ?)"
        now = db.execute(f"{sql} (SELECT change FROM {kind}s WHERE {of})", (last,)).fetchone()
        changes.append((int(last), before, left == now))
    return changes


def _show_again(db: sqlite3.Connection, kind: str, edit: int, change: int, before: int | None) -> None:
    """Add a change to an edit that shows again what a change replaced.

    Args:
        db: connection within a transaction.
        kind: `pose` or `pin`.
        edit: to add to.
        change: the last one of the pose or pin in the edit that is taken back.
        before: the one to show again; None clears the pose or pin.
    """
    key, _ = KEYS[kind]
    table = f"{kind}_changes"
    made, origin = (", made_in", ", coalesce(made_in, edit)") if kind == "pose" and before is not None else ("", "")
    same = key if before is None else _copied(db, kind)
    shown = f"(SELECT change FROM {kind}s WHERE ({key}) = (SELECT {key} FROM {table} WHERE id = ?2))"
    added = db.execute(
        f"INSERT INTO {table} (edit, previous{made}, {same}) SELECT ?1, {shown}{origin}, {same} FROM {table} "
        "WHERE id = coalesce(?3, ?2)",
        (edit, change, before),
    ).lastrowid
    if kind == "pose":
        copied = "rank, numbers, model_revision, cost_px"
        db.execute(
            f"INSERT INTO alternatives (change, {copied}) SELECT ?, {copied} FROM alternatives WHERE change = ?",
            (added, before),
        )
    show_change(db, kind, added, added)


def _copied(db: sqlite3.Connection, kind: str) -> str:
    """Return the columns of a change that say what it shows, for SQL."""
    log = ("id", "edit", "previous", "made_in", "checksum")
    return ", ".join(row[1] for row in db.execute(f"PRAGMA table_info({kind}_changes)") if row[1] not in log)


def _changed_by(db: sqlite3.Connection, edit: int) -> str:
    """Name the authors of the edits that hold what an edit had changed."""
    authors = {
        str(author)
        for (author,) in db.execute(
            "SELECT DISTINCT e.author FROM pose_changes c JOIN poses p USING (person, frame) "
            "JOIN pose_changes d ON d.id = p.change JOIN edits e ON e.id = d.edit WHERE c.edit = ?",
            (edit,),
        )
    }
    return " and ".join(sorted(authors)) or "somebody"


def _setting(db: sqlite3.Connection, name: str) -> dict[str, int]:
    row = db.execute("SELECT value FROM settings WHERE key = ?", (name,)).fetchone()
    return {} if row is None else dict(rows.decoded_json(row[0], f"setting '{name}'"))
