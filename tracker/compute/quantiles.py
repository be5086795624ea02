"""Quantiles of small arrays, without the argument handling that dominates `numpy.quantile`."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution by its median absolute deviation."""


def quantiles(values: NDArray[np.floating], shares: Sequence[float]) -> NDArray[np.float64]:
    """Compute quantiles along the first axis, interpolated like those of `numpy.quantile`.

    Args:
        values: (n, ...), n > 0.
        shares: the quantiles, from 0 to 1, (q,).

    Returns:
        Their values, (q, ...).
    """
    ordered, last = np.sort(values, axis=0), len(values) - 1
    places = [share * last for share in shares]
    below = [min(int(at), max(last - 1, 0)) for at in places]
    return np.array(
        [
            ordered[i] + (at - i) * (ordered[min(i + 1, last)].astype(np.float64) - ordered[i])
            for i, at in zip(below, places, strict=True)
        ]
    )


def known_median(values: NDArray[np.floating]) -> NDArray[np.float64]:
    """Compute the median of what is known along the first axis, (n, ...) to (...); NaN where nothing is."""
    ordered = np.sort(np.concatenate([values, np.full((1, *values.shape[1:]), np.nan)]), axis=0)  # NaN last
    n = np.isfinite(values).sum(axis=0)
    low, high = (np.take_along_axis(ordered, np.maximum(at, 0)[None], axis=0)[0] for at in ((n - 1) // 2, n // 2))
    return np.asarray(np.where(n > 0, (low + high) / 2, np.nan))


def median(values: NDArray[np.floating]) -> NDArray[np.float64]:
    """Compute the median along the first axis, (n, ...) to (...)."""
    return np.asarray(quantiles(values, (0.5,))[0])
