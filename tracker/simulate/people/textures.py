"""Procedural noise for cloth, walls and floors."""

import numpy as np
from scipy import ndimage

from tracker.geometry.arrays import Array

_LATTICE = np.random.default_rng(7).random((32, 32, 32)).astype(np.float32)


def value_noise(points: Array, size: float | Array, octaves: int = 2) -> Array:
    """Evaluate a smooth random function of space, about -1 to 1.

    Args:
        points: (N, 3).
        size: extent of its features in the unit of the points, one number or (3,).
        octaves: number of octaves; each has half the size and half the strength of the one before.

    Returns:
        (N,).
    """
    out = np.zeros(len(points))
    for octave in range(octaves):
        coordinates = (points / size * 2.0**octave + 11.0 * octave).T
        out += 0.5**octave * (2.0 * ndimage.map_coordinates(_LATTICE, coordinates, order=1, mode="grid-wrap") - 1.0)
    return out
