"""What a whole image is like, from some thousand places: noise, contrast, exposure.

Thresholds follow the whole image, and must not change with the region that happens to be looked at. Reading the
gradients and smoothed colours at a grid of places takes a fraction of the time of computing them everywhere.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.silhouettes import SMOOTHING_PX, Image

FloatArray = NDArray[np.float32]

SPACING_PX = 20
"""Distance between neighbouring probes, matched px."""
_LEAST_PLACES = 8  # along each axis, in small images
_TAPS = 9
"""Matched pixels a side that smoothing (7) and a derivative (3) draw on."""


class Readings(NamedTuple):
    """What the probes of an image show."""

    colors: FloatArray
    """Smoothed colour, (n, 3), gray levels."""
    strengths: FloatArray
    """L1 norm of the gradient of the channel in which it is largest, (n,), as `edges` computes it."""


class Probes:
    """A grid of places in the images of one camera, as filmed."""

    def __init__(self, size: tuple[int, int], scale: float) -> None:
        """Lay the grid.

        Args:
            size: width and height of the footage, px.
            scale: matched pixels per pixel of the footage, at most 1.
        """
        self._columns, self._rows = (_taps(length, scale) for length in size)
        self._block = min(int(1 / scale), 2)
        self._kernels = _kernels()

    def read(self, image: Image) -> Readings:
        """Read a frame as filmed, (H, W, 3)."""
        patches = np.empty((len(self._rows) * len(self._columns), 3, _TAPS * _TAPS), np.float32)
        _gather(image, self._rows, self._columns, self._block, patches)
        responses = patches @ self._kernels  # (n, 3, 3): channels, then smooth and the two derivatives
        strengths = np.abs(responses[..., 1:]).sum(axis=-1).max(axis=-1)
        return Readings(np.ascontiguousarray(responses[..., 0]), strengths)


def _taps(length: int, scale: float) -> NDArray[np.int64]:
    """Positions along one axis, (places, taps), px of the footage, within the image."""
    places = max(_LEAST_PLACES, round(length * scale / SPACING_PX))
    middles = (np.arange(places) + 0.5) * length / places
    taps = middles[:, None] + (np.arange(_TAPS) - _TAPS // 2) / scale
    return np.clip(np.round(taps), 0, length - 1).astype(np.int64)


def _kernels() -> FloatArray:
    """Smoothing, and Sobel's derivatives along u and v of the smoothed image, as columns, (taps^2, 3)."""
    smooth = np.pad(cv2.getGaussianKernel(_TAPS - 2, SMOOTHING_PX).ravel(), 1)
    narrow = smooth[1:-1]
    wide, derived = np.convolve(narrow, (1.0, 2.0, 1.0)), np.convolve(narrow, (1.0, 0.0, -1.0))
    pairs = ((smooth, smooth), (wide, derived), (derived, wide))  # along v, along u
    return np.stack([np.outer(v, u).ravel() for v, u in pairs], axis=1).astype(np.float32)


@njit(nogil=True, cache=True)
def _gather(image: Image, rows: NDArray[np.int64], columns: NDArray[np.int64], block: int, patches: FloatArray) -> None:
    """Fill the patches, (n, 3, taps^2); each tap is the mean of a block of pixels, as a reduced image would show."""
    height, width, _ = image.shape
    taps = rows.shape[1]
    share = np.float32(1.0 / (block * block))
    n = 0
    for r in range(rows.shape[0]):
        for c in range(columns.shape[0]):
            for i in range(taps):
                for j in range(taps):
                    red, green, blue = 0, 0, 0
                    for di in range(block):
                        v = min(rows[r, i] + di, height - 1)
                        for dj in range(block):
                            u = min(columns[c, j] + dj, width - 1)
                            red += image[v, u, 0]
                            green += image[v, u, 1]
                            blue += image[v, u, 2]
                    t = i * taps + j
                    patches[n, 0, t], patches[n, 1, t], patches[n, 2, t] = red * share, green * share, blue * share
            n += 1
