"""The store of annotations: poses with their provenance, pins, body models, settings, and undo across restarts.

An SQLite file (`schema`). Poses and pins are a log of changes, each part of an edit (`edit_tree`). Only the current
state and head are changed in place.
"""

import json
import secrets
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from tracker.errors import SessionError
from tracker.store import edit_tree, rows
from tracker.store.changes import write_changes
from tracker.store.connection import Connection
from tracker.store.records import (
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

_ID = "store_id"
"""Setting of a store: a random text that rescue files name it by."""


class AnnotationStore:
    """The annotations of a session. Safe to use from several threads; one program may write at a time.

    When a method returns, its changes are on the disk.
    """

    def __init__(self, path: str | Path, read_only: bool = False) -> None:
        """Open a store. Unless read only, create a missing one and upgrade an older one.

        Raises:
            SessionError: the file is missing, not a store, or newer than this program.
            DamagedStoreError: the file is not as it was written; the message names the backup to go back to.
        """
        self._connection = Connection(path, read_only)
        self._edits = edit_tree.EditTree(self._connection)
        if not read_only and self.setting(_ID) is None:
            self.set_setting(_ID, secrets.token_hex(8))

    def close(self) -> None:
        """Release the file."""
        self._connection.close()

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
        found = self._connection.all(
            f"SELECT p.frame, {rows.RECORD_COLUMNS} {rows.CURRENT_POSES} JOIN edits e ON e.id = c.edit "
            "LEFT JOIN program_settings t ON t.id = c.program_settings "
            "WHERE p.person = ? AND p.frame BETWEEN ? AND ? ORDER BY p.frame",
            (person, frames.start, frames.stop - 1),
        )
        return {frame: rows.row_to_record(row) for frame, *row in found}

    def former_poses(self, person: str, frames: range) -> dict[int, PoseRecord]:
        """Return the poses that the present ones of a range of frames replaced, by frame, ascending.

        Edits that changed only marks do not count, nor do steps within the edit that made the present pose. A pose
        that was set after the frame was cleared has replaced none.
        """
        found = self._connection.all(
            "WITH RECURSIVE f (frame, numbers, edit, change) AS ("
            f"SELECT p.frame, c.numbers, c.edit, c.previous {rows.CURRENT_POSES} "
            "WHERE p.person = ? AND p.frame BETWEEN ? AND ? UNION ALL "
            "SELECT f.frame, f.numbers, CASE WHEN d.numbers IS f.numbers THEN d.edit ELSE f.edit END, d.previous "
            "FROM f JOIN pose_changes d ON d.id = f.change "
            "WHERE d.numbers IS f.numbers OR d.edit = f.edit OR d.numbers IS NULL) "
            f"SELECT f.frame, {rows.RECORD_COLUMNS} FROM f JOIN pose_changes c ON c.id = f.change "
            "JOIN edits e ON e.id = c.edit LEFT JOIN program_settings t ON t.id = c.program_settings "
            "WHERE c.numbers IS NOT f.numbers AND c.edit != f.edit AND c.numbers IS NOT NULL ORDER BY f.frame",
            (person, frames.start, frames.stop - 1),
        )
        return {frame: rows.row_to_record(row) for frame, *row in found}

    def alternatives(self, person: str, frame: int) -> tuple[Alternative, ...]:
        """Return the alternatives to a person's pose in a frame, best first."""
        found = self._connection.all(
            f"SELECT {rows.ALTERNATIVE_COLUMNS} FROM poses p JOIN alternatives a ON a.change = p.change "
            "WHERE p.person = ? AND p.frame = ? ORDER BY a.rank",
            (person, frame),
        )
        return tuple(rows.row_to_alternative(row) for row in found)

    def frames(self, person: str, within: range = range(1 << 31)) -> list[FrameRow]:
        """Summarize the frames of a range in which the person has a pose, ascending; all frames by default."""
        return [rows.row_to_frame_row(row) for row in self._within(rows.FRAME_ROW_COLUMNS, person, within)]

    def frame_poses(self, person: str, frames: range) -> list[FramePose]:
        """Return the poses and costs of a person in the frames of a range that have a pose, ascending."""
        return [rows.row_to_frame_pose(row) for row in self._within(rows.FRAME_POSE_COLUMNS, person, frames)]

    def pins(self, person: str, frame: int) -> list[Pin]:
        """Return the pins of a person in a frame, by point and camera."""
        found = self._connection.all(
            "SELECT c.point, c.camera, c.u, c.v FROM pins p JOIN pin_changes c ON c.id = p.change "
            "WHERE p.person = ? AND p.frame = ? ORDER BY p.point, p.camera",
            (person, frame),
        )
        return [Pin(point, camera, (u, v)) for point, camera, u, v in found]

    def commit(self, label: str, changes: Sequence[Change], author: str = "", by_program: bool = False) -> Committed:
        """Make changes as one edit, which one undo reverts.

        Args:
            label: name of the edit for its user, such as `Drag left wrist`.
            changes: poses and pins to set or clear.
            author: name of the person who makes it.
            by_program: leave keyframes unchanged.
        """
        with self._connection.transaction() as db:
            edit = self._edits.add(db, label, author)
            return Committed(edit, write_changes(db, edit, changes, by_program))

    def amend(self, edit: int, changes: Sequence[Change], by_program: bool = False) -> tuple[tuple[str, int], ...]:
        """Add changes to the last edit, while its gesture continues.

        Returns:
            Person and frame of the keyframes left unchanged because a program made the edit.

        Raises:
            SessionError: another edit, or an undo, has come in between.
        """
        with self._connection.transaction() as db:
            head = edit_tree.head(db)
            if head != edit:
                raise SessionError(f"edit {edit} cannot go on: the history stands at {head}; begin a new edit")
            return write_changes(db, edit, changes, by_program)

    def undo(self) -> str | None:
        """Undo the last edit; returns its label, or None if there is none."""
        return self._edits.undo()

    def redo(self) -> str | None:
        """Redo the edit that was undone last; returns its label, or None if there is none."""
        return self._edits.redo()

    def go_to(self, edit: int | None) -> list[int]:
        """Undo or redo until an edit is the last one done; see `EditTree.go_to`."""
        return self._edits.go_to(edit)

    def history(self, limit: int = 100) -> list[HistoryEntry]:
        """List the edits that redo and undo can reach, latest first, at most `limit` of each."""
        return self._edits.history(limit)

    def frames_of(self, edit: int) -> list[int]:
        """List the frames whose poses or pins an edit changes, ascending."""
        return self._edits.frames_of(edit)

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
        return [ModelRevision(*r) for r in self._connection.all(sql, (person,))]

    def model_revision(self, revision: int) -> ModelRevision:
        """Return the body model with the id that a pose refers to."""
        sql = "SELECT id, person, toml, time FROM model_revisions WHERE id = ?"
        row = self._connection.one(sql, (revision,))
        assert row is not None, f"no model revision {revision}"
        return ModelRevision(*row)

    def setting(self, key: str, default: Any = None) -> Any:
        """Return a setting of the session, any JSON value."""
        row = self._connection.one("SELECT value FROM settings WHERE key = ?", (key,))
        return default if row is None else json.loads(row[0])

    def set_setting(self, key: str, value: Any) -> None:
        """Store a setting of the session. Settings are not part of the history."""
        with self._connection.transaction() as db:
            db.execute("INSERT OR REPLACE INTO settings (key, value) VALUES (?, ?)", (key, json.dumps(value)))

    def _within(self, columns: str, person: str, frames: range) -> list[Any]:
        """Select columns of the poses of a person within a range of frames, ascending."""
        sql = f"SELECT {columns} {rows.CURRENT_POSES} WHERE p.person = ? AND p.frame BETWEEN ? AND ? ORDER BY p.frame"
        return self._connection.all(sql, (person, frames.start, frames.stop - 1))
