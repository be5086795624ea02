"""Choose some of many items, part them, or fill a space evenly."""

from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray


def spread_indices(n: int, most: int) -> NDArray[np.int64]:
    """Return indices of at most so many of n items, evenly spaced from the first to the last, ascending."""
    return np.unique(np.linspace(0, n - 1, min(n, most)).round().astype(np.int64))


def without_gaps(ascending: Iterable[int]) -> list[NDArray[np.int64]]:
    """Part whole numbers into stretches of successive ones."""
    numbers = np.fromiter(ascending, np.int64)
    return [part for part in np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1) if len(part)]


def farthest_first(points: NDArray[np.float64], most: int, least: float = 0.0, fewest: int = 1) -> NDArray[np.int64]:
    """Choose points far from one another: the one nearest the mean, then always the farthest from those chosen.

    It is farthest-point sampling (Gonzalez 1985).

    Args:
        points: (N, D), or (N, J, D), which are as far apart as the one of J that moves most.
        most: number to choose.
        least: distance below which no more are chosen.
        fewest: number that are chosen at any distance.

    Returns:
        Indices in the order of choice.
    """
    if not len(points) or most < 1:
        return np.empty(0, dtype=np.int64)
    flat = points.reshape(len(points), -1)
    chosen = [int(np.argmin(np.linalg.norm(flat - flat.mean(axis=0), axis=1)))]
    nearest = np.full(len(points), np.inf)
    while len(chosen) < min(most, len(points)):
        apart = np.linalg.norm(points - points[chosen[-1]], axis=-1)
        nearest = np.minimum(nearest, apart.reshape(len(points), -1).max(axis=1))
        nearest[chosen] = -1.0  # Equal points are chosen, too, but each once.
        if nearest.max() < least and len(chosen) >= fewest:
            break
        chosen.append(int(np.argmax(nearest)))
    return np.array(chosen)


_TAIL = 0.002
"""Probability that is left out at either end of a normal distribution: it lies nearly three deviations away."""


@lru_cache(maxsize=16)
def even_points(n: int, dims: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return points that fill the unit cube evenly, (n, dims), and the same normally distributed (Sobol sequence)."""
    # Imported lazily: these take 0.3 s to load.
    from scipy.special import ndtri
    from scipy.stats import qmc

    even = np.asarray(qmc.Sobol(dims, seed=7).random(n))
    return even, np.asarray(ndtri(_TAIL + (1 - 2 * _TAIL) * even))
