"""A whole store as values that name nothing by number, so that logs of copies can be joined; and back to a file."""

import json
import sqlite3
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias, TypeVar

from tracker.errors import DamagedStoreError
from tracker.session.store import rows
from tracker.session.store.connection import Connection
from tracker.session.store.edit_tree import show_change
from tracker.session.store.records import ModelRevision
from tracker.session.store.settings import checked_setting
from tracker.session.store.task_log import Rows, TaskLog, Uid, write_rows
from tracker.validation import Time, check

T = TypeVar("T")

COLUMNS = tuple(rows.WRITTEN_COLUMNS.split(", "))
"""Columns of a pose in a `PoseRow`. Its body is the pair of person and text, its settings are JSON text."""
_BODY, _SETTINGS, NUMBERS = (COLUMNS.index(name) for name in ("model_revision", "program_settings", "numbers"))

Body: TypeAlias = tuple[str, str]
"""Person and text of a body model."""
Pair: TypeAlias = tuple[str, int]
"""Person and frame."""
PinKey: TypeAlias = tuple[str, int, str, str]
"""Person, frame, point and camera."""


class PoseRow(NamedTuple):
    """A pose as an edit left it."""

    pose: tuple[Any, ...] | None
    """Values of `COLUMNS`; None: cleared."""
    made_in: str | None
    """Identity of the edit that made it, if this one did not."""
    alternatives: tuple[tuple[Body, bytes, float | None], ...] = ()
    """Body, values and cost of each alternative, best first."""


class LoggedEdit(NamedTuple):
    """An edit with its changes in order."""

    uid: str
    label: str
    author: str
    time: str
    program: str
    poses: tuple[tuple[Pair, PoseRow], ...]
    pins: tuple[tuple[PinKey, tuple[float, float] | None], ...]


class Move(NamedTuple):
    """An undo or redo of an edit."""

    kind: Literal["undo", "redo"]
    uid: str
    time: Time


@dataclass(frozen=True, eq=False)
class EditLog:
    """The content of a store."""

    edits: Sequence[LoggedEdit]
    """In the order in which they were made."""
    done: frozenset[str]
    """Identities of the edits that are not undone."""
    moves: Sequence[Move]
    """In the order in which they happened."""
    revisions: Sequence[ModelRevision]
    """The body models; their ids matter to `settings` alone."""
    settings: Mapping[str, Any]
    """By name, as they are stored: they may name edits and bodies by number."""
    numbers: Mapping[int, str]
    """The identity of each edit by its number."""
    tasks: Rows


def read_log(connection: Connection) -> EditLog:
    """Read a whole store.

    Raises:
        DamagedStoreError: a row is not one that the program writes.
        SessionError: the file cannot be read.
    """
    _check_rows(connection)
    every = connection.all
    revisions = every("SELECT id, person, toml, time FROM model_revisions ORDER BY id", (), rows.row_to_revision)
    bodies = _ById("body model", {r.id: (r.person, sys.intern(r.toml)) for r in revisions})
    edits = every(f"SELECT {', '.join(_Edit._fields)} FROM edits ORDER BY id", (), _checked_edit)
    numbers = _ById("edit", {edit.id: edit.uid for edit in edits})
    if len({*numbers.values()}) < len(edits):
        raise DamagedStoreError("expected another identity for each edit (its uid), found two that are equal")
    poses, pins = _poses(connection, bodies, numbers), dict[int, list[Any]]()
    for edit, *key, u, v in every(
        "SELECT edit, person, frame, point, camera, u, v FROM pin_changes ORDER BY id", (), tuple
    ):
        pins.setdefault(edit, []).append((tuple(key), None if u is None else (u, v)))
    done = every(
        "WITH RECURSIVE line (id) AS (SELECT edit FROM head UNION ALL SELECT parent FROM line JOIN edits USING (id)) "
        "SELECT id FROM line WHERE id IS NOT NULL",
        (),
        lambda row: numbers[row[0]],
    )
    tasks = TaskLog(connection)
    return EditLog(
        [
            LoggedEdit(uid, label, author, time, program, tuple(poses.get(number, ())), tuple(pins.get(number, ())))
            for number, uid, label, author, time, program in edits
        ],
        frozenset(done),
        every("SELECT kind, edit, time FROM moves ORDER BY id", (), lambda r: _checked_move(r[0], numbers[r[1]], r[2])),
        revisions,
        dict(every("SELECT key, value FROM settings", (), _setting)),
        numbers,
        (tasks.tasks(), tasks.states(), tasks.comments()),
    )


class _Edit(NamedTuple):
    """The columns of an edit."""

    id: int
    uid: Uid
    label: str
    author: str
    time: Time
    program: str


class _ById(dict[int, T]):
    """What rows refer to by number."""

    def __init__(self, kind: str, found: Mapping[int, T]) -> None:
        super().__init__(found)
        self._kind = kind

    def __missing__(self, number: int) -> T:
        raise DamagedStoreError(f"a row refers to {self._kind} {number!r:.20}, which is missing")


def _checked_edit(row: Sequence[Any]) -> _Edit:
    edit: _Edit = check(list(row), _Edit, f"edit {row[0]!r:.20}", DamagedStoreError)
    return edit


def _checked_move(*row: Any) -> Move:
    move: Move = check(row, Move, f"the undo or redo of edit {row[1]!r:.40}", DamagedStoreError)
    return move


def _setting(row: Sequence[Any]) -> tuple[str, Any]:
    return str(row[0]), checked_setting(str(row[0]), rows.decoded_json(row[1], f"setting '{row[0]}'"))


def _check_rows(connection: Connection) -> None:
    """Check all poses, alternatives and pins.

    Raises:
        DamagedStoreError: a row is not one that the program writes.
    """

    def pair(row: Sequence[Any]) -> rows.PoseLabel:
        where = rows.PoseLabel(check(row[0], str, f"the person in frame {row[1]!r:.20}", DamagedStoreError), row[1])
        rows.frame_number(row[1], where)
        return where

    of_pose, of_pin = "SELECT c.person, c.frame", "SELECT person, frame"
    connection.all(f"{of_pose} FROM pose_changes c", (), pair)
    connection.all(
        f"{of_pose}, {rows.RECORD_COLUMNS} FROM pose_changes c {rows.ORIGIN} WHERE c.numbers IS NOT NULL",
        (),
        lambda row: rows.row_to_record(row[2:], pair(row)) and None,
    )
    connection.all(
        f"{of_pose}, {rows.ALTERNATIVE_COLUMNS} {rows.ALTERNATIVES}",
        (),
        lambda row: rows.row_to_alternative(row[2:], pair(row)) and None,
    )
    connection.all(
        f"{of_pin}, point, camera, coalesce(u, 0), coalesce(v, 0) FROM pin_changes",
        (),
        lambda row: rows.row_to_pin(row[2:], pair(row)) and None,
    )


def _poses(
    connection: Connection, bodies: Mapping[int, Body], numbers: Mapping[int, str]
) -> dict[int, list[tuple[Pair, PoseRow]]]:
    """Return the changes of poses by number of their edit, in order."""
    others: dict[int, list[Any]] = {}
    for change, body, values, cost_px in connection.all(
        "SELECT change, model_revision, numbers, cost_px FROM alternatives ORDER BY change, rank", (), tuple
    ):
        others.setdefault(change, []).append((bodies[body], values, cost_px))
    columns = ", ".join(f"c.{name}" for name in COLUMNS[:-1])
    poses: dict[int, list[tuple[Pair, PoseRow]]] = {}
    for change, edit, made_in, person, frame, *pose in connection.all(
        f"SELECT c.id, c.edit, c.made_in, c.person, c.frame, {columns}, coalesce(t.settings, c.settings) "
        "FROM pose_changes c LEFT JOIN program_settings t ON t.id = c.program_settings ORDER BY c.id",
        (),
        tuple,
    ):
        content = None
        if pose[NUMBERS] is not None:
            pose[_BODY], pose[_SETTINGS] = bodies[pose[_BODY]], sys.intern(pose[_SETTINGS])
            content = tuple(pose)
        row = PoseRow(content, None if made_in is None else numbers[made_in], tuple(others.get(change, ())))
        poses.setdefault(edit, []).append(((person, frame), row))
    return poses


class Written(NamedTuple):
    """Numbers in a store that was written from a log."""

    edits: Mapping[str, int]
    """By identity."""
    bodies: Mapping[Body, int]


def write_log(connection: Connection, log: EditLog) -> Written:
    """Write a log into an empty store, all or nothing: done edits form one line, undone ones branch off it.

    Settings that name edits or bodies by number are the caller's; `log.settings` are written as they are.
    """
    with connection.transaction() as db:
        bodies: dict[Body, int] = {}
        for r in log.revisions:
            bodies[r.person, r.toml] = _insert(db, "model_revisions", person=r.person, toml=r.toml, time=r.time)
        edits: dict[str, int] = {}
        head: int | None = None
        for edit in log.edits:
            uid, label, author, time, program, *_ = edit
            number = edits[uid] = _insert(
                db, "edits", parent=head, label=label, author=author, time=time, program=program, uid=uid
            )
            _write_changes(db, edit, edits, bodies, edit.uid in log.done)
            head = number if edit.uid in log.done else head
        db.execute("UPDATE head SET edit = ?", (head,))
        for move in log.moves:
            _insert(db, "moves", kind=move.kind, edit=edits[move.uid], time=move.time)
        for key, value in log.settings.items():
            db.execute("INSERT OR REPLACE INTO settings (key, value) VALUES (?, ?)", (key, json.dumps(value)))
        write_rows(db, log.tasks)
    return Written(edits, bodies)


def _write_changes(
    db: sqlite3.Connection, edit: LoggedEdit, edits: Mapping[str, int], bodies: Mapping[Body, int], is_done: bool
) -> None:
    """Write the changes of an edit; those of an undone one become current only while they are written."""
    shown: list[tuple[str, int, int | None]] = []
    for (person, frame), row in edit.poses:
        pose = dict.fromkeys(COLUMNS) if row.pose is None else dict(zip(COLUMNS, row.pose, strict=True))
        if row.pose is not None:
            text = pose["program_settings"]
            db.execute("INSERT OR IGNORE INTO program_settings (settings) VALUES (?)", (text,))
            (settings,) = db.execute("SELECT id FROM program_settings WHERE settings = ?", (text,)).fetchone()
            pose |= {"program_settings": settings, "model_revision": bodies[row.pose[_BODY]]}
        previous = _current(db, "pose", (person, frame))
        made_in = None if row.made_in is None else edits[row.made_in]
        keys: dict[str, Any] = {"edit": edits[edit.uid], "previous": previous, "person": person, "frame": frame}
        change = _insert(db, "pose_changes", **keys, made_in=made_in, **pose)
        for rank, (body, values, cost_px) in enumerate(row.alternatives):
            other = (change, rank, bodies[body], values, cost_px)
            db.execute(
                "INSERT INTO alternatives (change, rank, model_revision, numbers, cost_px) VALUES (?, ?, ?, ?, ?)",
                other,
            )
        show_change(db, "pose", change, change)
        shown.append(("pose", change, previous))
    for key, place in edit.pins:
        previous = _current(db, "pin", key)
        named = dict(zip(("person", "frame", "point", "camera"), key, strict=True))
        u, v = place or (None, None)
        change = _insert(db, "pin_changes", edit=edits[edit.uid], previous=previous, **named, u=u, v=v)
        show_change(db, "pin", change, change)
        shown.append(("pin", change, previous))
    for kind, change, previous in () if is_done else reversed(shown):
        show_change(db, kind, change, previous)


def _current(db: sqlite3.Connection, kind: str, key: Sequence[Any]) -> int | None:
    """Return the number of the change that is current for a pose or pin."""
    columns = "person, frame" if kind == "pose" else "person, frame, point, camera"
    marks = ", ".join("?" * len(key))
    row = db.execute(f"SELECT change FROM {kind}s WHERE ({columns}) = ({marks})", tuple(key)).fetchone()
    return None if row is None else int(row[0])


def _insert(db: sqlite3.Connection, table: str, **values: Any) -> int:
    marks = ", ".join("?" * len(values))
    sql = f"INSERT INTO {table} ({', '.join(values)}) VALUES ({marks})"
    number = db.execute(sql, tuple(values.values())).lastrowid
    assert number is not None
    return number
