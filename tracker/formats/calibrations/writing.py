"""Write calibrated cameras in the layouts of other programs, in metres: `X_camera = R X_world + t`."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import tomli_w

from tracker.files import write_text_atomic
from tracker.formats.anipose import anipose_section, format_calibration
from tracker.geometry.cameras import Camera


def anipose_text(cameras: Sequence[Camera], metadata: Mapping[str, Any] | None = None) -> str:
    """Return `calibration.toml` of anipose: sections `cam_0`, `cam_1`, ... with the cameras' names."""
    data = {f"cam_{i}": {"name": c.name, **anipose_section(c), "fisheye": c.fisheye} for i, c in enumerate(cameras)}
    return tomli_w.dumps({**data, "metadata": dict(metadata or {"adjusted": True, "error": 0.0})})


def caliscope_text(cameras: Sequence[Camera]) -> str:
    """Return `camera_array.toml` of Caliscope, which numbers its cameras: by the ends of their names if these differ.

    Its videos are named `cam_0.mp4` and so on.
    """
    ends = [re.search(r"(\d+)\D*\Z", c.name) for c in cameras]
    numbers = [int(end[1]) for end in ends if end is not None]
    if len(set(numbers)) < len(cameras):
        numbers = list(range(len(cameras)))
    sections = {
        str(n): {"cam_id": n, "rotation_count": 0, "error": 0.0, "grid_count": 0, "ignore": False, **anipose_section(c)}
        | ({"fisheye": True} if c.fisheye else {})
        for n, c in zip(numbers, cameras, strict=True)
    }
    return tomli_w.dumps({"cameras": sections})


def opencv_text(cameras: Sequence[Camera]) -> str:
    """Return YAML of OpenCV's `FileStorage`: a group with `camera_matrix`, `dist_coeffs`, `R`, `T` for each camera."""
    storage = cv2.FileStorage(".yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    for i, camera in enumerate(cameras):
        # Keys of a storage begin with a letter and have no blanks.
        plain = re.fullmatch(r"[A-Za-z_][\w-]*", camera.name, re.ASCII)
        storage.startWriteStruct(camera.name if plain else f"cam_{i}", cv2.FileNode_MAP)
        storage.write("name", camera.name)
        storage.write("image_width", camera.width)
        storage.write("image_height", camera.height)
        storage.write("camera_matrix", camera.K)
        storage.write("dist_coeffs", camera.distortion.reshape(1, -1) if camera.distortion.size else np.zeros((1, 4)))
        storage.write("R", np.ascontiguousarray(camera.T_camera_world[:3, :3]))
        storage.write("T", np.ascontiguousarray(camera.T_camera_world[:3, 3:]))
        if camera.fisheye:
            storage.write("fisheye", 1)
        storage.endWriteStruct()
    return storage.releaseAndGetString()


LAYOUT_TEXTS: Mapping[str, Callable[[Sequence[Camera]], str]] = {
    "anipose": anipose_text,
    "pose2sim": format_calibration,
    "caliscope": caliscope_text,
    "opencv": opencv_text,
}
"""Writers by the names that a user chooses. In `Calib.toml` of Pose2Sim each camera has a section of its name."""


def write_layout(path: Path, layout: str, cameras: Sequence[Camera]) -> None:
    """Write cameras in a layout of `LAYOUT_TEXTS`, whole or not at all.

    Raises:
        OSError: the folder is missing or not writable, or the disk is full.
    """
    write_text_atomic(path, LAYOUT_TEXTS[layout](cameras))
