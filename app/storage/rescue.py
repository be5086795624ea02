"""Rescue files: edits that could not be written when the program ended, kept outside of the session.

A file holds its own checksum, the edits in order, and the body models of their poses. `quadrille restore` writes the
edits into the session, as entries of its history, and deletes the file.
"""

import hashlib
import os
import secrets
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from platformdirs import user_data_path

from app.remedies import page_text
from tracker.errors import SessionError, TrackerError
from tracker.store.annotation_store import AnnotationStore
from tracker.store.records import Change, MarkChange, PinChange, PoseChange, PoseRecord

_VERSION = 1
_KINDS: dict[str, type[Change]] = {"pose": PoseChange, "mark": MarkChange, "pin": PinChange}
_NAMES = {kind: name for name, kind in _KINDS.items()}


class UnsavedEdit(NamedTuple):
    """An edit, or an addition to one, that is not on disk."""

    label: str
    changes: Sequence[Change]
    amend: int | None
    """The edit on disk to add to; None makes a new one."""
    by_program: bool


class _Change(msgspec.Struct):
    kind: str
    of: msgspec.Raw


class _Edit(msgspec.Struct):
    label: str
    changes: list[_Change]
    amend: int | None
    by_program: bool


class _Model(msgspec.Struct):
    person: str
    toml: str


class _Rescue(msgspec.Struct):
    version: int
    session: str
    """Path of the session's folder."""
    store: str
    """Id of the store."""
    author: str
    time: str
    why: str
    models: dict[int, _Model]
    """The body models of the poses, by revision."""
    edits: list[_Edit]


class RescueFile(NamedTuple):
    """A rescue file of a session."""

    path: Path
    n_edits: int
    time: str
    damage: str = ""
    """Why it cannot be read."""

    @property
    def offer(self) -> str:
        """What it holds, and what to do with it."""
        if self.damage:
            return self.damage
        edits, are = ("1 edit", "is") if self.n_edits == 1 else (f"{self.n_edits} edits", "are")
        return (
            f"{edits} of {self.time} could not be written and {are} kept in {self.path}: "
            "end the program and run 'quadrille restore' on the session to write them"
        )


def write(
    folder: Path, store: AnnotationStore, edits: Iterable[UnsavedEdit], models: dict[int, str], author: str, why: str
) -> Path:
    """Keep edits in a file where there is room: in the user's data folder, else the temporary or home folder.

    Args:
        folder: of the session.
        store: its annotations.
        edits: in order.
        models: text of the body model of each revision that the edits name.
        author: of the edits.
        why: they could not be written.

    Returns:
        Path of the file, which is complete on the disk.

    Raises:
        SessionError: it cannot be written anywhere.
    """
    edits = list(edits)
    people = revisions_of(edits)
    now = datetime.now(UTC)
    data = _Rescue(
        _VERSION, str(folder), store.id, author, now.strftime("%Y-%m-%d %H:%M:%S UTC"), why,
        {r: _Model(person, models[r]) for r, person in people.items()},
        [_Edit(e.label, [_encoded(c) for c in e.changes], e.amend, e.by_program) for e in edits],
    )  # fmt: skip
    problems = []
    for place in _places(folder):
        path = place / f"{_prefix(store.id)}{now.strftime('%Y%m%dT%H%M%S')}-{secrets.token_hex(3)}.json"
        try:
            place.mkdir(parents=True, exist_ok=True)
            _write(path, data)
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
            data = _read(path)
        except TrackerError as error:
            found.append(RescueFile(path, 0, "", page_text(error)))
            continue
        # A copy of the session has the same id: its edits are those of the folder that they were made in.
        if data.session == str(folder) or not Path(data.session).exists():
            found.append(RescueFile(path, len(data.edits), data.time))
    return found


def replay(path: Path, store: AnnotationStore) -> int:
    """Write the edits of a rescue file into a store, each as an entry of the history, and delete the file.

    Returns:
        Their number.

    Raises:
        SessionError: the file is damaged or the store cannot be written; what is left stays in the file.
    """
    data = _read(path)
    n_edits = len(data.edits)
    revisions = {r: store.add_model_revision(m.person, m.toml) for r, m in data.models.items()}
    while data.edits:
        edit = data.edits[0]
        changes = [_with_revisions(_decoded(c), revisions) for c in edit.changes]
        last = next((e.edit for e in store.history(1) if not e.undone), None)
        try:
            if edit.amend is not None and edit.amend == last:
                store.amend(edit.amend, changes, edit.by_program)
            else:
                store.commit(edit.label, changes, data.author, edit.by_program)
        except SessionError:
            if len(data.edits) < n_edits:
                path.unlink()
                _write(path, data)
            raise
        data.edits.pop(0)
    path.unlink(missing_ok=True)
    return n_edits


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
    own = [p for p in files if not hasattr(os, "getuid") or p.lstat().st_uid == os.getuid()]
    return sorted((p for p in own if p.is_file() and not p.is_symlink()), key=lambda p: p.name)


def _write(path: Path, data: _Rescue) -> None:
    """Write a new file that only this user may read."""
    text = msgspec.json.encode(data)
    number = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    try:
        with open(number, "wb") as file:
            file.write(hashlib.sha256(text).hexdigest().encode() + b"\n" + text + b"\n")
            file.flush()
            os.fsync(file.fileno())
    except BaseException:
        path.unlink(missing_ok=True)
        raise


def _read(path: Path) -> _Rescue:
    """Read a rescue file.

    Raises:
        SessionError: it cannot be read, is not as it was written, or is of a newer program.
    """
    try:
        checksum, _, text = path.read_bytes().partition(b"\n")
    except OSError as error:
        raise SessionError(f"rescue file {path} cannot be read: {error.strerror}; check your rights") from error
    if hashlib.sha256(text.removesuffix(b"\n")).hexdigest().encode() != checksum:
        raise SessionError(f"rescue file {path} is not as it was written: its checksum differs; delete or move it")
    version = msgspec.json.decode(text).get("version")
    if version != _VERSION:
        raise SessionError(f"rescue file {path} has version {version}, expected {_VERSION}; upgrade quadrille")
    return msgspec.json.decode(text, type=_Rescue)


def _encoded(change: Change) -> _Change:
    return _Change(_NAMES[type(change)], msgspec.Raw(msgspec.json.encode(change, enc_hook=_listed)))


def _decoded(change: _Change) -> Change:
    return msgspec.json.decode(change.of, type=_KINDS[change.kind], dec_hook=_array)


def _listed(values: Any) -> Any:
    """Encode an array of numbers exactly; numbers and text of numpy as those of Python."""
    return values.tolist()


def _array(_: type, values: Any) -> Any:
    return np.array(values, dtype=np.float64)


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
