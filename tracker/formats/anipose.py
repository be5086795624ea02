"""Calibrations in the TOML layout of anipose, Pose2Sim and Caliscope.

One section per camera: `name`, `size` (width, height), `matrix` (3x3), `distortions` (OpenCV's order), `rotation`
(Rodrigues vector, or a 3x3 matrix) and `translation` with `X_camera = R X_world + t`, `fisheye`. A section
`metadata` is not a camera. The file does not state whether its lengths are metres or millimetres; the caller does.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import tomli_w

from tracker.errors import CalibrationError
from tracker.files import read_toml, write_text_atomic
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import DISTORTION_COUNTS, Camera

Units = Literal["m", "mm"]

MAX_STUDIO_M = 100.0
"""A camera read as metres and farther from the origin than this has translations in millimetres."""
MIN_STUDIO_M = 0.05
"""Cameras read as millimetres that are all nearer to the origin than this have translations in metres."""
_ROTATION_TOLERANCE = 1e-3  # a rotation matrix printed with four digits still passes


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
    data = read_toml(path, "calibration", CalibrationError)
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
    where = f"calibration {path}, camera '{section}'"
    if not isinstance(data, dict):
        raise CalibrationError(
            f"calibration {path}: expected sections of cameras, found the lone key '{section}'; remove it"
        )
    name = str(data.get("name", section))
    missing = [key for key in ("size", "matrix", "rotation", "translation") if key not in data]
    if missing:
        raise CalibrationError(f"{where}: missing {', '.join(missing)}; add what is missing or remove the section")
    if data.get("fisheye", False):
        raise CalibrationError(
            f"{where}: a fisheye lens is not supported, only OpenCV's model with 4, 5 or 8 coefficients; "
            "undistort the footage first and calibrate it without fisheye"
        )
    distortion = _numbers(data.get("distortions", []), where, "distortions")
    if distortion.ndim != 1 or distortion.size not in DISTORTION_COUNTS:
        raise CalibrationError(
            f"{where}: expected 0, 4, 5 or 8 values in 'distortions', found {distortion.size}; "
            "calibrate with OpenCV's standard or rational model"
        )
    translation = _numbers(data["translation"], where, "translation")
    if translation.shape != (3,):
        raise CalibrationError(f"{where}: expected 3 values in 'translation', found {translation.size}; correct it")
    T_camera_world = rigid.transform(_rotation(data["rotation"], where), translation * metres_per_unit)
    return Camera(
        name, _size(data["size"], where), _matrix(data["matrix"], where), distortion, rigid.inverse(T_camera_world)
    )


def _numbers(value: Any, where: str, key: str) -> Array:
    try:
        numbers = np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise CalibrationError(f"{where}: expected numbers in '{key}', found {value}; correct it") from error
    if not np.all(np.isfinite(numbers)):
        raise CalibrationError(f"{where}: expected finite numbers in '{key}', found {value}; calibrate again")
    return numbers


def _size(value: Any, where: str) -> tuple[int, int]:
    size = _numbers(value, where, "size")
    if size.shape != (2,) or np.any(size < 1) or np.any(size != np.round(size)):
        raise CalibrationError(
            f"{where}: expected width and height in whole pixels in 'size', found {value}; correct it"
        )
    return int(size[0]), int(size[1])


def _matrix(value: Any, where: str) -> Array:
    K = _numbers(value, where, "matrix")
    if K.shape != (3, 3) or K[0, 0] <= 0 or K[1, 1] <= 0 or K[1, 0] != 0 or np.any(K[2] != (0.0, 0.0, 1.0)):
        raise CalibrationError(
            f"{where}: expected [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] with positive fx and fy in 'matrix', "
            f"found {value}; correct it"
        )
    return K


def _rotation(value: Any, where: str) -> Array:
    """Convert a Rodrigues vector, or a matrix that is a rotation within rounding, to a rotation matrix (3, 3)."""
    rotation = _numbers(value, where, "rotation")
    if rotation.shape == (3,):
        return rigid.so3_exp(rotation)
    if rotation.shape != (3, 3):
        raise CalibrationError(
            f"{where}: expected a Rodrigues vector of 3 values or a 3x3 matrix in 'rotation', found {value}; correct it"
        )
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
