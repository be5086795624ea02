"""Frame and background to silhouette: where the image shows something that the empty scene does not."""

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]

MIN_DIFFERENCE = 12.0
"""Least difference of any colour channel (of 255) that counts as a change; video noise stays below."""


def subtract_background(image: Image, background: Image) -> Mask:
    """Find the pixels that differ from the background: the silhouette, with holes where colours agree.

    The threshold follows the noise of the view: most pixels show the background, so the median difference tells
    how far an unchanged pixel strays.

    Args:
        image: frame, (H, W, 3) RGB.
        background: the empty scene, (H, W, 3) RGB, same size and pixels.

    Returns:
        (H, W) bool.
    """
    blurred = [cv2.GaussianBlur(i, (0, 0), 1.0) for i in (image, background)]
    difference = np.max(cv2.absdiff(*blurred), axis=-1)
    threshold = max(MIN_DIFFERENCE, 5.0 * float(np.median(difference)))
    changed = (difference > threshold).astype(np.uint8)
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
    return cv2.morphologyEx(changed, cv2.MORPH_OPEN, kernel).astype(bool)


def grow(mask: Mask, radius_px: float) -> Mask:
    """Dilate a mask by a radius: the generous foreground within which edges may belong to a person."""
    if radius_px < 1 or not mask.any():
        return mask
    outside = np.where(mask, 0, 255).astype(np.uint8)
    return np.asarray(cv2.distanceTransform(outside, cv2.DIST_L2, cv2.DIST_MASK_5)) <= radius_px
