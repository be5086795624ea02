"""Calibrations in the TOML layout of anipose, Pose2Sim and Caliscope.

One section per camera: `name`, `size` (width, height), `matrix` (3x3), `distortions` (OpenCV's order), `rotation`
(Rodrigues vector, or a 3x3 matrix) and `translation` with `X_camera = R X_world + t`, and `fisheye`: with true, the
distortions are k1 to k4 of OpenCV's equidistant model. A section `metadata` is not a camera. Caliscope's
`camera_array.toml` has its sections below `cameras`; they are named after its videos, `cam_0` and so on. The file does
not state whether its lengths are metres or millimetres; the caller does.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import tomli_w

from tracker.errors import CalibrationError
from tracker.files import write_text_atomic
from tracker.formats.camera_section import METRES, CameraEntry, Units, check_names_and_units, read_entry
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera
from tracker.text_files import TextKind, parse_toml, read_text
from tracker.validation import quoted

KIND = TextKind("calibration", 500_000, CalibrationError)
"""A camera takes about 1 kB."""


def read_calibration(path: str | Path, units: Units = "m") -> tuple[Camera, ...]:
    """Read the cameras of a calibration file, in the order of its sections.

    Args:
        path: the TOML file.
        units: unit of its translations.

    Raises:
        CalibrationError: the file is missing or malformed, or describes impossible cameras.
    """
    return tuple(entry.camera() for entry in parse_calibration(read_text(Path(path), KIND), str(path), units))


def parse_calibration(text: str, source: str, units: Units = "m") -> tuple[CameraEntry, ...]:
    """Read the cameras of the text of a calibration file; `source` names it in messages.

    Raises:
        CalibrationError: the text is malformed, or describes impossible cameras.
    """
    where = f"calibration {source}"
    if units not in METRES:
        raise CalibrationError(f"expected units {', '.join(METRES)}, found '{units}'; correct --units")
    sections = _sections(parse_toml(text, source, KIND), where)
    entries = tuple(read_entry(name, section, where, METRES[units]) for name, section in sections.items())
    check_names_and_units(entries, where, units)
    return entries


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
            "fisheye": c.fisheye,
        }
    data["metadata"] = {"adjusted": False, "error": 0.0}
    write_text_atomic(Path(path), tomli_w.dumps(data))


def _sections(data: dict[str, Any], where: str) -> dict[str, Any]:
    """Return the sections of the cameras by name.

    Raises:
        CalibrationError: there are none, or keys that belong to no camera.
    """
    if "camera_count" in data and "charuco" in data:
        raise CalibrationError(
            f"{where}: expected a calibration, found the settings of a Caliscope project; give its camera_array.toml"
        )
    if set(data) == {"cameras"} and isinstance(data["cameras"], dict):
        data = {_caliscope_name(key, section): section for key, section in data["cameras"].items()}
    sections = {name: section for name, section in data.items() if name.lower() != "metadata"}
    ignored = {
        name for name, section in sections.items() if isinstance(section, dict) and section.get("ignore") is True
    }
    if not sections.keys() - ignored:
        raise CalibrationError(
            f"{where}: expected one section per camera, such as [cam01], found none; "
            "export it in the anipose or Pose2Sim layout"
        )
    for name, section in sections.items():
        if not isinstance(section, dict):
            raise CalibrationError(
                f"{where}: expected sections of cameras, found the lone key {quoted(name)}; remove it"
            )
    return {name: section for name, section in sections.items() if name not in ignored}


def _caliscope_name(key: str, section: Any) -> str:
    """Return the name of a camera of Caliscope, after which its video is named: `cam_0`, once `port_0`."""
    for number in ("cam_id", "port"):
        if isinstance(section, dict) and isinstance(section.get(number), int):
            return f"{number.removesuffix('_id')}_{section[number]}"
    return key
