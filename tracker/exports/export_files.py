"""Export a session to files: all of them appear complete, or none."""

import os
import secrets
import shutil
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from tracker.errors import Remedy, TrackerError
from tracker.exports.export_format import ExportFormat
from tracker.exports.motion import ExportedMotion
from tracker.exports.options import ExportOptions
from tracker.exports.provenance import SIDE_FILE, write_provenance
from tracker.formats.file_names import identifiers

if TYPE_CHECKING:
    from tracker.session.session import Session


FOLDER_PROVENANCE = "provenance.json"
"""Name of the file of provenance in a folder; a folder that has it is one of an export."""


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
    from tracker.exports.options import AXES, KEYPOINT_SETS, PICTURES, PIXELS, UNITS, load_character

    values = {name: value for name, value in given.items() if value is not None}
    allowed: dict[str, Sequence[str]] = {
        "axes": AXES,
        "units": UNITS,
        "keypoints": KEYPOINT_SETS,
        "pixels": PIXELS,
        "pictures": PICTURES,
        "view": _camera_names(session),
    }
    for name, value in values.items():
        if name not in chosen.options:
            can = f"its options are {', '.join(f'--{o}' for o in sorted(chosen.options))}"
            raise TrackerError(f"expected no --{name} with format {chosen.name}, found '{value}'; {can}")
        if name == "character":
            load_character(value)
        elif value not in allowed[name]:
            raise TrackerError(f"expected --{name} to be one of {', '.join(allowed[name])}, found '{value}'")
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
    refuse_existing(paths, overwrite, is_export_folder if chosen.is_folder else None)
    try:
        with moved_at_end(paths) as folder:
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
    return TrackerError(f"cannot write {out}: {reason}; choose a folder that you may write to, with room")


def refuse_existing(paths: Sequence[Path], overwrite: bool, may_replace: Callable[[Path], bool] | None) -> None:
    """Refuse to replace files.

    Args:
        paths: the files or folders to write.
        overwrite: whether files may be replaced.
        may_replace: returns whether a folder may be replaced then; None for no folder.

    Raises:
        TrackerError: one exists that may not be replaced.
    """
    for found in paths:
        may_overwrite = may_replace(found) if found.is_dir() and may_replace else not (found.is_dir() or may_replace)
        if found.exists() and not (overwrite and may_overwrite):
            kind = "folder" if found.is_dir() else "file"
            remedy = Remedy("another_file_or_overwrite") if may_overwrite else Remedy("another_file")
            raise TrackerError(f"expected {found} not to exist, found a {kind}", remedy)


@contextmanager
def moved_at_end(paths: Sequence[Path]) -> Generator[Path, None, None]:
    """Yield an empty folder beside some files; at the end, files of the same names move from there to their places."""
    folder = paths[0].with_name(f".{paths[0].name}.{secrets.token_hex(4)}.tmp")
    folder.mkdir()
    try:
        yield folder
        for path in paths:
            if path.is_dir():  # it moves away first: a folder does not replace one that has files
                os.replace(path, folder / f"{path.name}.before")
            os.replace(folder / path.name, path)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _camera_names(session: "Session") -> tuple[str, ...]:
    return tuple(source.camera.name for source in session.cameras)
