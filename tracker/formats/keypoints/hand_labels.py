"""Points that people set in pictures: CVAT's XML for images and for videos, and Label Studio's JSON."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any
from xml.etree import ElementTree

import msgspec
import numpy as np

from tracker.errors import FormatError
from tracker.formats.keypoints.coco_reading import CocoPicture, common_size, images_by_camera
from tracker.formats.keypoints.detections import MAX_PEOPLE, parse_numbers
from tracker.formats.keypoints.picture_table import PicturePerson, PictureTable, table_of_people, text_of
from tracker.formats.number_rows import MAX_NAMES, check_size
from tracker.formats.plain_data import parse_xml
from tracker.formats.text_files import read_json, read_text
from tracker.validation import MAX_FRAMES, MAX_SIDE_PX, Name, check, quoted

Tables = list[tuple[tuple[str, ...], PictureTable]]
"""For each camera the names that it may have, best first, and its key points."""
_Points = dict[str, tuple[float, float]]
"""x, y (pixels) of the points of a person, by their names."""
_People = dict[int, dict[str, _Points]]
"""Points of each person in each image, by its number; people by a name within the image."""
_OWN = "points without a person"
_Percent = Annotated[float, msgspec.Meta(ge=-100, le=200, description="percent of the picture")]
_Side = Annotated[int, msgspec.Meta(ge=1, le=MAX_SIDE_PX, description="a size in pixels")]


class _Value(msgspec.Struct):
    x: _Percent
    y: _Percent
    keypointlabels: Annotated[list[Name], msgspec.Meta(min_length=1, description="the name of the point")]


class _Region(msgspec.Struct):
    type: str = ""
    value: Any = None
    original_width: _Side = 1
    original_height: _Side = 1
    parent: Any = msgspec.field(default=None, name="parentID")


class _Annotated(msgspec.Struct):
    result: list[_Region] = []
    was_cancelled: bool = False


class _Task(msgspec.Struct):
    data: dict[str, Any]
    annotations: list[_Annotated] = []


def read_label_studio(path: Path) -> Tables:
    """Read a JSON export of Label Studio; points with a common box are of one person.

    Raises:
        FormatError: the file is malformed, or has no points.
    """
    where = f"Label Studio file {path}"
    tasks = check(read_json(path, text_of("Label Studio")), list[_Task], where, FormatError)
    images, people = [], _People()
    for i, task in enumerate(tasks):
        name = next((v for v in task.data.values() if isinstance(v, str) and "." in v), "")
        regions = [r for a in task.annotations if not a.was_cancelled for r in a.result if r.type == "keypointlabels"]
        size = (regions[0].original_width, regions[0].original_height) if regions else (0, 0)
        images.append(CocoPicture(i, name.rpartition("=")[2], *size))
        for region in regions:
            value = check(region.value, _Value, where, FormatError)
            # Shares count from the border of the picture, whose first pixel has its centre at 0.
            place = tuple(s * share / 100 - 0.5 for s, share in zip(size, (value.x, value.y), strict=True))
            person = people.setdefault(i, {}).setdefault(str(region.parent or _OWN), {})
            _add(person, value.keypointlabels[0], (place[0], place[1]), where)
    return _tables(images, people, where)


def is_label_studio(data: Any) -> bool:
    """Return whether plain data of a JSON file are tasks of Label Studio."""
    return isinstance(data, list) and bool(data) and isinstance(data[0], dict) and {"data", "annotations"} <= {*data[0]}


def read_cvat(path: Path) -> Tables:
    """Read an XML export of CVAT, for images or for videos; single points of a picture are of one person.

    Raises:
        FormatError: the file is malformed, or has no points.
    """
    where, kind = f"CVAT file {path}", text_of("CVAT")
    root = parse_xml(read_text(path, kind), str(path), kind)
    width, height = (_whole(root.findtext(f".//original_size/{side}") or "0", where) for side in ("width", "height"))
    images, people = list[CocoPicture](), _People()
    for i, element in enumerate(root.iter("image")):
        own_width, own_height = (_whole(element.get(side, "0"), where) for side in ("width", "height"))
        images.append(CocoPicture(i, element.get("name", ""), own_width, own_height))
        for k, shape in enumerate(element):
            _add_shape(people.setdefault(i, {}), shape, str(k), shape.get("label", ""), where)
    for track in root.iter("track"):
        for shape in track:
            frame = _whole(shape.get("frame", "-1"), where)
            if shape.get("outside") != "1":
                _add_shape(people.setdefault(frame, {}), shape, track.get("id", ""), track.get("label", ""), where)
    if not images:
        images = [CocoPicture(n, "", width, height) for n in sorted(people)]
    return _tables(images, people, where)


def is_cvat(head: Sequence[str]) -> bool:
    """Return whether the first lines of a file are those of CVAT's XML."""
    return "<annotations>" in "".join(head)


def _add_shape(people: dict[str, _Points], shape: ElementTree.Element, person: str, label: str, where: str) -> None:
    """Add a skeleton, or a single point whose label is its name; other shapes are left out."""
    if shape.tag == "skeleton":
        for point in shape.iter("points"):
            if point.get("outside") != "1":
                _add(people.setdefault(person, {}), point.get("label", ""), _place(point, where), where)
    elif shape.tag == "points":
        _add(people.setdefault(_OWN, {}), label, _place(shape, where), where)


def _add(points: _Points, name: str, place: tuple[float, float], where: str) -> None:
    if name in points:
        advice = "label several people as skeletons or in boxes"
        raise FormatError.mismatch(where, "each point of a person once", f"{quoted(name)} twice in a picture", advice)
    points[name] = place


def _place(point: ElementTree.Element, where: str) -> tuple[float, float]:
    text = point.get("points", "")
    if text.count(",") != 1 or "nan" in text.lower():
        raise FormatError(f"{where}: expected x and y of a point, found {quoted(text)}; label points one by one")
    x, y = parse_numbers(text.split(","), where)
    return x, y


def _whole(text: str, where: str) -> int:
    if not text.isascii() or not text.isdigit() or len(text) > len(str(MAX_FRAMES)):
        raise FormatError(f"{where}: expected a whole number of at most {MAX_FRAMES}, found {quoted(text)}; correct it")
    return int(text)


def _tables(images: Sequence[CocoPicture], people: Mapping[int, Mapping[str, _Points]], where: str) -> Tables:
    """Return the points of each camera; pictures without any are left out."""
    names = tuple(dict.fromkeys(n for some in people.values() for points in some.values() for n in points))
    most = max(map(len, people.values()), default=0)
    if not names or len(names) > MAX_NAMES or most > MAX_PEOPLE or not all(names):
        expected = f"points with names of up to {MAX_PEOPLE} people in a picture"
        advice = "label key points or skeletons"
        raise FormatError.mismatch(where, expected, f"{most} people" if names else "none", advice)
    check_size((len(people), most, len(names), 3), where)
    out = []
    for labels, own in images_by_camera([i for i in images if people.get(int(i.id))], where).items():
        size = common_size(own.values(), where)
        seen = {n: [_person(points, names) for points in people[int(image.id)].values()] for n, image in own.items()}
        out.append((labels, table_of_people(seen, where, names, size=size, is_by_hand=True)))
    return out


def _person(points: _Points, names: Sequence[str]) -> PicturePerson:
    values = np.array([points.get(name, (np.nan, np.nan)) for name in names])
    return PicturePerson(np.column_stack([values, np.where(np.isnan(values[:, 0]), 0.0, np.nan)]))
