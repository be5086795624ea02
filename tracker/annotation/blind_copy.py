"""Blind copies of a session: for each annotator the recording and the tasks, without poses on the planned frames."""

from collections.abc import Sequence
from pathlib import Path

from tracker.annotation.numbered_settings import numbered_settings, plain_settings
from tracker.annotation.plan import Task
from tracker.annotation.session_copy import write_session_copy
from tracker.session.session import Session
from tracker.session.store.edit_log import EditLog, LoggedEdit, Pair
from tracker.session.store.identities import derived_uid


def write_blind_copy(folder: Path, session: Session, log: EditLog, tasks: Sequence[Task], annotator: str) -> int:
    """Write a copy of a session for one annotator.

    Poses and pins on all planned frames are left out of its history, and so are comments there, decisions on tasks, and
    the tasks of others. `merge_sessions` joins it with the session again.

    Args:
        folder: to write; must not exist, or be empty.
        session: the session.
        log: its annotations.
        tasks: its tasks.
        annotator: name of the annotator.

    Returns:
        Number of tasks in the copy.

    Raises:
        SessionError: the folder is in use or cannot be written.
    """
    return _write(folder, session, log, tasks, [t for t in tasks if _is_for(t, annotator)])


def write_second_pass(
    folder: Path, session: Session, log: EditLog, tasks: Sequence[Task], annotator: str, n: int
) -> int:
    """Write another blind copy for an annotator, with some of the same tasks alone; see `write_blind_copy`.

    Args:
        n: number of tasks. They are drawn at random, but always the same ones.
    """
    due = sorted((t for t in tasks if _is_for(t, annotator)), key=lambda task: derived_uid("repeat", task.row.uid))
    return _write(folder, session, log, tasks, due[:n])


def _write(folder: Path, session: Session, log: EditLog, tasks: Sequence[Task], own: Sequence[Task]) -> int:
    hidden = {(t.row.person, t.row.frame) for t in tasks if t.state != "withdrawn"}
    blind = EditLog(
        [_without(edit, hidden) for edit in log.edits],
        log.done,
        log.moves,
        log.revisions,
        plain_settings(log),
        {},
        ([t.row for t in own], [], [c for c in log.tasks[2] if (c.person, c.frame) not in hidden]),
    )
    write_session_copy(folder, session, blind, numbered_settings(log), [session.folder])
    return len(own)


def _is_for(task: Task, annotator: str) -> bool:
    return task.row.annotator in ("", annotator) and task.row.kind == "plan" and task.state != "withdrawn"


def _without(edit: LoggedEdit, hidden: set[Pair]) -> LoggedEdit:
    return edit._replace(
        poses=tuple(change for change in edit.poses if change[0] not in hidden),
        pins=tuple(change for change in edit.pins if change[0][:2] not in hidden),
    )
