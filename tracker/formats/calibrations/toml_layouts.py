"""Calibrations in TOML: anipose, Pose2Sim, FreeMoCap, and Caliscope in its newer and older forms."""

from collections.abc import Mapping
from typing import Any

from tracker.formats.calibrations.camera_words import Section, is_camera, section_of
from tracker.formats.calibrations.document import Document, refuse
from tracker.formats.calibrations.lens_words import is_understood, is_unknown
from tracker.formats.calibrations.words import spelled
from tracker.validation import quoted

_CAMERA_KEYS = {"name", "size", "matrix", "rotation", "translation", "distortions"}
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
    return document.syntax == "toml" and any(_CAMERA_KEYS & group.keys() for group in document.groups.values())


def read_top_sections(document: Document) -> dict[str, Section]:
    """Read the sections of cameras at the top; others, such as `metadata`, are left out.

    Raises:
        CalibrationError: a key or value that changes the meaning is not understood.
    """
    for key, value in document.data.items():
        if not isinstance(value, dict) and not is_understood(key, value) and is_unknown(key, value):
            raise refuse(document, None, "known keys of a lens or a convention", quoted(key), "remove it")
    groups = document.groups.items()
    return _sections({k: g for k, g in groups if k.lower() != "metadata" and _CAMERA_KEYS & g.keys()}, document)


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
