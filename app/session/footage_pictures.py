"""A small picture of footage that belongs to no session yet.

Read single frames for thumbnails with decoders of their own, so that playback and trackers keep their places.
"""

import threading
from collections.abc import Sequence
from contextlib import closing
from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np

from app.drawing.pictures import footage as footage_jpeg
from app.session.footage_indices import footage_indices
from tracker.errors import RecordingError
from tracker.evidence.images.working_view import WorkingView
from tracker.footage.camera_source import CameraSource
from tracker.footage.chapters import VIDEO_SUFFIXES
from tracker.footage.recording import Recording
from tracker.footage.video import open_footage
from tracker.geometry.arrays import Image
from tracker.geometry.cameras import Camera

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


_CACHE_BYTES = 2**20
"""Hardly any: neighbouring thumbnails show other frames."""
_AREA_PX = 960 * 720
"""Largest number of pixels of an image that thumbnails are cut from."""
_N_VIEWS = 8
"""Number of cameras whose resampling maps are cached, 4 MB each at most."""


class FootageCrops:
    """The footage of a session at the scale of thumbnails. Files are opened at the first image."""

    def __init__(self, cameras: Sequence[CameraSource], indices: Path | None = None) -> None:
        """Open nothing yet.

        Args:
            cameras: footage of each camera.
            indices: folder in which the lists of frames are cached.
        """
        self._indices = indices
        self._recording: Recording | None = None
        self.set_cameras(cameras)
        self._scales = [min(1.0, float(np.sqrt(_AREA_PX / (c.camera.width * c.camera.height)))) for c in cameras]
        self._lock = threading.Lock()

    def set_cameras(self, cameras: Sequence[CameraSource]) -> None:
        """Continue with other calibrations of the same cameras."""
        self._sources = tuple(cameras)
        if self._recording is not None:
            self._recording = self._recording.with_cameras(cameras)
        self._views = lru_cache(_N_VIEWS)(self._view)

    @property
    def cameras(self) -> list[Camera]:
        """The cameras of the images."""
        return [c.camera.pinhole.scaled(s) for c, s in zip(self._sources, self._scales, strict=True)]

    def image(self, camera: int, frame: int) -> Image | None:
        """Return the undistorted image of a frame, (H, W, 3) RGB; None if it is damaged.

        Raises:
            RecordingError: the footage cannot be read.
        """
        with self._lock:
            if self._recording is None:
                self._recording = Recording(self._sources, _CACHE_BYTES, self._indices)
            recording = self._recording
        found = recording.read_view(camera, frame)
        view = self._views(camera)
        return None if found is None else view.image(found, view.whole)

    def close(self) -> None:
        """Release all files."""
        with self._lock:
            if self._recording is not None:
                self._recording.close()
                self._recording = None

    def _view(self, camera: int) -> WorkingView:
        return WorkingView(self._sources[camera].camera, self._scales[camera])
