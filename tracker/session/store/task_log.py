"""The plan of annotation as rows that are only added: tasks, their states, comments; and the edits they depend on.

The union of the rows of two copies is their merge: a row has the same `uid` everywhere.
"""

import sqlite3
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias, TypeVar

import msgspec
from msgspec import Meta

from tracker.errors import DamagedStoreError
from tracker.session.store.connection import Connection
from tracker.session.store.own_undo import held_edits
from tracker.session.store.records import derived_uid
from tracker.validation import MAX_FRAMES, Time, check

T = TypeVar("T")

Kind: TypeAlias = Literal["plan", "disagreement"]
"""Tasks of a plan, and poses on which two copies disagreed when they were merged."""
State: TypeAlias = Literal["draft", "annotated", "verified", "rejected", "withdrawn"]
"""States of a task. The log stores the last three; the first two follow from the poses (`tracker.annotation.plan`)."""

_Frame: TypeAlias = Annotated[int, Meta(ge=0, lt=MAX_FRAMES, description=f"a frame from 0 to {MAX_FRAMES - 1}")]
_Flag: TypeAlias = Annotated[int, Meta(ge=0, le=1, description="0 or 1")]
Uid: TypeAlias = Annotated[str, Meta(pattern=r"^[0-9a-f]{32}\Z", description="32 hexadecimal digits")]
"""Identity of a row."""


class TaskRow(NamedTuple):
    """A frame of a person that somebody is to annotate."""

    uid: Uid
    kind: Kind
    person: str
    frame: _Frame
    annotator: str
    """Name of the annotator; empty for anybody."""
    author: str
    """Name of the person who planned it."""
    time: Time
    """Time at which it was planned, ISO 8601, UTC."""


class StateRow(NamedTuple):
    """A decision on a task."""

    uid: Uid
    task: Uid
    """Identity of the task."""
    state: State
    comment: str
    """Reason, as of a rejection; may be empty."""
    author: str
    time: Time
    pose: Uid | None = None
    """Identity of the pose on which it was made; None without a pose, and for rows from before version 11."""

    def is_about(self, shown: "PlannedPose") -> bool:
        """Return whether it was made on a pose; for an older row, whether the pose was made before it."""
        return self.pose == shown.uid if self.pose else shown.time <= self.time


class CommentRow(NamedTuple):
    """A comment on a person in a frame, or the news that one is resolved or open again."""

    uid: Uid
    about: Annotated[str, Meta(pattern=r"^([0-9a-f]{32})?\Z")]
    """Identity of the comment that it resolves or opens again; empty for a new comment."""
    person: str
    frame: _Frame
    limb: str
    """Name of the limb (`tracker.body.limbs`); empty for the whole body."""
    text: str
    resolved: _Flag
    """1 resolves the comment, 0 leaves or opens it."""
    author: str
    time: Time


class MadePose(NamedTuple):
    """The edit that made or marked the pose of a person in a frame."""

    person: str
    frame: int
    keyframe: bool
    author: str
    time: str
    uid: str
    """Identity of the edit."""


class PlannedPose(NamedTuple):
    """The present pose of a frame that has a task."""

    keyframe: bool
    author: str
    """Of the edit that made it."""
    time: str
    """Time of that edit."""
    uid: str
    """Identity that follows from that edit, its values and its body: one that undo shows again has the same."""


class _PlannedRow(NamedTuple):
    person: str
    frame: _Frame
    keyframe: _Flag
    author: str
    time: Time
    edit: str
    body: str
    """Model of the body as TOML."""
    numbers: bytes

    @property
    def uid(self) -> str:
        return derived_uid("pose", self.edit, self.body, self.numbers)


Rows: TypeAlias = tuple[Sequence[TaskRow], Sequence[StateRow], Sequence[CommentRow]]
"""All rows of the log: tasks, states, comments."""

TABLES: dict[str, type[TaskRow] | type[StateRow] | type[CommentRow]] = {
    "tasks": TaskRow, "task_states": StateRow, "comments": CommentRow
}  # fmt: skip
"""The tables, and the rows that they hold."""
_EDIT = "JOIN edits e ON e.id = coalesce(c.made_in, c.edit)"
_MADE = "c.person, c.frame, c.keyframe, e.author, e.time, e.uid"


class TaskLog:
    """The rows of the plan in an open store."""

    def __init__(self, connection: Connection) -> None:
        """Use an open store."""
        self._connection = connection

    def add(
        self, tasks: Sequence[TaskRow] = (), states: Sequence[StateRow] = (), comments: Sequence[CommentRow] = ()
    ) -> None:
        """Add rows, all or none. A row whose `uid` is there already stays as it is.

        Raises:
            SessionError: the file cannot be written.
        """
        with self._connection.transaction() as db:
            write_rows(db, (tasks, states, comments))

    def tasks(self) -> list[TaskRow]:
        """Return all tasks, by person, frame and annotator."""
        return self._all("tasks", TaskRow, "person, frame, annotator, uid")

    def states(self) -> list[StateRow]:
        """Return all decisions on tasks, earliest first."""
        return self._all("task_states", StateRow, "time, uid")

    def comments(self) -> list[CommentRow]:
        """Return all comments and what happened to them, earliest first."""
        return self._all("comments", CommentRow, "time, uid")

    def makers_of_poses(self) -> list[MadePose]:
        """Return the edits that made the present poses."""
        return self._connection.all(
            f"SELECT {_MADE} FROM poses p JOIN pose_changes c ON c.id = p.change {_EDIT}", (), _made
        )

    def planned_poses(self) -> dict[tuple[str, int], PlannedPose]:
        """Return the present poses of the frames that have a task, by person and frame."""
        with self._connection.snapshot():
            bodies = dict(self._connection.all("SELECT id, toml FROM model_revisions", (), tuple))
            found = self._connection.all(
                "SELECT p.person, p.frame, c.keyframe, e.author, e.time, e.uid, c.model_revision, c.numbers "
                "FROM (SELECT DISTINCT person, frame FROM tasks) JOIN poses p USING (person, frame) "
                f"JOIN pose_changes c ON c.id = p.change {_EDIT}",
                (),
                lambda row: _planned(*row[:6], bodies.get(row[6]), row[7]),
            )
        return {
            (row.person, row.frame): PlannedPose(bool(row.keyframe), row.author, row.time, row.uid) for row in found
        }

    def keyframe_edits(self) -> list[MadePose]:
        """Return the edits that hold and that set or marked keyframes, earliest first, assessments left out."""
        with self._connection.snapshot():
            held = held_edits(self._connection.db)
            found = self._connection.all(
                f"SELECT c.edit, {_MADE} FROM pose_changes c {_EDIT} WHERE c.keyframe = 1 AND c.numbers IS NOT NULL "
                "ORDER BY e.time, e.uid",
                (),
                lambda row: (int(row[0]), _made(row[1:])),
            )
        return [made for edit, made in found if edit in held]

    def verifications(self) -> dict[tuple[str, int], StateRow]:
        """Return the decision by which each present pose is verified, by person and frame.

        The last decision on this pose counts, in any of its tasks.
        """
        poses = {task.uid: (task.person, task.frame) for task in self.tasks()}
        decided = defaultdict[tuple[str, int], list[StateRow]](list)
        for state in self.states():
            if state.task in poses:
                decided[poses[state.task]].append(state)
        shown = self.planned_poses() if decided else {}
        verdicts = {at: last_verdict(decided[at], pose) for at, pose in shown.items()}
        return {at: verdict for at, verdict in verdicts.items() if verdict is not None and verdict.state == "verified"}

    def edit_times(self) -> list[tuple[str, str]]:
        """Return author and time of all edits, undone ones too, earliest first."""
        return self._connection.all(
            "SELECT author, time FROM edits ORDER BY time", (), lambda row: (str(row[0]), _checked_time(row[1], row[0]))
        )

    def _all(self, table: str, row_type: Callable[..., T], order: str) -> list[T]:
        def convert(row: tuple[Any, ...]) -> T:
            decoded: T = check(list(row), row_type, f"row {row[0]!r:.40} of {table}", DamagedStoreError)
            return decoded

        fields = ", ".join(TABLES[table]._fields)
        return self._connection.all(f"SELECT {fields} FROM {table} ORDER BY {order}", (), convert)


def last_verdict(decided: Sequence[StateRow], shown: PlannedPose | None) -> StateRow | None:
    """Return the last verdict on a pose, which alone says whether it is verified; None without one.

    Args:
        decided: decisions, earliest first.
        shown: the pose; None for none.
    """
    about = (s for s in reversed(decided) if shown is not None and s.state != "withdrawn" and s.is_about(shown))
    return next(about, None)


def write_rows(db: sqlite3.Connection, found: Rows) -> None:
    """Write rows of all tables within a transaction; those that are there already stay."""
    for (table, row_type), new in zip(TABLES.items(), found, strict=True):
        assert all(msgspec.convert(list(row), row_type) == row for row in new)
        marks = ", ".join("?" * len(row_type._fields))
        db.executemany(f"INSERT OR IGNORE INTO {table} ({', '.join(row_type._fields)}) VALUES ({marks})", new)


def _planned(*columns: Any) -> _PlannedRow:
    planned: _PlannedRow = check(columns, _PlannedRow, f"the pose of frame {columns[1]!r:.20}", DamagedStoreError)
    return planned


def _made(row: Sequence[Any]) -> MadePose:
    person, frame, keyframe, author, time, uid = row
    return MadePose(str(person), int(frame), bool(keyframe), str(author), _checked_time(time, author), str(uid))


def _checked_time(time: Any, author: Any) -> str:
    return str(check(time, Time, f"the time of an edit of {author!r:.40}", DamagedStoreError))
