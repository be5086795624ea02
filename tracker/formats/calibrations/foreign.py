"""Names and advice for files of other programs that are not read."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from tracker.errors import CalibrationError

EXPECTED = "a calibration of a layout that docs/recordings.md lists"
_POSE2SIM = "convert it with Pose2Sim (calibration_type = 'convert' in its Config.toml), which writes a Calib.toml"
_TO_JSON = "write K, distortion, R and t of each camera to JSON"
_MATLAB = ("a MATLAB file", f"{_TO_JSON} with jsonencode")
_ARCHIVE = ("a NumPy archive or ZIP file", _TO_JSON)
_ARRAY = ("a NumPy array", _TO_JSON)
_PICKLE = ("a Python pickle, as OpenCap writes", f"{_POSE2SIM}, with convert_from = 'opencap'")
_STEREO = (
    "the pairs of cameras of DeepLabCut 3D",
    "write both cameras to one JSON file: cameraMatrix1, distCoeffs1, R = I and t = 0 as K, distortion, R and t of the "
    "first, and cameraMatrix2, distCoeffs2, R and T of the second",
)
_BEGINNINGS = (
    (b"MATLAB", *_MATLAB),
    (b"\x89HDF", "a MATLAB or HDF5 file", f"{_TO_JSON} with jsonencode"),
    (b"PK\x03\x04", *_ARCHIVE),
    (b"\x93NUMPY", *_ARRAY),
    (b"\x80", *_PICKLE),
)
"""First bytes of files of other programs, their names, and how to convert them."""
_SUFFIXES = {
    ".pickle": _PICKLE,
    ".pkl": _PICKLE,
    ".mat": _MATLAB,
    ".npz": _ARCHIVE,
    ".npy": _ARRAY,
    ".mcal": ("a calibration of OptiTrack Motive", _POSE2SIM),
    ".cal": ("a calibration of OptiTrack or a project of another program", _POSE2SIM),
    ".bin": ("a binary model of COLMAP", "export it as text and give its cameras.txt"),
    ".c3d": ("a file of markers", "export the calibration of the cameras"),
}
"""The same for files that are known by their suffix alone."""


def named(path: Path, found: str, advice: str) -> CalibrationError:
    """Return the error of a file that is not read."""
    return CalibrationError(f"calibration {path}: expected {EXPECTED}, found {found}; {advice}")


def name_binary(path: Path) -> None:
    """Name a file of another program that is no text; one that is missing is left to the reader of texts.

    Raises:
        CalibrationError: it is one.
    """
    if not path.is_file():
        return
    try:
        with path.open("rb") as file:
            begin = file.read(1000)
    except OSError:
        return
    if begin[0:1] == b"\x80" and b"cameraMatrix1" in begin:
        raise named(path, *_STEREO)
    for first, found, advice in _BEGINNINGS:
        if begin.startswith(first):
            raise named(path, found, advice)
    if path.suffix.lower() in _SUFFIXES:
        raise named(path, *_SUFFIXES[path.suffix.lower()])


def refuse_program(path: Path, data: Any) -> None:
    """Refuse data of programs that have words of cameras, and whose cameras cannot be read.

    Raises:
        CalibrationError: they are of one.
    """
    if not isinstance(data, dict):
        return
    if {"camera_matrix", "distortion_model", "projection_matrix"} <= data.keys():
        found = "the lens of one camera as ROS writes it (camera_info), without its pose"
        raise named(path, found, "calibrate the cameras together, by a board or by people")
    first = next(iter(data.values()), None)
    if isinstance(first, dict) and {"T_imu_cam", "intrinsics"} <= first.keys():
        raise named(path, "the cameras of Basalt, whose poses are those within one moving rig", _TO_JSON)
    if isinstance(first, dict) and {"input", "world"} <= first.keys():
        advice = f"{_TO_JSON}, with the lenses of each camera's own file (SN*.conf)"
        raise named(path, "the poses of ZED cameras without their lenses", advice)


def foreign(path: Path, data: Any) -> CalibrationError:
    """Name the program that wrote data of no known layout."""
    if isinstance(data, ElementTree.Element):
        if data.tag == "document" and data.find("chunk") is not None:
            return named(path, "a project of Agisoft Metashape", "export the cameras as OpenCV XML with their poses")
        if data.tag.lower().startswith("optitrack"):
            return named(path, "a calibration of OptiTrack", f"{_POSE2SIM}, with convert_from = 'optitrack'")
        return named(path, f"XML with <{data.tag[:40]}>", "export it in one of these layouts")
    if isinstance(data, dict):
        frames = data.get("frames")
        if isinstance(frames, list) and any(isinstance(f, dict) and "transform_matrix" in f for f in frames):
            return named(path, "a transforms.json of NeRF tools, whose scale is not known", "calibrate with a board")
        if {"M1", "D1", "M2", "D2"} <= data.keys() or {"R1", "R2", "P1", "P2"} <= data.keys():
            advice = "write both cameras to one file: K, distortion, R and t; R = I and t = 0 for the first"
            return named(path, "one half of a stereo calibration of OpenCV", advice)
        if "camera_count" in data or "charuco" in data:
            found = "the settings of a Caliscope project without cameras"
            return named(path, found, "give the camera_array.toml beside it")
    if isinstance(data, str):
        found = "another kind of file" if data.strip() else "an empty file"
        return named(path, found, "export the calibration again")
    return named(path, "no camera", "export it in one of these layouts")
