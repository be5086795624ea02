"""Read single frames for thumbnails with decoders of their own, so that playback and trackers keep their places."""

import threading
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np

from tracker.evidence.images.working_view import WorkingView
from tracker.footage.camera_source import CameraSource
from tracker.footage.recording import Recording
from tracker.geometry.arrays import Image
from tracker.geometry.cameras import Camera

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
