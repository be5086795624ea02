"""Mark the contour points of a part that another part occludes.

A line of sight runs from a point (s = 0) to the eye (s = 1) in the unit coordinates of the possible occluder. Its
intersection with the enclosing quadric has a closed form, computed for many points at once without branches. If the
part does not fill its quadric, its own shape is tested on the common interval.
"""

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import FAR, FAST_MATH, ONE, TINY, ZERO, njit
from tracker.evidence.contours.surfaces import ALONG, N_ALONG, N_SECTION, SECTION
from tracker.geometry.arrays import FloatArray
from tracker.geometry.segment_distance import LANES

JOINT_MARGIN_M = 0.03
"""Distance in front of an adjoining part at which a contour becomes visible, metres."""

_TRIES = (0.5, 0.25, 0.75, 0.001)
"""Places in the common interval of line and quadric at which the shape is tested, far end (0) to near one (1)."""


@njit(inline="always", **FAST_MATH)
def _meet_quadric(
    part: int, solids: FloatArray, Q: FloatArray, margin: float, points: FloatArray, first: int, last: int,
    shared: FloatArray,
) -> None:  # fmt: skip
    """Intersect lines of sight, between point and eye, with the quadric around a part; see `mark_occluded`."""
    gx, gy, k, bulge = solids[part, 0], solids[part, 1], solids[part, 2], solids[part, 3]
    q00, q01, q02, q03, ex = Q[0, 0] * gx, Q[0, 1] * gx, Q[0, 2] * gx, Q[0, 3] * gx, Q[0, 4] * gx
    q10, q11, q12, q13, ey = Q[1, 0] * gy, Q[1, 1] * gy, Q[1, 2] * gy, Q[1, 3] * gy, Q[1, 4] * gy
    q20, q21, q22, q23, ez = Q[2, 0], Q[2, 1], Q[2, 2], Q[2, 3], Q[2, 4]
    behind = np.float32(-margin)
    # Whole vectors; the numbers after the last point are not read again. The index is unsigned, because loops over
    # signed indices are not vectorized.
    for j in range(np.uint64((last - first + LANES - 1) // LANES * LANES)):
        i = np.uint64(first) + j
        a, b, c = points[0, i], points[1, i], points[2, i]
        x = q00 * a + q01 * b + q02 * c + q03
        y = q10 * a + q11 * b + q12 * c + q13
        z = q20 * a + q21 * b + q22 * c + q23
        dx, dy, dz = ex - x, ey - y, ez - z
        w, dw = ONE + k * z, k * dz
        A = dx * dx + dy * dy + bulge * dz * dz - dw * dw
        A = A if abs(A) > TINY else TINY
        B = x * dx + y * dy + bulge * z * dz - w * dw
        C = x * x + y * y + bulge * z * z - w * w
        disc = B * B - A * C
        root = np.sqrt(max(disc, ZERO))
        inverse = ONE / A
        s0, s1 = (-B - root) * inverse, (-B + root) * inverse
        # A line steeper than the cone (A < 0) is inside beyond one of the roots, on the side of the cone's base.
        low = s0 if A > ZERO else (s0 if dw > ZERO else -FAR)
        high = s1 if A > ZERO else (FAR if dw > ZERO else s1)
        dz = dz if abs(dz) > TINY else TINY
        per_z = ONE / dz
        e0, e1 = (-ONE - z) * per_z, (ONE - z) * per_z
        low = max(max(low, behind), min(e0, e1))
        high = min(min(high, ONE), max(e0, e1))
        shared[0, i] = low
        shared[1, i] = high if disc > ZERO else -FAR


@njit(**FAST_MATH)
def _is_inside(part: int, solids: FloatArray, x: np.float32, y: np.float32, z: np.float32) -> bool:
    """Return whether a point in unit coordinates is inside a superquadric, by the tables of its shape."""
    at = abs(z) * np.float32(N_ALONG)
    k = np.uint64(at)  # a signed index may wrap around
    if k >= N_ALONG:
        return False
    cell = np.uint64(ALONG) + k
    below = solids[part, cell]
    size = below + (at - np.float32(k)) * (solids[part, cell + np.uint64(1)] - below)
    if solids[part, 7] > 0:
        size *= ONE + solids[part, 5] * z
        return x * x + y * y < size * size
    x = abs(x / (ONE + solids[part, 5] * z))
    y = abs(y / (ONE + solids[part, 6] * z))
    larger, smaller = max(x, y), min(x, y)
    if larger >= size:
        return False
    at = smaller / max(larger, TINY) * np.float32(N_SECTION)
    k = np.uint64(min(at, np.float32(N_SECTION - 1)))
    cell = np.uint64(SECTION) + k
    below = solids[part, cell]
    return larger * (below + (at - np.float32(k)) * (solids[part, cell + np.uint64(1)] - below)) < size


@njit(inline="always", **FAST_MATH)
def mark_occluded(
    part: int, solids: FloatArray, Q: FloatArray, margin: float, points: FloatArray, first: int, last: int,
    shared: FloatArray, occluded: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Mark the points that a part occludes: exact, except for lines that graze a superquadric.

    Args:
        part: index of the possible occluder.
        solids: shapes, see `Surfaces`. Passing all of `Surfaces` would cost more than the work.
        Q: from the frame of the points to the part's unit coordinates, with the eye there as last column, (3, 5).
        margin: how far behind the point the part still occludes it, as a share of the distance to the eye.
        points: (3, room), with room for `LANES` more.
        first: index of the first point.
        last: index after the last point.
        shared: scratch for the interval of each line of sight inside the quadric, (2, room + LANES).
        occluded: marked, (room,).
    """
    _meet_quadric(part, solids, Q, margin, points, first, last, shared)
    if solids[part, 4] > 0:  # the quadric is the part
        for j in range(np.uint64(last - first)):
            i = np.uint64(first) + j
            occluded[i] |= shared[0, i] < shared[1, i]
        return
    # Read once: the compiler cannot know that marking a point does not change them.
    q00, q01, q02, q03, ex = Q[0, 0], Q[0, 1], Q[0, 2], Q[0, 3], Q[0, 4]
    q10, q11, q12, q13, ey = Q[1, 0], Q[1, 1], Q[1, 2], Q[1, 3], Q[1, 4]
    q20, q21, q22, q23, ez = Q[2, 0], Q[2, 1], Q[2, 2], Q[2, 3], Q[2, 4]
    for j in range(np.uint64(last - first)):
        i = np.uint64(first) + j
        far, near = shared[0, i], shared[1, i]
        if far >= near or occluded[i]:
            continue
        a, b, c = points[0, i], points[1, i], points[2, i]
        x = q00 * a + q01 * b + q02 * c + q03
        y = q10 * a + q11 * b + q12 * c + q13
        z = q20 * a + q21 * b + q22 * c + q23
        dx, dy, dz = ex - x, ey - y, ez - z
        for share in _TRIES:
            s = far + np.float32(share) * (near - far)
            if _is_inside(part, solids, x + s * dx, y + s * dy, z + s * dz):
                occluded[i] = True
                break
