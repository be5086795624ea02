"""A distance image read between its pixels."""

import numpy as np
from numba import njit

from tracker.kernels import FAST
from tracker.rigid import FloatArray

_ZERO = np.float32(0.0)  # a plain number would turn the kernel's arithmetic into float64


@njit(**FAST)
def bilinear(
    image: FloatArray, width: int, height: int, u: np.float32, v: np.float32
) -> tuple[np.float32, np.float32, np.float32]:
    """Value at a pixel, and its slopes along u and v; outside the image those of the nearest border pixel.

    Without a branch, so that loops that store nothing do it for whole vectors. The slopes are those of the bilinear
    surface (KRH08 Sect. 5.3; see DESIGN section 7 for the second one).

    Args:
        image: row by row, (height * width,).
        width: of the image.
        height: of the image.
        u: px.
        v: px.
    """
    right, bottom = np.float32(width - 1), np.float32(height - 1)
    u = u if u > _ZERO else _ZERO
    u = u if u < right else right
    v = v if v > _ZERO else _ZERO
    v = v if v < bottom else bottom
    last_column, last_row = np.int32(width - 2), np.int32(height - 2)
    column, row = np.int32(u), np.int32(v)
    column = column if column < last_column else last_column
    row = row if row < last_row else last_row
    a, b = u - np.float32(column), v - np.float32(row)
    at, below = np.uint64(row * np.int32(width) + column), np.uint64(width)  # a signed index might count from the end
    d00, d01 = image[at], image[at + np.uint64(1)]
    d10, d11 = image[at + below], image[at + below + np.uint64(1)]
    upper, lower = d00 + a * (d01 - d00), d10 + a * (d11 - d10)
    across = (d01 - d00) + b * ((d11 - d10) - (d01 - d00))
    return upper + b * (lower - upper), across, lower - upper
