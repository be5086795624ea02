"""Read the files of other programs, by format: key points in pictures, masks, or points in space."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tracker.errors import FormatError
from tracker.footage.mask_image import LabelImage, read_label_image
from tracker.formats.bvh_reading import read_bvh
from tracker.formats.c3d import read_c3d
from tracker.formats.joint_tables.layouts import SCENES, Scenes, find_layout, read_joint_files, refuse_unread
from tracker.formats.keypoints.coco_reading import holds, is_coco, read_coco
from tracker.formats.keypoints.coco_segmentation import SegmentedPictures, check_mask_size, read_segmentations
from tracker.formats.keypoints.deeplabcut import is_deeplabcut, read_deeplabcut_csv
from tracker.formats.keypoints.hdf5 import read_hdf5_apart
from tracker.formats.keypoints.openpose import numbered_name, read_openpose_pictures
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.formats.observation_layout import Sample
from tracker.formats.trc import MarkerTable, read_trc
from tracker.observations.mask_files import MaskFiles
from tracker.observations.sources import FileGroup, Found, folder_labels, list_files, numbered_groups
from tracker.text_files import TABLE_BYTES, TextKind, read_json

_JSON = TextKind("JSON file", TABLE_BYTES, FormatError)
Groups = list[tuple[FileGroup, PictureTable]]


@dataclass(frozen=True)
class PictureFormat:
    """A format of key points in pictures."""

    title: str
    read: Callable[[Sequence[Found]], Groups]
    """Reads files, each with the folder it is relative to."""


@dataclass(frozen=True)
class SpaceFormat:
    """A format of points in space."""

    title: str
    read: Callable[[Sequence[Path], float | None, float], Scenes]
    """Reads files. Lengths without a unit in the file have the given one, metres, or are refused; rows without times
    have the given rate, 1/s. Returns the points of each person with the file or folder that they are from."""


def _each(read: Callable[[Path, float | None], MarkerTable]) -> Callable[[Sequence[Path], float | None, float], Scenes]:
    return lambda paths, unit_m, rate: [(path, read(path, unit_m)) for path in paths]


@dataclass(frozen=True)
class MaskFormat:
    """A format of masks."""

    title: str
    read: Callable[[Sequence[Found]], list[MaskFiles]]
    """Reads where masks are, each file with the folder it is relative to."""


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


def _read_png(files: Sequence[Found]) -> list[MaskFiles]:
    return [_png_masks(group) for group in numbered_groups(files)]


def _png_masks(group: FileGroup) -> MaskFiles:
    def read(i: int, size: tuple[int, int]) -> LabelImage:
        image = read_label_image(group.files[i], "mask")
        height, width = image.labels.shape
        check_mask_size((width, height), size, f"mask {group.files[i]}")
        return image

    named = [numbered_name(path.name) for path in group.files]
    return MaskFiles(group, np.array([n for _, n in filter(None, named)], dtype=np.int64), read)


def _read_coco_masks(files: Sequence[Found]) -> list[MaskFiles]:
    return [
        _coco_masks(found, FileGroup((path,), (*found.labels, *folder_labels(path, root)), root))
        for path, root in files
        for found in read_segmentations(path)
    ]


def _coco_masks(found: SegmentedPictures, group: FileGroup) -> MaskFiles:
    numbers = sorted(found.images)
    return MaskFiles(
        group,
        np.array(numbers, dtype=np.int64),
        lambda i, size: LabelImage(found.labels_of(numbers[i], size)),
        found.notes,
    )


PICTURE_FORMATS = {
    "openpose": PictureFormat("OpenPose JSON", _read_openpose),
    "coco": PictureFormat("COCO", _read_coco),
    "deeplabcut": PictureFormat("DeepLabCut", _read_deeplabcut),
    "hdf5": PictureFormat("SLEAP, NWB or HDF5", _read_hdf5),
}
SPACE_FORMATS = {
    "trc": SpaceFormat("TRC", _each(lambda path, unit_m: read_trc(path))),
    "c3d": SpaceFormat("C3D", _each(read_c3d)),
    "bvh": SpaceFormat("BVH", _each(read_bvh)),
    "csv": SpaceFormat("CSV", read_joint_files),
    "arrays": SpaceFormat("NumPy", read_joint_files),
    "scenes": SpaceFormat("JSON of people in space", read_joint_files),
}
MASK_FORMATS = {
    "masks": MaskFormat("masks in PNG", _read_png),
    "coco masks": MaskFormat("COCO segmentation", _read_coco_masks),
}
FORMATS: Mapping[str, PictureFormat | SpaceFormat | MaskFormat] = {**PICTURE_FORMATS, **SPACE_FORMATS, **MASK_FORMATS}
"""The formats by name."""
_BY_SUFFIX = {".slp": "hdf5", ".nwb": "hdf5", ".h5": "hdf5", ".trc": "trc", ".c3d": "c3d", ".bvh": "bvh"} | {
    ".tsv": "csv", ".npy": "arrays", ".npz": "arrays",
}  # fmt: skip
_MASK_SUFFIX = ".png"
SUFFIXES = (".json", ".csv", *_BY_SUFFIX, _MASK_SUFFIX)


def find_files(paths: Sequence[Path], masks: bool = False) -> tuple[str, list[Found]]:
    """Return the name of the format of some files and folders, and the files, each with the folder it is relative to.

    Args:
        paths: of the files and folders.
        masks: whether masks are taken where there are key points too; else pictures beside other files are none.

    Raises:
        FormatError: there are none, they have several formats, or none that is known.
    """
    files = list_files(paths, SUFFIXES)
    pictures = [f for f in files if f[0].suffix.lower() == _MASK_SUFFIX]
    if len(pictures) < len(files):
        files = pictures if masks and pictures else [f for f in files if f[0].suffix.lower() != _MASK_SUFFIX]
    formats = {_format_of(path, masks): path for path, _ in _samples(files)}
    if len(formats) > 1:
        listed = " and ".join(f"{path.name} ({FORMATS[name].title})" for name, path in list(formats.items())[:2])
        raise FormatError(f"expected files of one format, found {listed}; import them one after the other")
    name = next(iter(formats))
    if masks and name not in MASK_FORMATS:
        raise FormatError(
            f"expected masks among the files, found {FORMATS[name].title}; export PNG files or COCO segmentations"
        )
    return name, files


def _samples(files: Sequence[Found]) -> list[Found]:
    """Return the first file of each suffix in each folder; all but one of a numbered folder are alike."""
    first: dict[tuple[Path, str], Found] = {}
    for path, root in files:
        first.setdefault((path.parent, path.suffix.lower()), (path, root))
    return list(first.values())


def _format_of(path: Path, masks: bool) -> str:
    """Return the name of the format of a file, by its suffix and content.

    Raises:
        FormatError: it is none that is known, or cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix == _MASK_SUFFIX:
        return "masks"
    if suffix in _BY_SUFFIX:
        return _BY_SUFFIX[suffix]
    if suffix == ".csv":
        return "csv" if find_layout(Sample(path)) or not is_deeplabcut(path) else "deeplabcut"
    if suffix == ".json":
        if find_layout(Sample(path)) in SCENES:
            return "scenes"
        data = _decoded(path)
        if numbered_name(path.name) is not None and not is_coco(data):
            return "openpose"
        return "coco masks" if masks or (holds(data, "segmentation") and not holds(data, "keypoints")) else "coco"
    refuse_unread(Sample(path))
    raise FormatError(
        f"expected a file that ends in {', '.join(SUFFIXES)}, found {path}; export it in one of these formats"
    )


def _decoded(path: Path) -> Any:
    """Return plain data of a JSON file; None if it is none, which its reader explains."""
    try:
        return read_json(path, _JSON)
    except FormatError:
        return None
