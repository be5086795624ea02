"""Smoothed histograms of colours as densities."""

import numpy as np

from tracker.geometry.arrays import Array
from tracker.images.color_histogram import BINS

VOLUME = (256 / BINS) ** 3
"""Volume of a bin, cubic gray levels."""
_SMOOTHING_BINS = 0.7
"""Standard deviation of the Gaussian that smooths histograms, bins: light and noise move a colour to the next bin."""
_UNKNOWN = 0.02
"""Share of arbitrary colours: one that was never seen is not impossible."""


def smoothed_shares(counts: Array) -> Array:
    """Return the shares of colours, (..., BINS^3), smoothed, with a rest of arbitrary colours."""
    from scipy.ndimage import gaussian_filter  # imported lazily: loading takes 0.1 s

    cubes = np.asarray(counts, np.float64).reshape(*counts.shape[:-1], BINS, BINS, BINS)
    smooth = np.asarray(gaussian_filter(cubes, _SMOOTHING_BINS, mode="nearest", axes=(-3, -2, -1)))
    smooth = smooth.reshape(counts.shape)
    total = smooth.sum(axis=-1, keepdims=True)
    shares = np.where(total > 0, smooth / np.maximum(total, 1e-12), 1 / BINS**3)
    return np.asarray((1 - _UNKNOWN) * shares + _UNKNOWN / BINS**3)
