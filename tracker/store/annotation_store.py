"""The store of poses: who or what set them, when, why; pins, body models, and undo that survives a restart.

An SQLite file. Edits form a tree: each stands on the one before it, `head` is the one that the current poses show.
Undo moves head to the parent, redo to the youngest child. A commit after an undo grows a new branch; the old one
stays in the log but cannot be reached any more. Nothing but the current state and head is ever changed in place.
"""

import json
import sqlite3
import threading
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from tracker.errors import SessionError
from tracker.store import rows as stored_poses
from tracker.store import schema
from tracker.store.records import (
    Alternative,
    Change,
    Committed,
    FrameNumbers,
    FrameRow,
    HistoryEntry,
    MarkChange,
    ModelRevision,
    Pin,
    PinChange,
    PoseChange,
    PoseRecord,
)

# What each kind of current state is found by, and the column that is NULL where a change clears.
_KEYS = {"pose": ("person, frame", "numbers"), "pin": ("person, frame, point, camera", "u")}


class AnnotationStore:
    """The annotations of a session. Safe to use from several threads; one program may write at a time.

    Whatever a method has written is on the disk when it returns.
    """

    def __init__(self, path: str | Path, read_only: bool = False) -> None:
        """Open a store; a missing one is made and an older one brought up to date, unless it is only to be read.

        Raises:
            SessionError: the file is missing, not a store, or newer than this program.
        """
        self._path = Path(path)
        self._lock = threading.RLock()
        if read_only and not self._path.is_file():
            raise SessionError(f"annotations {path} not found; check the session folder")
        mode = "ro" if read_only else "rwc"
        with self._errors():
            self._db = sqlite3.connect(
                f"{self._path.absolute().as_uri()}?mode={mode}",
                uri=True,
                isolation_level=None,  # transactions are said, not guessed
                check_same_thread=False,
                timeout=10.0,
            )
            # No write-ahead log: it needs shared memory, which network drives lack. EXTRA is FULL plus the folder's
            # entry, without which a power cut could bring the journal back and take the last commit away.
            self._db.execute("PRAGMA journal_mode = DELETE")
            self._db.execute("PRAGMA synchronous = EXTRA")
            self._db.execute("PRAGMA foreign_keys = ON")
            version = self._prepared(read_only)
        if version != schema.VERSION:
            self._db.close()
            what = "is not a store of annotations" if version == 0 else f"has version {version}"
            raise SessionError(
                f"annotations {path} {what}, this program reads up to version {schema.VERSION}; upgrade quadrille"
            )

    def close(self) -> None:
        """Release the file."""
        with self._lock:
            self._db.close()

    def pose(self, person: str, frame: int) -> PoseRecord | None:
        """The pose of a person in a frame, or None."""
        row = self._one(
            f"SELECT {stored_poses.RECORD} {stored_poses.SHOWN} JOIN edits e ON e.id = c.edit "
            "LEFT JOIN told t ON t.id = c.told WHERE p.person = ? AND p.frame = ?",
            (person, frame),
        )
        return None if row is None else stored_poses.record_of(row)

    def alternatives(self, person: str, frame: int) -> tuple[Alternative, ...]:
        """Poses that are about as good as the one that a person has in a frame, best first."""
        rows = self._all(
            f"SELECT {stored_poses.ALTERNATIVE} FROM poses p JOIN alternatives a ON a.change = p.change "
            "WHERE p.person = ? AND p.frame = ? ORDER BY a.rank",
            (person, frame),
        )
        return tuple(stored_poses.alternative_of(row) for row in rows)

    def frames(self, person: str, within: range = range(1 << 31)) -> list[FrameRow]:
        """The frames of a range in which the person has a pose, ascending, in short; by default of all frames."""
        return [stored_poses.frame_of(row) for row in self._within(stored_poses.FRAME, person, within)]

    def numbers(self, person: str, frames: range) -> list[FrameNumbers]:
        """Poses and costs of a person in those frames of a range that have a pose, ascending: what a curve shows."""
        return [stored_poses.numbers_of(row) for row in self._within(stored_poses.NUMBERS, person, frames)]

    def pins(self, person: str, frame: int) -> list[Pin]:
        """The pins of a person in a frame, by point and camera."""
        rows = self._all(
            "SELECT c.point, c.camera, c.u, c.v FROM pins p JOIN pin_changes c ON c.id = p.change "
            "WHERE p.person = ? AND p.frame = ? ORDER BY p.point, p.camera",
            (person, frame),
        )
        return [Pin(point, camera, (u, v)) for point, camera, u, v in rows]

    def commit(self, label: str, changes: Sequence[Change], author: str = "", by_program: bool = False) -> Committed:
        """Make changes as one edit, which one undo takes back.

        Args:
            label: what the edit is to its user: `Drag left wrist`.
            changes: poses and pins to set or clear.
            author: who makes it.
            by_program: leave keyframes as they are.
        """
        with self._lock, self._errors(), self._transaction():
            (head,) = self._db.execute("SELECT edit FROM head").fetchone()
            edit = self._db.execute(
                "INSERT INTO edits (parent, label, author, time, program) VALUES (?, ?, ?, ?, ?)",
                (head, label, author, _now(), _program_version()),
            ).lastrowid
            assert edit is not None
            self._db.execute("UPDATE head SET edit = ?", (edit,))
            return Committed(edit, self._apply(edit, changes, by_program))

    def amend(self, edit: int, changes: Sequence[Change], by_program: bool = False) -> tuple[tuple[str, int], ...]:
        """Add changes to the edit made last, as the same gesture goes on.

        Returns:
            Person and frame of the keyframes that a program was kept from changing.

        Raises:
            SessionError: another edit, or an undo, has come in between.
        """
        with self._lock, self._errors(), self._transaction():
            (head,) = self._db.execute("SELECT edit FROM head").fetchone()
            if head != edit:
                raise SessionError(f"edit {edit} cannot go on: the history stands at {head}; begin a new edit")
            return self._apply(edit, changes, by_program)

    def undo(self) -> str | None:
        """Take the last edit back; returns its label, or None where there is none."""
        with self._lock, self._errors(), self._transaction():
            row = self._db.execute("SELECT e.id, e.label FROM head h JOIN edits e ON e.id = h.edit").fetchone()
            if row is None:
                return None
            self._take_back(row[0])
            return str(row[1])

    def redo(self) -> str | None:
        """Do again what the last undo took back; returns its label, or None where there is none."""
        with self._lock, self._errors(), self._transaction():
            row = self._db.execute(
                "SELECT id, label FROM edits WHERE parent IS (SELECT edit FROM head) ORDER BY id DESC LIMIT 1"
            ).fetchone()
            if row is None:
                return None
            self._do_again(row[0])
            return str(row[1])

    def go_to(self, edit: int | None) -> list[int]:
        """Undo or redo, all or nothing, until an edit is the last one done; None takes everything back.

        Returns:
            Ids of the edits taken back or done again, in that order.

        Raises:
            SessionError: neither undo nor redo leads there.
        """
        with self._lock, self._errors(), self._transaction():
            (head,) = self._db.execute("SELECT edit FROM head").fetchone()
            back = self._ids("?", "(SELECT parent FROM edits WHERE id = line.id)", head)
            if edit in back:
                way = back[: back.index(edit)]
                for last in way:
                    self._take_back(last)
                return way
            youngest = "(SELECT max(id) FROM edits WHERE parent IS {})"
            onward = self._ids(youngest.format("?"), youngest.format("line.id"), head)
            if edit not in onward:
                raise SessionError(f"entry {edit} of the history cannot be reached any more; look at the list again")
            way = onward[: onward.index(edit) + 1]
            for following in way:
                self._do_again(following)
            return way

    def history(self, limit: int = 100) -> list[HistoryEntry]:
        """Edits that redo and undo can reach, latest first; at most `limit` of each."""
        youngest = "(SELECT max(id) FROM edits WHERE parent IS {})"
        undone = self._line(youngest.format("(SELECT edit FROM head)"), youngest.format("line.id"), limit)
        done = self._line("(SELECT edit FROM head)", "line.parent", limit)
        return [HistoryEntry(e, label, author, time, True) for e, label, author, time in reversed(undone)] + [
            HistoryEntry(e, label, author, time, False) for e, label, author, time in done
        ]

    def frames_of(self, edit: int) -> list[int]:
        """Frames whose poses or pins an edit changes, ascending."""
        sql = "SELECT frame FROM pose_changes WHERE edit = ?1 UNION SELECT frame FROM pin_changes WHERE edit = ?1"
        return sorted(frame for (frame,) in self._all(sql, (edit,)))

    def add_model_revision(self, person: str, toml: str) -> int:
        """Keep a body model for good; returns its id, that of the same body where the person has had it before."""
        with self._lock, self._errors(), self._transaction():
            for known in self.model_revisions(person):
                if known.toml == toml:
                    return known.id
            row = self._db.execute(
                "INSERT INTO model_revisions (person, toml, time) VALUES (?, ?, ?)", (person, toml, _now())
            ).lastrowid
            assert row is not None
            return row

    def model_revisions(self, person: str) -> list[ModelRevision]:
        """All body models that a person has had, oldest first."""
        sql = "SELECT id, person, toml, time FROM model_revisions WHERE person = ? ORDER BY id"
        return [ModelRevision(*r) for r in self._all(sql, (person,))]

    def model_revision(self, revision: int) -> ModelRevision:
        """The body model of an id that a pose names."""
        row = self._one("SELECT id, person, toml, time FROM model_revisions WHERE id = ?", (revision,))
        assert row is not None, f"no model revision {revision}"
        return ModelRevision(*row)

    def setting(self, key: str, default: Any = None) -> Any:
        """A setting of the session: anything that JSON holds."""
        row = self._one("SELECT value FROM settings WHERE key = ?", (key,))
        return default if row is None else json.loads(row[0])

    def set_setting(self, key: str, value: Any) -> None:
        """Keep a setting of the session; not part of the history."""
        with self._lock, self._errors(), self._transaction():
            self._db.execute("INSERT OR REPLACE INTO settings VALUES (?, ?)", (key, json.dumps(value)))

    def _prepared(self, read_only: bool) -> int:
        """Make a new store, bring an older one up to date; returns the version it then has.

        An older store that is only to be read stays as it is on the disk and is read as if it were new.
        """
        if read_only:
            return schema.show_as_new(self._db)
        version = schema.version(self._db)
        if version < schema.VERSION:
            with self._transaction():  # all of it or nothing: a power cut leaves the older file
                version = schema.upgrade(self._db)
        return version

    def _apply(self, edit: int, changes: Sequence[Change], by_program: bool) -> tuple[tuple[str, int], ...]:
        skipped = []
        for change in changes:
            if isinstance(change, PinChange):
                self._set_pin(edit, change)
            elif isinstance(change, MarkChange):
                self._mark(edit, change)
            elif by_program and self._is_keyframe(change.person, change.frame):
                skipped.append((change.person, change.frame))
            else:
                self._set_pose(edit, change)
        return tuple(skipped)

    def _is_keyframe(self, person: str, frame: int) -> bool:
        sql = "SELECT c.keyframe FROM poses p JOIN pose_changes c ON c.id = p.change WHERE (p.person, p.frame) = (?, ?)"
        row = self._db.execute(sql, (person, frame)).fetchone()
        return row is not None and bool(row[0])

    def _set_pose(self, edit: int, change: PoseChange) -> None:
        pose = change.pose
        content = (None,) * 11 if pose is None else (*stored_poses.content_of(pose), self._told(pose.settings))
        row = self._db.execute(
            f"INSERT INTO pose_changes (edit, previous, person, frame, {stored_poses.CONTENT}) VALUES (?1, (SELECT "
            "change FROM poses WHERE (person, frame) = (?2, ?3)), ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10, ?11, ?12, ?13, "
            "?14)",
            (edit, change.person, change.frame, *content),
        ).lastrowid
        self._show("pose", row, row)
        self._db.executemany(
            "INSERT INTO alternatives (change, rank, numbers, model_revision, cost_px) VALUES (?, ?, ?, ?, ?)",
            [(row, i, *stored_poses.alternative_content_of(a)) for i, a in enumerate(change.alternatives)],
        )

    def _mark(self, edit: int, change: MarkChange) -> None:
        """Write the pose that is there again with other marks: the log holds every state of a frame as a whole."""
        same = stored_poses.UNMARKED
        found = self._db.execute(
            f"INSERT INTO pose_changes (edit, previous, person, frame, keyframe, reviewed, {same}) "
            f"SELECT ?, id, person, frame, ?, ?, {same} FROM pose_changes "
            "WHERE id = (SELECT change FROM poses WHERE (person, frame) = (?, ?))",
            (edit, change.keyframe, change.reviewed, change.person, change.frame),
        )
        if found.rowcount:
            kept = "rank, numbers, model_revision, cost_px"
            self._db.execute(
                f"INSERT INTO alternatives (change, {kept}) SELECT ?1, {kept} FROM alternatives "
                "WHERE change = (SELECT previous FROM pose_changes WHERE id = ?1)",
                (found.lastrowid,),
            )
            self._show("pose", found.lastrowid, found.lastrowid)

    def _told(self, settings: Mapping[str, Any]) -> int:
        """Id of settings, which are kept once however many poses were made with them."""
        text = json.dumps(dict(settings))
        self._db.execute("INSERT OR IGNORE INTO told (settings) VALUES (?)", (text,))
        return int(self._db.execute("SELECT id FROM told WHERE settings = ?", (text,)).fetchone()[0])

    def _set_pin(self, edit: int, change: PinChange) -> None:
        u, v = change.position_px or (None, None)
        row = self._db.execute(
            "INSERT INTO pin_changes (edit, previous, person, frame, point, camera, u, v) VALUES (?1, (SELECT change "
            "FROM pins WHERE (person, frame, point, camera) = (?2, ?3, ?4, ?5)), ?2, ?3, ?4, ?5, ?6, ?7)",
            (edit, *change[:4], u, v),
        ).lastrowid
        self._show("pin", row, row)

    def _line(self, start: str, onward: str, limit: int) -> list[Any]:
        """Edits from one to the next in the tree; `start` and `onward` are SQL for their ids."""
        columns = "edits.id, edits.parent, edits.label, edits.author, edits.time"
        return self._all(
            f"WITH RECURSIVE line (id, parent, label, author, time, n) AS (SELECT {columns}, 1 FROM edits "
            f"WHERE id = {start} UNION ALL SELECT {columns}, n + 1 FROM line JOIN edits ON edits.id = {onward} "
            "WHERE n < ?) SELECT id, label, author, time FROM line",
            (limit,),
        )

    def _take_back(self, edit: int) -> None:
        """Undo the last edit."""
        (parent,) = self._db.execute("SELECT parent FROM edits WHERE id = ?", (edit,)).fetchone()
        self._move("undo", edit, parent)
        for table in ("pose", "pin"):
            for change, previous in self._changes(table, edit)[::-1]:
                self._show(table, change, previous)

    def _do_again(self, edit: int) -> None:
        """Redo an edit that stands on the last one."""
        self._move("redo", edit, edit)
        for table in ("pose", "pin"):
            for change, _ in self._changes(table, edit):
                self._show(table, change, change)

    def _ids(self, start: str, onward: str, head: int | None) -> list[Any]:
        """Ids of edits from one to the next in the tree, then None; `start` and `onward` are SQL for them."""
        return [
            edit
            for (edit,) in self._db.execute(
                f"WITH RECURSIVE line (id) AS (SELECT {start} UNION ALL SELECT {onward} FROM line "
                "WHERE id IS NOT NULL) SELECT id FROM line",
                (head,),
            )
        ]

    def _changes(self, kind: str, edit: int) -> list[tuple[int, int | None]]:
        """Ids of an edit's changes, and of what was there before each, in order."""
        return self._db.execute(
            f"SELECT id, previous FROM {kind}_changes WHERE edit = ? ORDER BY id", (edit,)
        ).fetchall()

    def _show(self, kind: str, change: int | None, shown: int | None) -> None:
        """Let the frame (or pin) that a change is about show another of its changes, or nothing."""
        key, content = _KEYS[kind]
        self._db.execute(
            f"DELETE FROM {kind}s WHERE ({key}) = (SELECT {key} FROM {kind}_changes WHERE id = ?)", (change,)
        )
        self._db.execute(
            f"INSERT INTO {kind}s ({key}, change) SELECT {key}, id FROM {kind}_changes "
            f"WHERE id = ? AND {content} IS NOT NULL",
            (shown,),
        )

    def _move(self, kind: str, edit: int, head: int | None) -> None:
        self._db.execute("INSERT INTO moves (kind, edit, time) VALUES (?, ?, ?)", (kind, edit, _now()))
        self._db.execute("UPDATE head SET edit = ?", (head,))

    def _within(self, columns: str, person: str, frames: range) -> list[Any]:
        """Some columns of the poses that a person has within a range of frames, ascending."""
        sql = f"SELECT {columns} {stored_poses.SHOWN} WHERE p.person = ? AND p.frame BETWEEN ? AND ? ORDER BY p.frame"
        return self._all(sql, (person, frames.start, frames.stop - 1))

    def _one(self, sql: str, parameters: tuple[Any, ...]) -> Any:
        with self._lock, self._errors():
            return self._db.execute(sql, parameters).fetchone()

    def _all(self, sql: str, parameters: tuple[Any, ...]) -> list[Any]:
        with self._lock, self._errors():
            return self._db.execute(sql, parameters).fetchall()

    @contextmanager
    def _transaction(self) -> Generator[None, None, None]:
        self._db.execute("BEGIN IMMEDIATE")
        try:
            yield
            self._db.execute("COMMIT")
        except BaseException:
            if self._db.in_transaction:  # a full disk may have ended it already
                self._db.execute("ROLLBACK")
            raise

    @contextmanager
    def _errors(self) -> Generator[None, None, None]:
        try:
            yield
        except sqlite3.Error as error:
            raise SessionError(
                f"annotations {self._path} cannot be read or written: {error}; check the disk and who has the file open"
            ) from error


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="milliseconds")


@cache
def _program_version() -> str:
    try:
        return metadata.version("quadrille")
    except metadata.PackageNotFoundError:  # run from the source tree without an installation
        return "unknown"
