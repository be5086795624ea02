"""The store of annotations: poses with their provenance, pins, body models, settings, and undo across restarts.

An SQLite file (`schema`). Poses and pins are a log of changes, each part of an edit (`edit_tree`). Only the current
state and head are changed in place.
"""

import json
import secrets
import sqlite3
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Self, TypeVar

from tracker.errors import OvertakenEditError
from tracker.session.store import edit_tree, own_undo, rows
from tracker.session.store.annotator import annotator
from tracker.session.store.connection import Connection
from tracker.session.store.edit_log import EditLog, Written, read_log, write_log
from tracker.session.store.edit_tree import write_changes
from tracker.session.store.own_undo import OwnLabels, OwnMove
from tracker.session.store.records import (
    ALL_FRAMES,
    Alternative,
    Change,
    Committed,
    FramePose,
    FrameRow,
    HistoryEntry,
    ModelRevision,
    Pin,
    PoseRecord,
)
from tracker.session.store.settings import checked_setting
from tracker.session.store.task_log import TaskLog

T = TypeVar("T")

_ID = "store_id"
"""Setting of a store: a random text that rescue files name it by."""


class AnnotationStore:
    """The annotations of a session; a context manager. Safe to use from several threads.

    One program may write at a time. When a method returns, its changes are on the disk.
    """

    def __init__(self, path: str | Path, read_only: bool = False, author: str | None = None) -> None:
        """Open a store. Unless read only, create a missing one and upgrade an older one.

        Args:
            path: of the file.
            read_only: leave the file unchanged.
            author: name of the annotator who makes the edits; by default that of `annotator`.

        Raises:
            SessionError: the file is missing, not a store, or newer than this program.
            DamagedStoreError: the file is not as it was written; the message names the backup to go back to.
        """
        self._connection = Connection(path, read_only)
        self._edits, self._author = edit_tree.EditTree(self._connection), annotator() if author is None else author
        self.tasks = TaskLog(self._connection)
        """The plan of annotation: tasks, states and comments."""
        if not read_only and self.setting(_ID) is None:
            self.set_setting(_ID, secrets.token_hex(8))

    def close(self) -> None:
        """Release the file."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def id(self) -> str:
        """Identifies the store, and copies of it; empty for an older one that was opened read only."""
        return str(self.setting(_ID, ""))

    def impatient(self) -> AbstractContextManager[None]:
        """Do not wait for other programs that have locked the file, but raise at once, within a `with` block."""
        return self._connection.impatient()

    @property
    def backup_error(self) -> str | None:
        """Why there is no backup of the store as it was opened; None if there is one."""
        return self._connection.backup_error

    def pose(self, person: str, frame: int) -> PoseRecord | None:
        """Return the pose of a person in a frame, or None."""
        return self.poses(person, range(frame, frame + 1)).get(frame)

    def poses(self, person: str, frames: range) -> dict[int, PoseRecord]:
        """Return the poses of a person in a range of frames, by frame, ascending."""
        return self._records(
            f"SELECT p.frame, {rows.RECORD_COLUMNS} {rows.CURRENT_POSES} {rows.ORIGIN} "
            "WHERE p.person = ? AND p.frame BETWEEN ? AND ? ORDER BY p.frame",
            person,
            frames,
        )

    def former_poses(self, person: str, frames: range) -> dict[int, PoseRecord]:
        """Return the poses that the present ones of a range of frames replaced, by frame, ascending.

        Edits that changed only marks do not count, nor do steps within the edit that made the present pose. A pose
        that was set after the frame was cleared has replaced none.
        """
        return self._records(
            "WITH RECURSIVE f (frame, numbers, edit, change) AS ("
            f"SELECT p.frame, c.numbers, c.edit, c.previous {rows.CURRENT_POSES} "
            "WHERE p.person = ? AND p.frame BETWEEN ? AND ? UNION ALL "
            "SELECT f.frame, f.numbers, CASE WHEN d.numbers IS f.numbers THEN d.edit ELSE f.edit END, d.previous "
            "FROM f JOIN pose_changes d ON d.id = f.change "
            "WHERE d.numbers IS f.numbers OR d.edit = f.edit OR d.numbers IS NULL) "
            f"SELECT f.frame, {rows.RECORD_COLUMNS} FROM f JOIN pose_changes c ON c.id = f.change "
            f"{rows.ORIGIN} "
            "WHERE c.numbers IS NOT f.numbers AND c.edit != f.edit AND c.numbers IS NOT NULL ORDER BY f.frame",
            person,
            frames,
        )

    def pose_versions(self, person: str, frame: int) -> list[PoseRecord]:
        """Return the pose of a person in a frame and the ones before it that undo would show, the present one first.

        Steps within one edit count, too. Nothing is returned if the frame shows no pose.
        """
        return self._connection.all(
            "WITH RECURSIVE f (change) AS (SELECT change FROM poses WHERE person = ? AND frame = ? UNION ALL "
            "SELECT c.previous FROM f JOIN pose_changes c ON c.id = f.change WHERE c.previous IS NOT NULL) "
            f"SELECT {rows.RECORD_COLUMNS} FROM f JOIN pose_changes c ON c.id = f.change {rows.ORIGIN} "
            "WHERE c.numbers IS NOT NULL ORDER BY c.id DESC",
            (person, frame),
            lambda row: rows.row_to_record(row, rows.PoseLabel(person, frame)),
        )

    def pose_edits(self, person: str) -> dict[int, int]:
        """Return the entry of the history that made each pose of a person, by frame, ascending."""
        sql = f"SELECT p.frame, coalesce(c.made_in, c.edit) {rows.CURRENT_POSES} WHERE p.person = ? ORDER BY p.frame"
        return dict(self._connection.all(sql, (person,), lambda row: (int(row[0]), int(row[1]))))

    def alternatives(self, person: str, frame: int) -> tuple[Alternative, ...]:
        """Return the alternatives to a person's pose in a frame, best first."""
        alternatives = self._connection.all(
            f"SELECT {rows.ALTERNATIVE_COLUMNS} FROM poses p JOIN alternatives a ON a.change = p.change "
            "WHERE p.person = ? AND p.frame = ? ORDER BY a.rank",
            (person, frame),
            lambda row: rows.row_to_alternative(row, f"an alternative to {rows.PoseLabel(person, frame)}"),
        )
        return tuple(alternatives)

    def frames(self, person: str, within: range = ALL_FRAMES) -> list[FrameRow]:
        """Summarize the frames of a range in which the person has a pose, ascending; all frames by default."""
        return self._within(rows.FRAME_ROW_COLUMNS, person, within, rows.row_to_frame_row)

    def frame_poses(self, person: str, frames: range) -> list[FramePose]:
        """Return the poses and costs of a person in the frames of a range that have a pose, ascending."""
        return self._within(rows.FRAME_POSE_COLUMNS, person, frames, rows.row_to_frame_pose)

    def pins(self, person: str, frame: int) -> list[Pin]:
        """Return the pins of a person in a frame, by point and camera."""
        return self._connection.all(
            "SELECT c.point, c.camera, c.u, c.v FROM pins p JOIN pin_changes c ON c.id = p.change "
            "WHERE p.person = ? AND p.frame = ? ORDER BY p.point, p.camera",
            (person, frame),
            lambda row: rows.row_to_pin(row, f"a pin of {person!r} in frame {frame}"),
        )

    def commit(
        self, label: str, changes: Sequence[Change], author: str | None = None, by_program: bool = False,
        settings: Callable[[int], Mapping[str, Any]] = lambda edit: {},
    ) -> Committed:  # fmt: skip
        """Make changes as one edit, which one undo reverts.

        Args:
            label: name of the edit for its user, such as `Drag left wrist`.
            changes: poses and pins to set or clear.
            author: name of the annotator who makes it; by default the one of the store.
            by_program: leave keyframes unchanged.
            settings: returns settings that name the number of the edit; they are stored with it or not at all.
        """
        with self._connection.transaction() as db:
            edit = self._edits.add(db, label, self._author if author is None else author)
            for key, value in settings(edit).items():
                _store_setting(db, key, value)
            return Committed(edit, write_changes(db, edit, changes, by_program))

    def amend(self, edit: int, changes: Sequence[Change], by_program: bool = False) -> tuple[tuple[str, int], ...]:
        """Add changes to an edit, while its gesture continues. Edits of other poses may have come in between.

        Returns:
            Person and frame of the keyframes left unchanged because a program made the edit.

        Raises:
            OvertakenEditError: the edit is undone, or a later one has changed the same poses.
        """
        with self._connection.transaction() as db:
            head = edit_tree.head(db)
            if head != edit and edit_tree.is_overtaken(db, edit, {(c.person, c.frame) for c in changes}):
                raise OvertakenEditError(f"edit {edit} cannot go on: the history stands at {head}; begin a new edit")
            return write_changes(db, edit, changes, by_program)

    def undo(self) -> str | None:
        """Undo the last edit; returns its label, or None if there is none."""
        return self._edits.undo()

    def redo(self) -> str | None:
        """Redo the edit that was undone last; returns its label, or None if there is none."""
        return self._edits.redo()

    def undo_own(self, author: str | None = None, in_tree: bool = True) -> OwnMove | None:
        """Undo the last edit of an annotator, also among later edits of others; see `own_undo.undo_own`.

        Args:
            author: the annotator; by default the one of the store.
            in_tree: whether the last edit of all is undone in the tree.
        """
        return own_undo.undo_own(self._connection, self._edits, self._author if author is None else author, in_tree)

    def redo_own(self, author: str | None = None, in_tree: bool = True) -> OwnMove | None:
        """Redo the last edit of an annotator that was undone; arguments as for `undo_own`."""
        return own_undo.redo_own(self._connection, self._edits, self._author if author is None else author, in_tree)

    def own_labels(self, author: str | None = None) -> OwnLabels:
        """Return labels of what an annotator, by default the one of the store, can undo and redo."""
        return own_undo.own_labels(self._connection, self._author if author is None else author)

    def go_to(self, edit: int | None) -> list[int]:
        """Undo or redo until an edit is the last one done; see `EditTree.go_to`."""
        return self._edits.go_to(edit)

    def history(self, limit: int = 100) -> list[HistoryEntry]:
        """List the edits that redo and undo can reach, latest first, at most `limit` of each."""
        return self._edits.history(limit)

    def done_edits(self) -> list[int]:
        """List the entries of the history that are done, ascending."""
        return self._edits.done()

    def frames_of(self, edit: int) -> list[int]:
        """List the frames whose poses or pins an edit changes, ascending."""
        return self._edits.frames_of(edit)

    def poses_of(self, edit: int) -> set[tuple[str, int]]:
        """Return person and frame of the poses and pins that an edit changes."""
        return self._edits.poses_of(edit)

    def add_model_revision(self, person: str, toml: str) -> int:
        """Store a body model for good and return its id. An equal model of the person is not stored twice."""
        with self._connection.transaction() as db:
            for known in self.model_revisions(person):
                if known.toml == toml:
                    return known.id
            revision = db.execute(
                "INSERT INTO model_revisions (person, toml, time) VALUES (?, ?, ?)", (person, toml, edit_tree.now())
            ).lastrowid
            assert revision is not None
            return revision

    def model_revisions(self, person: str) -> list[ModelRevision]:
        """Return all body models that a person has had, oldest first."""
        sql = "SELECT id, person, toml, time FROM model_revisions WHERE person = ? ORDER BY id"
        return self._connection.all(sql, (person,), rows.row_to_revision)

    def model_revision(self, revision: int) -> ModelRevision:
        """Return the body model with the id that a pose refers to.

        Raises:
            DamagedStoreError: there is none.
        """
        sql = "SELECT id, person, toml, time FROM model_revisions WHERE id = ?"
        stored = self._connection.one(sql, (revision,), rows.row_to_revision)
        if stored is None:
            raise self._connection.damaged(f"a pose refers to model revision {revision}, which is missing")
        return stored

    def read_log(self) -> EditLog:
        """Read all that the store holds, without numbers of rows."""
        with self._connection.snapshot():
            return read_log(self._connection)

    def write_log(self, log: EditLog) -> Written:
        """Write a log into this store, which must be new and empty."""
        return write_log(self._connection, log)

    def value_counts(self) -> dict[int, dict[int, tuple[str, int]]]:
        """Return for each model revision the numbers of values of its poses, each with a person and frame that has it.

        Poses of a body all have the same number.
        """
        pose = "SELECT id, person, frame, model_revision, numbers FROM pose_changes WHERE numbers IS NOT NULL"
        others = f"SELECT c.id, person, frame, a.model_revision, a.numbers {rows.ALTERNATIVES}"
        sql = f"SELECT model_revision, length(numbers), person, frame FROM ({pose} UNION ALL {others}) GROUP BY 1, 2"
        counts: dict[int, dict[int, tuple[str, int]]] = {}
        for revision, n_bytes, *of in self._connection.all(sql, (), tuple):
            counts.setdefault(revision, {})[(n_bytes or 0) // 8] = (str(of[0]), of[1])
        return counts

    def require_fit(self, revision: int, n_values: int, counts: dict[int, dict[int, tuple[str, int]]]) -> None:
        """Check that the poses of a body have as many values as it.

        Args:
            revision: of the body model.
            n_values: number of its values.
            counts: of `value_counts`.

        Raises:
            DamagedStoreError: one has not.
        """
        for n, (person, frame) in counts.get(revision, {}).items():
            if n != n_values:
                raise self._connection.damaged(
                    f"{rows.PoseLabel(person, frame)}: expected {n_values} values as its body has, found {n}"
                )

    def setting(self, key: str, default: Any = None) -> Any:
        """Return a setting of the session, checked against its declaration; the default where it is not stored."""
        stored = self._connection.one(
            "SELECT value FROM settings WHERE key = ?",
            (key,),
            lambda row: (checked_setting(key, rows.decoded_json(row[0], f"setting '{key}'")),),
        )
        return default if stored is None else stored[0]

    def set_setting(self, key: str, value: Any) -> None:
        """Store a setting of the session. Settings are not part of the history."""
        with self._connection.transaction() as db:
            _store_setting(db, key, value)

    def _records(self, sql: str, person: str, frames: range) -> dict[int, PoseRecord]:
        """Read frames and poses of a person, by frame."""

        def convert(row: Sequence[Any]) -> tuple[int, PoseRecord]:
            where = rows.PoseLabel(person, row[0])
            return rows.frame_number(row[0], where), rows.row_to_record(row[1:], where)

        return dict(self._connection.all(sql, (person, frames.start, frames.stop - 1), convert))

    def _within(
        self, columns: str, person: str, frames: range, convert: Callable[[Sequence[Any], object], T]
    ) -> list[T]:
        """Select columns of the poses of a person within a range of frames, ascending; the first one is the frame."""
        sql = f"SELECT {columns} {rows.CURRENT_POSES} WHERE p.person = ? AND p.frame BETWEEN ? AND ? ORDER BY p.frame"
        return self._connection.all(
            sql, (person, frames.start, frames.stop - 1), lambda row: convert(row, rows.PoseLabel(person, row[0]))
        )


def _store_setting(db: sqlite3.Connection, key: str, value: Any) -> None:
    db.execute("INSERT OR REPLACE INTO settings (key, value) VALUES (?, ?)", (key, json.dumps(value)))
