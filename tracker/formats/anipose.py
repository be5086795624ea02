"""Calibrations in the TOML layout of anipose, Pose2Sim and Caliscope.

One section per camera: `name`, `size` (width, height), `matrix` (3x3), `distortions` (OpenCV's order), `rotation`
(Rodrigues vector, or a 3x3 matrix) and `translation` with `X_camera = R X_world + t`, `fisheye`. A section
`metadata` is not a camera. The file does not state whether its lengths are metres or millimetres; the caller does.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

import msgspec
import numpy as np
import tomli_w
from msgspec import Meta

from tracker.errors import CalibrationError
from tracker.files import write_text_atomic
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import DISTORTION_COUNTS, Camera
from tracker.text_files import TextKind, read_toml
from tracker.validation import MAX_SIDE_PX, FileStem, Number, Vector, check, quoted

Units = Literal["m", "mm"]

MAX_STUDIO_M = 100.0
"""A camera read as metres and farther from the origin than this has translations in millimetres."""
MIN_STUDIO_M = 0.05
"""Cameras read as millimetres that are all nearer to the origin than this have translations in metres."""
_ROTATION_TOLERANCE = 1e-3  # a rotation matrix printed with four digits still passes
_KIND = TextKind("calibration", 500_000, CalibrationError)
"""A camera takes about 1 kB."""

_Pixels: TypeAlias = Annotated[float, Meta(ge=1, le=MAX_SIDE_PX, multiple_of=1)]
_Focal: TypeAlias = Annotated[float, Meta(ge=1, le=1e9)]
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

    size: Annotated[tuple[_Pixels, _Pixels], Meta(description="width and height in whole pixels, from 1 to 32767,")]
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
        if self.fisheye:
            raise ValueError(
                "expected OpenCV's lens model with 4, 5 or 8 coefficients, found a fisheye lens, which is not "
                "supported; undistort the footage first and calibrate it without fisheye"
            )
        if len(self.distortions) not in DISTORTION_COUNTS:
            raise ValueError(f"expected 0, 4, 5 or 8 values as 'distortions', found {len(self.distortions)}")


def read_calibration(path: str | Path, units: Units = "m") -> tuple[Camera, ...]:
    """Read the cameras of a calibration file, in the order of its sections.

    Args:
        path: the TOML file.
        units: unit of its translations.

    Raises:
        CalibrationError: the file is missing or malformed, or describes impossible cameras.
    """
    path = Path(path)
    if units not in ("m", "mm"):
        raise CalibrationError(f"expected units m or mm, found '{units}'; correct --units")
    data = read_toml(path, _KIND)
    sections = {name: section for name, section in data.items() if name.lower() != "metadata"}
    if not sections:
        raise CalibrationError(
            f"calibration {path}: expected one section per camera, such as [cam01], found none; "
            "export it in the anipose or Pose2Sim layout"
        )
    cameras = tuple(_camera(name, section, path, 1.0 if units == "m" else 1e-3) for name, section in sections.items())
    names = [c.name for c in cameras]
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise CalibrationError(f"calibration {path}: two cameras are named '{twice[0]}'; give each its own name")
    _check_units(cameras, path, units)
    return cameras


def write_calibration(path: str | Path, cameras: Sequence[Camera]) -> None:
    """Write cameras, in metres. `read_calibration` reads them back to 12 digits and in the same order."""
    data: dict[str, Any] = {}
    for c in cameras:
        data[c.name] = {
            "name": c.name,
            "size": [float(c.width), float(c.height)],
            "matrix": c.K.tolist(),
            "distortions": c.distortion.tolist(),
            "rotation": rigid.so3_log(c.T_camera_world[:3, :3]).tolist(),
            "translation": c.T_camera_world[:3, 3].tolist(),
            "fisheye": False,
        }
    data["metadata"] = {"adjusted": False, "error": 0.0}
    write_text_atomic(Path(path), tomli_w.dumps(data))


def _camera(section: str, data: Any, path: Path, metres_per_unit: float) -> Camera:
    where = f"calibration {path}, camera {quoted(section)}"
    if not isinstance(data, dict):
        raise CalibrationError(
            f"calibration {path}: expected sections of cameras, found the lone key {quoted(section)}; remove it"
        )
    row: _CameraSection = check(data, _CameraSection, where, CalibrationError)
    name = check(section, FileStem, where, CalibrationError) if row.name is None else row.name
    translation = np.array(row.translation) * metres_per_unit
    T_camera_world = rigid.transform(_rotation(row.rotation, where), translation)
    width, height = map(int, row.size)
    K, distortion = np.array(row.matrix), np.array(row.distortions, dtype=np.float64)
    return Camera(name, (width, height), K, distortion, rigid.inverse(T_camera_world))


def _rotation(value: list[Any], where: str) -> Array:
    """Convert a Rodrigues vector, or a matrix that is a rotation within rounding, to a rotation matrix (3, 3)."""
    is_matrix = any(isinstance(row, list) for row in value)
    rotation = np.array(
        check(value, _RotationMatrix if is_matrix else _Rodrigues, f"{where}, rotation", CalibrationError)
    )
    if rotation.shape == (3,):
        return rigid.so3_exp(rotation)
    error = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    determinant = float(np.linalg.det(rotation))
    if error > _ROTATION_TOLERANCE or determinant < 0:
        raise CalibrationError(
            f"{where}: 'rotation' is not a rotation: expected orthonormal rows and determinant 1, "
            f"found rows off by {error:.2g} and determinant {determinant:.3g}; calibrate again"
        )
    # Use the nearest rotation: a rounded matrix would shear what it maps.
    U, _, V = np.linalg.svd(rotation)
    return U @ V


def _check_units(cameras: tuple[Camera, ...], path: Path, units: Units) -> None:
    distances = [float(np.linalg.norm(c.center_world)) for c in cameras]
    farthest = max(distances)
    if units == "m" and farthest > MAX_STUDIO_M:
        name = cameras[distances.index(farthest)].name
        raise CalibrationError(
            f"calibration {path}: camera '{name}' would stand {farthest:.0f} m from the origin, so its translations "
            "look like millimetres and metres were expected; say --units mm"
        )
    # All at the origin is one camera that defines the world, which has no scale to check.
    if units == "mm" and 0 < farthest < MIN_STUDIO_M:
        raise CalibrationError(
            f"calibration {path}: read as millimetres all cameras would stand within {farthest * 1000:.2g} mm of the "
            "origin, so its translations look like metres; leave out --units mm"
        )
