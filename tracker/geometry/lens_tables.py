"""Tables that depend on the lens of a camera alone, cached for all cameras that share it."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import FloatArray
from tracker.geometry.cameras import BEYOND_PX, Camera


class Lens(NamedTuple):
    """The lens of a camera and the size of its image, as values that can be looked up."""

    size: tuple[int, int]
    """Width and height, px."""
    K: bytes
    """Its matrix."""
    distortion: bytes
    """Its coefficients."""
    fisheye: bool
    """See `Camera`."""

    @property
    def camera(self) -> Camera:
        """A camera with this lens at the origin, which looks along z."""
        K, distortion = np.frombuffer(self.K).reshape(3, 3), np.frombuffer(self.distortion)
        return Camera("", self.size, K, distortion, np.eye(4), self.fisheye)


def lens_of(camera: Camera) -> Lens:
    """Return the lens of a camera."""
    return Lens(camera.size, camera.K.tobytes(), camera.distortion.tobytes(), camera.fisheye)


@lru_cache(maxsize=32)
def undistortion_map(lens: Lens) -> tuple[FloatArray, FloatArray]:
    """Return the undistorted pixel of each original pixel, columns and rows, (H, W) each.

    It is far outside of the picture for pixels that have none.
    """
    camera = lens.camera
    original_px = np.stack(np.meshgrid(np.arange(camera.width), np.arange(camera.height)), axis=-1)
    found = camera.undistort_points(original_px.astype(np.float64))
    found = np.nan_to_num(np.clip(found, BEYOND_PX, -BEYOND_PX), nan=BEYOND_PX).astype(np.float32)
    return np.ascontiguousarray(found[..., 0]), np.ascontiguousarray(found[..., 1])
