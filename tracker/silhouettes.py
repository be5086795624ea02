"""Frame and background to silhouette: where the image shows something that the empty scene does not."""

import cv2
import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]

SMOOTHING_PX = 1.0
"""Standard deviation of the Gaussian that images are smoothed with before they are compared or derived, px."""
MIN_DIFFERENCE = 12.0
"""Least difference of any colour channel (of 255) that counts as a change; video noise stays below."""


def smoothed(image: Image) -> Image:
    """Smooth an image, (H, W, 3), against the noise of single pixels."""
    return np.asarray(cv2.GaussianBlur(image, (0, 0), SMOOTHING_PX), dtype=np.uint8)


def change_threshold(differences: NDArray[np.float32]) -> float:
    """Difference beyond which a pixel has changed, gray levels.

    It follows the noise of the view: most pixels show the background, so the median difference tells how far an
    unchanged pixel strays.

    Args:
        differences: of the smoothed frame to the smoothed background, largest over the channels, at places spread
            over the whole image, (n,).
    """
    return max(MIN_DIFFERENCE, 5.0 * float(np.median(differences)))


def subtract_background(smooth: Image, background: Image, threshold: float) -> Mask:
    """Find the pixels that differ from the background: the silhouette, with holes where colours agree.

    Args:
        smooth: smoothed frame, (H, W, 3) RGB.
        background: the smoothed empty scene, (H, W, 3) RGB, same size and pixels.
        threshold: see `change_threshold`.

    Returns:
        (H, W) bool.
    """
    red, green, blue = cv2.split(cv2.absdiff(smooth, background))
    changed = np.asarray(cv2.max(cv2.max(red, green), blue)) > np.uint8(min(threshold, 255))
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    return np.asarray(cv2.morphologyEx(changed.view(np.uint8), cv2.MORPH_OPEN, cross)) > 0


def grow(mask: Mask, radius_px: float) -> Mask:
    """Dilate a mask by a radius: the generous foreground within which edges may belong to a person.

    The disc is an octagon, made of a square and diamonds, which takes a third of the time of a distance transform.
    """
    radius = round(radius_px)
    straight = round((np.sqrt(2) - 1) * radius)  # as wide along the diagonals as along the axes
    square = np.ones((2 * straight + 1, 2 * straight + 1), np.uint8)
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    grown = cv2.dilate(mask.view(np.uint8), square)
    return np.asarray(cv2.dilate(grown, cross, iterations=radius - straight)) > 0
