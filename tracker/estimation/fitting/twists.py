"""Convert residuals of contours to normal equations: summed per part as twists, then per degree of freedom.

A point X of a part moves by the part's spatial twist (omega, v) as omega x X + v. A residual with spatial gradient g
therefore has the row (X x g, g), whatever joints move the part.

The sliding term of the extremal-contour Jacobian of KRH08 (Eq. 22-31).

A contour point at a fixed height of its part moves with the part (A), and slides around the surface to where the new
lines of sight graze it (B). B moves the point within the tangent plane, which holds the line of sight. In the image it
therefore moves along the contour and not across it.
"""

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import FAST_MATH, njit
from tracker.geometry.arrays import Array, FloatArray, IntArray


@njit(**FAST_MATH)
def add_twists(
    span: IntArray, pieces: FloatArray, pulls: Array, P: Array, W: Array, eye: Array, slides: bool, M: Array, b: Array
) -> None:
    """Add the sums of a part's pieces in one view to the normal matrix and gradient of the part's twist.

    The image (u, v) of a surface point X has derivatives (X x a, a) and (X x c, c) by the twist, with a and c the
    spatial gradients of u and v. Their products with the summed squares S of a piece are those of two rows, by the
    Cholesky factor of S.

    A point that slides moves by s, the speed around the axis, for each unit of speed of the eye along the normal n,
    relative to the part. To a row with spatial gradient g this adds -(g . s) (eye x n, n) (B of KRH08 Eq. 31).

    Args:
        span: index of the part's first piece, and after its last, (2,).
        pieces: see `contour_arrays.Scratch`, (8, room).
        pulls: see `contour_arrays.Scratch`, (7, room).
        P: projection matrix, (3, 4).
        W: from the part's unit coordinates to the world, (3, 4), metres.
        eye: camera centre in the world, (3,), metres.
        slides: whether contour points slide on the surface. The part is then a solid of revolution in its unit
            coordinates, such as an elliptical cone.
        M: upper triangle of the normal matrix, (6, 6), added to.
        b: gradient, (6,), added to.
    """
    m00 = m01 = m02 = m03 = m04 = m05 = m11 = m12 = m13 = m14 = m15 = 0.0
    m22 = m23 = m24 = m25 = m33 = m34 = m35 = m44 = m45 = m55 = 0.0
    b0 = b1 = b2 = b3 = b4 = b5 = 0.0
    p0, p1, p2, unit = P[0], P[1], P[2], unit_eye(W, eye)
    for k in range(np.uint64(span[0]), np.uint64(span[1])):
        x, y, z, u, v = pieces[5, k], pieces[6, k], pieces[7, k], pieces[0, k], pieces[1, k]
        X = W[0, 0] * x + W[0, 1] * y + W[0, 2] * z + W[0, 3]
        Y = W[1, 0] * x + W[1, 1] * y + W[1, 2] * z + W[1, 3]
        Z = W[2, 0] * x + W[2, 1] * y + W[2, 2] * z + W[2, 3]
        w = 1.0 / (p2[0] * X + p2[1] * Y + p2[2] * Z + p2[3])
        a3, a4, a5 = (p0[0] - u * p2[0]) * w, (p0[1] - u * p2[1]) * w, (p0[2] - u * p2[2]) * w
        c3, c4, c5 = (p1[0] - v * p2[0]) * w, (p1[1] - v * p2[1]) * w, (p1[2] - v * p2[2]) * w
        nu, nv = pieces[3, k], pieces[4, k]
        # The plane through the eye and the contour's tangent is the tangent plane of the surface.
        at = nu * u + nv * v
        n0, n1, n2 = (
            nu * p0[0] + nv * p1[0] - at * p2[0],
            nu * p0[1] + nv * p1[1] - at * p2[1],
            nu * p0[2] + nv * p1[2] - at * p2[2],
        )
        e0, e1, e2 = eye[1] * n2 - eye[2] * n1, eye[2] * n0 - eye[0] * n2, eye[0] * n1 - eye[1] * n0
        sight2 = (X - eye[0]) ** 2 + (Y - eye[1]) ** 2 + (Z - eye[2]) ** 2
        along_x = W[0, 0] * n0 + W[1, 0] * n1 + W[2, 0] * n2
        along_y = W[0, 1] * n0 + W[1, 1] * n1 + W[2, 1] * n2
        speed = sliding_speed(x, y, z, along_x, along_y, sight2, unit) if slides else 0.0
        s0, s1, s2 = (
            speed * (x * W[0, 1] - y * W[0, 0]),
            speed * (x * W[1, 1] - y * W[1, 0]),
            speed * (x * W[2, 1] - y * W[2, 0]),
        )
        gu, gv = pulls[1, k] * nu + pulls[5, k], pulls[1, k] * nv + pulls[6, k]
        f3, f4, f5 = gu * a3 + gv * c3, gu * a4 + gv * c4, gu * a5 + gv * c5
        slide = f3 * s0 + f4 * s1 + f5 * s2
        b0 += Y * f5 - Z * f4 - slide * e0
        b1 += Z * f3 - X * f5 - slide * e1
        b2 += X * f4 - Y * f3 - slide * e2
        b3 += f3 - slide * n0
        b4 += f4 - slide * n1
        b5 += f5 - slide * n2
        root = np.sqrt(pulls[0, k] * nu * nu + pulls[2, k])
        skew = (pulls[0, k] * nu * nv + pulls[3, k]) / max(root, 1e-150)
        rest = np.sqrt(max(pulls[0, k] * nv * nv + pulls[4, k] - skew * skew, 0.0))
        a3, a4, a5 = root * a3 + skew * c3, root * a4 + skew * c4, root * a5 + skew * c5
        c3, c4, c5 = rest * c3, rest * c4, rest * c5
        slide = a3 * s0 + a4 * s1 + a5 * s2
        a0, a1, a2 = Y * a5 - Z * a4 - slide * e0, Z * a3 - X * a5 - slide * e1, X * a4 - Y * a3 - slide * e2
        a3, a4, a5 = a3 - slide * n0, a4 - slide * n1, a5 - slide * n2
        slide = c3 * s0 + c4 * s1 + c5 * s2
        c0, c1, c2 = Y * c5 - Z * c4 - slide * e0, Z * c3 - X * c5 - slide * e1, X * c4 - Y * c3 - slide * e2
        c3, c4, c5 = c3 - slide * n0, c4 - slide * n1, c5 - slide * n2
        m00 += a0 * a0 + c0 * c0
        m01 += a0 * a1 + c0 * c1
        m02 += a0 * a2 + c0 * c2
        m03 += a0 * a3 + c0 * c3
        m04 += a0 * a4 + c0 * c4
        m05 += a0 * a5 + c0 * c5
        m11 += a1 * a1 + c1 * c1
        m12 += a1 * a2 + c1 * c2
        m13 += a1 * a3 + c1 * c3
        m14 += a1 * a4 + c1 * c4
        m15 += a1 * a5 + c1 * c5
        m22 += a2 * a2 + c2 * c2
        m23 += a2 * a3 + c2 * c3
        m24 += a2 * a4 + c2 * c4
        m25 += a2 * a5 + c2 * c5
        m33 += a3 * a3 + c3 * c3
        m34 += a3 * a4 + c3 * c4
        m35 += a3 * a5 + c3 * c5
        m44 += a4 * a4 + c4 * c4
        m45 += a4 * a5 + c4 * c5
        m55 += a5 * a5 + c5 * c5
    found = (
        (m00, m01, m02, m03, m04, m05), (m01, m11, m12, m13, m14, m15), (m02, m12, m22, m23, m24, m25),
        (m03, m13, m23, m33, m34, m35), (m04, m14, m24, m34, m44, m45), (m05, m15, m25, m35, m45, m55),
    )  # fmt: skip
    force = (b0, b1, b2, b3, b4, b5)
    for i in range(6):
        b[i] += force[i]
        for j in range(i, 6):
            M[i, j] += found[i][j]


@njit(nogil=True, cache=True)
def twists_to_dofs(
    M: Array, b: Array, axes: Array, origins: Array, is_length: NDArray[np.bool_], parts: IntArray, parents: IntArray,
    moves: NDArray[np.bool_], gradient: Array, hessian: Array,
) -> None:  # fmt: skip
    """Convert the parts' normal matrices, upper triangles (n_parts, 6, 6), to the degrees of freedom.

    The spatial twist of a rotation by axis a through o is (a, o x a), of a translation (0, a). A degree of freedom
    moves its part and all descendants by the same twist, so their matrices are first summed up the tree. The arguments
    are not changed.
    """
    n_parts, n, M, b = M.shape[0], axes.shape[0], M.copy(), b.copy()
    for p in range(n_parts - 1, 0, -1):
        for i in range(6):
            b[parents[p], i] += b[p, i]
            for j in range(i, 6):
                M[parents[p], i, j] += M[p, i, j]
    twists, forces = np.empty((n, 6)), np.empty((n, 6))
    for k in range(n):
        ax, ay, az = axes[k, 0], axes[k, 1], axes[k, 2]
        ox, oy, oz = origins[k, 0], origins[k, 1], origins[k, 2]
        if is_length[k]:
            twists[k, 0], twists[k, 1], twists[k, 2] = 0.0, 0.0, 0.0
            twists[k, 3], twists[k, 4], twists[k, 5] = ax, ay, az
        else:
            twists[k, 0], twists[k, 1], twists[k, 2] = ax, ay, az
            twists[k, 3], twists[k, 4], twists[k, 5] = oy * az - oz * ay, oz * ax - ox * az, ox * ay - oy * ax
        part, total = parts[k], 0.0
        for i in range(6):
            force = 0.0
            for j in range(6):
                force += (M[part, i, j] if j >= i else M[part, j, i]) * twists[k, j]
            forces[k, i] = force
            total += twists[k, i] * b[part, i]
        gradient[k] = total
    for k in range(n):
        for m in range(k, n):
            total = 0.0
            if moves[k, parts[m]]:  # parents come first, so m is the deeper one
                for i in range(6):
                    total += twists[k, i] * forces[m, i]
            hessian[k, m] = hessian[m, k] = total


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
