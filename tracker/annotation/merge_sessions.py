"""Merge two copies of one session into a new session folder."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from tracker.annotation.merge import Merged, merge_logs
from tracker.annotation.numbered_settings import sizes_after
from tracker.annotation.session_copy import write_session_copy
from tracker.annotation.three_way import Conflict
from tracker.errors import SessionError
from tracker.formats.model_toml import format_model, parse_model
from tracker.pipeline.calibration_revisions import same_calibration
from tracker.session.session import Person, Session, load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.edit_log import EditLog


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
