"""Smoothed histograms of colours as shares."""

import numpy as np

from tracker.evidence.images.color_histogram import BINS
from tracker.geometry.arrays import TINY, Array

VOLUME = ((np.iinfo(np.uint8).max + 1) / BINS) ** 3
"""Volume of a bin, cubic gray levels."""
DOUBT = 0.02
"""Share of arbitrary pixels under a part: a colour that was never seen there is not impossible. With half
and with twice as much, region evidence finds the same limbs (`tests/benchmarks/region_evidence.py --displaced`)."""
_SMOOTHING_BINS = 0.7
"""Standard deviation of the Gaussian that smooths histograms, bins: light and noise move a colour to the next bin.
With half and with twice as much, region evidence finds 26 and 30 of 37 displaced limbs, with this 27, and 2, 3 and 2 of
1,147 others."""


def smoothed(counts: Array) -> Array:
    """Return histograms of colours, (..., BINS^3), smoothed over neighbouring colours."""
    from scipy.ndimage import gaussian_filter  # imported lazily: loading takes 0.1 s

    cubes = np.asarray(counts, dtype=np.float64).reshape(*counts.shape[:-1], BINS, BINS, BINS)
    return np.asarray(gaussian_filter(cubes, _SMOOTHING_BINS, mode="nearest", axes=(-3, -2, -1))).reshape(counts.shape)


def log_density(counts: Array) -> Array:
    """Return the log density of each colour, (..., BINS^3), per cubic gray level, of histograms with some doubt."""
    smooth = smoothed(counts)
    total = smooth.sum(axis=-1, keepdims=True)
    shares = np.where(total > 0, smooth / np.maximum(total, TINY), 1 / BINS**3)
    return np.log(((1 - DOUBT) * shares + DOUBT / BINS**3) / VOLUME)
