"""Calibrations of sessions, in the TOML layout of anipose and Pose2Sim, in metres.

One section per camera: `name`, `size` (width, height), `matrix` (3x3), `distortions` (OpenCV's order), `rotation`
(Rodrigues vector, or a 3x3 matrix) and `translation` with `X_camera = R X_world + t`, and `fisheye`: with true, the
distortions are k1 to k4 of OpenCV's equidistant model. A section `metadata` is not a camera. Foreign files, which may
say the same in other words and units, are rewritten to this layout (`tracker.formats.calibrations`), so that all are
checked by one declaration.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias, get_args

import msgspec
import numpy as np
import tomli_w
from msgspec import Meta

from tracker.errors import CalibrationError
from tracker.files import write_text_atomic
from tracker.formats.text_files import TextKind, parse_toml, read_text
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera, coefficient_counts, count_words
from tracker.geometry.lengths import METRES_BY_WORD
from tracker.validation import MAX_NUMBER, MAX_SIDE_PX, ROUNDING, FileStem, Number, Vector, check, quoted

Units = Literal["m", "cm", "mm"]
METRES = {unit: METRES_BY_WORD[unit] for unit in get_args(Units)}
"""Metres per unit."""

FOUR_DIGITS = 1e-3
"""Error of a rotation matrix or a unit quaternion that is printed with four digits."""
_MAX_TURN_RAD = 2 * np.pi + ROUNDING
"""Longest Rodrigues vector: programs write at most half a turn, and optimizers stay within one."""
MAX_OFFSET = 0.25
"""Distance of a principal point from the middle, as a share of the side of the picture: lenses are mounted in the
middle, and pictures are seldom cropped to a half."""

_Pixels: TypeAlias = Annotated[float, Meta(ge=1, le=MAX_SIDE_PX, multiple_of=1)]
_Size: TypeAlias = Annotated[
    tuple[_Pixels, _Pixels], Meta(description="width and height in whole pixels, from 1 to 32767,")
]
_Focal: TypeAlias = Annotated[float, Meta(ge=1, le=MAX_NUMBER)]
_Zero: TypeAlias = Annotated[float, Meta(ge=0, le=0)]
_One: TypeAlias = Annotated[float, Meta(ge=1, le=1)]
_Rodrigues: TypeAlias = Annotated[
    tuple[Number, Number, Number], Meta(description="a Rodrigues vector of 3 values or a 3x3 matrix")
]
_RotationMatrix: TypeAlias = Annotated[
    tuple[Vector, Vector, Vector], Meta(description="a Rodrigues vector of 3 values or a 3x3 matrix")
]


class _CameraSection(msgspec.Struct):
    """The section of one camera; it may have other keys besides."""

    size: _Size | None
    matrix: Annotated[
        tuple[tuple[_Focal, Number, Number], tuple[_Zero, _Focal, Number], tuple[_Zero, _Zero, _One]],
        Meta(description="[[fx, skew, cx], [0, fy, cy], [0, 0, 1]] with positive fx and fy"),
    ]
    rotation: list[Any]
    """`_Rodrigues` or `_RotationMatrix`."""
    translation: Vector
    distortions: list[Number] = []
    name: FileStem | None = None
    fisheye: bool = False

    def __post_init__(self) -> None:
        if len(self.distortions) not in coefficient_counts(self.fisheye):
            raise ValueError(
                f"expected {count_words(self.fisheye)} values as 'distortions', found {len(self.distortions)}"
            )


@dataclass(frozen=True, eq=False)
class CameraEntry:
    """A calibrated camera whose image size may be unknown."""

    name: str
    size: tuple[int, int] | None
    """Image width and height, px; None if the file does not state it."""
    K: Array
    """Pinhole matrix, (3, 3), px."""
    distortion: Array
    """As in `Camera`."""
    T_world_camera: Array
    """Pose, (4, 4), metres."""
    fisheye: bool = False
    """As in `Camera`."""

    def eccentricity(self, size: tuple[int, int]) -> float:
        """Return how far the principal point lies from the middle of pictures of a size, as a share of their sides."""
        return float(np.abs((self.K[:2, 2] + 0.5) / np.array(size) - 0.5).max())

    def camera(self, footage_size: tuple[int, int] | None = None) -> Camera:
        """Return the camera; its size is that of the footage if the file does not state one.

        Raises:
            CalibrationError: the size is unknown, or the principal point lies far from the middle of the footage.
        """
        size = self.size or footage_size
        if size is None:
            advice = "add the width and height of the pictures"
            expected = "the key 'size' in the calibration"
            raise CalibrationError.mismatch(f"camera '{self.name}'", expected, "none", advice)
        if self.size is None and self.eccentricity(size) > MAX_OFFSET:
            other = f"is not that of footage of {size[0]}x{size[1]} pixels; calibrate at the size of the footage"
            point = f"and its principal point {self.K[0, 2]:.0f}, {self.K[1, 2]:.0f} {other}"
            raise CalibrationError(f"camera '{self.name}': the calibration states no image size, {point}")
        return Camera(self.name, size, self.K, self.distortion, self.T_world_camera, self.fisheye)


def read_entry(section: str, data: Any, where: str, metres_per_unit: float) -> CameraEntry:
    """Check the section of one camera.

    Args:
        section: its name in the file, which is the camera's unless `data` has another.
        data: keys and values of the anipose layout.
        where: names the file in messages.
        metres_per_unit: of the translation.

    Raises:
        CalibrationError: it describes no possible camera.
    """
    where = f"{where}, camera {quoted(section)}"
    row: _CameraSection = check(data, _CameraSection, where, CalibrationError)
    name = check(section, FileStem, where, CalibrationError) if row.name is None else row.name
    translation = np.array(row.translation) * metres_per_unit
    T_camera_world = rigid.transform(_rotation(row.rotation, where), translation)
    size = None if row.size is None else (int(row.size[0]), int(row.size[1]))
    K, distortion = np.array(row.matrix), np.array(row.distortions, dtype=np.float64)
    return CameraEntry(name, size, K, distortion, rigid.inverse(T_camera_world), row.fisheye)


def _rotation(value: list[Any], where: str) -> Array:
    """Convert a Rodrigues vector, or a matrix that is a rotation within rounding, to a rotation matrix (3, 3)."""
    is_matrix = any(isinstance(row, list) for row in value)
    rotation = np.array(
        check(value, _RotationMatrix if is_matrix else _Rodrigues, f"{where}, rotation", CalibrationError)
    )
    if rotation.shape == (3,):
        if (angle := float(np.linalg.norm(rotation))) > _MAX_TURN_RAD:
            found = f"one of length {angle:.4g}, more than a turn (6.28), as of degrees or of angles about x, y and z"
            advice = "rewrite the rotations as 3x3 matrices"
            raise CalibrationError.mismatch(where, "a Rodrigues vector in radians", found, advice)
        return rigid.so3_exp(rotation)
    error = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    determinant = float(np.linalg.det(rotation))
    if error > FOUR_DIGITS or determinant < 0:
        found = f"rows off by {error:.2g} and determinant {determinant:.3g}"
        here = f"{where}: 'rotation' is not a rotation"
        raise CalibrationError.mismatch(here, "orthonormal rows and determinant 1", found, "calibrate again")
    # Use the nearest rotation: a rounded matrix would shear what it maps.
    U, _, V = np.linalg.svd(rotation)
    return U @ V


def check_names(entries: Sequence[CameraEntry], where: str) -> None:
    """Check that each camera has a name of its own.

    Raises:
        CalibrationError: two have one name.
    """
    names = [c.name for c in entries]
    if twice := sorted({n for n in names if names.count(n) > 1}):
        raise CalibrationError(f"{where}: two cameras are named '{twice[0]}'; give each its own name")


KIND = TextKind("calibration", 4_000_000, CalibrationError)
"""A calibrated camera takes 1 to 2 kB, and the largest rig known has 521 (CMU Panoptic)."""


def read_calibration(path: str | Path) -> tuple[Camera, ...]:
    """Read the cameras of a session's calibration, in metres and in the order of its sections.

    Args:
        path: the TOML file.

    Raises:
        CalibrationError: the file is missing or malformed, or describes impossible cameras.
    """
    where = f"calibration {path}"
    sections = _sections(parse_toml(read_text(Path(path), KIND), str(path), KIND), where)
    entries = tuple(read_entry(name, section, where, 1.0) for name, section in sections.items())
    check_names(entries, where)
    return tuple(entry.camera() for entry in entries)


def write_calibration(path: str | Path, cameras: Sequence[Camera]) -> None:
    """Write cameras, in metres. `read_calibration` reads them back to 12 digits and in the same order."""
    write_text_atomic(Path(path), format_calibration(cameras))


def format_calibration(cameras: Sequence[Camera]) -> str:
    """Format cameras as `write_calibration` writes them."""
    data: dict[str, Any] = {}
    for c in cameras:
        size = [float(side) for side in c.size]
        data[c.name] = {"name": c.name, **anipose_section(c), "size": size, "fisheye": c.fisheye}
    return tomli_w.dumps({**data, "metadata": {"adjusted": False, "error": 0.0}})


def anipose_section(camera: Camera) -> dict[str, Any]:
    """Return a camera in anipose's keys."""
    return {
        "size": list(camera.size),
        "matrix": camera.K.tolist(),
        "distortions": camera.distortion.tolist(),
        "rotation": rigid.so3_log(camera.T_camera_world[:3, :3]).tolist(),
        "translation": camera.T_camera_world[:3, 3].tolist(),
    }


def _sections(data: dict[str, Any], where: str) -> dict[str, Any]:
    """Return the sections of the cameras by name.

    Raises:
        CalibrationError: there are none, or keys that belong to no camera.
    """
    sections = {name: section for name, section in data.items() if name.lower() != "metadata"}
    if not sections:
        advice = "export it in the anipose or Pose2Sim layout"
        raise CalibrationError.mismatch(where, "one section per camera, such as [cam01]", "none", advice)
    for name, section in sections.items():
        if not isinstance(section, dict):
            raise CalibrationError.mismatch(where, "sections of cameras", f"the lone key {quoted(name)}", "remove it")
    return sections
