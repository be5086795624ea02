"""COCO keypoints: JSON with images, categories and, for each person in each image, an annotation.

Keypoints are x, y, v triples in the pixels of the image as filmed, with pixel centres at integers. v is 2 for a visible
point, 1 for an occluded one, and 0 (with x = y = 0) for a point outside the image or one that the body does not have.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.files import write_text_atomic
from tracker.geometry.arrays import Array, IntArray

_SIDES = ("left", "right")
PERSON_KEYPOINTS = (
    "nose",
    *(f"{side}_{part}" for part in ("eye", "ear") for side in _SIDES),
    *(f"{side}_{part}" for part in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle") for side in _SIDES),
)
"""The 17 keypoints of COCO's category `person`."""
_LINES = (
    "left_ankle left_knee", "left_knee left_hip", "right_ankle right_knee", "right_knee right_hip",
    "left_hip right_hip", "left_shoulder left_hip", "right_shoulder right_hip", "left_shoulder right_shoulder",
    "left_shoulder left_elbow", "right_shoulder right_elbow", "left_elbow left_wrist", "right_elbow right_wrist",
    "left_eye right_eye", "nose left_eye", "nose right_eye", "left_eye left_ear", "right_eye right_ear",
    "left_ear left_shoulder", "right_ear right_shoulder",
)  # fmt: skip
"""COCO's own lines between them, in its order."""
PERSON_SKELETON = tuple(
    (PERSON_KEYPOINTS.index(one) + 1, PERSON_KEYPOINTS.index(other) + 1) for one, other in map(str.split, _LINES)
)
"""The same lines by the numbers of their points, counted from 1."""


class CocoCategory(msgspec.Struct, frozen=True):
    """A set of keypoints."""

    id: int
    name: str
    keypoints: Sequence[str]
    skeleton: Sequence[tuple[int, int]]
    """Lines between keypoints, counted from 1."""
    supercategory: str = "person"


class CocoImage(msgspec.Struct, frozen=True):
    """A frame of a camera."""

    id: int
    file_name: str
    """`CAMERA/000012.jpg` for frame 12 of a video, counted from 0; the name of the image in a folder of images."""
    width: int
    height: int
    camera: str
    frame: int
    """Frame of the session."""
    video: str
    """Name of the footage."""
    video_frame: int
    """Frame of the footage: that of the session plus the camera's offset."""


class Segmentation(msgspec.Struct, frozen=True):
    """A mask as run lengths, which pycocotools decodes."""

    size: tuple[int, int]
    """Height and width."""
    counts: Sequence[int]
    """Lengths of runs, column by column; the first one is outside of the mask."""


def segmentation(mask: NDArray[np.bool_]) -> Segmentation:
    """Return a mask, (H, W), as run lengths."""
    column_wise = mask.ravel(order="F")
    ends = np.flatnonzero(np.diff(column_wise, prepend=False))
    height, width = mask.shape
    return Segmentation((height, width), np.diff(ends, prepend=0, append=mask.size).tolist())


class CocoAnnotation(msgspec.Struct, frozen=True):
    """A person in an image, by the keypoints of one category."""

    id: int
    image_id: int
    category_id: int
    keypoints: Sequence[float]
    """x, y, v of each keypoint."""
    num_keypoints: int
    """Number of keypoints with v > 0."""
    bbox: tuple[float, float, float, float]
    """x, y, width, height of the whole body within the image, whether occluded or not."""
    area: float
    """Area of the body's silhouette within the image, px^2, whether occluded or not."""
    person: str
    track_id: int
    """Number of the person in the session, from 0."""
    status: str
    calibration: int
    """Revision of the calibration that the pose was made with."""
    earlier_calibration: bool
    """Whether that is another one than that of the file."""
    iscrowd: int = 0
    segmentation: Segmentation | msgspec.UnsetType = msgspec.UNSET
    """Its visible pixels."""


def person_category(id: int) -> CocoCategory:
    """Return COCO's category of people."""
    return CocoCategory(id, "person", PERSON_KEYPOINTS, PERSON_SKELETON)


def body_category(id: int, model: BodyModel) -> CocoCategory:
    """Return the category of all points of a body model, named after it."""
    skeleton = [(model.point_names.index(a) + 1, model.point_names.index(b) + 1) for a, b in model.bones]
    return CocoCategory(id, model.name, model.point_names, skeleton)


def keypoint_triples(
    names: Sequence[str], points_px: Array, visibility: IntArray, wanted: Sequence[str]
) -> list[float]:
    """Return x, y, v of some points by name.

    Args:
        names: of the points given, (n,).
        points_px: (n, 2), original pixels.
        visibility: COCO's v, (n,).
        wanted: names of the keypoints, in order; v = 0 for those not given.
    """
    out: list[float] = []
    for name in wanted:
        v = int(visibility[names.index(name)]) if name in names else 0
        x, y = points_px[names.index(name)] if v else (0.0, 0.0)
        out += [round(float(x), 3), round(float(y), 3), v]
    return out


def write_coco(
    path: str | Path,
    description: str,
    calibration: int,
    categories: Sequence[CocoCategory],
    images: Sequence[CocoImage],
    annotations: Sequence[CocoAnnotation],
) -> None:
    """Write a dataset; `calibration` is the revision of the session's cameras."""
    data: dict[str, Any] = {
        "info": {"description": description, "version": "1.0", "calibration": calibration},
        "licenses": [],
        "categories": categories,
        "images": images,
        "annotations": annotations,
    }
    write_text_atomic(Path(path), msgspec.json.encode(data).decode() + "\n")
