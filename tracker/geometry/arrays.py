"""Type aliases of arrays, errors of files of arrays, and how much masks overlap."""

import tokenize
import zipfile
import zlib

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Points, poses, transforms and other double-precision values."""
FloatArray = NDArray[np.float32]
"""Values per pixel or per piece of a contour."""
IntArray = NDArray[np.int64]
"""Indices and counts."""
Image = NDArray[np.uint8]
"""Pixels, (H, W) or (H, W, 3) in BGR, as each function states."""
Mask = NDArray[np.bool_]
"""Whether each pixel belongs to something, (H, W)."""
TINY = 1e-9
"""Less is rounding: of lengths in metres or pixels, sines, shares. Divisors that may be 0 are at least that."""
DAMAGED_ARRAYS = (
    OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error, RuntimeError, SyntaxError, MemoryError,
    tokenize.TokenError,
)  # fmt: skip
"""Errors of `numpy.load` on a file that is missing, damaged, encrypted or compressed in a way that is not known."""


def intersection_over_union(one: Mask, other: Mask) -> float:
    """Return the share of two masks of one shape that both cover, of all that either covers; 0 for empty masks."""
    return int(np.count_nonzero(one & other)) / max(1, int(np.count_nonzero(one | other)))
