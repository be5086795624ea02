"""Options of an export, and the axes of its files."""

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import up_rotation
from tracker.session.session import Session

AxesName = Literal["calibration", "y-up"]
UnitName = Literal["m", "mm"]
KeypointSet = Literal["all", "coco17", "body"]
PicturesName = Literal["images", "video"]
PixelsName = Literal["original", "undistorted"]
FacesName = Literal["shown", "blurred"]
MeshName = Literal["ply", "obj", "stl", "glb"]


@dataclass(frozen=True)
class ExportOptions:
    """Options of all formats; each format has some of them."""

    axes: AxesName = "calibration"
    """calibration: the world of the session; y-up: y points up from the floor."""
    units: UnitName = "m"
    """Unit of lengths."""
    keypoints: KeypointSet = "all"
    """COCO: the 17 keypoints of people, those of the body model, or both."""
    view: str | None = None
    """Overlay video: name of the camera; None for a grid of all."""
    character: str | None = None
    """Overlay video: body that moves as the person beside the footage, a preset or a file; see `load_character`."""

    pixels: PixelsName = "original"
    """Pixels of points and masks: those of the footage, or without lens distortion, with such pictures and cameras."""
    pictures: PicturesName = "images"
    """Dataset: an image of each exported frame, or the footage as it is."""
    faces: FacesName = "shown"
    """Heads in pictures: as filmed, or blurred; see `tracker.interchange.exports.faces`."""
    mesh: MeshName = "ply"
    """Meshes: format of their files."""
    provenance: bool = False
    """Whether a file beside one that cannot hold it has the provenance of the poses."""

    @property
    def per_metre(self) -> float:
        """Units per metre."""
        return 1000.0 if self.units == "mm" else 1.0


def load_character(text: str) -> BodyModel:
    """Return the body of a character: a preset or the path of a .toml file, and `:METRES` for its height.

    Raises:
        TrackerError: there is no such body, or the height is none.
    """
    name, _, height = text.rpartition(":") if re.search(r":[\d.]+$", text) else (text, "", "")
    try:
        height_m = float(height) if height else None
    except ValueError:
        height_m = np.nan
    if height_m is not None and not 0.3 <= height_m <= 3.0:
        raise TrackerError(
            f"expected a height of 0.3 to 3 metres after the body, found '{text}'; give one as {name}:1.2"
        )
    return load_model(name, height_m)


def file_from_world(session: Session, axes: AxesName) -> Array:
    """Return the transform from the session's world to the axes of a file, (4, 4), metres.

    In y-up axes, y is the height above the floor. A world in which z points up becomes (x, z, -y).
    """
    if axes == "calibration":
        return np.eye(4)
    R_world_up = up_rotation(session.up, session.floor)
    origin_world = np.zeros(3) if session.floor is None else session.floor.origin_world
    y_up = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    return rigid.transform(y_up) @ rigid.inverse(rigid.transform(R_world_up, origin_world))


def up_in_file(session: Session, axes: AxesName) -> Array:
    """Return the unit vector that points up in the axes of a file, (3,)."""
    return file_from_world(session, axes)[:3, :3] @ up_rotation(session.up, session.floor)[:, 2]
