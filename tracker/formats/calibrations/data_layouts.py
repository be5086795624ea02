"""Calibrations in JSON, YAML, OpenCV's XML or TOML, with all cameras in one file.

The direction of a pose other than `X_camera = R X_world + t` is that of the tool's own source:
`export_json` of multical, `Calibration::saveCamerasParams` of MC-Calib, and the camchain of Kalibr's manual.
"""

from collections import ChainMap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from tracker.formats.calibrations.camera_matrices import homogeneous, is_transposed, plain_array
from tracker.formats.calibrations.camera_words import (
    Section,
    camera_groups,
    is_camera,
    known_values,
    once,
    plain_text,
    posed,
    section_of,
)
from tracker.formats.calibrations.document import Document, refuse
from tracker.formats.calibrations.lens_words import is_understood, is_unknown, spelled
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.validation import quoted

_ANIPOSE_KEYS = {"name", "size", "matrix", "rotation", "translation", "distortions"}


def has_cameras(document: Document) -> bool:
    """Return whether the data have a camera under OpenCV's words."""
    return bool(camera_groups(document.data))


def read_words(document: Document) -> dict[str, Section]:
    """Read cameras under OpenCV's words."""

    def cameras() -> Iterator[tuple[str, Section]]:
        for key, group in camera_groups(document.data).items():
            if known_values(group).get("ignore") is not True:
                section = section_of(group, key or document.stem, document)
                name = key if section["name"] is None else plain_text(section["name"])
                yield name, section | ({"name": name} if name else {})

    return once(document, cameras())


def is_aniposelib(document: Document) -> bool:
    """Return whether the data are a list of cameras with anipose's keys."""
    data = document.data
    return isinstance(data, list) and any(isinstance(row, dict) and row.keys() >= _ANIPOSE_KEYS for row in data)


# --- EasyMocap ------------------------------------------------------------------------------------------------------


def is_easymocap(document: Document) -> bool:
    """Return whether keys such as `K_01`, or `R_01` and `T_01`, are at the top."""
    return _has_intrinsics(document) or _has_extrinsics(document)


def join_easymocap(documents: Sequence[Document]) -> Sequence[Document]:
    """Join a file of lenses and one of poses; others stay apart."""
    if len(documents) == 1 or not (any(map(_has_intrinsics, documents)) and any(map(_has_extrinsics, documents))):
        return documents
    return [replace(documents[0], data={key: value for d in documents for key, value in d.data.items()})]


def _has_intrinsics(document: Document) -> bool:
    """Return whether EasyMocap's matrices are there."""
    return isinstance(document.data, dict) and any(key.startswith("K_") for key in document.data)


def _has_extrinsics(document: Document) -> bool:
    """Return whether EasyMocap's poses are there."""
    keys = document.data.keys() if isinstance(document.data, dict) else ()
    return any(k.startswith(("R_", "Rot_")) for k in keys) and any(k.startswith("T_") for k in keys)


# --- Kalibr ---------------------------------------------------------------------------------------------------------


def read_kalibr(document: Document) -> dict[str, Section]:
    """Read a camchain: `T_cn_cnm1` maps from the camera before; the first camera defines the world."""
    found: dict[str, Section] = {}
    T_camera_world: Array | None = np.eye(4)
    cameras = {n: g for n, g in document.groups.items() if {"camera_model", "intrinsics"} <= g.keys()}
    for i, (name, group) in enumerate(cameras.items()):
        step = homogeneous(group.get("T_cn_cnm1"))
        if i:
            T_camera_world = None if step is None or T_camera_world is None else step @ T_camera_world
        lens = {key: value for key, value in group.items() if not key.startswith("T_")}
        found[name] = section_of(lens, name, document) | {"name": name} | posed(T_camera_world)
    return found


# --- multical -------------------------------------------------------------------------------------------------------


def read_multical(document: Document) -> dict[str, Section]:
    """Read cameras and their poses; `a_to_b` is the pose of camera a in the frame of b."""
    poses = {name.partition("_to_")[0]: pose for name, pose in document.groups["camera_poses"].items()}
    poses |= document.groups["camera_poses"]
    found: dict[str, Section] = {}
    for name, lens in document.groups["cameras"].items():
        group = ChainMap(*(half for half in (poses.get(name), lens) if isinstance(half, dict)))
        found[name] = section_of(group, name, document) | {"name": name}
    return found


# --- MC-Calib -------------------------------------------------------------------------------------------------------


def read_mc_calib(document: Document) -> dict[str, Section]:
    """Read cameras whose pose maps camera to world: the inverse of the projection's, as MC-Calib writes it.

    Raises:
        CalibrationError: the cameras are in groups that do not know of each other.
    """
    cameras = {n: g for n, g in document.groups.items() if "camera_matrix" in g or "camera_pose_matrix" in g}
    groups = {plain_text(group.get("camera_group", 0)) for group in cameras.values()}
    if len(groups) > 1:
        seen = f"{len(groups)} (camera_group), each with a world of its own"
        raise refuse(document, None, "one group of cameras", seen, "film the boards so that all cameras are connected")
    found = {}
    for name, group in cameras.items():
        T_world_camera = homogeneous(group.get("camera_pose_matrix"))
        lens = {key: value for key, value in group.items() if key != "camera_pose_matrix"}
        pose = None if T_world_camera is None else rigid.inverse(T_world_camera)
        found[name] = section_of(lens, name, document) | {"name": name} | posed(pose)
    return found


# --- JARVIS and DANNCE: row vectors ---------------------------------------------------------------------------------


def read_row_vectors(document: Document) -> dict[str, Section]:
    """Read cameras that project row vectors, `x = [X 1] [R; t] K`: all matrices are transposed.

    A camera whose matrix stands upright was rewritten by a person; it is read as it is.
    """
    rows, found = document.rows, dict[str, Section]()
    if isinstance(document.data, list):  # `params` of MATLAB
        rows = [(f"camera{i + 1}", row) for i, (_, row) in enumerate(rows)]
    for name, group in rows:
        section = section_of(group, name or document.stem, document)
        if is_transposed(section["matrix"]):
            section["matrix"] = plain_array(section["matrix"]).T.tolist()
            rotation = plain_array(section["rotation"])
            if rotation.shape == (3, 3):
                section["rotation"] = rotation.T.tolist()
        found[name] = section | ({"name": name} if name else {})
    return found


# --- OpenPose -------------------------------------------------------------------------------------------------------


def read_openpose(document: Document) -> dict[str, Section]:
    """Read one camera: OpenPose's `CameraMatrix` is the pose, (3, 4)."""
    words = {"CameraMatrix": "Rt", "Intrinsics": "K"}
    group = {words.get(key, key): value for key, value in document.data.items() if key != "CameraMatrixInitial"}
    return {"": section_of(group, document.stem, document)}


_CALISCOPE_NUMBERS = ("cam_id", "port")
"""Keys of the number of a camera, after which Caliscope names its videos: `cam_0`, once `port_0`."""


def is_caliscope(document: Document) -> bool:
    """Return whether the cameras lie below `cameras`."""
    cameras = document.groups.get("cameras", {})
    return document.syntax == "toml" and any(isinstance(c, dict) and is_camera(c) for c in cameras.values())


def read_caliscope(document: Document) -> dict[str, Section]:
    """Read `camera_array.toml`; cameras that Caliscope ignores are left out."""
    groups = {key: group for key, group in document.data["cameras"].items() if isinstance(group, dict)}
    return _sections({_caliscope_name(key, group): group for key, group in groups.items()}, document)


def is_pyxy3d(document: Document) -> bool:
    """Return whether numbered cameras lie beside other sections at the top."""
    cameras = filter(is_camera, document.groups.values())
    return document.syntax == "toml" and any(number in camera for camera in cameras for number in _CALISCOPE_NUMBERS)


def is_freemocap(document: Document) -> bool:
    """Return whether the metadata are those of FreeMoCap."""
    metadata = document.groups.get("metadata", {})
    return is_anipose(document) and any(spelled(key).startswith("charuco") for key in metadata)


def is_anipose(document: Document) -> bool:
    """Return whether there are sections of cameras at the top."""
    return document.syntax == "toml" and any(_ANIPOSE_KEYS & group.keys() for group in document.groups.values())


def read_top_sections(document: Document) -> dict[str, Section]:
    """Read the sections of cameras at the top; others, such as `metadata`, are left out.

    Raises:
        CalibrationError: a key or value that changes the meaning is not understood.
    """
    for key, value in document.data.items():
        if not isinstance(value, dict) and not is_understood(key, value) and is_unknown(key, value):
            raise refuse(document, None, "known keys of a lens or a convention", quoted(key), "remove it")
    groups = document.groups.items()
    return _sections({k: g for k, g in groups if k.lower() != "metadata" and _ANIPOSE_KEYS & g.keys()}, document)


def _sections(groups: Mapping[str, Mapping[str, Any]], document: Document) -> dict[str, Section]:
    return {
        name: section_of(group, name, document)
        for name, group in groups.items()
        if not (group.get("ignore") is True or group.get("ignored") is True)
    }


def _caliscope_name(key: str, group: Mapping[str, Any]) -> str:
    for number in _CALISCOPE_NUMBERS:
        if isinstance(group.get(number), int):
            return f"{number.removesuffix('_id')}_{group[number]}"
    return key


def board_square(document: Document) -> float | None:
    """Return the side of a square of the board in the unit of the file; None if it is not stated."""
    for key, value in document.groups.get("metadata", {}).items():
        if spelled(key) in ("charucosquaresize", "squaresize", "squarelength", "boardsquaresize"):
            return float(value) if isinstance(value, int | float) and value > 0 else None
    return None
