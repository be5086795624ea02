"""Calibrations in JSON and XML of calib.io and of data sets: XRMoCap, VoxelPose, Google's rigs, MVHumanNet, Wildtrack.

The directions of their poses are those of the data sets' own code: `xrprimer`, `project_pose` of VoxelPose, the cameras
of Nerfies, and `read_camera_mvhumannet`.
"""

import pickletools
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tracker.calibrations.camera_matrices import plain_array
from tracker.calibrations.camera_words import Section, once, section_of
from tracker.calibrations.document import Document, refuse
from tracker.geometry import rigid
from tracker.validation import quoted

_VOXELPOSE = {"R", "T", "fx", "fy", "cx", "cy", "k", "p"}
_GOOGLE = {"orientation", "position", "focal_length", "principal_point"}
_MVHUMANNET = {"rotation", "translation", "focal_length", "image_center"}
_WILDTRACK = {"intr_": {"camera_matrix", "distortion_coefficients"}, "extr_": {"rvec", "tvec"}}


def _rows(document: Document) -> list[tuple[str, dict[str, Any]]]:
    """Return the groups of a file, or the rows of its list, with their names; of a lone camera the file itself."""
    data = document.data
    if isinstance(data, list):
        return [(str(row.get("name", i)), row) for i, row in enumerate(data) if isinstance(row, dict)]
    return list(document.groups.items()) or ([("", data)] if isinstance(data, dict) else [])


def _have(document: Document, keys: set[str]) -> bool:
    return any(keys <= row.keys() for _, row in _rows(document))


def _posed(section: Section, R: Any, position: Any) -> Section:
    """Give a camera its pose by the rotation from world to camera and its place; wrong shapes are refused later."""
    R, position = plain_array(R), plain_array(position).ravel()
    R = rigid.so3_exp(R) if R.shape == (3,) and np.isfinite(R).all() else R
    if R.shape != (3, 3) or position.shape != (3,):
        return section | {"rotation": R.tolist(), "translation": position.tolist()}
    return section | {"rotation": R.tolist(), "translation": (-R @ position).tolist()}


# --- XRMoCap --------------------------------------------------------------------------------------------------------


def is_xrmocap(document: Document) -> bool:
    """Return whether the file is one camera of XRPrimer."""
    return isinstance(document.data, dict) and {"extrinsic_r", "extrinsic_t", "world2cam"} <= document.data.keys()


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
    lens = {key: data.get(key) or 0.0 for key in ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")}
    words = {"K": K.tolist(), **lens, "size": [data.get("width"), data.get("height")]}
    section = section_of(words, name or document.stem, replace(document, data={})) | {"name": name or None}
    R, t = plain_array(data["extrinsic_r"]), plain_array(data["extrinsic_t"]).ravel()
    if not data["world2cam"] and R.shape == (3, 3) and t.shape == (3,):
        return {name: _posed(section, R.T, t)}
    return {name: section | {"rotation": R.tolist(), "translation": t.tolist()}}


# --- VoxelPose, Google ----------------------------------------------------------------------------------------------


def is_voxelpose(document: Document) -> bool:
    """Return whether cameras have a radial lens `k` and a tangential one `p` beside their numbers."""
    return _have(document, _VOXELPOSE)


def read_voxelpose(document: Document) -> dict[str, Section]:
    """Read cameras whose `T` is their place, in millimetres."""
    found = {}
    for name, group in once(document, _rows(document)).items():
        words = {"radial": group.get("k"), "tangential": group.get("p")}
        words |= {key: group.get(key) for key in ("fx", "fy", "cx", "cy", "width", "height")}
        section = section_of(words, name or document.stem, document)
        found[name] = _posed(section, group.get("R"), group.get("T")) | {"name": name or None}
    return found


def is_google(document: Document) -> bool:
    """Return whether cameras have an orientation and a position beside their lens."""
    return _have(document, _GOOGLE)


def read_google(document: Document) -> dict[str, Section]:
    """Read cameras of Google's light fields and of Nerfies: `orientation` maps world to camera."""
    found = {}
    for name, group in once(document, _rows(document)).items():
        lens = {key: value for key, value in group.items() if key not in ("orientation", "position")}
        focal, ratio = plain_array(group.get("focal_length")), plain_array(group.get("pixel_aspect_ratio", 1.0))
        if focal.shape == ratio.shape == ():
            lens["focal_length"] = [float(focal), float(focal * ratio)]
        section = section_of(lens, name or document.stem, document)
        if section["fisheye"]:
            radial = plain_array(group.get("radial_distortion", [])).ravel().tolist()
            section["distortions"] = [*radial, 0.0, 0.0, 0.0, 0.0][:4]
        found[name] = _posed(section, group.get("orientation"), group.get("position")) | {"name": name or None}
    return found


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
        f, ratio = plain_array(numbers.pop("f", None)), plain_array(numbers.pop("ar", 1.0))
        order = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tauX", "tauY")
        turn, shift = (_inner(camera, "transform", key) for key in ("rotation", "translation"))
        words = {
            "model": names[kind],
            "focal_length": [float(f), float(f * ratio)] if f.shape == ratio.shape == () else None,
            "principal_point": [numbers.get("cx"), numbers.get("cy")],
            "distortions": [numbers.get(key) or 0.0 for key in order],
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


def is_mvhumannet(document: Document) -> bool:
    """Return whether cameras have the words of `camera_extrinsics.json`."""
    return _have(document, _MVHUMANNET)


def read_mvhumannet(document: Document) -> dict[str, Section]:
    """Read cameras whose translations, millimetres, count by the factor in `camera_scale.pkl`.

    Raises:
        CalibrationError: that file is not beside this one, or holds no number.
    """
    scale = _camera_scale(document)
    rows = []
    for key, group in once(document, _rows(document)).items():
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
