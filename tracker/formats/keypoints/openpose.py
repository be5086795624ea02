"""OpenPose JSON: one file for each picture with the key points of its people, as Pose2Sim writes them too.

`people` is a list, empty where nobody was found; each has `pose_keypoints_2d`, a flat list of x, y, confidence in
pixels of the picture. 0, 0, 0 is an absent point. Files are named `CAMERA_000000000012_keypoints.json`.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import msgspec
import numpy as np

from tracker.errors import FormatError
from tracker.formats.keypoints.picture_table import PicturePerson, text_of
from tracker.formats.text_files import read_json
from tracker.geometry.arrays import Array, IntArray
from tracker.validation import Number, check

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
