"""Export a session to files: all of them appear complete, or none."""

import errno
import os
import secrets
import shutil
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, get_args, get_type_hints

import msgspec

from tracker.errors import Remedy, TrackerError
from tracker.formats.file_names import identifiers
from tracker.interchange.exports.formats import ExportFormat
from tracker.interchange.exports.motion import ExportedMotion, ExportOptions
from tracker.interchange.exports.provenance import SIDE_FILE, write_provenance
from tracker.session.lock import is_alive, read_holder, this_holder

if TYPE_CHECKING:
    from tracker.session.session import Session


FOLDER_PROVENANCE = "provenance.json"
"""Name of the file of provenance in a folder; a folder that has it is one of an export."""
_HOLDER = ".holder"
"""Name of a file in the temporary folder of an export: the program that makes it (`tracker.session.lock`)."""
_BEFORE = ".before"
"""End of the name of a folder that is being replaced."""
_OF_GLTF = {"axes": "y-up", "units": "m"}
"""Axes and unit of all glTF files (glTF 2.0, Sect. 3.4)."""


@dataclass(frozen=True)
class ExportFiles:
    """The files of an export."""

    people: tuple[int, ...]
    """Indices of the people in these files."""
    names: tuple[str, ...]
    """File names, one for each suffix of the format; of a folder its own."""
    side_file: str
    """Name of the file of their provenance, below the folder if they are one."""


def check_options(chosen: ExportFormat, session: "Session", given: dict[str, str | None]) -> ExportOptions:
    """Return the options of a format.

    Args:
        chosen: the format.
        session: the session.
        given: value of each option; None for the default.

    Raises:
        TrackerError: the format has no such option, or a value is not allowed.
    """
    from tracker.interchange.exports.motion import load_character

    values = {name: value for name, value in given.items() if value is not None}
    allowed = {name: get_args(kind) for name, kind in get_type_hints(ExportOptions).items()}
    allowed["view"] = tuple(source.camera.name for source in session.cameras)
    for name, value in values.items():
        if name not in chosen.options:
            can = f"it takes {', '.join(sorted(chosen.options))}" if chosen.options else "it has no options"
            raise TrackerError(f"expected no option '{name}' with format {chosen.name}, found '{value}'; {can}")
        if name == "character":
            load_character(value)
        elif value not in allowed[name]:
            raise TrackerError(f"expected --{name} to be one of {', '.join(allowed[name])}, found '{value}'")
    for name, value in _OF_GLTF.items() if values.get("mesh") == "glb" else ():
        if values.setdefault(name, value) != value:
            raise TrackerError(f"expected {name} {value} of meshes as glTF, found '{values[name]}'; leave them out")
    return replace(ExportOptions(chosen.axes, chosen.units), **values)  # pyrefly: ignore[bad-argument-type]


def for_format(chosen: ExportFormat, motion: ExportedMotion) -> ExportedMotion:
    """Return a motion with the frames that a format has."""
    return replace(motion, frames=motion.span) if chosen.has_rate else motion


def files_of(chosen: ExportFormat, stem: str, motion: ExportedMotion) -> list[ExportFiles]:
    """Return the files of an export; with several people and files of one person each, these carry the names."""
    if chosen.is_folder:
        return [ExportFiles(motion.chosen, (stem,), f"{stem}/{FOLDER_PROVENANCE}")]
    groups = [(motion.chosen, stem)]
    if chosen.one_person and len(motion.chosen) > 1:
        people = identifiers([p.person.name for p in motion.exported])
        groups = [((index,), f"{stem}_{name}") for index, name in zip(motion.chosen, people, strict=True)]
    return [
        ExportFiles(indices, tuple(name + suffix for suffix in chosen.suffixes), name + chosen.suffixes[0] + SIDE_FILE)
        for indices, name in groups
    ]


def is_export_folder(path: Path) -> bool:
    """Return whether a folder is one that an export has made, and may replace."""
    return (path / FOLDER_PROVENANCE).is_file()


def n_ticks(chosen: ExportFormat, motion: ExportedMotion) -> int:
    """Return how often an export reports progress."""
    return len(for_format(chosen, motion).frames) * (len(motion.chosen) if chosen.one_person else 1)


def export(
    chosen: ExportFormat,
    motion: ExportedMotion,
    options: ExportOptions,
    out: Path,
    overwrite: bool = False,
    tick: Callable[[], None] = lambda: None,
) -> list[Path]:
    """Export a motion.

    Args:
        chosen: the format.
        motion: what to export.
        options: of the format.
        out: the file or folder; with several files, their names are made from this one.
        overwrite: whether to replace files that exist, and folders that an export has made.
        tick: called `n_ticks` times; it may raise to stop the export, which leaves nothing behind.

    Returns:
        The files, or the folder.

    Raises:
        TrackerError: a file exists or cannot be written, or the footage cannot be read.
    """
    motion = for_format(chosen, motion)
    groups = files_of(chosen, out.name if chosen.is_folder else out.name.removesuffix(out.suffix), motion)
    has_side_files = options.provenance and not chosen.holds_provenance and not chosen.is_folder
    names = [n for files in groups for n in (*files.names, *[files.side_file] * has_side_files)]
    paths = [out.with_name(name) for name in names]
    try:
        with moved_at_end(paths, overwrite, is_export_folder if chosen.is_folder else None) as folder:
            for files in groups:
                part = replace(motion, chosen=files.people)
                chosen.write(part, options, [folder / name for name in files.names], tick)
                if (has_side_files or chosen.is_folder) and not (folder / files.side_file).exists():
                    write_provenance(folder / files.side_file, part, options)
    except OSError as error:
        raise unwritable(out, error) from error
    return paths


def unwritable(out: Path, error: OSError) -> TrackerError:
    """Return the error of an export that cannot be written."""
    reason = error.strerror or str(error)
    advice = "a shorter name" if error.errno == errno.ENAMETOOLONG else "a folder that you may write to, with room"
    return TrackerError(f"cannot write {out}: {reason}; choose {advice}")


@contextmanager
def moved_at_end(
    paths: Sequence[Path], overwrite: bool | None, may_replace: Callable[[Path], bool] | None = None
) -> Generator[Path, None, None]:
    """Yield an empty folder beside some files; at the end, files of the same names move from there to their places.

    Of two programs that make a file at the same time, one does. Folders that killed programs left are removed.

    Args:
        paths: the files or folders to write.
        overwrite: whether they may be replaced; None where that is not offered.
        may_replace: returns whether a folder may be replaced then; None for no folder.

    Raises:
        TrackerError: one exists that may not be replaced.
        OSError: they cannot be written.
    """
    _refuse_existing(paths, overwrite, may_replace)
    _remove_left(paths[0].parent)
    folder, placed = paths[0].with_name(f".{paths[0].name}.{secrets.token_hex(4)}.tmp"), list[Path]()
    folder.mkdir()
    try:
        (folder / _HOLDER).write_bytes(msgspec.json.encode(this_holder()))
        yield folder
        for path in paths:
            try:
                _place(folder / path.name, path, bool(overwrite))
            except OSError:
                _refuse_existing([path], overwrite, may_replace)  # another program was quicker
                raise
            placed.append(path)
    except BaseException:
        for path in [] if overwrite else placed:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        raise
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _refuse_existing(paths: Sequence[Path], overwrite: bool | None, may_replace: Callable[[Path], bool] | None) -> None:
    for found in paths:
        may_overwrite = may_replace(found) if found.is_dir() and may_replace else not (found.is_dir() or may_replace)
        if found.exists() and not (overwrite and may_overwrite):
            kind = "folder" if found.is_dir() else "file"
            is_offered = may_overwrite and overwrite is not None
            remedy = Remedy("another_file_or_overwrite") if is_offered else Remedy("another_file")
            raise TrackerError(f"expected {found} not to exist, found a {kind}", remedy)


def _place(made: Path, path: Path, overwrite: bool) -> None:
    """Move a file or folder to its place. Without `overwrite`, it must be free until then.

    Raises:
        OSError: it is not, or cannot be written.
    """
    if overwrite:
        if path.is_dir():  # it moves away first: a folder does not replace one that has files
            os.replace(path, made.with_name(path.name + _BEFORE))
        os.replace(made, path)
    elif made.is_dir():
        made.rename(path)
    else:
        try:
            os.link(made, path)
        except FileExistsError:
            raise
        except OSError:  # a drive without hard links
            path.open("xb").close()
            os.replace(made, path)


def _remove_left(parent: Path) -> None:
    """Remove the folders that killed exports left; a folder that one was about to replace goes back to its place."""
    for holder_file in parent.glob(f".*.tmp/{_HOLDER}"):
        holder, left = read_holder(holder_file), holder_file.parent
        if holder is None or is_alive(holder):
            continue
        for before in left.glob(f"*{_BEFORE}"):
            if not (place := parent / before.name.removesuffix(_BEFORE)).exists():
                before.rename(place)
        shutil.rmtree(left, ignore_errors=True)
