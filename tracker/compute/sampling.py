"""Choose some of many items."""

import numpy as np
from numpy.typing import NDArray


def spread_indices(n: int, most: int) -> NDArray[np.int64]:
    """Return indices of at most so many of n items, evenly spaced from the first to the last, ascending."""
    return np.unique(np.linspace(0, n - 1, min(n, most)).round().astype(np.int64))
