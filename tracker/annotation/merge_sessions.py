"""Merge two copies of one session into a new session folder.

Merge the logs of two copies of one session: a union of edits, and the poses and pins that both copies show.

The done edits of both follow one another in order of time. Where the last one is not what a three-way comparison of the
two copies chooses, a final edit `Merge` sets it, and keeps the other pose of a conflict as an alternative.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from tracker.annotation.edit_union import (
    Conflict,
    EditUnion,
    Shown,
    join_pins,
    join_poses,
    pins_after,
    poses_after,
    unite,
)
from tracker.annotation.numbered_settings import Numbered, join_numbered, numbered_settings, plain_settings, sizes_after
from tracker.annotation.session_copies import write_session_copy
from tracker.body.model import BodyModel
from tracker.compute.installed_package import program_version
from tracker.errors import SessionError
from tracker.formats.model_toml import format_model, parse_model
from tracker.geometry.arrays import Array
from tracker.pipeline.calibration_revisions import same_calibration
from tracker.session.session import Person, Session, load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.edit_log import COLUMNS, NUMBERS, EditLog, LoggedEdit, PoseRow
from tracker.session.store.records import ModelRevision, derived_uid
from tracker.session.store.task_log import CommentRow, Rows, StateRow, TaskRow

_Row = TypeVar("_Row", TaskRow, StateRow, CommentRow)

_BODY = COLUMNS.index("model_revision")


class Merged(NamedTuple):
    """The merged log."""

    log: EditLog
    """Its `settings` are those without numbers."""
    numbered: Numbered
    """The settings with numbers."""
    conflicts: Sequence[Conflict]


def merge_logs(a: EditLog, b: EditLog, tolerance_m: float) -> Merged:
    """Merge two logs; `merge_logs(b, a)` is the same.

    Args:
        a: log of one copy.
        b: log of the other.
        tolerance_m: largest distance of a joint up to which two poses count as the same, m.

    Raises:
        ModelError: a stored body is malformed.
    """
    union = unite(a, b)
    origins = {edit.uid: edit for edit in union.edits}
    present = [[edit for edit in log.edits if edit.uid in log.done] for log in (a, b)]
    base, mine, theirs = (poses_after(edits, origins) for edits in (union.common, *present))
    poses, conflicts, won = join_poses(base, mine, theirs, _distance_m, tolerance_m)
    pins = join_pins(pins_after(union.common), tuple(map(pins_after, present)), won)
    edits, done = _with_corrections(union, poses, pins, origins)
    log = EditLog(
        edits,
        done,
        union.moves,
        _joined_revisions((*a.revisions, *b.revisions)),
        _joined_settings(a, b),
        {},
        _joined_rows(a.tasks, b.tasks, conflicts),
    )
    return Merged(log, join_numbered(numbered_settings(a), numbered_settings(b)), conflicts)


def _with_corrections(
    union: EditUnion, poses: Mapping[Any, Shown], pins: Mapping[Any, Any], origins: Mapping[str, LoggedEdit]
) -> tuple[list[LoggedEdit], frozenset[str]]:
    """Return the edits and which of them are done, with a last one where they do not lead to the poses and pins."""
    done = [edit for edit in union.edits if edit.uid in union.done]
    replayed, replayed_pins = poses_after(done, origins), {k: pin[0] for k, pin in pins_after(done).items()}
    changed_poses = tuple(
        (key, poses[key].row if key in poses else PoseRow(None, None))
        for key in sorted(poses.keys() | replayed.keys())
        if key not in poses or key not in replayed or poses[key].row != replayed[key].row
    )
    pin_keys = sorted(pins.keys() | replayed_pins.keys())
    changed_pins = tuple((key, pins.get(key)) for key in pin_keys if pins.get(key) != replayed_pins.get(key))
    if not changed_poses and not changed_pins:
        return union.edits, union.done
    uid = derived_uid("merge", changed_poses, changed_pins)
    times = [*(edit.time for edit in union.edits), *(move.time for move in union.moves)]
    after = datetime.fromisoformat(max(times)) + timedelta(milliseconds=1)
    time = after.isoformat(timespec="milliseconds")
    merge = LoggedEdit(uid, "Merge", "", time, program_version(), changed_poses, changed_pins)
    return [*union.edits, merge], union.done | {uid}


def _distance_m(one: Shown, other: Shown) -> float:
    """Return the largest distance of a joint in two poses, m; infinite if the bodies share no joint."""
    a, b = _joints(one.row), _joints(other.row)
    shared = a.keys() & b.keys()
    return max((float(np.linalg.norm(a[name] - b[name])) for name in shared), default=float("inf"))


def _joints(row: PoseRow) -> dict[str, Array]:
    assert row.pose is not None
    body = _body(row.pose[_BODY][1])
    return body.named_points_world(np.frombuffer(row.pose[NUMBERS], dtype="<f8"))


@cache
def _body(text: str) -> BodyModel:
    return parse_model(text, "of a stored pose")


def _joined_revisions(revisions: Sequence[ModelRevision]) -> list[ModelRevision]:
    """Return each body model once, oldest first."""
    first_of: dict[tuple[str, str], ModelRevision] = {}
    for r in sorted(revisions, key=lambda r: (r.time, r.person, r.toml)):
        first_of.setdefault((r.person, r.toml), r)
    return list(first_of.values())


def _joined_settings(a: EditLog, b: EditLog) -> dict[str, Any]:
    """Join settings by name and key. Of two other values, that of the copy with the later edit counts."""
    sides = [(_last(log), json.dumps(plain_settings(log), sort_keys=True), plain_settings(log)) for log in (a, b)]
    (*_, other), (*_, one) = sorted(sides, key=lambda side: side[:2])
    joined = _joined(one, other)
    assert isinstance(joined, dict)
    return joined


def _last(log: EditLog) -> str:
    return max((edit.time for edit in log.edits), default="")


def _joined(later: Any, earlier: Any) -> Any:
    if isinstance(later, dict) and isinstance(earlier, dict):
        both = {key: _joined(later[key], earlier[key]) for key in later if key in earlier}
        return {key: both.get(key, {**earlier, **later}[key]) for key in sorted({**earlier, **later})}
    return later


def _joined_rows(a: Rows, b: Rows, conflicts: Sequence[Conflict]) -> Rows:
    """Return the union of the rows of two plans, and a task for each conflict."""
    tasks, states = _disagreements(conflicts)
    return _by_uid((*a[0], *b[0], *tasks)), _by_uid((*a[1], *b[1], *states)), _by_uid((*a[2], *b[2]))


def _by_uid(rows: Sequence[_Row]) -> list[_Row]:
    """Return each row once, the earlier one where two copies planned the same; earliest first."""
    first_of: dict[str, _Row] = {}
    for row in sorted(rows, key=lambda r: (r.time, r)):
        first_of.setdefault(row.uid, row)
    return list(first_of.values())


def _disagreements(conflicts: Sequence[Conflict]) -> tuple[list[TaskRow], list[StateRow]]:
    tasks, states = [], []
    for (person, frame), winner, other, apart_m in conflicts:
        poses = sorted(repr((s.row.pose[_BODY], s.row.pose[NUMBERS])) for s in (winner, other) if s.row.pose)
        uid = derived_uid("disagreement", person, frame, *poses)
        time = max(winner.time, other.time)
        tasks.append(TaskRow(uid, "disagreement", person, frame, "", "", time))
        names = [shown.author or "nobody named" for shown in (winner, other)]
        shows = f"{names[0]}'s is shown, {names[1]}'s is its alternative"
        comment = f"two poses, up to {1000 * apart_m:.0f} mm apart: {shows}"
        states.append(StateRow(derived_uid("disagreement found", uid), uid, "rejected", comment, "", time))
    return tasks, states


class MergeReport(NamedTuple):
    """The result of a merge."""

    n_edits: int
    """Number of edits in the merged history."""
    n_own: tuple[int, int]
    """Number of edits that only the one and only the other copy has."""
    conflicts: tuple[Conflict, ...]
    """Poses on which they disagree."""
    notes: tuple[str, ...]
    """Sentences on imported observations of equal names with other content."""


def merge_sessions(a: Path, b: Path, into: Path, tolerance_m: float) -> MergeReport:
    """Merge two copies of one session. Both stay as they are; the new folder appears whole or not at all.

    Args:
        a: folder of one copy.
        b: folder of the other.
        into: folder to write; must not exist, or be empty.
        tolerance_m: largest distance of a joint at which two poses count as one, m.

    Raises:
        SessionError: they are no copies of one session, their cameras or people differ, or the folder is in use.
    """
    sessions = load_session(a), load_session(b)
    require_copies(*sessions)
    logs = [_read(session) for session in sessions]
    uids = [{edit.uid for edit in log.edits} for log in logs]
    if not (uids[0] & uids[1] or _has_one_origin(sessions, logs)):
        raise SessionError(
            f"expected two copies of one session, found {a} and {b} without a common edit in their histories; merge a "
            "copy with the session that it was copied from"
        )
    merged = merge_logs(logs[0], logs[1], tolerance_m)
    if not merged.numbered.changes and not same_calibration(*sessions):
        raise SessionError(
            f"expected two copies of one session, found other calibrations in {a} and {b} that their histories "
            "do not know; give both the same calibration.toml"
        )
    later, earlier = sorted(zip(logs, sessions, strict=True), key=_age, reverse=True)
    people = _people(later[1], earlier[1], merged) if earlier[0].revisions else later[1].people  # never opened
    session = replace(later[1], people=people)
    notes = write_session_copy(into, session, merged.log, merged.numbered, [later[1].folder, earlier[1].folder])
    only_here = len(uids[0] - uids[1]), len(uids[1] - uids[0])
    return MergeReport(len(merged.log.edits), only_here, tuple(merged.conflicts), tuple(notes))


def _has_one_origin(sessions: Sequence[Session], logs: Sequence[EditLog]) -> bool:
    """Return whether two sessions are copies of one folder, by the identity of the session or of its annotations."""
    (one, other), stores = sessions, [log.settings.get("store_id") for log in logs]
    return one.uid == other.uid != "" or stores[0] == stores[1]


def require_copies(a: Session, b: Session) -> None:
    """Check that two sessions have the same cameras, frames and people.

    Raises:
        SessionError: they differ; the message says in what.
    """
    compared: dict[str, tuple[Any, Any]] = {
        "cameras": (a.camera_names, b.camera_names),
        "sizes of the pictures": ([c.camera.size for c in a.cameras], [c.camera.size for c in b.cameras]),
        "first frames of the footage": ([c.offset for c in a.cameras], [c.offset for c in b.cameras]),
        "people": ([p.name for p in a.people], [p.name for p in b.people]),
        "numbers of frames": (a.n_frames, b.n_frames),
        "frame rates": (a.fps, b.fps),
        "axes that point up": (a.up, b.up),
    }
    for what, (one, other) in compared.items():
        if one != other:
            raise SessionError(
                f"expected two copies of one session, found other {what}: {_words(one)} in {a.folder}, "
                f"{_words(other)} in {b.folder}; choose copies of one session"
            )


def _people(one: Session, other: Session, merged: Merged) -> tuple[Person, ...]:
    """Return the people in the bodies that they have after the merged history."""
    bodies = sizes_after(merged.numbered, [edit.uid for edit in merged.log.edits], merged.log.done)
    people = []
    for mine, theirs in zip(one.people, other.people, strict=True):
        model = mine.model
        if format_model(model) != format_model(theirs.model):
            if mine.name not in bodies:
                raise SessionError(
                    f"expected two copies of one session, found other bodies of {mine.name} in {one.folder} and "
                    f"{other.folder} that their histories do not know; give both the same models/{mine.name}.toml"
                )
            model = parse_model(bodies[mine.name][1], f"of '{mine.name}'")
        people.append(replace(mine, model=model))
    return tuple(people)


def _words(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)


def _read(session: Session) -> EditLog:
    if session.uid and not session.annotations_path.exists():  # nobody has opened it yet
        return EditLog((), frozenset(), (), (), {}, {}, ((), (), ()))
    with AnnotationStore(session.annotations_path, read_only=True) as store:
        return store.read_log()


def _age(pair: tuple[EditLog, Session]) -> tuple[str, str]:
    log, session = pair
    return max((edit.time for edit in log.edits), default=""), str(session.floor)
