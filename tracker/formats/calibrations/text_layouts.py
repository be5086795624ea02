"""Calibrations in plain text and in tables: Skeletool, MayaCam, DLT coefficients, COLMAP and Ego-Exo4D.

The directions of their poses are those of Autoscoper (MayaCam), of COLMAP's manual (`images.txt`), and of the tutorials
of Ego-Exo4D (`gopro_calibs.csv`).
"""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import PurePath

import numpy as np

from tracker.formats.calibrations.camera_matrices import ProjectionError, split_projection
from tracker.formats.calibrations.camera_words import COEFFICIENTS, Section, once, plain_camera, unit_rotation, unusable
from tracker.formats.calibrations.document import Document, numbers_in, read_numbers, refuse
from tracker.geometry import rigid
from tracker.geometry.camera_rig import axes_point
from tracker.validation import quoted

_SKELETOOL = "Skeletool Camera Calibration File"
_OF_FISHEYE = ("polynomial", "affine", "imageCircleRadius")
_MAYACAM = ("image size", "camera matrix", "rotation", "translation")
_COLMAP = {
    "SIMPLE_PINHOLE": "f cx cy",
    "PINHOLE": "fx fy cx cy",
    "SIMPLE_RADIAL": "f cx cy k1",
    "RADIAL": "f cx cy k1 k2",
    "OPENCV": "fx fy cx cy k1 k2 p1 p2",
    "FULL_OPENCV": "fx fy cx cy k1 k2 p1 p2 k3 k4 k5 k6",
    "SIMPLE_RADIAL_FISHEYE": "f cx cy k1",
    "RADIAL_FISHEYE": "f cx cy k1 k2",
    "OPENCV_FISHEYE": "fx fy cx cy k1 k2 k3 k4",
}
"""Parameters of COLMAP's models of lenses, in its order; the others are none of OpenCV's."""


def _lines(document: Document) -> list[str]:
    """Return the lines of a plain text without comments; none for other data."""
    text = document.data if isinstance(document.data, str) else ""
    return [line.strip() for line in text.splitlines() if not line.startswith("#")]


# --- Skeletool ------------------------------------------------------------------------------------------------------


def is_skeletool(document: Document) -> bool:
    """Return whether the first line is Skeletool's."""
    return isinstance(document.data, str) and document.data.lstrip().startswith(_SKELETOOL)


def read_skeletool(document: Document) -> dict[str, Section]:
    """Read the cameras of Skeletool, in millimetres; its lenses other than pinholes are refused."""
    cameras: list[dict[str, str]] = []
    for line in filter(None, _lines(document)[1:]):
        key, *value = line.split(maxsplit=1)
        if key == "name":
            cameras.append({})
        if cameras:
            cameras[-1].setdefault(key, "".join(value))
    return once(document, (_skeletool_camera(document, camera) for camera in cameras))


def _skeletool_camera(document: Document, values: Mapping[str, str]) -> tuple[str, Section]:
    name = values["name"]
    if values.get("animated", "0") != "0":
        return name, unusable(name, f"camera '{name}' moves during the recording (animated); film with one that stands")
    lens = [key for key in values if key.startswith(_OF_FISHEYE)]
    if lens or any(numbers_in(values.get("radial", "0"))):
        found = f"Skeletool's lens model ({(lens or ['radial'])[0]}), whose coefficients are not those of OpenCV"
        return name, unusable(
            name, f"camera '{name}' has {found}; undistort the footage, and set the coefficients to 0"
        )
    K, T = (read_numbers(document, name, key, values.get(key, ""), 16) for key in ("intrinsic", "extrinsic"))
    size = read_numbers(document, name, "size", values.get("size", ""), 2)
    return name, plain_camera(name, size, np.reshape(K, (4, 4))[:3, :3], [], np.reshape(T, (4, 4)))


# --- MayaCam --------------------------------------------------------------------------------------------------------


def is_mayacam2(document: Document) -> bool:
    """Return whether the lines have the titles of XMALab."""
    return set(_MAYACAM) <= {line.lower() for line in _lines(document)}


def read_mayacam2(document: Document) -> dict[str, Section]:
    """Read one camera of XMALab or Autoscoper, named by its file."""
    blocks: dict[str, list[str]] = {}
    title = ""
    for line in filter(None, _lines(document)):
        title = line.lower() if line.lower() in _MAYACAM else title
        blocks.setdefault(title, []).extend([line] * (line.lower() != title))
    size, K, R, t = (
        read_numbers(document, document.stem, key, ",".join(blocks[key]), count)
        for key, count in zip(_MAYACAM, (2, 9, 9, 3), strict=True)
    )
    T = rigid.transform(np.reshape(R, (3, 3)), np.array(t))
    return {"": plain_camera(None, size, np.reshape(K, (3, 3)), [], T)}


def is_mayacam1(document: Document) -> bool:
    """Return whether there are five lines of three numbers, with a focal length below 0 as Maya has it."""
    rows = [numbers_in(line) for line in filter(None, _lines(document))]
    return [len(row) for row in rows] == [3] * 5 and rows[3][2] < 0


def read_mayacam1(document: Document) -> dict[str, Section]:
    """Read one camera of the MATLAB programs before XMALab: its place, its angles, and u0, v0 and Z of its film.

    The camera looks along -z with y up; v0 counts from the bottom, and both count pixels from 1 (Autoscoper).
    """
    place, angles, _, (u0, v0, z), (_, *size) = (numbers_in(line) for line in filter(None, _lines(document)))
    width, height = (side or 1024.0 for side in size)
    x, y, turn = (rigid.so3_exp(np.radians(a) * axis) for a, axis in zip(angles, np.eye(3), strict=True))
    R = np.diag([1.0, -1.0, -1.0]) @ (turn @ y @ x).T
    K = np.array([[-z, 0.0, u0 - 1], [0.0, -z, height - v0], [0.0, 0.0, 1.0]])
    return {"": plain_camera(None, [width, height], K, [], rigid.transform(R, -R @ np.array(place)))}


# --- DLT ------------------------------------------------------------------------------------------------------------


def is_dlt(document: Document) -> bool:
    """Return whether there are eleven lines with as many numbers each (Abdel-Aziz and Karara 1971)."""
    counts = [len(numbers_in(line)) for line in filter(None, _lines(document))]
    return len(counts) == 11 and min(counts) == max(counts) > 0


def read_dlt(document: Document) -> dict[str, Section]:
    """Read a column of coefficients for each camera.

    Raises:
        CalibrationError: all cameras look away from where their axes meet: rows were counted from the bottom.
    """
    columns = np.array([numbers_in(line) for line in filter(None, _lines(document))]).T
    found, Ts = {}, []
    for name, column in ((f"cam{i + 1}", column) for i, column in enumerate(columns)):
        try:
            K, T = split_projection(np.append(column, 1.0))
        except ProjectionError as error:
            found[name] = unusable(name, f"camera '{name}': {error}; calibrate it again")
            continue
        Ts.append(rigid.inverse(T))
        found[name] = plain_camera(name, None, K, [], T)
    point = axes_point(Ts) if len(Ts) > 1 else None
    if point is not None and point.is_determined and point.angles_rad.min() > np.pi / 2:
        found = "that all look away from it, as of coefficients whose rows are counted from the bottom of the picture"
        advice = "replace rows 5 to 8 by (height - 1) times rows 9, 10, 11 and 1, less rows 5 to 8"
        raise refuse(document, None, "cameras that look at what they film", found, advice)
    return found


# --- COLMAP ---------------------------------------------------------------------------------------------------------


def _colmap_lenses(document: Document) -> Iterator[list[str]]:
    words = (line.split() for line in _lines(document))
    return (row for row in words if len(row) > 4 and row[0].isdigit() and re.fullmatch(r"[A-Z][A-Z_]+", row[1]))


def _colmap_pictures(document: Document) -> Iterator[list[str]]:
    for line in _lines(document):
        row = line.split(maxsplit=9)
        if len(row) == 10 and len(numbers_in(" ".join(row[:9]))) == 9 and not numbers_in(row[9]):
            yield row


def is_colmap(document: Document) -> bool:
    """Return whether the lines are those of `cameras.txt` or `images.txt`."""
    return any(_colmap_lenses(document)) or any(_colmap_pictures(document))


def join_colmap(documents: Sequence[Document]) -> Sequence[Document]:
    """Join the files of lenses and of pictures."""
    return [replace(documents[0], data="\n".join(document.data for document in documents))]


def read_colmap(document: Document) -> dict[str, Section]:
    """Read pictures with the lenses of their cameras, named by the pictures, or by the folders that these lie in."""
    lenses = {row[0]: row for row in _colmap_lenses(document)}
    pictures = list(_colmap_pictures(document))
    are_together = len({PurePath(row[9]).parent for row in pictures}) == 1
    if not pictures:
        return {f"camera {key}": _colmap_camera(document, f"camera {key}", row, None) for key, row in lenses.items()}
    names = [p.stem if are_together else p.parent.name or p.stem for p in (PurePath(row[9]) for row in pictures)]
    posed = zip(names, pictures, strict=True)
    return once(document, ((n, _colmap_camera(document, n, lenses.get(row[8]), row[1:8])) for n, row in posed))


def _colmap_camera(document: Document, name: str, lens: Sequence[str] | None, pose: Sequence[str] | None) -> Section:
    if lens is None:
        return unusable(name, f"camera '{name}' has no lens; give the cameras.txt beside the images.txt")
    if pose is None:
        return unusable(name, f"{name} has no pose; give the images.txt beside the cameras.txt")
    words = _COLMAP.get(lens[1], "").split()
    if not words:
        found = f"COLMAP's lens {lens[1]}, which OpenCV does not know"
        return unusable(name, f"camera '{name}' has {found}; undistort the pictures")
    numbers = dict(zip(words, read_numbers(document, name, lens[1], " ".join(lens[4:]), len(words)), strict=True))
    *quaternion, x, y, z = read_numbers(document, name, "pose", " ".join(pose), 7)
    R = unit_rotation(document, name, "pose", quaternion)
    fx, fy = (numbers.get(key, numbers.get("f", 0.0)) for key in ("fx", "fy"))
    # COLMAP's corner of the picture is at 0, 0, and the centre of its first pixel at 0.5, 0.5.
    K = np.array([[fx, 0.0, numbers["cx"] - 0.5], [0.0, fy, numbers["cy"] - 0.5], [0.0, 0.0, 1.0]])
    fisheye = lens[1].endswith("FISHEYE")
    order = COEFFICIENTS[fisheye][: 8 if "k3" in numbers else 4]
    size = read_numbers(document, name, "size", " ".join(lens[2:4]), 2)
    T = rigid.transform(R, np.array([x, y, z]))
    return plain_camera(name, size, K, [numbers.get(key, 0.0) for key in order], T, fisheye)


# --- Ego-Exo4D ------------------------------------------------------------------------------------------------------


def is_egoexo(document: Document) -> bool:
    """Return whether the header is that of `gopro_calibs.csv`."""
    return any("cam_uid" in line and "tx_world_cam" in line for line in _lines(document)[:1])


def read_egoexo(document: Document) -> dict[str, Section]:
    """Read the cameras of a take: fisheyes whose poses map camera to world, in metres."""
    return once(document, (_egoexo_camera(document, row) for row in csv.DictReader(_lines(document))))


def _egoexo_camera(document: Document, row: Mapping[str, str | None]) -> tuple[str, Section]:
    name = row.get("cam_uid") or ""

    def numbers(*keys: str) -> list[float]:
        return read_numbers(document, name, keys[0], ",".join(row.get(key) or "none" for key in keys), len(keys))

    if row.get("intrinsics_type") != "KANNALABRANDTK3":
        lens = quoted(row.get("intrinsics_type"))
        return name, unusable(name, f"camera '{name}' has the lens {lens}, not KANNALABRANDTK3; undistort the footage")
    fx, fy, cx, cy, *lens = numbers(*(f"intrinsics_{i}" for i in range(8)))
    R = unit_rotation(document, name, "qw_world_cam", numbers(*(f"q{axis}_world_cam" for axis in "wxyz")))
    T = rigid.inverse(rigid.transform(R, np.array(numbers(*(f"t{axis}_world_cam" for axis in "xyz")))))
    K = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    return name, plain_camera(name, numbers("image_width", "image_height"), K, lens, T, fisheye=True)
