"""Read key points of people from COCO: a dataset with images and categories, or a list of results.

v of a key point is 0, 1 or 2 in datasets, which is no confidence; detectors write theirs there, or as the score of a
person. Images are matched to cameras by `camera`, as this program writes it, or by the folder of their file name.
"""

from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal, NamedTuple

import msgspec
import numpy as np

from tracker.errors import FormatError
from tracker.formats.keypoints.openpose import numbered_name
from tracker.formats.keypoints.picture_table import PictureTable, stack_pictures, stack_tracks
from tracker.formats.number_rows import MAX_NAMES
from tracker.geometry.arrays import Array
from tracker.text_files import TABLE_BYTES, TextKind, read_json
from tracker.validation import MAX_FRAMES, MAX_SIDE_PX, Name, Number, check

_KIND = TextKind("COCO file", TABLE_BYTES, FormatError, "export it again")
_FrameNumber = Annotated[int, msgspec.Meta(ge=0, le=MAX_FRAMES, description=f"a whole number of at most {MAX_FRAMES}")]
_Side = Annotated[int, msgspec.Meta(ge=0, le=MAX_SIDE_PX, description="a size in pixels")]


class CocoPicture(msgspec.Struct):
    """An image of a dataset."""

    id: _FrameNumber
    file_name: str = ""
    width: _Side = 0
    height: _Side = 0
    camera: str = ""
    video_frame: _FrameNumber | None = None


class _Category(msgspec.Struct):
    id: int = 1
    name: str = ""
    supercategory: str = ""
    keypoints: Annotated[
        tuple[Name, ...], msgspec.Meta(max_length=MAX_NAMES, description="the names of the key points")
    ] = ()


class _Annotation(msgspec.Struct):
    image_id: _FrameNumber
    category_id: int = 1
    keypoints: list[Number] = []
    score: Number | None = None
    segmentation: Any = None
    track_id: Any = None

    @property
    def track(self) -> str:
        """Name of a person who is followed from picture to picture; empty without one."""
        return str(self.track_id) if isinstance(self.track_id, int | str) else ""


class _Dataset(msgspec.Struct):
    images: list[CocoPicture]
    annotations: list[_Annotation]
    categories: list[_Category] = []


def is_coco(data: Any) -> bool:
    """Return whether plain data of a JSON file looks like COCO."""
    return isinstance(data, list) or (isinstance(data, dict) and "annotations" in data)


def holds(data: Any, key: Literal["keypoints", "segmentation"]) -> bool:
    """Return whether an annotation in plain data of a COCO file has key points or a segmentation."""
    annotations = data.get("annotations") if isinstance(data, dict) else data
    return isinstance(annotations, list) and any(isinstance(a, dict) and a.get(key) for a in annotations)


class PictureDataset(NamedTuple):
    """The content of a file, by picture."""

    dataset: _Dataset
    images: Mapping[tuple[str, ...], Mapping[int, CocoPicture]]
    """The images of each camera by their numbers. The key has the names that it may have, best first."""


class KeypointDataset(NamedTuple):
    """The content of a file, and what of it are key points of people."""

    dataset: _Dataset
    category: int
    """The category of the people."""
    names: tuple[str, ...]
    """Names of their points; empty if the file has none."""
    images: Mapping[tuple[str, ...], Mapping[int, CocoPicture]]
    """The images of each camera by their numbers. The key has the names that it may have, best first."""
    notes: tuple[str, ...]

    @property
    def annotations(self) -> list[_Annotation]:
        """The annotations of people with key points."""
        return [a for a in self.dataset.annotations if a.category_id == self.category and a.keypoints]

    @property
    def has_flags(self) -> bool:
        """Whether the third number of all points is a flag of visibility, not a confidence."""
        return all(v in (0, 1, 2) for a in self.annotations for v in a.keypoints[2::3])


def read_pictures(path: Path) -> PictureDataset:
    """Read a dataset or a list of results, of key points or segmentations.

    Raises:
        FormatError: the file is malformed.
    """
    where = f"COCO file {path}"
    data = read_json(path, _KIND)
    if isinstance(data, list):
        annotations = check(data, list[_Annotation], where, FormatError)
        dataset = _Dataset([CocoPicture(i) for i in sorted({a.image_id for a in annotations})], annotations)
    else:
        dataset = check(data, _Dataset, where, FormatError)
    by_camera: dict[tuple[str, ...], dict[int, CocoPicture]] = {}
    for image in dataset.images:
        labels, number = _place(image)
        taken = by_camera.setdefault(labels, {})
        if number in taken:
            raise FormatError(
                f"{where}: expected one image for each picture of a camera, found {quoted_images(taken[number], image)}"
                "; give the images numbers or folders of their cameras"
            )
        taken[number] = image
    return PictureDataset(dataset, by_camera)


def read_dataset(path: Path) -> KeypointDataset:
    """Read key points of a dataset or a list of results, without arrays.

    Raises:
        FormatError: the file is malformed, or has no key points.
    """
    dataset, images = read_pictures(path)
    category, names, notes = _category(dataset, f"COCO file {path}")
    if any(a.segmentation for a in dataset.annotations):
        notes = (*notes, "key points were taken, and segmentations of the file left out")
    return KeypointDataset(dataset, category, names, images, notes)


def read_coco(path: Path) -> list[tuple[tuple[str, ...], PictureTable]]:
    """Read a dataset or a list of results.

    Returns:
        For each camera the names that it may have, best first, and its key points.

    Raises:
        FormatError: the file is malformed, or has no key points.
    """
    where, found = f"COCO file {path}", read_dataset(path)
    people = _people(found, where)
    tracks: dict[int, list[str]] = {}
    for annotation in found.annotations:
        tracks.setdefault(annotation.image_id, []).append(annotation.track)
    n_points = len(found.names) or max((len(p) for some in people.values() for p in some), default=0)
    if not n_points:
        raise FormatError(f"{where}: expected key points of people, found none; export them")
    out = []
    for labels, images in found.images.items():
        numbers = sorted(images)
        points = stack_pictures([people.get(images[n].id, []) for n in numbers], n_points, where)
        sizes = {(i.width, i.height) for i in images.values() if i.width and i.height}
        if len(sizes) > 1:
            raise FormatError(f"{where}: expected images of one size for {labels[0]}, found {sorted(sizes)[:3]}")
        size = next(iter(sizes), None)
        names = stack_tracks([tracks.get(images[n].id, []) for n in numbers])
        table = PictureTable(found.names, np.array(numbers, dtype=np.int64), points, size, None, found.notes, names)
        out.append((labels, table))
    return out


def quoted_images(one: CocoPicture, other: CocoPicture) -> str:
    """Return the names of two images for a message."""
    return f"'{one.file_name[-60:]}' and '{other.file_name[-60:]}'"


def _place(image: CocoPicture) -> tuple[tuple[str, ...], int]:
    """Return the names that the camera of an image may have, best first, and the number of the picture."""
    path = PurePosixPath(image.file_name.replace("\\", "/"))
    named = numbered_name(f"{path.stem}.json") if path.stem else None
    number = image.video_frame if image.video_frame is not None else named[1] if named else image.id
    labels = (image.camera, named[0] if named else "", *(p for p in reversed(path.parts[:-1]) if p != "/"))
    return tuple(label for label in labels if label), number


def _category(dataset: _Dataset, where: str) -> tuple[int, tuple[str, ...], tuple[str, ...]]:
    """Return the category with most annotations, its key points and a note on others."""
    counts: dict[int, int] = {}
    for annotation in dataset.annotations:
        if annotation.keypoints:
            counts[annotation.category_id] = counts.get(annotation.category_id, 0) + 1
    if not counts:
        raise FormatError(f"{where}: expected annotations with key points, found none; export them")
    chosen = max(counts, key=lambda c: counts[c])
    names = next((c.keypoints for c in dataset.categories if c.id == chosen), ())
    if len(set(names)) < len(names):
        raise FormatError(f"{where}: expected each name of a key point once, found one twice; rename it")
    notes = () if len(counts) == 1 else (f"key points of category {chosen} were taken, those of the others left out",)
    return chosen, names, notes


def _people(found: KeypointDataset, where: str) -> dict[int, list[Array]]:
    """Return the people of each image by its id, each (n_points, 3).

    Raises:
        FormatError: people have different numbers of points.
    """
    chosen = found.annotations
    n_points = len(found.names) or len(chosen[0].keypoints) // 3
    values = np.zeros((len(chosen), n_points, 3))
    for row, annotation in zip(values, chosen, strict=True):
        if len(annotation.keypoints) != 3 * n_points:
            raise FormatError(
                f"{where}: expected {3 * n_points} numbers for {n_points} key points, found "
                f"{len(annotation.keypoints)} of the person in image {annotation.image_id}; export it again"
            )
        row[:] = np.array(annotation.keypoints).reshape(-1, 3)
    absent = (values[..., 2] == 0) | (values[..., :2] == 0).all(axis=-1)
    if found.has_flags:
        scores = np.array([np.nan if a.score is None else a.score for a in chosen])
        values[..., 2] = scores[:, None]
    values[absent] = (np.nan, np.nan, 0.0)
    people: dict[int, list[Array]] = {}
    for annotation, points in zip(chosen, values, strict=True):
        people.setdefault(annotation.image_id, []).append(points)
    return people
