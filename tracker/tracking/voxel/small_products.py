"""Products of small matrices on the calling thread alone."""

import numpy as np

from tracker.geometry.arrays import Array

_MAX_MULTIPLICATIONS = 2**17
"""Multiplications of a product that BLAS does on the calling thread. Where all cores are busy, its other threads make a
product of two 96x96 matrices a hundred times slower."""


def product(a: Array, b: Array) -> Array:
    """Return the product of matrices, (l, m) and (m, n), in blocks of rows."""
    n_rows = max(1, _MAX_MULTIPLICATIONS // max(1, a.shape[1] * b.shape[1]))
    out = np.empty((a.shape[0], b.shape[1]))
    for first in range(0, a.shape[0], n_rows):
        np.matmul(a[first : first + n_rows], b, out=out[first : first + n_rows])
    return out
