"""OpenPose's JSON: one file for each picture, with the 25 points (BODY_25) of each person in it.

Pixel centres lie at integers. A point is x, y and a confidence from 0 to 1; all are 0 for a point that is not there.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from tracker.formats.joint_maps import BODY_25
from tracker.geometry.arrays import Array, IntArray

POINTS = (
    "Nose", "Neck", "RShoulder", "RElbow", "RWrist", "LShoulder", "LElbow", "LWrist", "MidHip", "RHip", "RKnee",
    "RAnkle", "LHip", "LKnee", "LAnkle", "REye", "LEye", "REar", "LEar", "LBigToe", "LSmallToe", "LHeel", "RBigToe",
    "RSmallToe", "RHeel",
)  # fmt: skip
"""BODY_25 in OpenPose's order."""
COUNTERPARTS: Mapping[str, tuple[str, ...]] = {
    **{point: (joint,) for joint, point in BODY_25.markers.items() if point in POINTS},
    "MidHip": ("left_hip", "right_hip"),
    **{f"{side[0].upper()}Heel": (f"{side}_heel",) for side in ("left", "right")},
    **{f"{side[0].upper()}BigToe": (f"{side}_toe",) for side in ("left", "right")},
}
"""Points of the body whose mean a point is. No body has a nose, eyes, ears and small toes."""


class OpenPosePerson(NamedTuple):
    """A person in a picture."""

    person: int
    """Number of the person."""
    points_px: Array
    """Its points in the order of `POINTS`, (25, 2); NaN without one."""
    confidence: Array
    """(25,), from 0 to 1."""
    visibility: IntArray
    """0 for a point that is not in the picture, 1 for one that is occluded, 2 for one that is visible, (25,)."""


def file_name(camera: str, picture: int) -> str:
    """Return the name of the file of a picture of a camera, counted from 0, as OpenPose gives it."""
    return f"{camera}_{picture:012d}_keypoints.json"


def write_openpose(path: Path, figures: Sequence[OpenPosePerson]) -> None:
    """Write the people of a picture.

    Raises:
        OSError: the file cannot be written.
    """
    path.write_bytes(msgspec.json.encode({"version": 1.3, "people": [_person(f) for f in figures]}))


def _person(figure: OpenPosePerson) -> dict[str, Any]:
    is_there = (figure.visibility > 0) & np.isfinite(figure.points_px).all(axis=-1)
    rows = np.column_stack([figure.points_px, figure.confidence])
    rows[~is_there] = 0.0
    others = ("face_keypoints_2d", "hand_left_keypoints_2d", "hand_right_keypoints_2d", "pose_keypoints_3d")
    return {
        "person_id": [figure.person],
        "pose_keypoints_2d": np.round(rows, 3).ravel().tolist(),
        "pose_visibility": np.where(is_there, figure.visibility, 0).tolist(),
        **{key: [] for key in (*others, "face_keypoints_3d", "hand_left_keypoints_3d", "hand_right_keypoints_3d")},
    }
