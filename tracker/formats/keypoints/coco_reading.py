"""Read key points of people from COCO: a dataset with images and categories, or a list of results, as AlphaPose has.

Points are replaced in JSON of COCO and of OpenPose, and all other bytes stay.

v of a key point is 0, 1 or 2 in datasets, which is no confidence; detectors write theirs there, or as the score of a
person. Images are matched to cameras by `camera`, as this program writes it, or by the folder of their file name.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import Annotated, Any, Literal, NamedTuple

import msgspec
import numpy as np

from tracker.errors import FormatError
from tracker.formats.keypoints.picture_names import picture_names
from tracker.formats.keypoints.picture_table import Changes, PicturePerson, PictureTable, table_of_people, text_of
from tracker.formats.number_rows import MAX_NAMES, check_size
from tracker.formats.text_files import read_json
from tracker.formats.text_patch import PIXEL_DECIMALS, Span, SpanList, TextPatch, number_like
from tracker.geometry.arrays import Array
from tracker.validation import MAX_FRAMES, MAX_SIDE_PX, Name, Number, check

_FrameNumber = Annotated[int, msgspec.Meta(ge=0, le=MAX_FRAMES, description=f"a whole number of at most {MAX_FRAMES}")]
_Side = Annotated[int, msgspec.Meta(ge=0, le=MAX_SIDE_PX, description="a size in pixels")]


class CocoPicture(msgspec.Struct):
    """An image of a dataset."""

    id: _FrameNumber | Name
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
    image_id: _FrameNumber | Name
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
    if isinstance(data, list):
        return all(isinstance(a, dict) and "image_id" in a for a in data)
    return isinstance(data, dict) and "annotations" in data and "images" in data


def is_alphapose(data: Any) -> bool:
    """Return whether plain data of a JSON file is a list of results for names of images."""
    return isinstance(data, list) and bool(data) and is_coco(data) and isinstance(data[0]["image_id"], str)


def holds(data: Any, key: Literal["keypoints", "segmentation"]) -> bool:
    """Return whether an annotation in plain data of a COCO file has key points or a segmentation."""
    annotations = data.get("annotations") if isinstance(data, dict) else data
    return isinstance(annotations, list) and any(isinstance(a, dict) and a.get(key) for a in annotations)


class PictureDataset(NamedTuple):
    """The content of a file, by picture, and what of it are key points of people."""

    dataset: _Dataset
    images: Mapping[tuple[str, ...], Mapping[int, CocoPicture]]
    """The images of each camera by their numbers. The key has the names that it may have, best first."""
    category: int = 0
    """The category of people with key points."""
    names: tuple[str, ...] = ()
    """Names of their points; empty if the file has none."""
    notes: tuple[str, ...] = ()

    @property
    def annotations(self) -> list[_Annotation]:
        """The annotations of people with key points."""
        return [a for a in self.dataset.annotations if a.category_id == self.category and a.keypoints]

    @property
    def has_flags(self) -> bool:
        """Whether the third number of all points is a flag of visibility, not a confidence."""
        return all(v in (0, 1, 2) for a in self.annotations for v in a.keypoints[2::3])


def read_pictures(path: Path, program: str = "COCO") -> PictureDataset:
    """Read a dataset or a list of results, of key points or segmentations; `program` names it in messages.

    Raises:
        FormatError: the file is malformed.
    """
    where = f"{program} file {path}"
    data = read_json(path, text_of(program))
    if isinstance(data, list):
        annotations = check(data, list[_Annotation], where, FormatError)
        ids = dict.fromkeys(a.image_id for a in annotations)
        dataset = _Dataset([CocoPicture(i, i if isinstance(i, str) else "") for i in ids], annotations)
    else:
        dataset = check(data, _Dataset, where, FormatError)
    return PictureDataset(dataset, images_by_camera(dataset.images, where))


def images_by_camera(images: Sequence[CocoPicture], where: str) -> dict[tuple[str, ...], dict[int, CocoPicture]]:
    """Return images by the names that their camera may have, best first, and by number; `where` names the file.

    Raises:
        FormatError: two images are of one picture, or an image has no number.
    """
    by_camera: dict[tuple[str, ...], dict[int, CocoPicture]] = {}
    for image, (labels, number) in zip(images, _places(images, where), strict=True):
        taken = by_camera.setdefault(labels, {})
        if number in taken:
            advice = "give the images numbers or folders of their cameras"
            expected = "one image for each picture of a camera"
            raise FormatError.mismatch(where, expected, quoted_images(taken[number], image), advice)
        taken[number] = image
    return by_camera


def read_dataset(path: Path, program: str = "COCO") -> PictureDataset:
    """Read key points of a dataset or a list of results, without arrays; `program` names it in messages.

    Raises:
        FormatError: the file is malformed, or has no key points.
    """
    found = read_pictures(path, program)
    category, names, notes = _category(found.dataset, f"{program} file {path}")
    if any(a.segmentation for a in found.dataset.annotations):
        notes = (*notes, "key points were taken, and segmentations of the file left out")
    return found._replace(category=category, names=names, notes=notes)


def read_coco(path: Path, program: str = "COCO") -> list[tuple[tuple[str, ...], PictureTable]]:
    """Read a dataset or a list of results; `program` names it in messages.

    Returns:
        For each camera the names that it may have, best first, and its key points.

    Raises:
        FormatError: the file is malformed, or has no key points.
    """
    where, found = f"{program} file {path}", read_dataset(path, program)
    people = _people(found, where)
    n_points = len(found.names) or max((len(p.points) for some in people.values() for p in some), default=0)
    if not n_points:
        raise FormatError(f"{where}: expected key points of people, found none; export them")
    out = []
    for labels, images in found.images.items():
        of_number = {number: people.get(image.id, []) for number, image in images.items()}
        more = {"size": common_size(images.values(), where), "notes": found.notes}
        out.append((labels, table_of_people(of_number, where, found.names, **more)))
    return out


def common_size(images: Iterable[CocoPicture], where: str) -> tuple[int, int] | None:
    """Return width and height of the images of a camera, px; None if none states its size.

    Raises:
        FormatError: they differ; `where` names the file.
    """
    sizes = {(i.width, i.height) for i in images if i.width and i.height}
    if len(sizes) > 1:
        raise FormatError(f"{where}: expected images of one size, found {sorted(sizes)[:3]}; export them apart")
    return next(iter(sizes), None)


def quoted_images(one: CocoPicture, other: CocoPicture) -> str:
    """Return the names of two images for a message."""
    return f"'{one.file_name[-60:]}' and '{other.file_name[-60:]}'"


def _places(images: Sequence[CocoPicture], where: str) -> list[tuple[tuple[str, ...], int]]:
    """Return the names that the camera of each image may have, best first, and the number of the picture.

    Raises:
        FormatError: an image has no number.
    """
    paths = [PurePosixPath(image.file_name.replace("\\", "/")) for image in images]
    by_folder: dict[PurePosixPath, list[int]] = {}
    for i, path in enumerate(paths):
        by_folder.setdefault(path.parent, []).append(i)
    out: list[tuple[tuple[str, ...], int]] = [((), 0)] * len(images)
    for folder, some in by_folder.items():
        folders = [part for part in reversed(folder.parts) if part != "/"]
        for i, named in zip(some, picture_names([paths[i].stem for i in some]), strict=True):
            image = images[i]
            number = image.video_frame if image.video_frame is not None else named.number if named else image.id
            if isinstance(number, str):
                raise FormatError(f"{where}: expected the number of the picture in '{number[:60]}'; name it by number")
            labels = (image.camera, named.label if named else "", *folders)
            out[i] = tuple(label for label in labels if label), number
    return out


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


def _people(found: PictureDataset, where: str) -> dict[int | str, list[PicturePerson]]:
    """Return the people of each image by its id.

    Raises:
        FormatError: people have different numbers of points.
    """
    chosen = found.annotations
    n_points = len(found.names) or len(chosen[0].keypoints) // 3
    wrong = next((a for a in chosen if len(a.keypoints) != 3 * n_points), None)
    if wrong is not None:
        seen = f"{len(wrong.keypoints)} of the person in image {wrong.image_id}"
        raise FormatError.mismatch(where, f"{3 * n_points} numbers for {n_points} key points", seen)
    check_size((len(chosen), n_points, 3), where)
    values = np.array([a.keypoints for a in chosen]).reshape(len(chosen), n_points, 3)
    absent = (values[..., 2] == 0) | (values[..., :2] == 0).all(axis=-1)
    if found.has_flags:
        scores = np.array([np.nan if a.score is None else a.score for a in chosen])
        values[..., 2] = scores[:, None]
    values[absent] = (np.nan, np.nan, 0.0)
    people: dict[int | str, list[PicturePerson]] = {}
    for annotation, points in zip(chosen, values, strict=True):
        people.setdefault(annotation.image_id, []).append(PicturePerson(points, annotation.track))
    return people


def patch_openpose(path: Path, changes: Mapping[int, Changes]) -> bytes:
    """Return the file of a picture with points of some people replaced; numbers are those among people with points.

    Args:
        path: the file, which has been read before.
        changes: of its only camera and row.
    """
    patch = TextPatch(path.read_bytes())
    people = patch.json_spans()["people"]
    numbers = [p["pose_keypoints_2d"].items for p in people.items if "pose_keypoints_2d" in p]
    with_points = [some for some in numbers if some]
    for person, values in changes[0][0]:
        if person < 0:
            patch.append(people, f'{{"person_id": [-1], "pose_keypoints_2d": [{_triples(values, has_flags=False)}]}}')
        else:
            _replace_triples(patch, with_points[person], values, has_flags=False)
    return patch.encoded()


def patch_coco(path: Path, changes: Mapping[int, Changes]) -> bytes:
    """Return a file with points of some people replaced; all other bytes stay, but for the counts of their points.

    In a file with flags of visibility, a point that is replaced keeps its flag, or is visible if it was absent.

    Args:
        path: the file, which has been read before.
        changes: by the number of the camera in the order of `read_coco`, and by row of its table.
    """
    found, patch = read_dataset(path), TextPatch(path.read_bytes())
    spans = patch.json_spans()
    annotations: SpanList = spans if isinstance(spans, SpanList) else spans["annotations"]
    of_image: dict[int | str, list[dict[str, Any]]] = {}
    for annotation, own in zip(found.dataset.annotations, annotations.items, strict=True):
        if annotation.category_id == found.category and annotation.keypoints:
            of_image.setdefault(annotation.image_id, []).append(own)
    has_flags, next_id = found.has_flags, _next_id(annotations, patch)
    for camera, rows in changes.items():
        images = list(found.images.values())[camera]
        numbers = sorted(images)
        for row, people in rows.items():
            image_id = images[numbers[row]].id
            for person, values in people:
                if person < 0:
                    number = None if annotations is spans else next_id
                    patch.append(annotations, _annotation(values, has_flags, image_id, found.category, number))
                    next_id += 1
                    continue
                own = of_image[image_id][person]
                before, after = _replace_triples(patch, own["keypoints"].items, values, has_flags)
                if isinstance(count := own.get("num_keypoints"), tuple) and after != before:
                    patch.replace(count, str(after))
    return patch.encoded()


def _replace_triples(patch: TextPatch, spans: Sequence[Span], values: Array, has_flags: bool) -> tuple[int, int]:
    """Replace x, y, v of a person; return how many points were there before, and how many are now."""
    is_there = [float(patch.old(span)) != 0 for span in spans[2::3]]
    before = sum(is_there)
    for i, (x, y, confidence) in enumerate(values.tolist()):
        if confidence != confidence:
            continue
        *of_place, v_span = spans[3 * i : 3 * i + 3]
        was_there, is_there[i] = is_there[i], confidence > 0
        for span, value in zip(of_place, (x, y), strict=True):
            patch.replace_number(span, value if is_there[i] else 0.0, PIXEL_DECIMALS)
        if has_flags:
            patch.replace(v_span, "0" if not is_there[i] else patch.old(v_span) if was_there else "2")
        else:
            patch.replace_number(v_span, confidence, PIXEL_DECIMALS)
    return before, sum(is_there)


def _triples(values: Array, has_flags: bool) -> str:
    """Return x, y, v of the points of a new person; 0 for absent ones."""
    rows = np.where(values[:, 2:] > 0, values, 0.0)
    cells = [[number_like(cell, "", PIXEL_DECIMALS) for cell in row] for row in rows.tolist()]
    if has_flags:
        cells = [[x, y, "2" if v else "0"] for (x, y, _), v in zip(cells, rows[:, 2], strict=True)]
    return ", ".join(cell for row in cells for cell in row)


def _next_id(annotations: SpanList, patch: TextPatch) -> int:
    """Return a number above those of all annotations."""
    ids = [own.get("id") for own in annotations.items]
    return 1 + max((int(float(patch.old(span))) for span in ids if isinstance(span, tuple)), default=0)


def _annotation(values: Array, has_flags: bool, image_id: int | str, category: int, number: int | None) -> str:
    """Return the annotation of a person who was not found; with a number in a dataset, else in a list of results."""
    known, triples = values[values[:, 2] > 0, :2], _triples(values, has_flags)
    fields = {"image_id": json.dumps(image_id), "category_id": str(category), "keypoints": f"[{triples}]"}
    if number is None:
        fields["score"] = "1.0"
    else:
        low, high = known.min(axis=0), known.max(axis=0)
        box = ", ".join(number_like(x, "", PIXEL_DECIMALS) for x in (*low, *(high - low)))
        area = number_like(float(np.prod(high - low)), "", PIXEL_DECIMALS)
        fields = {"id": str(number)} | fields
        fields |= {"num_keypoints": str(len(known)), "bbox": f"[{box}]", "area": area, "iscrowd": "0"}
    return "{" + ", ".join(f'"{key}": {value}' for key, value in fields.items()) + "}"
