"""Calibrations of sessions, in the TOML layout of anipose and Pose2Sim, in metres.

One section per camera: `name`, `size` (width, height), `matrix` (3x3), `distortions` (OpenCV's order), `rotation`
(Rodrigues vector, or a 3x3 matrix) and `translation` with `X_camera = R X_world + t`, and `fisheye`: with true, the
distortions are k1 to k4 of OpenCV's equidistant model. A section `metadata` is not a camera. Foreign files, which may
say the same in other words and units, are read by `tracker.formats.calibrations`.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tomli_w

from tracker.errors import CalibrationError
from tracker.files import write_text_atomic
from tracker.formats.camera_section import check_names, read_entry
from tracker.formats.text_files import TextKind, parse_toml, read_text
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera
from tracker.validation import quoted

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
