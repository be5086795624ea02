"""Frame to edge map, over colour channels, within the foreground where there is one."""

from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.compute.quantiles import quantiles
from tracker.geometry.arrays import FloatArray, Image
from tracker.images.background_subtraction import Mask

STRONG_FRACTION, WEAK_FRACTION = 0.92, 0.80
"""Canny's thresholds, as fractions of the pixels whose gradient is weaker (without a foreground)."""
MIN_GRADIENT = 24.0
"""Gradients (Sobel 3x3, of 255) below this are noise, whatever the fractions say."""


class Levels(NamedTuple):
    """Canny's two thresholds, gray levels of the L1 norm of a Sobel gradient."""

    strong: float
    """An edge begins where the gradient is stronger."""
    weak: float
    """It goes on while the gradient is stronger."""


class Edges(NamedTuple):
    """Edges one pixel thin, and the gradients that they are crests of."""

    found: NDArray[np.uint8]
    """255 on an edge, (H, W)."""
    gradients: NDArray[np.int16]
    """Sobel gradient of the colour channel in which it is strongest, along u and along v, (2, H, W)."""


def levels(strengths: FloatArray, restricted: bool) -> Levels:
    """Choose the thresholds for an image.

    Args:
        strengths: L1 norms of the strongest channel's gradient at places spread over the whole image, (n,).
        restricted: whether only a foreground is looked at. Inside it the noise sets the bounds, not what share of
            the picture is textured.
    """
    strongest, weaker = quantiles(strengths, (STRONG_FRACTION, WEAK_FRACTION)).tolist()
    strong, weak = max(2 * MIN_GRADIENT, strongest), max(MIN_GRADIENT, weaker)
    return Levels(min(strong, 4 * MIN_GRADIENT), min(weak, 2 * MIN_GRADIENT)) if restricted else Levels(strong, weak)


def detect_edges(smooth: Image, bounds: Levels, foreground: Mask | None = None) -> Edges:
    """Canny's edges over colour channels: at each pixel the channel with the strongest gradient counts.

    Two regions of equal brightness and different hue have an edge here that a gray image does not show.

    Args:
        smooth: smoothed frame, (H, W, 3) RGB.
        bounds: Canny's thresholds.
        foreground: where edges may lie, (H, W) bool; everywhere if None.
    """
    gradients = np.empty((2, *smooth.shape[:2]), np.int16)
    _strongest(smooth.reshape(len(smooth), -1), *gradients)
    found = cv2.Canny(gradients[0], gradients[1], bounds.weak, bounds.strong)
    if foreground is not None:
        found = cv2.bitwise_and(found, found, mask=foreground.view(np.uint8))
    return Edges(np.asarray(found, dtype=np.uint8), gradients)


@njit(nogil=True, cache=True)
def _strongest(image: NDArray[np.uint8], out_x: NDArray[np.int16], out_y: NDArray[np.int16]) -> None:
    """Sobel gradient of the channel with the largest L1 norm at each pixel, of (H, 3 W) to (H, W) each.

    Row by row, so that nothing as large as the image is kept: fresh memory costs more than the sums. In float32, where
    they run on whole vectors; numba would widen integers to 64 bits. Beyond the border the image is mirrored.
    """
    height, width = image.shape
    # With a pixel, that is three numbers, more on either side.
    blurred, derived = np.empty(width + 6, np.float32), np.empty(width + 6, np.float32)
    gx, gy = np.empty(width, np.float32), np.empty(width, np.float32)
    for v in range(height):
        above, here, below = image[min(abs(v - 1), height - 1)], image[v], image[height - 1 - abs(height - 2 - v)]
        for i in range(width):
            a, b, c = np.float32(above[i]), np.float32(here[i]), np.float32(below[i])
            blurred[i + 3], derived[i + 3] = a + b + b + c, c - a
        for i in range(3):
            blurred[i], derived[i] = blurred[i + 6], derived[i + 6]
            blurred[width + 3 + i], derived[width + 3 + i] = blurred[width - 3 + i], derived[width - 3 + i]
        for i in range(width):
            gx[i] = blurred[i + 6] - blurred[i]
            gy[i] = derived[i] + derived[i + 3] + derived[i + 3] + derived[i + 6]
        _take_strongest(gx, gy, out_x[v], out_y[v])


@njit(nogil=True, cache=True)
def _take_strongest(gx: FloatArray, gy: FloatArray, out_x: NDArray[np.int16], out_y: NDArray[np.int16]) -> None:
    """Gradients of a row's channels, (3 W,) each, to those of the strongest channels, (W,) each."""
    for i in range(out_x.shape[0]):
        x0, x1, x2 = gx[3 * i], gx[3 * i + 1], gx[3 * i + 2]
        y0, y1, y2 = gy[3 * i], gy[3 * i + 1], gy[3 * i + 2]
        m0, m1, m2 = abs(x0) + abs(y0), abs(x1) + abs(y1), abs(x2) + abs(y2)
        x, y, m = (x1, y1, m1) if m1 > m0 else (x0, y0, m0)
        out_x[i], out_y[i] = (np.int16(x2), np.int16(y2)) if m2 > m else (np.int16(x), np.int16(y))
