"""Look up raw pixels from undistorted sensor coordinates, so that only the rigid motion is computed at run time.

MTHC01 Eq. 1 maps distorted to undistorted coordinates (Tsai). Cameras here have OpenCV's model, which maps undistorted
to distorted ones, so that the table is filled without inverting it. The table depends on the lens alone and holds for
any pose of the camera.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Array
from tracker.geometry.cameras import BEYOND_PX, Camera
from tracker.geometry.lens_tables import Lens

_STEPS_PER_PX = 2
"""Entries of the table per raw pixel along each axis."""
_MAX_ENTRIES = 4096
"""Largest number of entries along each axis. Wide lenses have long borders."""
_BORDER_SAMPLES = 64
"""Points along each side of the image whose rays bound the table; a border bends little between two of them."""
_ROWS_AT_ONCE = 64
"""Rows of the table that are filled at a time: all rows of a wide lens would take gigabytes."""


class SensorLookup(NamedTuple):
    """Raw pixel of each quantized point of the undistorted sensor plane at focal length 1."""

    pixels: NDArray[np.int16]
    """Column and row of the raw pixel, (rows, columns, 2). It may lie outside the image."""
    corner: Array
    """Sensor coordinates x, y of the first entry, (2,)."""
    step: float
    """Distance between entries along both axes."""
    px_per_unit: float
    """Upper bound of the distance of two entries' pixels along an image axis, divided by their distance."""


@lru_cache(maxsize=32)
def lookup_of_lens(lens: Lens) -> SensorLookup:
    """Return the table of all cameras with a lens, cached. It covers the image and half a pixel around it."""
    camera = lens.camera
    low, high = _border(camera)
    step = max(1 / (_STEPS_PER_PX * max(camera.K[0, 0], camera.K[1, 1])), float((high - low).max()) / _MAX_ENTRIES)
    n_columns, n_rows = (int(np.ceil(n)) + 1 for n in (high - low) / step)
    x, rows = low[0] + step * np.arange(n_columns), low[1] + step * np.arange(n_rows)
    exact = np.concatenate([_exact_pixels(camera, x, y) for y in np.array_split(rows, -(-n_rows // _ROWS_AT_ONCE))])
    pixels = np.round(np.clip(exact, BEYOND_PX, -BEYOND_PX)).astype(np.int16)
    return SensorLookup(pixels, low, step, _steepest(exact) / step)


def _exact_pixels(camera: Camera, x: Array, y: Array) -> Array:
    """Return the raw pixel of each point of a grid of sensor coordinates, (len(y), len(x), 2)."""
    points = np.stack([*np.meshgrid(x, y), np.ones((len(y), len(x)))], axis=-1).reshape(-1, 3)
    exact = camera.project(points)
    # Beyond the lens the polynomial bends back: nothing is seen there.
    exact[~camera.within_lens(camera.pinhole.project(points)) | np.isnan(exact).any(axis=-1)] = BEYOND_PX
    return exact.reshape(len(y), len(x), 2)


def _border(camera: Camera) -> tuple[Array, Array]:
    """Return the lowest and highest sensor coordinates of the image, (2,) each; of a fisheye's, as undistorted."""
    seen = camera.pinhole if camera.fisheye else camera
    width, height = seen.size
    u, v = np.linspace(-1, width, _BORDER_SAMPLES), np.linspace(-1, height, _BORDER_SAMPLES)
    sides = [np.stack(np.broadcast_arrays(a, b), axis=-1) for a, b in ((u, -1), (u, height), (-1, v), (width, v))]
    rays = seen.rays(np.concatenate(sides))
    xy = rays[:, :2] / rays[:, 2:]
    return xy.min(axis=0), xy.max(axis=0)


def _steepest(pixels: Array) -> float:
    """Return the largest change of a pixel coordinate per step of the table, for a step in any direction of a box."""
    valid = np.asarray((pixels > BEYOND_PX).all(axis=-1), dtype=bool)
    along_x = np.abs(np.diff(pixels, axis=1))[valid[:, 1:] & valid[:, :-1]].max(axis=0)
    along_y = np.abs(np.diff(pixels, axis=0))[valid[1:] & valid[:-1]].max(axis=0)
    return float((along_x + along_y).max())
