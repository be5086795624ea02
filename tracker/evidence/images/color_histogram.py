"""Colour histograms of images."""

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.geometry.arrays import Image

BINS = 12
"""Number of bins of each colour channel."""


@njit(**NO_REFCOUNT)
def bin_of(image: Image, v: int, u: int) -> int:
    """Return the histogram bin of a pixel's colour."""
    r, g, b = image[v, u, 0] * BINS // 256, image[v, u, 1] * BINS // 256, image[v, u, 2] * BINS // 256
    return (r * BINS + g) * BINS + b


@njit(**NO_REFCOUNT)
def count_colors(image: Image, counts: NDArray[np.int64]) -> None:
    """Add the pixels of an image, (H, W, 3), to a histogram, (BINS^3,)."""
    for v in range(image.shape[0]):
        for u in range(image.shape[1]):
            counts[bin_of(image, v, u)] += 1
