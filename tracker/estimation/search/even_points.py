"""Points that fill a space evenly, for searches that try a number of poses."""

from functools import lru_cache

import numpy as np

from tracker.geometry.arrays import Array

_TAIL = 0.002
"""Probability that is left out at either end of a normal distribution: it lies nearly three deviations away."""


@lru_cache(maxsize=16)
def even_points(n: int, dims: int) -> tuple[Array, Array]:
    """Return points that fill the unit cube evenly, (n, dims), and the same normally distributed (Sobol sequence)."""
    # Imported lazily: these take 0.3 s to load.
    from scipy.special import ndtri
    from scipy.stats import qmc

    even = np.asarray(qmc.Sobol(dims, seed=7).random(n))
    return even, np.asarray(ndtri(_TAIL + (1 - 2 * _TAIL) * even))
