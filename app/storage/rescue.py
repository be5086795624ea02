"""Rescue files: edits that could not be written when the program ended, kept outside of the session.

`quadrille restore` writes the edits into the session, as entries of its history, and deletes the file. Copies of a
session have its id, so edits that were made in another folder are only offered; their file stays.
"""

import os
import secrets
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from platformdirs import user_data_path

from app.remedies import page_text
from app.storage.rescue_file import Model, Rescue, UnsavedEdit, read_rescue, write_rescue
from tracker import system
from tracker.errors import Remedy, SessionError, TrackerError
from tracker.session.folder import SESSION_FILE
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import Change, PoseChange, PoseRecord


class RescueFile(NamedTuple):
    """A rescue file of a session."""

    path: Path
    n_edits: int
    time: str
    damage: str = ""
    """Why it cannot be read."""
    origin: str = ""
    """The other folder in which the edits were made; empty if it is the session's."""

    @property
    def offer(self) -> tuple[str, Remedy | None]:
        """Its content and the way to use it, as a sentence and a remedy."""
        if self.damage:
            return self.damage, None
        edits, are = ("1 edit", "is") if self.n_edits == 1 else (f"{self.n_edits} edits", "are")
        if self.origin:
            held = (
                f"{edits} of {self.time} could not be written into {self.origin}, of which this session may be a copy, "
                f"and {are} kept in {self.path}"
            )
            return held, Remedy("restore_rescue", path=self.path)
        return f"{edits} of {self.time} could not be written and {are} kept in {self.path}", Remedy("restore")


def write(
    folder: Path, store: AnnotationStore, edits: Iterable[UnsavedEdit], models: dict[int, str], author: str, why: str
) -> Path:
    """Keep edits in a file where there is room: in the user's data folder, else the temporary or home folder.

    Args:
        folder: of the session.
        store: its annotations.
        edits: in order.
        models: text of the body model of each revision that the edits name.
        author: of the edits that name none.
        why: they could not be written.

    Returns:
        Path of the file, which is complete on the disk.

    Raises:
        SessionError: it cannot be written anywhere.
    """
    edits = list(edits)
    now = datetime.now(UTC)
    people = revisions_of(edits)
    data = Rescue(
        str(folder), store.id, author, now.strftime("%Y-%m-%d %H:%M:%S UTC"), why,
        {r: Model(person, models[r]) for r, person in people.items()}, edits,
    )  # fmt: skip
    problems = []
    for place in _places(folder):
        path = place / f"{_prefix(store.id)}{now.strftime('%Y%m%dT%H%M%S')}-{secrets.token_hex(3)}.json"
        try:
            place.mkdir(parents=True, exist_ok=True)
            write_rescue(path, data)
        except OSError as error:
            problems.append(f"{place}: {error.strerror}")
        else:
            return path
    raise SessionError(f"no rescue file could be written ({'; '.join(problems)}); make room there")


def revisions_of(edits: Iterable[UnsavedEdit]) -> dict[int, str]:
    """Return the model revisions that edits name, with the names of their people."""
    poses = [c for e in edits for c in e.changes if isinstance(c, PoseChange)]
    return {r: c.person for c in poses for r in _revisions(c)}


def find(folder: Path, store_id: str) -> list[RescueFile]:
    """List the rescue files of a session, oldest first. Files of other users are ignored.

    Args:
        folder: of the session.
        store_id: of its annotations.
    """
    found = []
    for path in _files(folder, store_id):
        try:
            data = read_rescue(path)
        except TrackerError as error:
            found.append(RescueFile(path, 0, "", page_text(error)))
            continue
        is_own = data.session == str(folder)
        if is_own or not os.path.isfile(os.path.join(data.session, SESSION_FILE)):  # which offers them itself
            found.append(RescueFile(path, len(data.edits), data.time, origin="" if is_own else data.session))
    return found


def replay(path: Path, folder: Path, store: AnnotationStore) -> int:
    """Write the edits of a rescue file into a store, each as an entry of the history.

    The file is deleted if the edits were made in this folder.

    Args:
        path: of the file.
        folder: of the session.
        store: its annotations.

    Returns:
        The number of edits.

    Raises:
        SessionError: the file is damaged or of another session, or the store cannot be written; what is left stays in
            the file.
    """
    data = read_rescue(path)
    if data.store != store.id:
        raise SessionError(
            f"rescue file {path} holds edits of another session, made in {data.session}; restore them there"
        )
    is_own = data.session == str(folder)
    revisions = {r: store.add_model_revision(m.person, m.toml) for r, m in data.models.items()}
    for done, edit in enumerate(data.edits):
        changes = [_with_revisions(c, revisions) for c in edit.changes]
        last = next((e.edit for e in store.history(1) if not e.undone), None)
        try:
            if edit.amend is not None and edit.amend == last:
                store.amend(edit.amend, changes, edit.by_program)
            else:
                author = data.author if edit.author is None else edit.author
                store.commit(edit.label, changes, author, edit.by_program)
        except SessionError:
            if done and is_own:
                with suppress(OSError):  # otherwise the edits that were written are written again
                    write_rescue(path, data._replace(edits=data.edits[done:]))
            raise
    if is_own:
        path.unlink(missing_ok=True)
    return len(data.edits)


def _prefix(store_id: str) -> str:
    return f"quadrille-rescue-{store_id}-"


def _places(folder: Path) -> Iterator[Path]:
    """Folders for rescue files, best first; the session's own is last, because it could not be written."""
    yield user_data_path("quadrille", appauthor=False) / "rescue"
    yield Path(tempfile.gettempdir())
    with suppress(RuntimeError):  # a user without a home
        yield Path.home()
    yield folder


def _files(folder: Path, store_id: str) -> list[Path]:
    files = [p for place in dict.fromkeys(_places(folder)) for p in place.glob(f"{_prefix(store_id)}*.json")]
    own = [p for p in files if system.is_mine(p.lstat())]
    return sorted((p for p in own if p.is_file() and not p.is_symlink()), key=lambda p: p.name)


def _revisions(change: PoseChange) -> set[int]:
    """Return the model revisions that a change names."""
    of_pose = set() if change.pose is None else {change.pose.model_revision}
    return of_pose | {a.model_revision for a in change.alternatives}


def _with_revisions(change: Change, revisions: dict[int, int]) -> Change:
    """Name the model revisions by their ids in the present store, which may be a restored one."""
    if not isinstance(change, PoseChange):
        return change
    pose: PoseRecord | None = change.pose
    if pose is not None:
        pose = replace(pose, model_revision=revisions[pose.model_revision])
    others = tuple(replace(a, model_revision=revisions[a.model_revision]) for a in change.alternatives)
    return replace(change, pose=pose, alternatives=others)
