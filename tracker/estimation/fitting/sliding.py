"""The sliding term of the extremal-contour Jacobian of KRH08 (Eq. 22-31).

A contour point at a fixed height of its part moves with the part (A), and slides around the surface to where the new
lines of sight graze it (B). B moves the point within the tangent plane, which holds the line of sight. In the image it
therefore moves along the contour and not across it.
"""

import numpy as np

from tracker.compute.jit import njit
from tracker.compute.numba_options import FAST_MATH
from tracker.geometry.arrays import Array

SINGULAR = 0.02
"""Sine of the angle between a line of sight and the neighbouring tangent planes below which sliding is weighted down:
where the two rulings of a cone meet, its speed has no bound."""
_ON_SIDE = 0.999
"""Largest height of a point on the curved surface, in half its length. Points beyond lie on the rim of an end, which is
fixed to the part."""
_TINY = float(np.finfo(np.float64).tiny)
"""Least divisor where a slope and its bound are 0."""


@njit(inline="always", **FAST_MATH)
def unit_eye(W: Array, eye: Array) -> tuple[float, float, float, float]:
    """Return x and y of the eye in the unit coordinates of a part, and its squared half axes along them.

    Args:
        W: from the part's unit coordinates to the world, (3, 4), metres.
        eye: camera centre in the world, (3,), metres.
    """
    x = y = square_x = square_y = 0.0
    for i in range(3):
        x += W[i, 0] * (eye[i] - W[i, 3])
        y += W[i, 1] * (eye[i] - W[i, 3])
        square_x += W[i, 0] * W[i, 0]
        square_y += W[i, 1] * W[i, 1]
    return x / square_x, y / square_y, square_x, square_y


@njit(inline="always", **FAST_MATH)
def sliding_speed(
    x: float, y: float, z: float, along_x: float, along_y: float, sight2: float,
    unit: tuple[float, float, float, float],
) -> float:  # fmt: skip
    """Return the angle by which a contour point slides around the axis per speed of the eye along the normal.

    It is 1/b of KRH08 Eq. 31, weighted down where it has a pole, and 0 on the rim of an end.

    Args:
        x: coordinates of the point on a solid of revolution, unit coordinates of its part.
        y: see `x`.
        z: see `x`.
        along_x: x of the surface normal in unit coordinates.
        along_y: its y.
        sight2: squared distance of the point from the eye, metres squared.
        unit: see `unit_eye`.
    """
    # Derivative of the normal by the angle, times the line of sight, and its squared length.
    slope = along_x * (y - unit[1]) - along_y * (x - unit[0])
    turned2 = along_x * along_x / unit[3] + along_y * along_y / unit[2]
    least2 = SINGULAR * SINGULAR * sight2 * turned2
    return slope / max(slope * slope, least2, _TINY) if abs(z) <= _ON_SIDE else 0.0
