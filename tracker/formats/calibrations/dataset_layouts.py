"""Calibrations in JSON and XML of calib.io and of data sets: XRMoCap, VoxelPose, Google's rigs, MVHumanNet, Wildtrack.

The directions of their poses are those of the data sets' own code: `xrprimer`, `project_pose` of VoxelPose, the cameras
of Nerfies, and `read_camera_mvhumannet`.
"""

import pickletools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tracker.formats.calibrations.camera_matrices import plain_array
from tracker.formats.calibrations.camera_words import COEFFICIENTS, Section, each, once, section_of
from tracker.formats.calibrations.document import Document, refuse
from tracker.geometry import rigid
from tracker.validation import quoted

_WILDTRACK = {"intr_": {"camera_matrix", "distortion_coefficients"}, "extr_": {"rvec", "tvec"}}


def _posed(section: Section, R: Any, position: Any) -> Section:
    """Give a camera its pose by the rotation from world to camera and its place; wrong shapes are refused later."""
    R, position = plain_array(R), plain_array(position).ravel()
    R = rigid.so3_exp(R) if R.shape == (3,) and np.isfinite(R).all() else R
    if R.shape != (3, 3) or position.shape != (3,):
        return section | {"rotation": R.tolist(), "translation": position.tolist()}
    return section | {"rotation": R.tolist(), "translation": (-R @ position).tolist()}


def _focal(f: Any, ratio: Any) -> list[float] | None:
    """Return focal lengths from the horizontal one and the ratio of the vertical one to it; None without both."""
    f, ratio = plain_array(f), plain_array(1.0 if ratio is None else ratio)
    return [float(f), float(f * ratio)] if f.shape == ratio.shape == () else None


# --- XRMoCap --------------------------------------------------------------------------------------------------------


def read_xrmocap(document: Document) -> dict[str, Section]:
    """Read one camera: `world2cam` says the direction of its pose, and `convention` the axes."""
    data = document.data
    name = str(data.get("name") or "")
    if data.get("convention", "opencv") != "opencv":
        found = f"'convention' = {quoted(data['convention'])}"
        raise refuse(document, name, "OpenCV's axes", found, "convert the camera to 'opencv' by XRPrimer")
    if not isinstance(data["world2cam"], bool):
        raise refuse(document, name, "true or false as 'world2cam'", quoted(data["world2cam"]), "correct it")
    K = plain_array(data.get("intrinsic"))
    if K.shape == (4, 4):  # its third and fourth row are exchanged, as PyTorch3D has them
        K = np.vstack([K[:2, :3], [0.0, 0.0, 1.0]])
    lens = {key: data.get(key) or 0.0 for key in COEFFICIENTS[False]}
    words = {"K": K.tolist(), **lens, "size": [data.get("width"), data.get("height")]}
    section = section_of(words, name or document.stem, replace(document, data={})) | {"name": name or None}
    R, t = plain_array(data["extrinsic_r"]), plain_array(data["extrinsic_t"]).ravel()
    if not data["world2cam"] and R.shape == (3, 3) and t.shape == (3,):
        return {name: _posed(section, R.T, t)}
    return {name: section | {"rotation": R.tolist(), "translation": t.tolist()}}


# --- VoxelPose, Google ----------------------------------------------------------------------------------------------


@each
def read_voxelpose(document: Document, name: str, row: Mapping[str, Any]) -> Section:
    """Read a camera whose `T` is its place, in millimetres."""
    words = {"radial": row.get("k"), "tangential": row.get("p")}
    words |= {key: row.get(key) for key in ("fx", "fy", "cx", "cy", "width", "height")}
    return _posed(section_of(words, name, document), row.get("R"), row.get("T"))


@each
def read_google(document: Document, name: str, row: Mapping[str, Any]) -> Section:
    """Read a camera of Google's light fields or of Nerfies: `orientation` maps world to camera."""
    lens = {key: value for key, value in row.items() if key not in ("orientation", "position")}
    if (focal := _focal(row.get("focal_length"), row.get("pixel_aspect_ratio"))) is not None:
        lens["focal_length"] = focal
    section = section_of(lens, name, document)
    if section["fisheye"]:
        radial = plain_array(row.get("radial_distortion", [])).ravel().tolist()
        section["distortions"] = [*radial, 0.0, 0.0, 0.0, 0.0][:4]
    return _posed(section, row.get("orientation"), row.get("position"))


# --- calib.io -------------------------------------------------------------------------------------------------------


def is_calib_io(document: Document) -> bool:
    """Return whether the data are those of calib.io's calibrator."""
    cameras = _calib_io_cameras(document)
    return bool(cameras) and all(isinstance(c, dict) and isinstance(c.get("model"), dict) for c in cameras)


def _calib_io_cameras(document: Document) -> Sequence[Any]:
    cameras = document.groups.get("Calibration", {}).get("cameras")
    return cameras if isinstance(cameras, list) else ()


def read_calib_io(document: Document) -> dict[str, Section]:
    """Read the cameras of calib.io, which are numbered; the name of a model is there at its first camera only."""
    found, names = {}, {}
    for i, camera in enumerate(_calib_io_cameras(document)):
        model = camera["model"]
        data = _inner(model, "ptr_wrapper", "data")
        kind = (model.get("polymorphic_id") or 0) % 2**31 if isinstance(model.get("polymorphic_id"), int) else 0
        names.setdefault(kind, str(model.get("polymorphic_name")).removeprefix("libCalib::CameraModel"))
        numbers = {key: _inner(row).get("val") for key, row in _inner(data, "parameters").items()}
        order = (*COEFFICIENTS[False], "s1", "s2", "s3", "s4", "tauX", "tauY")
        turn, shift = (_inner(camera, "transform", key) for key in ("rotation", "translation"))
        words = {
            "model": names[kind],
            "focal_length": _focal(numbers.get("f"), numbers.get("ar")),
            "principal_point": [numbers.get("cx"), numbers.get("cy")],
            "distortions": [numbers.get(key) or 0.0 for key in (order if "p1" in numbers else COEFFICIENTS[True])],
            "rvec": [turn.get(key) for key in ("rx", "ry", "rz")],
            "t": [shift.get(key) for key in "xyz"],
            "size": _inner(data, "CameraModelCRT", "CameraModelBase", "imageSize"),
        }
        found[str(i)] = section_of(words, str(i), document)
    return found


def _inner(group: Any, *keys: str) -> Mapping[str, Any]:
    """Return a group within groups; an empty one if it is not there."""
    for key in keys:
        group = group.get(key) if isinstance(group, dict) else None
    return group if isinstance(group, dict) else {}


# --- MVHumanNet -----------------------------------------------------------------------------------------------------


def read_mvhumannet(document: Document) -> dict[str, Section]:
    """Read cameras whose translations, millimetres, count by the factor in `camera_scale.pkl`.

    Raises:
        CalibrationError: that file is not beside this one, or holds no number.
    """
    scale = _camera_scale(document)
    rows = []
    for key, group in once(document, document.rows).items():
        name = key.partition(".")[0].rpartition("_")[2]
        center = plain_array(group.get("image_center")).ravel()
        words = {"focal_length": group.get("focal_length"), "principal_point": center[:2].tolist()}
        words |= {"size": center[2:].tolist()} if center.size == 4 else {}
        words |= {"R": group.get("rotation"), "t": (scale * plain_array(group.get("translation"))).tolist()}
        rows.append((name, section_of(words, name, document) | {"name": name}))
    return once(document, rows)


def _camera_scale(document: Document) -> float:
    """Return the number in a pickle beside a file. Its codes are looked at, and never run."""
    path = document.path.with_name("camera_scale.pkl")
    try:
        codes = list(pickletools.genops(path.read_bytes()[:1000])) if path.is_file() else []
    except ValueError:
        codes = []
    numbers = [value for code, value, _ in codes if isinstance(value, float) and code.name in ("BINFLOAT", "FLOAT")]
    if len(numbers) != 1:
        expected, found = "camera_scale.pkl of MVHumanNet beside it, with one number", "none"
        raise refuse(document, None, expected, found, "put it there, or multiply the translations by it")
    return numbers[0]


# --- Wildtrack ------------------------------------------------------------------------------------------------------


def is_wildtrack(document: Document) -> bool:
    """Return whether an XML file of OpenCV holds one lens alone, or one pose alone."""
    data = document.data
    return document.syntax == "xml" and isinstance(data, dict) and set(data) in _WILDTRACK.values()


def join_wildtrack(documents: Sequence[Document]) -> list[Document]:
    """Join the lens and the pose of each camera, whose files are named alike but for their beginnings."""
    halves: dict[str, dict[str, Any]] = {}
    for document in documents:
        name = document.stem
        for begin in _WILDTRACK:
            name = name.removeprefix(begin)
        halves.setdefault(name, {}).update(document.data)
    return [replace(documents[0], path=documents[0].path.with_name(f"{n}.xml"), data=d) for n, d in halves.items()]
