"""Files of the footage of a new session: videos of a folder, backgrounds and masks by the names of cameras."""

from pathlib import Path
from typing import NamedTuple

from tracker.errors import RecordingError, Remedy, SessionError
from tracker.files import entries_below, paths_in
from tracker.footage.camera_source import CameraSource
from tracker.footage.chapters import VIDEO_SUFFIXES
from tracker.footage.image_file import IMAGE_SUFFIXES
from tracker.footage.recording import read_background, read_mask
from tracker.formats.calibrations.reading import calibration_in
from tracker.session.matching import find_entry

_FOOTAGE, _BACKGROUND, _MASKS = ("videos", "footage"), ("background", "backgrounds"), ("masks",)
"""Usual names of the folders of a recording, in lower case."""


class SideParts(NamedTuple):
    """Parts of a recording that lie beside its footage; None for each that is not there."""

    calibration: Path | None
    background: Path | None
    masks: Path | None


def side_parts(folder: Path) -> SideParts:
    """Find calibration, background and masks of a recording.

    Args:
        folder: of the recording, or its folder `videos`.
    """
    around = folder.parent if folder.name.lower() in _FOOTAGE else folder
    calibration = calibration_in(around) or calibration_in(folder)
    return SideParts(calibration, *(_folder_named(around, names) for names in (_BACKGROUND, _MASKS)))


def _folder_named(folder: Path, names: tuple[str, ...]) -> Path | None:
    files = paths_in(folder, SessionError, lambda name: name.lower() in names)
    return next((path for path in files if path.is_dir()), None)


def footage_in(folder: Path) -> list[Path]:
    """Return the videos of a folder or of its folder `videos`.

    Without any, its folders of images or of the chapters of a video are returned.

    Raises:
        SessionError: there is neither.
    """
    if not folder.is_dir():
        raise SessionError(f"expected a folder of videos, found none at {folder}; check the path")
    entries = paths_in(folder, SessionError)
    videos = [path for path in entries if path.suffix.lower() in VIDEO_SUFFIXES and path.is_file()]
    if not videos and (inner := _folder_named(folder, _FOOTAGE)):
        return footage_in(inner)
    beside = (*_BACKGROUND, *_MASKS)
    folders = [path for path in entries if path.is_dir() and path.name.lower() not in beside]
    footage = videos or [path for path in folders if _has_footage(path)]
    if not footage:
        raise SessionError(
            f"expected videos ({', '.join(VIDEO_SUFFIXES)}) or folders of images in {folder}, found none; "
            "choose the folder that holds the footage of all cameras"
        )
    return footage


def _has_footage(folder: Path) -> bool:
    entries = entries_below(folder, SessionError, enters=False)
    return any(entry.name.lower().endswith((*IMAGE_SUFFIXES, *VIDEO_SUFFIXES)) for entry in entries)


def find_background(folder: Path, camera: str) -> Path:
    """Find the background of a camera by its name, an image or a video.

    Raises:
        RecordingError: there is none.
    """
    for suffix in (*IMAGE_SUFFIXES, *VIDEO_SUFFIXES):
        path = find_entry(folder, f"{camera}{suffix}")
        if path.is_file():
            return path
    raise RecordingError(
        f"camera '{camera}': no background in {folder}: expected {camera}.png or {camera}.mp4",
        Remedy("give_camera_background"),
    )


def find_masks(folder: Path, camera: str) -> Path:
    """Find the folder of masks of a camera by its name.

    Raises:
        RecordingError: there is none, or it has no masks.
    """
    path = find_entry(folder, camera)
    if not any(path.glob("[0-9]" * 6 + ".png")):
        raise RecordingError(
            f"camera '{camera}': no masks in {path}: expected files named 000000.png and so on by video frame",
            Remedy("give_camera_masks"),
        )
    return path


def check_side_files(source: CameraSource) -> None:
    """Read the background and the first mask, so that a misfit shows before tracking starts.

    Raises:
        RecordingError: one is missing, unreadable or of another size than the camera.
    """
    read_background(source)
    if source.masks is not None:
        first = min(find_masks(source.masks.parent, source.masks.name).glob("[0-9]" * 6 + ".png"))
        read_mask(source, int(first.stem) - source.offset)
