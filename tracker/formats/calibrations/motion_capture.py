"""Calibrations of marker systems: Qualisys (QTM) and Vicon (XCP).

The directions of their poses are those by which Pose2Sim converts them (`read_qca`, `read_vicon`).
"""

from collections.abc import Mapping
from functools import partial
from xml.etree import ElementTree

import numpy as np

from tracker.formats.calibrations.camera_words import Section, plain_camera, unit_rotation, unusable
from tracker.formats.calibrations.document import Document, read_numbers, refuse
from tracker.formats.calibrations.pose_conventions import OPENGL
from tracker.geometry import rigid

_SUBPIXELS = 64.0
"""Qualisys counts the sensor in 64ths of a pixel."""


def is_qualisys(document: Document) -> bool:
    """Return whether the data are XML of QTM."""
    root, at = document.data, "cameras/camera"
    return isinstance(root, ElementTree.Element) and root.tag == "calibration" and root.find(at) is not None


def read_qualisys(document: Document) -> dict[str, Section]:
    """Read the cameras of QTM; positions are in millimetres.

    Raises:
        CalibrationError: a number is missing, or the sensor is counted in another unit than pixels or their 64ths.
    """
    root: ElementTree.Element = document.data
    # Pose2Sim writes the lens in 64ths too, and names no version of QTM.
    by_pose2sim = root.get("qtm-version") == "none"
    found: dict[str, Section] = {}
    for i, camera in enumerate(root.findall("cameras/camera")):
        name = camera.get("serial") or f"camera {i + 1}"
        if camera.get("active") == "0":
            continue
        attributes = {tag: _attributes(camera, tag) for tag in ("transform", "intrinsic")}
        if None in attributes.values():
            found[name] = unusable(name)
            continue
        if camera.get("viewrotation") not in (None, "", "0", "none"):
            turned = f"is turned by {camera.get('viewrotation')} degrees in QTM, which says nothing of its video"
            found[name] = unusable(name, f"camera '{name}' {turned}; convert the calibration with Pose2Sim")
            continue
        values = {**(attributes["transform"] or {}), **(attributes["intrinsic"] or {})}
        values |= _attributes(camera, "fov_video") or _attributes(camera, "fov_marker") or {}
        number = partial(_number, document, name, values)
        left, top = number("left"), number("top")
        size = [number("right") - left + 1, number("bottom") - top + 1]
        subpixels = _SUBPIXELS
        if "sensorMaxU" in values:
            width = number("sensorMaxU") - number("sensorMinU", 0.0) + 1
            subpixels = _subpixels(width / size[0], document, name)
        fu, fv, cu, cv = (number(k) / subpixels for k in _MATRIX)
        lens = np.array([number(k, 0.0) for k in _LENS])
        R = OPENGL[:3, :3] @ np.array([[number(f"r{i}{j}") for j in (1, 2, 3)] for i in (1, 2, 3)])
        position = np.array([number(k) for k in "xyz"])
        K = [[fu, 0.0, cu - left], [0.0, fv, cv - top], [0.0, 0.0, 1.0]]
        lens = lens / (_SUBPIXELS if by_pose2sim else 1.0)
        found[name] = plain_camera(name, size, K, lens.tolist(), rigid.transform(R, -R @ position))
    return found


_MATRIX = ("focalLengthU", "focalLengthV", "centerPointU", "centerPointV")
_LENS = (
    "radialDistortion1", "radialDistortion2", "tangentalDistortion1", "tangentalDistortion2", "radialDistortion3",
)  # fmt: skip
"""In OpenCV's order."""


def _subpixels(ratio: float, document: Document, name: str) -> float:
    """Return the units of the sensor per pixel, from those per pixel of the video."""
    for unit in (_SUBPIXELS, 1.0):
        if abs(ratio / unit - 1) < 0.02:
            return unit
    expected, found = "a sensor as wide as the video in pixels or 64ths of them", f"{ratio:.3g} units per pixel"
    raise refuse(document, name, expected, found, "export the calibration for the size of the video")


_VICON = {
    "ORIENTATION": "x y z w", "FOCAL_LENGTH": "f", "PRINCIPAL_POINT": "u v", "POSITION": "x y z",
    "SENSOR_SIZE": "width height",
}  # fmt: skip
"""Attributes of a camera, and their numbers."""


def is_vicon(document: Document) -> bool:
    """Return whether the data are Vicon's XML."""
    root = document.data
    return isinstance(root, ElementTree.Element) and (root.tag == "Cameras" or root.find(".//KeyFrames") is not None)


def read_vicon(document: Document) -> dict[str, Section]:
    """Read the cameras of Vicon: `ORIENTATION` (x, y, z, w) maps world to camera, `POSITION` is in millimetres."""
    found: dict[str, Section] = {}
    for i, camera in enumerate(document.data.iter("Camera")):
        name = camera.get("DEVICEID") or f"camera {i + 1}"
        frame = camera.find("KeyFrames/KeyFrame")
        if frame is None or frame.get("ORIENTATION") is None:
            found[name] = unusable(name)
            continue
        lens = _words(frame.get("VICON_RADIAL2"))[2:] + _words(frame.get("VICON_RADIAL"))
        if np.any(lens):
            other = "has Vicon's lens model, whose coefficients are not those of OpenCV"
            advice = "undistort the footage, or convert the calibration with Pose2Sim (convert_from = 'vicon')"
            found[name] = unusable(name, f"camera '{name}' {other}; {advice}")
            continue
        values = {**camera.attrib, **frame.attrib}
        row = {k: read_numbers(document, name, k, values.get(k), len(of.split())) for k, of in _VICON.items()}
        R = unit_rotation(document, name, "ORIENTATION", np.roll(row["ORIENTATION"], 1))
        (focal,), (cu, cv) = row["FOCAL_LENGTH"], row["PRINCIPAL_POINT"]
        ratio = _number(document, name, values, "PIXEL_ASPECT_RATIO", 0.0) or 1.0
        K = [[focal, 0.0, cu], [0.0, focal / ratio, cv], [0.0, 0.0, 1.0]]
        T_camera_world = rigid.transform(R, -R @ np.array(row["POSITION"]))
        found[name] = plain_camera(name, row["SENSOR_SIZE"], K, [], T_camera_world)
    return found


def _attributes(element: ElementTree.Element, tag: str) -> Mapping[str, str] | None:
    inner = element.find(tag)
    return None if inner is None else inner.attrib


def _words(text: str | None) -> list[float]:
    """Return the numbers of an attribute; words between them are left out."""
    found = []
    for word in (text or "").split():
        try:
            found.append(float(word))
        except ValueError:
            continue
    return found


def _number(
    document: Document, camera: str, values: Mapping[str, str], key: str, default: float | None = None
) -> float:
    """Return a number of the attributes of a camera; refused by name where it is missing without a default."""
    if key not in values and default is not None:
        return default
    return read_numbers(document, camera, key, values.get(key), 1)[0]
