"""Frame to edge map, over colour channels, within the foreground where there is one."""

import cv2
import numpy as np

from tracker.silhouettes import Image, Mask

STRONG_FRACTION, WEAK_FRACTION = 0.92, 0.80
"""Canny's thresholds, as fractions of the pixels whose gradient is weaker (without a foreground)."""
MIN_GRADIENT = 24.0
"""Gradients (Sobel 3x3, of 255) below this are noise, whatever the fractions say."""


def detect_edges(image: Image, foreground: Mask | None = None) -> Mask:
    """Canny's edges over colour channels: at each pixel the channel with the strongest gradient counts.

    Two regions of equal brightness and different hue have an edge here that a gray image does not show.

    Args:
        image: frame, (H, W, 3) RGB.
        foreground: where edges may lie, (H, W) bool; everywhere if None.

    Returns:
        (H, W) bool, edges one pixel thin.
    """
    smooth = cv2.GaussianBlur(image, (0, 0), 1.0)
    gx = cv2.Sobel(smooth, cv2.CV_16S, 1, 0)
    gy = cv2.Sobel(smooth, cv2.CV_16S, 0, 1)
    magnitude = np.abs(gx.astype(np.int32)) + np.abs(gy.astype(np.int32))  # as Canny's L1 gradient
    strongest = np.argmax(magnitude, axis=-1)[..., None]
    gx = np.ascontiguousarray(np.take_along_axis(gx, strongest, axis=-1)[..., 0])
    gy = np.ascontiguousarray(np.take_along_axis(gy, strongest, axis=-1)[..., 0])
    peak = np.take_along_axis(magnitude, strongest, axis=-1)[..., 0]
    strong = max(2 * MIN_GRADIENT, float(np.quantile(peak[::2, ::2], STRONG_FRACTION)))
    weak = max(MIN_GRADIENT, float(np.quantile(peak[::2, ::2], WEAK_FRACTION)))
    if foreground is not None:
        # Inside the foreground the noise sets the bounds, not what share of the picture is textured.
        strong, weak = min(strong, 4 * MIN_GRADIENT), min(weak, 2 * MIN_GRADIENT)
    found = cv2.Canny(gx, gy, weak, strong) > 0
    return found if foreground is None else found & foreground
