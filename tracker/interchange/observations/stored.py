"""ObservationSet in the folder of a session: what they are, their numbers, and the files as they came.

    observations/NAME/
      observations.toml    format, people, joint map, notes, the files with their checksums
      points.npz           positions and confidences, without pickled objects
      files/               the imported files, unchanged

A folder appears complete or not at all.
"""

import io
import secrets
import shutil
import zipfile
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, TypeVar

import msgspec
import numpy as np
import tomli_w

from tracker.errors import SessionError
from tracker.files import refuse_links, sync_folder, write_text_atomic
from tracker.formats.joint_maps import format_joint_map, parse_joint_map
from tracker.formats.number_rows import MAX_NAMES, MAX_VALUES
from tracker.formats.text_files import TABLE_BYTES, TextKind, read_toml
from tracker.geometry.arrays import DAMAGED_ARRAYS, Array
from tracker.interchange.observations.observed import (
    ObservationSet,
    ObservedJoints,
    ObservedPoints,
    SourceFile,
    checksum,
)
from tracker.session.session import Session
from tracker.validation import FileStem, Name, check, check_version, quoted

FOLDER = "observations"
DESCRIPTION = "observations.toml"
"""Name of the file that says what observations are."""
_FILE, _POINTS, _FILES = DESCRIPTION, "points.npz", "files"
VERSION = 1
"""Newest version of the files that this program writes and reads."""
KIND = TextKind("observations", TABLE_BYTES, SessionError)


class Description(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """The file that says what was imported under a name."""

    version: int = VERSION
    name: FileStem
    format: Name
    notes: tuple[str, ...] = ()
    options: dict[str, str] = {}
    sources: tuple[SourceFile, ...] = ()


class _Content(Description, forbid_unknown_fields=True, kw_only=True):
    people: Annotated[tuple[Name, ...], msgspec.Meta(min_length=1, description="the people of whom they are")]
    points: Annotated[
        tuple[Name, ...], msgspec.Meta(min_length=1, max_length=MAX_NAMES, description="the names of the points")
    ]
    cameras: tuple[Name, ...] = ()
    skeleton: Name
    joint_map: dict[str, Any]


_D = TypeVar("_D", bound=Description)


def read_description(path: Path, where: str, kind: type[_D]) -> _D:
    """Read what was imported; `where` names the file in messages.

    Raises:
        SessionError: the file is missing, damaged or newer.
    """
    data = read_toml(path, KIND)
    check_version(data, VERSION, where, SessionError)
    return check(data, kind, where, SessionError)


def write_description(path: Path, where: str, content: Description) -> None:
    """Write what was imported. Raises SessionError where a name cannot be stored."""
    data = msgspec.to_builtins(content)
    check(data, type(content), where, SessionError)
    write_text_atomic(path, tomli_w.dumps(data))


def list_observations(session: Session, description: str = DESCRIPTION) -> list[str]:
    """Return the names of the observations of a session, in order: of those that a file of some name describes."""
    found = (session.folder / FOLDER).glob(f"*/{description}")
    return sorted(p.parent.name for p in found if not p.parent.name.startswith("."))


def files_folder(session: Session, name: str) -> Path:
    """Return the folder of the imported files of observations."""
    return session.folder / FOLDER / name / _FILES


def source_path(session: Session, name: str, source: SourceFile) -> Path:
    """Return the path of an imported file within the session."""
    return files_folder(session, name) / source.path


def save_observations(
    session: Session, observations: ObservationSet, files: Mapping[str, Path], replaces: bool = False
) -> None:
    """Store observations with a session.

    Args:
        session: to whose folder they are written.
        observations: their sources name the files.
        files: the file to copy for each path of a source.
        replaces: whether they take the place of those of the same name.

    Raises:
        SessionError: there are observations of this name, a file changed since it was read, or the folder cannot be
            written.
    """
    with appearing_folder(session, observations.name, replaces) as temporary:
        for source in observations.sources:
            target = temporary / _FILES / source.path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(read_unchanged(files[source.path], source))
        with (temporary / _POINTS).open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **_arrays(observations))
        write_description(temporary / _FILE, f"observations {observations.name}", _content(observations))


def new_folder(session: Session, name: str) -> Path:
    """Return the folder of observations that are not stored yet.

    Raises:
        SessionError: the name is none of a file, or there are observations of this name.
    """
    check(name, FileStem, "the name of the observations", SessionError)
    folder = session.folder / FOLDER / name
    refuse_links(session.folder, f"{FOLDER}/{name}")
    if folder.exists():
        raise SessionError(f"{folder} exists already; choose another name, or remove that folder")
    return folder


@contextmanager
def appearing_folder(session: Session, name: str, replaces: bool = False) -> Generator[Path, None, None]:
    """Yield a folder beside that of observations of a name, which it becomes at the end of the `with` block.

    Args:
        session: the session.
        name: of the observations.
        replaces: whether there are observations of this name, which go.

    Raises:
        SessionError: there are others of this name, or the folder cannot be written.
    """
    folder = session.folder / FOLDER / name if replaces else new_folder(session, name)
    temporary, replaced = (folder.with_name(f".{name}.{secrets.token_hex(4)}.tmp") for _ in range(2))
    try:
        temporary.mkdir(parents=True)
        yield temporary
        if replaces:
            folder.rename(replaced)
        temporary.rename(folder)
        sync_folder(folder.parent)
    except OSError as error:
        raise SessionError(f"cannot write {folder}: {error}; see that you may write to the session's folder") from error
    finally:
        for folder in (temporary, replaced):
            shutil.rmtree(folder, ignore_errors=True)


def load_observations(session: Session, name: str) -> ObservationSet:
    """Read stored observations of a session.

    Raises:
        SessionError: there are none of this name, or they are damaged, newer, or of another number of frames.
    """
    folder = session.folder / FOLDER / name
    if name not in (known := list_observations(session)):
        listed = ", ".join(known) or "none"
        advice = f"the session has {listed}: import some"
        raise SessionError.mismatch("", "the name of imported observations", f"'{name}'", advice)
    where = f"observations {folder / _FILE}"
    row = read_description(folder / _FILE, where, _Content)
    unknown = [p for p in row.people if p not in {person.name for person in session.people}]
    if unknown:
        raise SessionError(f"{where}: expected people of the session, found '{unknown[0]}'; import them again")
    for source in row.sources:
        path = PurePosixPath(source.path)
        if path.is_absolute() or ".." in path.parts or "\\" in source.path or "\0" in source.path:
            raise SessionError(f"{where}: expected the path of a file within, found {quoted(source.path)}; correct it")
    arrays = _read_arrays(folder / _POINTS)
    joint_map = parse_joint_map(row.skeleton, row.joint_map, str(folder / _FILE))
    try:
        points, joints, rows = _from_arrays(row, arrays, session)
    except (KeyError, ValueError, AssertionError) as error:
        lacking = f"does not hold {session.n_frames} frames of the points that {_FILE} names ({error})"
        raise SessionError(f"{folder / _POINTS} {lacking}; import them again") from error
    return ObservationSet(
        row.name, row.format, row.people, joint_map, points, joints, rows, row.sources, row.notes,
        tuple(row.options.items()),
    )  # fmt: skip


def _content(observations: ObservationSet) -> _Content:
    points = observations.points
    return _Content(
        name=observations.name,
        format=observations.format,
        people=observations.people,
        points=observations.point_names,
        cameras=points.cameras if points is not None else (),
        skeleton=observations.joint_map.name,
        joint_map=format_joint_map(observations.joint_map),
        notes=observations.notes,
        options=dict(observations.options),
        sources=observations.sources,
    )


def _arrays(observations: ObservationSet) -> dict[str, Array]:
    found: dict[str, Array | None] = {_rows_of(i): rows for i, rows in enumerate(observations.row_frames)}
    if (points := observations.points) is not None:
        found |= {"points_px": points.points_px, "confidence": points.confidence, "colors": points.colors}
    if (joints := observations.joints) is not None:
        found |= {"joints_world": joints.joints_world, "covariances": joints.covariances}
    return {name: values for name, values in found.items() if values is not None}


def _from_arrays(
    row: _Content, arrays: Mapping[str, Array], session: Session
) -> tuple[ObservedPoints | None, ObservedJoints | None, tuple[Array, ...]]:
    """Return points, joints and the frames of the rows of each file.

    Raises:
        KeyError: an array is missing.
        ValueError: one has another shape, as AssertionError says too.
    """
    all_rows = [arrays[_rows_of(0)]]
    while (rows := arrays.get(_rows_of(len(all_rows)))) is not None:
        all_rows.append(rows)
    if not all(rows.ndim == 1 and np.isfinite(rows).all() for rows in all_rows):
        raise ValueError("row_frames")
    joints = points = None
    if "joints_world" in arrays:
        joints = ObservedJoints(row.points, row.people, arrays["joints_world"], arrays.get("covariances"))
        n_frames = joints.n_frames
    else:
        px, confidence = arrays["points_px"], arrays["confidence"]
        points = ObservedPoints(row.points, row.cameras, px, confidence, colors=arrays.get("colors"))
        if row.cameras != session.camera_names:
            raise ValueError(f"cameras {', '.join(row.cameras)}")
        n_frames = points.n_frames
    if n_frames != session.n_frames:
        raise ValueError(f"{n_frames} frames")
    return points, joints, tuple(all_rows)


def _rows_of(file: int) -> str:
    """Return the name of the array with the rows of a file."""
    return f"row_frames_{file}" if file else "row_frames"


def _read_arrays(path: Path) -> dict[str, Array]:
    """Read the arrays of a file, at most `MAX_VALUES` values in each.

    Raises:
        SessionError: the file is missing or damaged.
    """
    try:
        data = path.read_bytes()
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            too_large = any(i.file_size > MAX_VALUES * np.dtype(np.float64).itemsize for i in archive.infolist())
        if too_large:
            raise ValueError("an array is too large")
        with np.load(io.BytesIO(data), allow_pickle=False) as found:
            arrays = {name: np.asarray(found[name], dtype=np.float64) for name in found.files}
    except DAMAGED_ARRAYS as error:
        raise SessionError(f"{path} cannot be read: {error}; import the files again") from error
    return arrays


def read_unchanged(path: Path, source: SourceFile) -> bytes:
    """Read a file that is imported.

    Raises:
        SessionError: it is another one than was read.
    """
    data = path.read_bytes()
    if checksum(data) != source.sha256:
        raise SessionError(f"{path} has changed since it was read; import it again")
    return data
