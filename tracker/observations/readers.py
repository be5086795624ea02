"""Read the files of other programs, by format: key points in pictures, or points in space."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from tracker.errors import FormatError
from tracker.files import read_regular
from tracker.formats.bvh_reading import read_bvh
from tracker.formats.c3d import read_c3d
from tracker.formats.keypoints.coco_reading import is_coco, read_coco
from tracker.formats.keypoints.deeplabcut import is_deeplabcut, read_deeplabcut_csv
from tracker.formats.keypoints.hdf5 import read_hdf5_apart
from tracker.formats.keypoints.openpose import numbered_name, read_openpose_pictures
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.formats.points_csv import read_points_csv
from tracker.formats.trc import MarkerTable, read_trc
from tracker.observations.sources import FileGroup, Found, folder_labels, list_files, numbered_groups
from tracker.text_files import TABLE_BYTES

Groups = list[tuple[FileGroup, PictureTable]]


@dataclass(frozen=True)
class PictureFormat:
    """A format of key points in pictures."""

    title: str
    read: Callable[[Sequence[Found]], Groups]
    """Reads files, each with the folder it is relative to."""


@dataclass(frozen=True)
class SpaceFormat:
    """A format of points in space, one file for each person."""

    title: str
    read: Callable[[Path, float | None, float], MarkerTable]
    """Reads a file. Lengths without a unit in the file have the given one, metres, or are refused; rows without times
    have the given rate, 1/s."""


def _read_openpose(files: Sequence[Found]) -> Groups:
    return [(g, read_openpose_pictures(g.files, f"folder {g.files[0].parent}")) for g in numbered_groups(files)]


def _read_coco(files: Sequence[Found]) -> Groups:
    return [
        (FileGroup((path,), (*labels, *folder_labels(path, root)), root), table)
        for path, root in files
        for labels, table in read_coco(path)
    ]


def _read_deeplabcut(files: Sequence[Found]) -> Groups:
    return [(FileGroup((path,), folder_labels(path, root), root), read_deeplabcut_csv(path)) for path, root in files]


def _read_hdf5(files: Sequence[Found]) -> Groups:
    out = []
    for path, root in files:
        found = read_hdf5_apart(path)
        for video, table in found:
            # A file of one camera is named after it more often than after its video.
            of_video = (video.stem, video.parent.name)
            own = folder_labels(path, root)
            labels = (*own, *of_video) if len(found) == 1 else of_video
            out.append((FileGroup((path,), labels, root), table))
    return out


PICTURE_FORMATS = {
    "openpose": PictureFormat("OpenPose JSON", _read_openpose),
    "coco": PictureFormat("COCO", _read_coco),
    "deeplabcut": PictureFormat("DeepLabCut", _read_deeplabcut),
    "hdf5": PictureFormat("SLEAP, NWB or HDF5", _read_hdf5),
}
SPACE_FORMATS = {
    "trc": SpaceFormat("TRC", lambda path, unit_m, rate: read_trc(path)),
    "c3d": SpaceFormat("C3D", lambda path, unit_m, rate: read_c3d(path, unit_m)),
    "bvh": SpaceFormat("BVH", lambda path, unit_m, rate: read_bvh(path, unit_m)),
    "csv": SpaceFormat("CSV", read_points_csv),
}
FORMATS: Mapping[str, PictureFormat | SpaceFormat] = {**PICTURE_FORMATS, **SPACE_FORMATS}
"""The formats by name."""
_BY_SUFFIX = {".slp": "hdf5", ".nwb": "hdf5", ".h5": "hdf5", ".trc": "trc", ".c3d": "c3d", ".bvh": "bvh"}
SUFFIXES = (".json", ".csv", *_BY_SUFFIX)


def find_files(paths: Sequence[Path]) -> tuple[str, list[Found]]:
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


def _samples(files: Sequence[Found]) -> list[Found]:
    """Return the first file of each suffix in each folder; all but one of a numbered folder are alike."""
    first: dict[tuple[Path, str], Found] = {}
    for path, root in files:
        first.setdefault((path.parent, path.suffix.lower()), (path, root))
    return list(first.values())


def _format_of(path: Path) -> str:
    """Return the name of the format of a file, by its suffix and content.

    Raises:
        FormatError: it is none that is known, or cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix in _BY_SUFFIX:
        return _BY_SUFFIX[suffix]
    if suffix == ".csv":
        return "deeplabcut" if is_deeplabcut(path) else "csv"
    if suffix == ".json":
        return "openpose" if numbered_name(path.name) is not None and not _is_dataset(path) else "coco"
    raise FormatError(
        f"expected a file that ends in {', '.join(SUFFIXES)}, found {path}; export it in one of these formats"
    )


def _is_dataset(path: Path) -> bool:
    """Return whether a JSON file holds the people of many pictures, not of one; False for a file that is no JSON."""
    try:
        return is_coco(msgspec.json.decode(read_regular(path, TABLE_BYTES)))
    except (OSError, msgspec.DecodeError, RecursionError):
        return False  # its reader explains it
