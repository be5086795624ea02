"""A small picture of footage that belongs to no session yet."""

from contextlib import closing
from pathlib import Path

import cv2
import numpy as np

from app.drawing.pictures import footage as footage_jpeg
from app.session.footage_indices import footage_indices
from tracker.errors import RecordingError
from tracker.footage.chapters import VIDEO_SUFFIXES
from tracker.footage.video import open_footage

_LONGER_SIDE_PX = 320


def preview(path: Path) -> bytes:
    """Return the first frame of a video or a folder of images, small, as JPEG.

    Raises:
        RecordingError: it is neither, or cannot be read.
    """
    if not path.is_dir() and (path.suffix.lower() not in VIDEO_SUFFIXES or not path.is_file()):
        raise RecordingError(f"expected a video or a folder of images, found {path}; choose another")
    with closing(open_footage(path, path.stem, footage_indices(), in_background=True)) as footage:
        image = footage.read(0)
    if image is None:
        raise RecordingError(f"the first frame of {path} is damaged; see whether a player shows it")
    scale = min(1.0, _LONGER_SIDE_PX / max(image.shape[:2]))
    size = max(1, round(scale * image.shape[1])), max(1, round(scale * image.shape[0]))
    return footage_jpeg(np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8), size)
