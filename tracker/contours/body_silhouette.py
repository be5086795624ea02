"""Paint the silhouettes of posed bodies in raw pixels: as filmed, lens distortion included."""

from collections.abc import Sequence
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.body.model import PosedBody
from tracker.contours.label_image import part_labels
from tracker.geometry.arrays import FloatArray
from tracker.geometry.cameras import Camera


def body_silhouette(bodies: Sequence[PosedBody], camera: Camera) -> NDArray[np.bool_]:
    """Return the pixels that bodies cover, (H, W), in the raw pixels of a camera.

    Pixels that only a lens shows, beyond the undistorted image, are left out.
    """
    covered = part_labels(bodies, camera.pinhole) > 0
    if camera.is_pinhole:
        return np.asarray(covered)
    columns, rows = _undistorted(camera.size, camera.K.tobytes(), camera.distortion.tobytes())
    return np.asarray(cv2.remap(covered.view(np.uint8), columns, rows, cv2.INTER_NEAREST)).view(np.bool_)


@lru_cache(maxsize=32)
def _undistorted(size: tuple[int, int], K: bytes, distortion: bytes) -> tuple[FloatArray, FloatArray]:
    """Return the undistorted pixel of each raw pixel, (H, W) each for columns and rows."""
    camera = Camera("", size, np.frombuffer(K).reshape(3, 3), np.frombuffer(distortion), np.eye(4))
    raw_px = np.stack(np.meshgrid(np.arange(size[0]), np.arange(size[1])), axis=-1).astype(np.float64)
    found = np.nan_to_num(camera.undistort_points(raw_px), nan=-1e6).astype(np.float32)
    return np.ascontiguousarray(found[..., 0]), np.ascontiguousarray(found[..., 1])
