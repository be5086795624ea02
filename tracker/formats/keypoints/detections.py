"""Key points of detectors whose files need no more than a function: OpenPose, EasyMocap, mmpose, SLEAP's CSV, YOLO.

OpenPose, and Pose2Sim alike, has one JSON file for each picture: `people` is a list, empty where nobody was found; each
has `pose_keypoints_2d`, a flat list of x, y, confidence in pixels of the picture. 0, 0, 0 is an absent point. Files are
named `CAMERA_000000000012_keypoints.json`. Files of one picture have no number of their own: it is in their name.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import msgspec
import numpy as np

from tracker.errors import FormatError
from tracker.formats.joint_maps import joint_maps_of_size
from tracker.formats.keypoints.picture_table import PicturePerson, PictureTable, table_of_people, text_of, triples
from tracker.formats.number_rows import MAX_NAMES, TableLine, not_a_number, read_delimited
from tracker.formats.text_files import read_json, read_lines
from tracker.geometry.arrays import Array, IntArray
from tracker.validation import MAX_FRAMES, MAX_NUMBER, Name, Number, check

_KIND = text_of("OpenPose")
MAX_PEOPLE = 100
"""Largest number of people in a picture: OpenPose finds 127 at most; arrays have room for the most of any."""


class _Person(msgspec.Struct):
    pose_keypoints_2d: list[Number] = []
    person_id: Any = None

    @property
    def track(self) -> str:
        """Name of a person who is followed from picture to picture; empty without one. OpenPose itself writes -1."""
        number = self.person_id[0] if isinstance(self.person_id, list) and self.person_id else None
        return str(number) if isinstance(number, int) and number >= 0 else ""


class _Picture(msgspec.Struct):
    people: Annotated[list[_Person], msgspec.Meta(max_length=MAX_PEOPLE, description=f"up to {MAX_PEOPLE} people")]


def read_openpose(path: Path) -> list[PicturePerson]:
    """Read the key points of the people in a picture; a person without points has an empty array.

    Raises:
        FormatError: the file is malformed, or its numbers are not triples.
    """
    where = f"OpenPose file {path}"
    data: Any = read_json(path, _KIND)
    if isinstance(data, Mapping) and "people" not in data:
        raise FormatError(f"{where}: expected the key 'people', found {', '.join(list(map(str, data))[:5]) or 'none'}")
    found = []
    for person in check(data, _Picture, where, FormatError).people:
        if len(person.pose_keypoints_2d) % 3:
            expected = "x, y and confidence of each point in 'pose_keypoints_2d'"
            raise FormatError.mismatch(where, expected, f"{len(person.pose_keypoints_2d)} numbers")
        values = np.array(person.pose_keypoints_2d, dtype=np.float64).reshape(-1, 3)
        values[(values[:, :2] == 0).all(axis=1)] = (np.nan, np.nan, 0.0)
        found.append(PicturePerson(values, person.track))
    return found


class OpenPosePerson(NamedTuple):
    """A person in a picture."""

    person: int
    """Number of the person."""
    points_px: Array
    """Its points in the order of the skeleton, (n, 2); NaN without one."""
    confidence: Array
    """(n,), from 0 to 1."""
    visibility: IntArray
    """0 for a point that is not in the picture, 1 for one that is occluded, 2 for one that is visible, (n,)."""


def file_name(camera: str, picture: int) -> str:
    """Return the name of the file of a picture of a camera, counted from 0, as OpenPose gives it."""
    return f"{camera}_{picture:012d}_keypoints.json"


def write_openpose(path: Path, people: Sequence[OpenPosePerson]) -> None:
    """Write the people of a picture.

    Raises:
        OSError: the file cannot be written.
    """
    path.write_bytes(msgspec.json.encode({"version": 1.3, "people": [_person_row(p) for p in people]}))


def _person_row(person: OpenPosePerson) -> dict[str, Any]:
    is_there = (person.visibility > 0) & np.isfinite(person.points_px).all(axis=-1)
    rows = np.column_stack([person.points_px, person.confidence])
    rows[~is_there] = 0.0
    others = ("face_keypoints_2d", "hand_left_keypoints_2d", "hand_right_keypoints_2d", "pose_keypoints_3d")
    return {
        "person_id": [person.person],
        "pose_keypoints_2d": np.round(rows, 3).ravel().tolist(),
        "pose_visibility": np.where(is_there, person.visibility, 0).tolist(),
        **{key: [] for key in (*others, "face_keypoints_3d", "hand_left_keypoints_3d", "hand_right_keypoints_3d")},
    }


_Place = tuple[Number, Number]
_Sure = tuple[Number, Number, Number]
_FrameNumber = Annotated[int, msgspec.Meta(ge=0, le=MAX_FRAMES, description=f"a whole number of at most {MAX_FRAMES}")]
_OF_POINTS = msgspec.Meta(max_length=MAX_NAMES, description=f"up to {MAX_NAMES} points")
_OF_PEOPLE = msgspec.Meta(max_length=MAX_PEOPLE, description=f"up to {MAX_PEOPLE} people")
_BOX = ("class", "x", "y", "width", "height")
"""First numbers of a line of YOLO."""


class _Annot(msgspec.Struct):
    keypoints: Annotated[list[_Sure], _OF_POINTS]


class _EasyMocapPicture(msgspec.Struct):
    annots: Annotated[list[_Annot], _OF_PEOPLE]


class _Instance(msgspec.Struct):
    keypoints: Annotated[list[_Place], _OF_POINTS]
    keypoint_scores: list[Number]


class _Frame(msgspec.Struct):
    frame_id: _FrameNumber
    instances: Annotated[list[_Instance], _OF_PEOPLE]


class _MetaInfo(msgspec.Struct):
    keypoint_id2name: dict[str, Name] = {}


class _MmposeVideo(msgspec.Struct):
    instance_info: list[_Frame]
    meta_info: _MetaInfo = msgspec.field(default_factory=_MetaInfo)


def read_easymocap(path: Path) -> list[PicturePerson]:
    """Read the people in a picture, as EasyMocap annotates them.

    Raises:
        FormatError: the file is malformed.
    """
    found = check(read_json(path, text_of("EasyMocap")), _EasyMocapPicture, f"EasyMocap file {path}", FormatError)
    return [PicturePerson(triples(person.keypoints)) for person in found.annots]


def read_mmpose_picture(path: Path) -> list[PicturePerson]:
    """Read the people in a picture, as mmpose's inferencer writes those of images.

    Raises:
        FormatError: the file is malformed.
    """
    where = f"mmpose file {path}"
    found = check(read_json(path, text_of("mmpose")), Annotated[list[_Instance], _OF_PEOPLE], where, FormatError)
    return [_mmpose_person(person, where) for person in found]


def read_mmpose_video(path: Path) -> PictureTable:
    """Read the pictures of a video, as mmpose's inferencer and its demo write them.

    Raises:
        FormatError: the file is malformed, or has a picture twice.
    """
    where, data = f"mmpose file {path}", read_json(path, text_of("mmpose"))
    found = check({"instance_info": data} if isinstance(data, list) else data, _MmposeVideo, where, FormatError)
    people = {f.frame_id: [_mmpose_person(person, where) for person in f.instances] for f in found.instance_info}
    if len(people) < len(found.instance_info):
        raise FormatError(f"{where}: expected each frame_id once, found one twice; export it again")
    by_number = found.meta_info.keypoint_id2name
    names = tuple(by_number.get(str(i), "") for i in range(len(by_number)))
    if not all(names) or len(set(names)) < len(names):
        raise FormatError(f"{where}: expected a name for each number in 'keypoint_id2name', found others; correct it")
    return table_of_people(people, where, names)


def is_mmpose_video(data: Any) -> bool:
    """Return whether plain data of a JSON file are pictures of a video by mmpose."""
    frames = data.get("instance_info") if isinstance(data, dict) else data
    return isinstance(frames, list) and _first_has(frames, "instances", "frame_id")


def is_mmpose_picture(data: Any) -> bool:
    """Return whether plain data of a JSON file are people in a picture by mmpose."""
    return isinstance(data, list) and _first_has(data, "keypoints", "keypoint_scores")


def read_yolo(path: Path) -> list[PicturePerson]:
    """Read the people in a picture, a line each, in shares of its width and height; a last score or track is left out.

    Raises:
        FormatError: the file is malformed.
    """
    found = []
    for number, line in enumerate(read_lines(path, text_of("YOLO")), 1):
        if line.strip():
            where = f"YOLO file {path}, line {number}"
            values = parse_numbers(line.split(), where)
            if not 0 < (len(values) - len(_BOX)) // 3 <= MAX_NAMES or len(found) >= MAX_PEOPLE:
                expected = f"a box and x, y, visibility of each point, of up to {MAX_PEOPLE} people"
                raise FormatError.mismatch(where, expected, f"{len(values)} numbers", "export key points")
            found.append(PicturePerson(_yolo_points(np.array(values), where)))
    return found


def _yolo_points(values: Array, where: str) -> Array:
    """Return points with a visibility, or without one if a skeleton has that many, and more of them are in the box."""
    box, values = np.split(values[1:], [len(_BOX) - 1])
    n_with, n_without = len(values) // 3, (len(values) - (values[-1] >= 1)) // 2  # a track counts from 1
    with_, without = np.reshape(values[: 3 * n_with], (-1, 3)), np.reshape(values[: 2 * n_without], (-1, 2))
    inside = [np.mean(np.abs(p[:, :2] - box[:2]) <= box[2:] / 2) for p in (with_, without)]
    if joint_maps_of_size(n_without) and inside[1] >= inside[0] and values.any():
        if inside[1] == inside[0] and joint_maps_of_size(n_with):
            found = f"those of {n_with} points with a visibility or {n_without} without"
            advice = "export visibilities, and boxes that are around the points"
            raise FormatError.mismatch(where, "numbers of one known skeleton", found, advice)
        return triples(without.tolist(), np.ones(n_without).tolist())
    return triples(with_.tolist())


def is_yolo(head: Sequence[str]) -> bool:
    """Return whether the first lines of a file are people of YOLO: a class, a box and points, in shares."""
    rows = [line.split() for line in head if line.strip()]
    try:
        values = np.array([[float(cell) for cell in row[: len(_BOX)]] for row in rows])
    except ValueError:
        return False
    is_complete = values.ndim == 2 and values.shape[1] == len(_BOX) and all(len(row) > 2 * len(_BOX) for row in rows)
    return is_complete and bool(((values[:, 1:] >= 0) & (values[:, 1:] <= 1)).all() and (values[:, 0] % 1 == 0).all())


def read_sleap_csv(path: Path) -> PictureTable:
    """Read an analysis that SLEAP exported as CSV: a row for each person in each picture.

    Raises:
        FormatError: the file is malformed.
    """
    where = f"SLEAP file {path}"
    lines = (row for row in read_delimited(path, text_of("SLEAP"), ",").rows if row.cells)
    head = next(lines, TableLine(1, [])).cells
    names = tuple(cell.removesuffix(".x") for cell in head if cell.endswith(".x"))
    columns = [f"{name}{part}" for name in names for part in (".x", ".y", ".score")]
    if not 0 < len(names) <= MAX_NAMES or len(set(head)) < len(head) or {*columns, "track", "frame_idx"} - set(head):
        expected = "track, frame_idx and NAME.x, NAME.y, NAME.score of each point, each once"
        raise FormatError.mismatch(where, expected, ", ".join(head)[:60])
    at = [head.index(c) for c in ("frame_idx", *columns)]
    people: dict[int, list[PicturePerson]] = {}
    for number, cells in lines:
        here = f"{where}, line {number}"
        if len(cells) != len(head):
            raise FormatError(f"{here}: expected {len(head)} columns, found {len(cells)}; export it again")
        picture, *values = parse_numbers([cells[i] or "nan" for i in at], here)
        if not (picture % 1 == 0 and 0 <= picture <= MAX_FRAMES):
            raise FormatError(f"{here}: expected a whole number as frame_idx, found {picture:g}; export it again")
        points = np.reshape(values, (-1, 3))
        points[np.isnan(points).any(axis=1)] = (np.nan, np.nan, 0.0)
        people.setdefault(int(picture), []).append(PicturePerson(points, cells[head.index("track")][:200]))
    if not people:
        raise FormatError(f"{where} has no rows of numbers; export it again")
    return table_of_people(people, where, names, is_of_video=True)


def is_sleap_csv(head: Sequence[str]) -> bool:
    """Return whether the first lines of a CSV are those of SLEAP's analysis."""
    return bool(head) and head[0].startswith("track,frame_idx,")


def _mmpose_person(person: _Instance, where: str) -> PicturePerson:
    if len(person.keypoints) != len(person.keypoint_scores):
        expected = f"a score for each of {len(person.keypoints)} points"
        raise FormatError.mismatch(where, expected, len(person.keypoint_scores))
    return PicturePerson(triples(person.keypoints, person.keypoint_scores))


def _first_has(rows: list[Any], *keys: str) -> bool:
    return bool(rows) and isinstance(rows[0], dict) and rows[0].keys() >= {*keys}


def parse_numbers(cells: Sequence[str], where: str) -> list[float]:
    """Return numbers of a table; `nan` stands for a missing one.

    Raises:
        FormatError: one is none, or too large; `where` names its place.
    """
    out = []
    for cell in cells:
        try:
            out.append(float(cell))
        except ValueError as error:
            raise FormatError(f"{where}: {not_a_number(cell)}") from error
    if wrong := next((value for value in out if abs(value) > MAX_NUMBER), None):
        raise FormatError(f"{where}: expected numbers within {MAX_NUMBER:g}, found {wrong:g}; correct it")
    return out
