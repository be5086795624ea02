"""Write the changes of an edit: poses, marks and assessments of poses, pins."""

import json
import sqlite3
from collections.abc import Mapping, Sequence
from typing import Any

from tracker.session.store import rows
from tracker.session.store.edit_tree import show_change
from tracker.session.store.records import AssessmentChange, Change, MarkChange, PinChange, PoseChange


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
