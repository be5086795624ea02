"""Frame to edge map, over colour channels, within the foreground where there is one."""

from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.silhouettes import Image, Mask

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


def levels(strengths: NDArray[np.float32], restricted: bool) -> Levels:
    """Choose the thresholds for an image.

    Args:
        strengths: L1 norms of the strongest channel's gradient at places spread over the whole image, (n,).
        restricted: whether only a foreground is looked at. Inside it the noise sets the bounds, not what share of
            the picture is textured.
    """
    strong = max(2 * MIN_GRADIENT, float(np.quantile(strengths, STRONG_FRACTION)))
    weak = max(MIN_GRADIENT, float(np.quantile(strengths, WEAK_FRACTION)))
    return Levels(min(strong, 4 * MIN_GRADIENT), min(weak, 2 * MIN_GRADIENT)) if restricted else Levels(strong, weak)


def detect_edges(smooth: Image, bounds: Levels, foreground: Mask | None = None) -> Edges:
    """Canny's edges over colour channels: at each pixel the channel with the strongest gradient counts.

    Two regions of equal brightness and different hue have an edge here that a gray image does not show.

    Args:
        smooth: smoothed frame, (H, W, 3) RGB.
        bounds: Canny's thresholds.
        foreground: where edges may lie, (H, W) bool; everywhere if None.
    """
    derived = [cv2.spatialGradient(channel) for channel in cv2.split(smooth)]
    gx, gy = (np.stack([pair[axis].ravel() for pair in derived]) for axis in (0, 1))
    gradients = np.empty((2, *smooth.shape[:2]), np.int16)
    _strongest(gx, gy, gradients[0].ravel(), gradients[1].ravel())
    found = cv2.Canny(gradients[0], gradients[1], bounds.weak, bounds.strong)
    if foreground is not None:
        found = cv2.bitwise_and(found, found, mask=foreground.view(np.uint8))
    return Edges(np.asarray(found, dtype=np.uint8), gradients)


@njit(nogil=True, cache=True)
def _strongest(
    gx: NDArray[np.int16], gy: NDArray[np.int16], out_x: NDArray[np.int16], out_y: NDArray[np.int16]
) -> None:
    """Gradient of the channel with the largest L1 norm at each pixel, (3, n) each to (n,) each.

    In float32, where the comparisons run on whole vectors; numba would widen integers to 64 bits.
    """
    for i in range(out_x.shape[0]):
        x0, x1, x2 = np.float32(gx[0, i]), np.float32(gx[1, i]), np.float32(gx[2, i])
        y0, y1, y2 = np.float32(gy[0, i]), np.float32(gy[1, i]), np.float32(gy[2, i])
        m0, m1, m2 = abs(x0) + abs(y0), abs(x1) + abs(y1), abs(x2) + abs(y2)
        x, y, m = (x1, y1, m1) if m1 > m0 else (x0, y0, m0)
        out_x[i], out_y[i] = (np.int16(x2), np.int16(y2)) if m2 > m else (np.int16(x), np.int16(y))
