"""The tree of edits: undo, redo, history.

Each edit has the one before it as its parent. `head` is the last edit done: the current poses and pins are those after
it. Undo moves head to the parent, redo to the youngest child. A commit after an undo starts a new branch; the old one
stays in the log but is out of reach.

Write the changes of an edit: poses, marks and assessments of poses, pins.
"""

import json
import sqlite3
from collections.abc import Callable, Collection, Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from tracker.compute.installed_package import program_version
from tracker.errors import SessionError
from tracker.session.store import rows
from tracker.session.store.connection import Connection
from tracker.session.store.records import (
    AssessmentChange,
    Change,
    HistoryEntry,
    MarkChange,
    PinChange,
    PoseChange,
    new_uid,
)

KEYS = {"pose": ("person, frame", "numbers"), "pin": ("person, frame, point, camera", "u")}
"""For each kind of annotation its key, and the column that is NULL in a change that clears it."""
_YOUNGEST = "(SELECT max(id) FROM edits WHERE parent IS {})"


class EditTree:
    """The edits of a store, and which of them is the last one done."""

    def __init__(self, connection: Connection) -> None:
        """Use an open store."""
        self._connection = connection

    def add(self, db: sqlite3.Connection, label: str, author: str) -> int:
        """Add an edit after head, within a transaction, make it head and return its id."""
        edit = db.execute(
            "INSERT INTO edits (parent, label, author, time, program, uid) VALUES (?, ?, ?, ?, ?, ?)",
            (head(db), label, author, now(), program_version(), new_uid()),
        ).lastrowid
        assert edit is not None
        db.execute("UPDATE head SET edit = ?", (edit,))
        return edit

    def undo(self) -> str | None:
        """Undo the last edit; returns its label, or None if there is none."""
        return self._move("SELECT e.id, e.label FROM head h JOIN edits e ON e.id = h.edit", undo_edit)

    def redo(self) -> str | None:
        """Redo the edit that was undone last; returns its label, or None if there is none."""
        sql = "SELECT id, label FROM edits WHERE parent IS (SELECT edit FROM head) ORDER BY id DESC LIMIT 1"
        return self._move(sql, redo_edit)

    def _move(self, sql: str, move: Callable[[sqlite3.Connection, int], None]) -> str | None:
        """Undo or redo the edit whose id and label a query finds, if any; returns its label."""
        with self._connection.transaction() as db:
            row = db.execute(sql).fetchone()
            if row is None:
                return None
            move(db, row[0])
            return str(row[1])

    def go_to(self, edit: int | None) -> list[int]:
        """Undo or redo, all or nothing, until an edit is the last one done; None undoes all edits.

        Returns:
            Ids of the edits undone or redone, in that order.

        Raises:
            SessionError: neither undo nor redo leads there.
        """
        with self._connection.transaction() as db:
            start = head(db)
            back = _chain(db, "?", "(SELECT parent FROM edits WHERE id = line.id)", start)
            if edit in back:
                path = back[: back.index(edit)]
                for last in path:
                    undo_edit(db, last)
                return path
            onward = _chain(db, _YOUNGEST.format("?"), _YOUNGEST.format("line.id"), start)
            if edit not in onward:
                raise SessionError(f"entry {edit} of the history cannot be reached any more; look at the list again")
            path = onward[: onward.index(edit) + 1]
            for following in path:
                redo_edit(db, following)
            return path

    def history(self, limit: int) -> list[HistoryEntry]:
        """List the edits that redo and undo can reach, latest first, at most `limit` of each."""
        undone = self._entries(_YOUNGEST.format("(SELECT edit FROM head)"), _YOUNGEST.format("line.id"), limit)
        done = self._entries("(SELECT edit FROM head)", "line.parent", limit)
        return [entry._replace(undone=True) for entry in reversed(undone)] + done

    def done(self) -> list[int]:
        """List the edits that are done, ascending."""
        sql = (
            "WITH RECURSIVE line (id) AS (SELECT edit FROM head UNION ALL SELECT parent FROM line JOIN edits "
            "USING (id)) SELECT id FROM line WHERE id IS NOT NULL ORDER BY id"
        )
        return self._connection.all(sql, (), lambda row: int(row[0]))

    def frames_of(self, edit: int) -> list[int]:
        """List the frames whose poses or pins an edit changes, ascending."""
        return sorted({frame for _, frame in self.poses_of(edit)})

    def poses_of(self, edit: int) -> set[tuple[str, int]]:
        """Return person and frame of the poses and pins that an edit changes."""
        changed = "SELECT person, frame FROM {}_changes WHERE edit = ?1"
        sql = f"{changed.format('pose')} UNION {changed.format('pin')}"
        pairs = self._connection.all(sql, (edit,), lambda row: (str(row[0]), rows.frame_number(row[1], f"edit {edit}")))
        return set(pairs)

    def _entries(self, start: str, onward: str, limit: int) -> list[HistoryEntry]:
        """Follow the tree from edit to edit; `start` and `onward` are SQL for their ids."""
        columns = "edits.id, edits.parent, edits.label, edits.author, edits.time"
        return self._connection.all(
            f"WITH RECURSIVE line (id, parent, label, author, time, n) AS (SELECT {columns}, 1 FROM edits "
            f"WHERE id = {start} UNION ALL SELECT {columns}, n + 1 FROM line JOIN edits ON edits.id = {onward} "
            "WHERE n < ?) SELECT id, label, author, time FROM line",
            (limit,),
            rows.row_to_entry,
        )


def head(db: sqlite3.Connection) -> int | None:
    """Return the id of the last edit done; None if there is none."""
    (edit,) = db.execute("SELECT edit FROM head").fetchone()
    return None if edit is None else int(edit)


def is_overtaken(db: sqlite3.Connection, edit: int, poses: Collection[tuple[str, int]]) -> bool:
    """Return whether an edit is not done, or a later one has changed a pose or its pins, by person and frame."""
    line = (
        "WITH RECURSIVE line (id) AS (SELECT edit FROM head UNION ALL "
        "SELECT parent FROM line JOIN edits USING (id) WHERE id > ?1) SELECT 1 FROM line WHERE id = ?1"
    )
    changed = "SELECT person, frame FROM {}_changes WHERE edit > ?1"
    later = db.execute(f"{changed.format('pose')} UNION {changed.format('pin')}", (edit,))
    return db.execute(line, (edit,)).fetchone() is None or not {(p, f) for p, f in later}.isdisjoint(poses)


def show_change(db: sqlite3.Connection, kind: str, change: int | None, shown: int | None) -> None:
    """Make a change current in place of another change of the same pose or pin.

    Args:
        db: connection within a transaction.
        kind: `pose` or `pin`.
        change: id of a change, which names the pose or pin.
        shown: id of the change that becomes current; None leaves the pose or pin cleared.
    """
    key, content = KEYS[kind]
    db.execute(f"DELETE FROM {kind}s WHERE ({key}) = (SELECT {key} FROM {kind}_changes WHERE id = ?)", (change,))
    db.execute(
        f"INSERT INTO {kind}s ({key}, change) SELECT {key}, id FROM {kind}_changes "
        f"WHERE id = ? AND {content} IS NOT NULL",
        (shown,),
    )


def now() -> str:
    """Return the time as the store writes it: ISO 8601, UTC.

    It counts microseconds, because events at the same time have no order.
    """
    return datetime.now(UTC).isoformat(timespec="microseconds")


def undo_edit(db: sqlite3.Connection, edit: int) -> None:
    """Undo the last edit done, within a transaction."""
    (parent,) = db.execute("SELECT parent FROM edits WHERE id = ?", (edit,)).fetchone()
    _move_head(db, "undo", edit, parent)
    for kind in ("pose", "pin"):
        for change, previous in _changes(db, kind, edit)[::-1]:
            show_change(db, kind, change, previous)


def redo_edit(db: sqlite3.Connection, edit: int) -> None:
    """Redo an edit that was undone, within a transaction."""
    _move_head(db, "redo", edit, edit)
    for kind in ("pose", "pin"):
        for change, _ in _changes(db, kind, edit):
            show_change(db, kind, change, change)


def _changes(db: sqlite3.Connection, kind: str, edit: int) -> list[tuple[int, int | None]]:
    """Ids of an edit's changes and of the changes that were current before them, in order."""
    return db.execute(f"SELECT id, previous FROM {kind}_changes WHERE edit = ? ORDER BY id", (edit,)).fetchall()


def _move_head(db: sqlite3.Connection, kind: str, edit: int, parent: int | None) -> None:
    db.execute("INSERT INTO moves (kind, edit, time) VALUES (?, ?, ?)", (kind, edit, now()))
    db.execute("UPDATE head SET edit = ?", (parent,))


def _chain(db: sqlite3.Connection, start: str, onward: str, parameter: int | None) -> list[Any]:
    """Ids of edits from one to the next in the tree, then None; `start` and `onward` are SQL for them."""
    rows = db.execute(
        f"WITH RECURSIVE line (id) AS (SELECT {start} UNION ALL SELECT {onward} FROM line "
        "WHERE id IS NOT NULL) SELECT id FROM line",
        (parameter,),
    )
    return [edit for (edit,) in rows]


def write_changes(
    db: sqlite3.Connection, edit: int, changes: Sequence[Change], by_program: bool
) -> tuple[tuple[str, int], ...]:
    """Write changes as part of an edit, within a transaction, and make them current.

    Args:
        db: connection within a transaction.
        edit: id of the edit.
        changes: in the order in which they are made.
        by_program: leave keyframes unchanged.

    Returns:
        Person and frame of the keyframes left unchanged.
    """
    skipped = []
    for change in changes:
        if isinstance(change, PinChange):
            _set_pin(db, edit, change)
        elif isinstance(change, MarkChange):
            _set_marks(db, edit, change)
        elif isinstance(change, AssessmentChange):
            _set_assessment(db, edit, change)
        elif by_program and _is_keyframe(db, change.person, change.frame):
            skipped.append((change.person, change.frame))
        else:
            _set_pose(db, edit, change)
    return tuple(skipped)


def _is_keyframe(db: sqlite3.Connection, person: str, frame: int) -> bool:
    sql = "SELECT c.keyframe FROM poses p JOIN pose_changes c ON c.id = p.change WHERE (p.person, p.frame) = (?, ?)"
    row = db.execute(sql, (person, frame)).fetchone()
    return row is not None and bool(row[0])


def _set_pose(db: sqlite3.Connection, edit: int, change: PoseChange) -> None:
    pose = change.pose
    content = (None,) * 14 if pose is None else (*rows.record_to_row(pose), _settings_record(db, pose.settings))
    change_id = db.execute(
        f"INSERT INTO pose_changes (edit, previous, person, frame, {rows.WRITTEN_COLUMNS}) VALUES (?1, (SELECT "
        "change FROM poses WHERE (person, frame) = (?2, ?3)), ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, "
        "?14, ?15, ?16, ?17)",
        (edit, change.person, change.frame, *content),
    ).lastrowid
    show_change(db, "pose", change_id, change_id)
    db.executemany(
        "INSERT INTO alternatives (change, rank, numbers, model_revision, cost_px) VALUES (?, ?, ?, ?, ?)",
        [(change_id, rank, *rows.alternative_to_row(a)) for rank, a in enumerate(change.alternatives)],
    )


def _set_marks(db: sqlite3.Connection, edit: int, change: MarkChange) -> None:
    """Write the current pose again with other marks: the log holds every state of a frame as a whole."""
    same = rows.UNMARKED_COLUMNS
    inserted = db.execute(
        f"INSERT INTO pose_changes (edit, previous, person, frame, keyframe, reviewed, {same}) "
        f"SELECT ?, id, person, frame, ?, ?, {same} FROM pose_changes "
        "WHERE id = (SELECT change FROM poses WHERE (person, frame) = (?, ?))",
        (edit, change.keyframe, change.reviewed, change.person, change.frame),
    )
    _show_copy(db, inserted)


def _set_assessment(db: sqlite3.Connection, edit: int, change: AssessmentChange) -> None:
    """Write the current pose again with another assessment, if it is the one that was assessed."""
    same = rows.UNASSESSED_COLUMNS
    inserted = db.execute(
        f"INSERT INTO pose_changes (edit, previous, person, frame, made_in, {rows.ASSESSED_COLUMNS}, {same}) "
        "SELECT ?1, id, person, frame, coalesce(made_in, edit), ?5, ?6, ?7, ?8, coalesce(?9, cost_px), "
        f"coalesce(?10, views_px), {same} FROM pose_changes "
        "WHERE id = (SELECT change FROM poses WHERE (person, frame) = (?2, ?3)) AND numbers = ?4",
        (edit, change.person, change.frame, rows.values_to_blob(change.values), *rows.assessment_to_row(change)),
    )
    _show_copy(db, inserted)


def _show_copy(db: sqlite3.Connection, inserted: sqlite3.Cursor) -> None:
    """Make a copy of the current pose current, with the same alternatives."""
    if inserted.rowcount:
        copied = "rank, numbers, model_revision, cost_px"
        db.execute(
            f"INSERT INTO alternatives (change, {copied}) SELECT ?1, {copied} FROM alternatives "
            "WHERE change = (SELECT previous FROM pose_changes WHERE id = ?1)",
            (inserted.lastrowid,),
        )
        show_change(db, "pose", inserted.lastrowid, inserted.lastrowid)


def _settings_record(db: sqlite3.Connection, settings: Mapping[str, Any]) -> int:
    """Return the id of the row of some settings. Equal settings share one row."""
    text = json.dumps(dict(settings))
    db.execute("INSERT OR IGNORE INTO program_settings (settings) VALUES (?)", (text,))
    return int(db.execute("SELECT id FROM program_settings WHERE settings = ?", (text,)).fetchone()[0])


def _set_pin(db: sqlite3.Connection, edit: int, change: PinChange) -> None:
    u, v = change.position_px or (None, None)
    change_id = db.execute(
        "INSERT INTO pin_changes (edit, previous, person, frame, point, camera, u, v) VALUES (?1, (SELECT change "
        "FROM pins WHERE (person, frame, point, camera) = (?2, ?3, ?4, ?5)), ?2, ?3, ?4, ?5, ?6, ?7)",
        (edit, *change[:4], u, v),
    ).lastrowid
    show_change(db, "pin", change_id, change_id)
