"""Calibrations in any layout that can be read with certainty; others are named, with a way to convert them."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from tracker.errors import CalibrationError
from tracker.formats import anipose
from tracker.formats.anipose import KIND
from tracker.formats.camera_layouts import Section, camera_sections
from tracker.formats.camera_section import METRES, CameraEntry, Units, check_names_and_units, read_entry
from tracker.formats.plain_data import parse_json, parse_xml, parse_yaml, storage_data
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera, viewed_point
from tracker.text_files import read_text

_READ = "TOML of anipose, Pose2Sim or Caliscope, or JSON, YAML or XML with K, distortion, R and t of each camera"
_POSE2SIM = "convert it with Pose2Sim (calibration_type = 'convert' in its Config.toml), which writes a Calib.toml"
_BINARY = {
    ".pickle": ("a Python pickle, as OpenCap writes", f"{_POSE2SIM}, with convert_from = 'opencap'"),
    ".pkl": ("a Python pickle", "write K, distortion, R and t of each camera to JSON"),
    ".mat": ("a MATLAB file", "write K, distortion, R and t of each camera to JSON with jsonencode"),
    ".npz": ("a NumPy archive", "write K, distortion, R and t of each camera to JSON"),
    ".npy": ("a NumPy array", "write K, distortion, R and t of each camera to JSON"),
    ".mcal": ("a calibration of OptiTrack Motive", _POSE2SIM),
    ".cal": ("a calibration of OptiTrack or a project of another program", _POSE2SIM),
    ".c3d": ("a file of markers", "export the calibration of the cameras"),
}
"""What files of other programs are by their suffix, and how to convert them."""
_MISREAD_RAD = np.radians(25.0)
"""Angle between a camera's axis and the point at which all look, above which the poses may be misread."""
_CONVERGENT_RAD = np.radians(10.0)
"""Angle below which cameras look at one point."""
_CROWDED = 0.2
"""Poses may be misread if the cameras stand this many times nearer to each other than with inverted poses."""


def read_cameras(path: str | Path, units: Units | None = None) -> tuple[CameraEntry, ...]:
    """Read the cameras of a calibration file, in its order.

    Args:
        path: the file.
        units: unit of its translations; by default the one that the layout fixes, else metres.

    Raises:
        CalibrationError: the file is missing or malformed, of an unknown layout, or describes impossible cameras.
    """
    path = Path(path)
    if units is not None and units not in METRES:
        raise CalibrationError(f"expected units {', '.join(METRES)}, found '{units}'; correct --units")
    if path.is_dir():
        raise CalibrationError(f"calibration {path} is a folder; give the file in it")
    if path.suffix.lower() in _BINARY and path.exists():
        what, advice = _BINARY[path.suffix.lower()]
        raise _named(path, what, advice)
    text = read_text(path, KIND)
    layout = _layout_of(text, path.suffix.lower())
    if layout == "toml":
        if path.suffix.lower() != ".toml" and not re.search(r"^\s*\[[^\]\n]+\]\s*$", text, re.MULTILINE):
            raise _named(path, "another kind of file", "export the calibration in one of these layouts")
        entries = anipose.parse_calibration(text, str(path), units or "m")
    else:
        entries = _of_data(_plain_data(text, path, layout), path, units)
    _check_directions(entries, f"calibration {path}")
    return entries


def _layout_of(text: str, suffix: str) -> str:
    """Return toml, json, yaml or xml, by the beginning of a text, else by the suffix of its file."""
    begin = text.lstrip()[:200]
    if begin.startswith("<"):
        return "xml"
    if begin.startswith("%YAML"):
        return "yaml"
    if begin.startswith("{") or re.match(r"\[\s*[\[{]\s*[\"{\d-]", begin):
        return "json"
    return {".json": "json", ".yml": "yaml", ".yaml": "yaml", ".xml": "xml", ".xcp": "xml"}.get(suffix, "toml")


def _plain_data(text: str, path: Path, layout: str) -> Any:
    """Parse text to plain data, with the other half of EasyMocap's pair of files.

    Raises:
        CalibrationError: it is malformed, or of a program whose conventions are not read.
    """
    if layout == "json":
        data = parse_json(text, str(path), KIND)
        _refuse_known(data, path)
        return data
    if layout == "xml":
        root = parse_xml(text, str(path), KIND)
        if root.tag != "opencv_storage":
            raise _foreign_xml(root, path)
        return storage_data(root)
    data = parse_yaml(text, str(path), KIND)
    _refuse_known(data, path)
    other = {"intri": "extri", "extri": "intri"}.get(path.stem)
    pair = path.with_name(f"{other}{path.suffix}")
    if other is not None and pair.exists() and isinstance(data, dict):
        more = parse_yaml(read_text(pair, KIND), str(pair), KIND)
        return data | more if isinstance(more, dict) else data
    return data


def _of_data(data: Any, path: Path, units: Units | None) -> tuple[CameraEntry, ...]:
    where = f"calibration {path}"
    sections, fixed = camera_sections(data)
    if not sections:
        raise CalibrationError(f"{where}: expected {_READ}, found no camera; export it in one of these layouts")
    for name, section in sections.items():
        _check_complete(name, section, where)
    used = units or fixed or "m"
    entries = tuple(read_entry(name, section, where, METRES[used]) for name, section in sections.items())
    check_names_and_units(entries, where, used)
    return entries


def _check_complete(name: str, section: Section, where: str) -> None:
    """Check that a camera has a matrix and a pose, in the words of other layouts than anipose's."""
    if section["matrix"] is None:
        raise CalibrationError(
            f"{where}, camera '{name}': expected its matrix under a key such as K or camera_matrix, found none; give "
            "the file of the intrinsics too, or one file with both"
        )
    if section["rotation"] is None or section["translation"] is None:
        raise CalibrationError(
            f"{where}, camera '{name}': expected its pose under keys such as R and t (X_camera = R X_world + t), found "
            "the lens alone; calibrate the cameras together and give the file with their poses"
        )


def _check_directions(entries: Sequence[CameraEntry], where: str) -> None:
    """Refuse poses that map camera to world: inverted, the cameras look at one point, and as they are they do not."""
    if len(entries) < 2:
        return
    divergence, extent = _arrangement([c.T_world_camera for c in entries])
    turned_divergence, turned_extent = _arrangement([rigid.inverse(c.T_world_camera) for c in entries])
    if turned_divergence < _CONVERGENT_RAD and (divergence > _MISREAD_RAD or extent < _CROWDED * turned_extent):
        raise CalibrationError(
            f"{where}: inverted, its poses would let all cameras look at one point, and as they are they do not, so "
            "they seem to map camera to world, and X_camera = R X_world + t was expected; invert them: R' = R^T, "
            "t' = -R^T t"
        )


def _arrangement(Ts_world_camera: Sequence[Array]) -> tuple[float, float]:
    """Return how cameras, given by their poses, look at one point, and how far they stand apart.

    Returns:
        The largest angle between an axis and the direction to the point nearest to all axes, rad, and the largest
        distance of a camera from their mean, metres.
    """
    K = np.eye(3)
    point = viewed_point([Camera("", (1, 1), K, np.zeros(0), T) for T in Ts_world_camera])
    centers = np.array([T[:3, 3] for T in Ts_world_camera])
    axes = np.array([T[:3, 2] for T in Ts_world_camera])
    toward = point - centers
    cosines = (axes * toward).sum(axis=1) / np.maximum(np.linalg.norm(toward, axis=1), 1e-9)
    extent = np.linalg.norm(centers - centers.mean(axis=0), axis=1).max()
    return float(np.arccos(np.clip(cosines, -1, 1)).max()), float(extent)


# --- other programs -------------------------------------------------------------------------------------------------


def _named(path: Path, what: str, advice: str) -> CalibrationError:
    return CalibrationError(f"calibration {path}: expected {_READ}, found {what}; {advice}")


def _foreign_xml(root: ElementTree.Element, path: Path) -> CalibrationError:
    """Name the program of an XML file."""
    camera = root.find(".//camera")
    if root.tag == "calibration" and root.find("cameras/camera") is not None:
        return _named(path, "a calibration of Qualisys QTM or Theia", f"{_POSE2SIM}, with convert_from = 'qualisys'")
    if root.find(".//KeyFrames") is not None or root.tag == "Cameras":
        return _named(path, "a calibration of Vicon (XCP)", f"{_POSE2SIM}, with convert_from = 'vicon'")
    if root.tag == "document" and root.find("chunk") is not None:
        return _named(path, "a project of Agisoft Metashape", "export the cameras as OpenCV XML with their poses")
    if camera is not None and root.tag.lower().startswith("optitrack"):
        return _named(path, "a calibration of OptiTrack", f"{_POSE2SIM}, with convert_from = 'optitrack'")
    return _named(path, f"XML with <{root.tag[:40]}>", "export it in one of these layouts")


def _refuse_known(data: Any, path: Path) -> None:
    """Name layouts that lack what is needed.

    Raises:
        CalibrationError: it is one of them.
    """
    if not isinstance(data, dict):
        return
    if isinstance(data.get("frames"), list) and any(
        isinstance(f, dict) and "transform_matrix" in f for f in data["frames"]
    ):
        raise _named(path, "a transforms.json of NeRF tools, whose scale is not known", "calibrate with a board")
    if {"M1", "D1", "M2", "D2"} <= data.keys() or {"R1", "R2", "P1", "P2"} <= data.keys():
        raise _named(
            path,
            "one half of a stereo calibration of OpenCV",
            "write both cameras to one file: K, distortion, R and t; R = I and t = 0 for the first",
        )
