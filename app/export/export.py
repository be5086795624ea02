"""Export a session to files: all of them appear complete, or none."""

import os
import secrets
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from app.export.formats import ExportFormat
from tracker.errors import Remedy, TrackerError
from tracker.export.motion import ExportedMotion
from tracker.export.options import ExportOptions
from tracker.formats.file_names import identifiers

if TYPE_CHECKING:
    from tracker.session.session import Session


@dataclass(frozen=True)
class ExportFiles:
    """The files of an export."""

    people: tuple[int, ...]
    """Indices of the people in these files."""
    names: tuple[str, ...]
    """File names, one for each suffix of the format."""


def check_options(chosen: ExportFormat, session: "Session", given: dict[str, str | None]) -> ExportOptions:
    """Return the options of a format.

    Args:
        chosen: the format.
        session: the session.
        given: value of each option; None for the default.

    Raises:
        TrackerError: the format has no such option, or a value is not allowed.
    """
    from tracker.export.options import AXES, KEYPOINT_SETS, UNITS, load_character

    values = {name: value for name, value in given.items() if value is not None}
    allowed = {"axes": AXES, "units": UNITS, "keypoints": KEYPOINT_SETS, "view": _camera_names(session)}
    for name, value in values.items():
        if name not in chosen.options:
            can = f"its options are {', '.join(f'--{o}' for o in sorted(chosen.options))}"
            raise TrackerError(f"expected no --{name} with format {chosen.name}, found '{value}'; {can}")
        if name == "character":
            load_character(value)
        elif value not in allowed[name]:
            raise TrackerError(f"expected --{name} to be one of {', '.join(allowed[name])}, found '{value}'")
    return replace(ExportOptions(axes=chosen.axes), **values)  # type: ignore[arg-type]


def files_of(chosen: ExportFormat, stem: str, motion: ExportedMotion) -> list[ExportFiles]:
    """Return the files of an export; with several people and files of one person each, these carry the names."""
    if not chosen.one_person or len(motion.chosen) == 1:
        return [ExportFiles(motion.chosen, tuple(stem + suffix for suffix in chosen.suffixes))]
    people = identifiers([p.person.name for p in motion.exported])
    return [
        ExportFiles((index,), tuple(f"{stem}_{name}{suffix}" for suffix in chosen.suffixes))
        for index, name in zip(motion.chosen, people, strict=True)
    ]


def n_ticks(chosen: ExportFormat, motion: ExportedMotion) -> int:
    """Return how often an export reports progress."""
    return len(motion.frames) * (len(motion.chosen) if chosen.one_person else 1)


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
        out: the file; with several files, their names are made from this one.
        overwrite: whether to replace files that exist.
        tick: called `n_ticks` times; it may raise to stop the export, which leaves nothing behind.

    Returns:
        The files.

    Raises:
        TrackerError: a file exists or cannot be written, or the footage cannot be read.
    """
    groups = files_of(chosen, out.name.removesuffix(out.suffix), motion)
    paths = [out.with_name(name) for files in groups for name in files.names]
    if any(path.is_dir() for path in paths) or (not overwrite and any(path.exists() for path in paths)):
        found = next(path for path in paths if path.exists())
        if found.is_dir():
            raise TrackerError(f"expected {found} not to exist, found a folder", Remedy("another_file"))
        raise TrackerError(f"expected {found} not to exist, found a file", Remedy("another_file_or_overwrite"))
    try:
        with _moved_at_end(paths) as folder:
            for files in groups:
                part = replace(motion, chosen=files.people)
                chosen.write(part, options, [folder / name for name in files.names], tick)
    except OSError as error:
        reason = error.strerror or str(error)
        raise TrackerError(f"cannot write {out}: {reason}; choose a folder that you may write to, with room") from error
    return paths


@contextmanager
def _moved_at_end(paths: Sequence[Path]) -> Iterator[Path]:
    """Yield an empty folder beside some files; at the end, files of the same names move from there to their places."""
    folder = paths[0].with_name(f".{paths[0].name}.{secrets.token_hex(4)}.tmp")
    folder.mkdir()
    try:
        yield folder
        for path in paths:
            os.replace(folder / path.name, path)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _camera_names(session: "Session") -> tuple[str, ...]:
    return tuple(source.camera.name for source in session.cameras)
