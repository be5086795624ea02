"""The extremal-contour Jacobian of KRH08 with its sliding term (Eq. 22-31), summed part by part.

A contour point at a fixed height of its part moves with the part (A), and slides around the surface to where the new
lines of sight graze it (B). B moves the point within the tangent plane, which holds the line of sight. In the image it
therefore moves along the contour and not across it.
"""

import numpy as np

from tracker.compute.jit import njit
from tracker.compute.numba_options import NO_REFCOUNT
from tracker.geometry.arrays import Array, FloatArray, IntArray

_Point = tuple[float, float, float]
_Row = tuple[float, float, float, float, float, float]

SINGULAR = 0.02
"""Sine of the angle between a line of sight and the neighbouring tangent planes below which sliding is weighted down:
where the two rulings of a cone meet, its speed has no bound."""
_ON_SIDE = 0.999
"""Largest height of a point on the curved surface, in half its length. Points beyond lie on the rim of an end, which is
fixed to the part."""


@njit(**NO_REFCOUNT)
def add_sliding_twists(
    span: IntArray, pieces: FloatArray, pulls: Array, P: Array, W: Array, eye: Array, M: Array, b: Array
) -> None:
    """Add the sums of a part's pieces in one view to its normal matrix and gradient, as `twists.add_twists`, with B.

    The part is a solid of revolution in its unit coordinates, such as an elliptical cone.

    Args:
        span: index of the part's first piece, and after its last, (2,).
        pieces: see `contour_arrays.Scratch`, (8, room).
        pulls: see `contour_arrays.Scratch`, (7, room).
        P: projection matrix, (3, 4).
        W: from the part's unit coordinates to the world, (3, 4), metres.
        eye: camera centre in the world, (3,), metres.
        M: upper triangle of the normal matrix, (6, 6), added to.
        b: gradient, (6,), added to.
    """
    for k in range(span[0], span[1]):
        rows = _image_rows(pieces[:, k], P, W, eye)
        nu, nv = pieces[3, k], pieces[4, k]
        gu, gv = pulls[1, k] * nu + pulls[5, k], pulls[1, k] * nv + pulls[6, k]
        suu, suv = pulls[0, k] * nu * nu + pulls[2, k], pulls[0, k] * nu * nv + pulls[3, k]
        svv = pulls[0, k] * nv * nv + pulls[4, k]
        for i in range(6):
            p, q = rows[0][i], rows[1][i]
            b[i] += gu * p + gv * q
            for j in range(i, 6):
                M[i, j] += p * (suu * rows[0][j] + suv * rows[1][j]) + q * (suv * rows[0][j] + svv * rows[1][j])


@njit(**NO_REFCOUNT)
def _image_rows(piece: FloatArray, P: Array, W: Array, eye: Array) -> tuple[_Row, _Row]:
    """Return the derivatives of a piece's image, u and v, by the spatial twist of its part: J_I (A + B), two rows."""
    u, v, nu, nv, x, y, z = piece[0], piece[1], piece[3], piece[4], piece[5], piece[6], piece[7]
    X = _placed(W, 0, x, y, z), _placed(W, 1, x, y, z), _placed(W, 2, x, y, z)
    # The plane through the eye and the contour's tangent is the tangent plane of the surface.
    at = nu * u + nv * v
    n = (
        nu * P[0, 0] + nv * P[1, 0] - at * P[2, 0],
        nu * P[0, 1] + nv * P[1, 1] - at * P[2, 1],
        nu * P[0, 2] + nv * P[1, 2] - at * P[2, 2],
    )
    speed = _sliding_speed(X, n, W, eye) if abs(z) <= _ON_SIDE else 0.0
    slide = (
        speed * (x * W[0, 1] - y * W[0, 0]), speed * (x * W[1, 1] - y * W[1, 0]), speed * (x * W[2, 1] - y * W[2, 0])
    )  # fmt: skip
    depth = P[2, 0] * X[0] + P[2, 1] * X[1] + P[2, 2] * X[2] + P[2, 3]
    return _row(P, 0, u, depth, X, n, slide, eye), _row(P, 1, v, depth, X, n, slide, eye)


@njit(inline="always", **NO_REFCOUNT)
def _placed(W: Array, i: int, x: float, y: float, z: float) -> float:
    """Return a world coordinate of a point in unit coordinates."""
    return W[i, 0] * x + W[i, 1] * y + W[i, 2] * z + W[i, 3]


@njit(**NO_REFCOUNT)
def _row(P: Array, r: int, c: float, depth: float, X: _Point, n: _Point, slide: _Point, eye: Array) -> _Row:
    """Return the derivative of image coordinate r, of value c, by the twist; see `_image_rows`."""
    g0, g1, g2 = (P[r, 0] - c * P[2, 0]) / depth, (P[r, 1] - c * P[2, 1]) / depth, (P[r, 2] - c * P[2, 2]) / depth
    sigma = g0 * slide[0] + g1 * slide[1] + g2 * slide[2]
    return (
        X[1] * g2 - X[2] * g1 - sigma * (eye[1] * n[2] - eye[2] * n[1]),
        X[2] * g0 - X[0] * g2 - sigma * (eye[2] * n[0] - eye[0] * n[2]),
        X[0] * g1 - X[1] * g0 - sigma * (eye[0] * n[1] - eye[1] * n[0]),
        g0 - sigma * n[0], g1 - sigma * n[1], g2 - sigma * n[2],
    )  # fmt: skip


@njit(**NO_REFCOUNT)
def _sliding_speed(X: _Point, n: _Point, W: Array, eye: Array) -> float:
    """Return the angle by which a contour point slides around the axis per speed of the eye along the normal: 1/b of
    KRH08 Eq. 31, weighted down where it has a pole."""
    along_x = along_y = slope = sight2 = turned2 = h2x = h2y = 0.0
    for i in range(3):  # the normal in unit coordinates
        along_x += W[i, 0] * n[i]
        along_y += W[i, 1] * n[i]
        h2x += W[i, 0] * W[i, 0]
        h2y += W[i, 1] * W[i, 1]
    for i in range(3):
        turned = along_x * W[i, 1] / h2y - along_y * W[i, 0] / h2x  # derivative of the normal by the angle
        sight = X[i] - eye[i]
        slope += turned * sight
        sight2 += sight * sight
        turned2 += turned * turned
    least = SINGULAR * np.sqrt(sight2 * turned2)
    if least == 0.0:
        return 0.0
    return 1.0 / slope if abs(slope) >= least else slope / (least * least)
