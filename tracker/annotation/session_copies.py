"""Write a session folder with the annotations of others: it appears whole or not at all.

Blind copies of a session: for each annotator the recording and the tasks, without poses on the planned frames.

Copy stored observations from one session to another, so that none of two with one name is lost.
"""

import filecmp
import os
import shutil
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import count
from pathlib import Path

import tomli_w

from tracker.annotation.numbered_settings import Numbered, numbered_settings, plain_settings, renumbered
from tracker.annotation.plan import Task
from tracker.files import sync_folder, write_text_atomic
from tracker.formats.text_files import read_toml
from tracker.interchange.observations.stored import DESCRIPTION, FOLDER, KIND
from tracker.pipeline.calibration_revisions import follow_history
from tracker.session.folder import appearing, require_free, tidy_path
from tracker.session.session import CALIBRATION_FILE, Session, load_session, save_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.edit_log import EditLog, LoggedEdit, Pair
from tracker.session.store.records import derived_uid


def write_session_copy(
    folder: Path, session: Session, log: EditLog, numbered: Numbered, observed: Sequence[Path]
) -> list[str]:
    """Write a session with the cameras and people of another one.

    Args:
        folder: to write; must not exist, or be empty.
        session: whose cameras, people and floor it gets; the calibration follows the log.
        log: the annotations, its settings those without numbers.
        numbered: the settings with numbers.
        observed: session folders whose imported observations are copied.

    Returns:
        Notes on observations of equal names with other content: those of a later folder get another name.

    Raises:
        SessionError: the folder is in use or cannot be written.
    """
    folder = tidy_path(folder)
    require_free(folder)
    with _appearing_on_disk(folder) as temporary:
        save_session(replace(session, folder=temporary))
        if (session.folder / CALIBRATION_FILE).exists():  # to the bit: writing rounds, and each rounding is a revision
            shutil.copyfile(session.folder / CALIBRATION_FILE, temporary / CALIBRATION_FILE)
        with AnnotationStore(temporary / session.annotations_path.name) as store:
            written = store.write_log(log)
            for key, value in renumbered(numbered, [e.uid for e in log.edits], log.done, written).items():
                store.set_setting(key, value)
            follow_history(load_session(temporary), store)
        return [note for source in observed for note in copy_observations(source, temporary)]


@contextmanager
def _appearing_on_disk(folder: Path) -> Generator[Path, None, None]:
    """Yield a folder as `appearing` does; what is written reaches the disk before the folder appears."""
    with appearing(folder) as temporary:
        yield temporary
        for path, _, names in os.walk(temporary):
            for name in names:
                with (Path(path) / name).open("rb") as file:
                    os.fsync(file.fileno())
    sync_folder(folder.parent)


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


def copy_observations(source: Path, into: Path) -> list[str]:
    """Copy all observations of a session. What is there already under its name with the same content stays.

    Args:
        source: folder of the session to copy from.
        into: folder of the session to copy to.

    Returns:
        A sentence on each set that got another name, because there is another one of its name.

    Raises:
        SessionError: the description of a set that gets another name is damaged.
        OSError: something cannot be read or written.
    """
    notes = []
    for one in sorted(p for p in (source / FOLDER).glob("*") if p.is_dir() and not p.name.startswith(".")):
        names = (one.name if k == 1 else f"{one.name}_{k}" for k in count(1))
        name = next(n for n in names if not (into / FOLDER / n).exists() or _is_same(one, into / FOLDER / n))
        target = into / FOLDER / name
        if target.exists():
            continue
        shutil.copytree(one, target)
        if name != one.name:
            _rename(target, name)
            notes.append(f"both copies have other observations '{one.name}': those of {source} are '{name}' now")
    return notes


def _rename(folder: Path, name: str) -> None:
    description = folder / DESCRIPTION
    if description.exists():
        write_text_atomic(description, tomli_w.dumps(read_toml(description, KIND) | {"name": name}))


def _is_same(one: Path, other: Path) -> bool:
    """Return whether two sets have the same content, whatever they are called."""
    files = [{p.relative_to(at) for p in at.rglob("*") if p.is_file()} for at in (one, other)]
    if files[0] != files[1]:
        return False
    described = {Path(DESCRIPTION)} if Path(DESCRIPTION) in files[0] and one.name != other.name else set()
    texts = [read_toml(at / DESCRIPTION, KIND) | {"name": ""} for at in (one, other) if described]
    alike = all(filecmp.cmp(one / path, other / path, shallow=False) for path in files[0] - described)
    return alike and all(text == texts[0] for text in texts)
