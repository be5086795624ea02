"""Read the files of other programs, by format: key points in pictures, or points in space."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from tracker.errors import FormatError
from tracker.formats.keypoints.openpose import read_openpose_pictures
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.formats.trc import MarkerTable, read_trc
from tracker.observations.sources import FileGroup, list_files, numbered_groups

Groups = list[tuple[FileGroup, PictureTable]]


@dataclass(frozen=True)
class PictureFormat:
    """A format of key points in pictures."""

    name: str
    title: str
    read: Callable[[Sequence[tuple[Path, Path]]], Groups]
    """Reads files, each with the folder it is relative to."""


@dataclass(frozen=True)
class SpaceFormat:
    """A format of points in space, one file for each person."""

    name: str
    title: str
    read: Callable[[Path, float | None], MarkerTable]
    """Reads a file; lengths without a unit in the file have the given one, metres, or are refused."""


def _read_openpose(files: Sequence[tuple[Path, Path]]) -> Groups:
    return [(g, read_openpose_pictures(g.files, f"folder {g.files[0].parent}")) for g in numbered_groups(files)]


def _read_trc(path: Path, _: float | None) -> MarkerTable:
    return read_trc(path)


PICTURE_FORMATS = {f.name: f for f in (PictureFormat("openpose", "OpenPose JSON", _read_openpose),)}
SPACE_FORMATS = {f.name: f for f in (SpaceFormat("trc", "TRC", _read_trc),)}
FORMATS: Mapping[str, PictureFormat | SpaceFormat] = {**PICTURE_FORMATS, **SPACE_FORMATS}
"""The formats by name."""
SUFFIXES = (".json", ".trc")


def find_files(paths: Sequence[Path]) -> tuple[str, list[tuple[Path, Path]]]:
    """Return the name of the format of some files and folders, and the files, each with the folder it is relative to.

    Raises:
        FormatError: there are none, they have several formats, or none that is known.
    """
    files = list_files(paths, SUFFIXES)
    formats = {_format_of(path): path for path, _ in _samples(files)}
    if len(formats) > 1:
        listed = " and ".join(f"{path.name} ({FORMATS[name].title})" for name, path in list(formats.items())[:2])
        raise FormatError(f"expected files of one format, found {listed}; import them one after the other")
    return next(iter(formats)), files


def _samples(files: Sequence[tuple[Path, Path]]) -> list[tuple[Path, Path]]:
    """Return the first file of each suffix in each folder."""
    first: dict[tuple[Path, str], tuple[Path, Path]] = {}
    for path, root in files:
        first.setdefault((path.parent, path.suffix.lower()), (path, root))
    return list(first.values())


def _format_of(path: Path) -> str:
    """Return the name of the format of a file, by its suffix and content.

    Raises:
        FormatError: it is none that is known.
    """
    suffix = path.suffix.lower()
    if suffix == ".trc":
        return "trc"
    if suffix == ".json":
        return "openpose"
    raise FormatError(
        f"expected a file that ends in {', '.join(SUFFIXES)}, found {path}; export it in one of these formats"
    )
