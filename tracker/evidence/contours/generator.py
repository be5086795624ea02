"""Compute the contour generator of one convex part: the closed curve of surface points that lines of sight graze.

A surface point x belongs to the generator where `n . (x - e) = 0`, with the normal n and the eye e. All are in the
part's unit coordinates (see `shapes`), which preserve tangent planes. On a solid of revolution the condition has a
closed form at every point of the profile. On other parts the zero line of the function is followed around a grid of
surface points.
"""

import numpy as np

from tracker.compute.jit import FAST_MATH, ONE, TINY, ZERO, njit
from tracker.evidence.contours.surfaces import N_RINGS, N_SECTORS, Surfaces
from tracker.geometry.arrays import Array, FloatArray

MAX_POINTS = 512
"""Room for the points of one generator."""


@njit(inline="always", **FAST_MATH)
def revolved_generator(
    part: int, n_profile: int, profile: FloatArray, eye: Array, turn: np.float32, half: FloatArray, out: FloatArray
) -> int:
    """Compute the contour generator of a solid of revolution.

    At the profile point (r, z) with normal (1, b) the condition is `|e_xy| cos d = r + b (z - e_z)`, with d the angle
    about the axis from the eye's direction. On a cone r + b z and b are constant, hence d: the generator is the two
    rulings of KRH08 Eq. 8-13, by the arc cosine that keeps both roots. Between neighbouring profile points, point and
    normal are interpolated. Around the rim of a flat end neighbours share r and z, and interpolation is exact too.

    Args:
        part: index of the part.
        n_profile: number of points of its profile.
        profile: radius, height, slope of the normal and its outward component at the points of all profiles, (P, 4, n).
        eye: camera centre, (3,), unit coordinates.
        turn: largest angle about the axis between neighbouring points, rad.
        half: scratch for one side of the curve, (3, MAX_POINTS).
        out: filled with the points in order, (3, MAX_POINTS), unit coordinates; the last joins the first.

    Returns:
        Number of points.
    """
    distance = np.sqrt(eye[0] * eye[0] + eye[1] * eye[1])
    inverse = np.float32(1.0 / max(distance, TINY))
    eye_z = np.float32(eye[2])
    n = 0
    c0 = r0 = z0 = n0 = ZERO
    for i in range(n_profile):
        r1, z1, n1 = profile[part, 0, i], profile[part, 1, i], profile[part, 3, i]
        c1 = (r1 + profile[part, 2, i] * (z1 - eye_z)) * inverse
        if i > 0:
            first, last = min(max(c0, -ONE), ONE), min(max(c1, -ONE), ONE)
            if first != last or abs(first) < ONE:
                n = _strip(c0, c1, n0, n1, first, last, r0, z0, r1, z1, turn, n, half)
        c0, r0, z0, n0 = c1, r1, z1, n1
    if n < 3:
        return 0
    cos_eye, sin_eye = np.float32(eye[0]) * inverse, np.float32(eye[1]) * inverse
    if distance < TINY:  # any direction is right
        cos_eye, sin_eye = ONE, ZERO
    for k in range(n):
        mirrored = 2 * n - 2 - k
        x, y = cos_eye * half[0, k], sin_eye * half[1, k]
        out[0, k], out[0, mirrored] = x - y, x + y
        x, y = sin_eye * half[0, k], cos_eye * half[1, k]
        out[1, k], out[1, mirrored] = x + y, x - y
        out[2, k] = out[2, mirrored] = half[2, k]
    return 2 * n - 2  # the mirrored first point is the first itself


@njit(inline="always", **FAST_MATH)
def _strip(
    c0: np.float32, c1: np.float32, n0: np.float32, n1: np.float32, first: np.float32, last: np.float32,
    r0: np.float32, z0: np.float32, r1: np.float32, z1: np.float32, turn: np.float32, n: int, half: FloatArray,
) -> int:  # fmt: skip
    """Append one side of the curve between two profile points; return the new number of points.

    Points are (r cos d, r sin d, z). The first is appended only where the curve begins. The normal turns evenly along
    the strip, so the position t where cos d = c follows from `(1 - t) n0 (c - c0) = t n1 (c1 - c)`, with n its outward
    component. Here c is cos d at a profile point; first and last are c0 and c1 clipped to [-1, 1].
    """
    s0, s1 = np.sqrt(ONE - first * first), np.sqrt(ONE - last * last)
    if n == 0:
        t = ZERO if first == c0 else n0 * (first - c0) / (n0 * (first - c0) + n1 * (c1 - first))
        r = r0 + t * (r1 - r0)
        half[0, 0], half[1, 0], half[2, 0] = r * first, r * s0, z0 + t * (z1 - z0)
        n = 1
    if (last - first) * (last - first) + (s1 - s0) * (s1 - s0) > turn * turn:
        angle = _arccos(first * last + s0 * s1)
        count = min(int(angle / turn) + 1, MAX_POINTS // 2 - n)
        step = angle / np.float32(count) if last < first else -angle / np.float32(count)
        squared = step * step
        cos_step = ONE - squared * (np.float32(1 / 2) - squared * np.float32(1 / 24))
        sin_step = step * (ONE - squared * (np.float32(1 / 6) - squared * np.float32(1 / 120)))
        c, s, is_rim, t = first, s0, r0 == r1 and z0 == z1, ZERO
        for _ in range(1, count):
            c, s = c * cos_step - s * sin_step, s * cos_step + c * sin_step
            if not is_rim:  # one division per point takes as long as everything else
                t = min(max(n0 * (c - c0) / (n0 * (c - c0) + n1 * (c1 - c)), ZERO), ONE)
            r = r0 + t * (r1 - r0)
            half[0, n], half[1, n], half[2, n] = r * c, r * s, z0 + t * (z1 - z0)
            n += 1
    if n < MAX_POINTS // 2:
        t = ONE if last == c1 else n0 * (last - c0) / (n0 * (last - c0) + n1 * (c1 - last))
        r = r0 + t * (r1 - r0)
        half[0, n], half[1, n], half[2, n] = r * last, r * s1, z0 + t * (z1 - z0)
        n += 1
    return n


@njit(inline="always", **FAST_MATH)
def _arccos(x: np.float32) -> np.float32:
    """Return the arc cosine within 7e-5 rad (Abramowitz and Stegun 4.4.45), in a third of the exact function's time."""
    a = min(abs(x), ONE)
    angle = np.float32(-0.0187293) * a + np.float32(0.0742610)
    angle = (angle * a - np.float32(0.2121144)) * a + np.float32(1.5707288)
    angle *= np.sqrt(ONE - a)
    return angle if x >= ZERO else np.float32(np.pi) - angle


@njit(**FAST_MATH)
def grid_generator(part: int, eye: Array, surfaces: Surfaces, f: FloatArray, out: FloatArray) -> int:
    """Follow the contour generator around the grid of a part, from cell to cell.

    The solid is convex, so the curve is one loop. It cannot leave the grid, because the first and last ring have one
    normal each.

    Args:
        part: index of the part.
        eye: camera centre, (3,), unit coordinates.
        surfaces: the shapes.
        f: scratch for the function on the grid, (rings * sectors,).
        out: filled with the points in order, (3, MAX_POINTS), unit coordinates; the last joins the first.

    Returns:
        Number of points.
    """
    normals, offsets, grid = surfaces.normals, surfaces.offsets, surfaces.grids
    x, y, z = np.float32(eye[0]), np.float32(eye[1]), np.float32(eye[2])
    for i in range(f.shape[0]):
        f[i] = offsets[part, i] - (normals[part, 0, i] * x + normals[part, 1, i] * y + normals[part, 2, i] * z)
    ring, sector, side = _start(f)
    if ring < 0:
        return 0
    first_ring, first_sector, first_side = ring, sector, side
    for n in range(MAX_POINTS):
        # The corners a, b, c, d of a cell; its sides 0 to 3 run from a to b, b to c, c to d, d to a.
        right = sector + 1 if sector + 1 < N_SECTORS else 0
        a, b = ring * N_SECTORS + sector, ring * N_SECTORS + right
        c, d = b + N_SECTORS, a + N_SECTORS
        i, j = a, b
        for _ in range(3):
            side = side + 1 if side < 3 else 0
            i, j = (a, b) if side == 0 else (b, c) if side == 1 else (c, d) if side == 2 else (d, a)
            if (f[i] > 0) != (f[j] > 0):
                break
        t = f[i] / (f[i] - f[j])
        for k in range(3):
            out[k, n] = grid[part, k, i] + t * (grid[part, k, j] - grid[part, k, i])
        if side == 0:
            ring -= 1
        elif side == 1:
            sector = right
        elif side == 2:
            ring += 1
        else:
            sector = sector - 1 if sector > 0 else N_SECTORS - 1
        side = (side + 2) % 4  # of the next cell
        if ring == first_ring and sector == first_sector and side == first_side:
            return n + 1
    return 0


@njit(**FAST_MATH)
def _start(f: FloatArray) -> tuple[int, int, int]:
    """Return ring, sector and side at which the zero line enters a cell; ring is -1 without a zero line."""
    for ring in range(N_RINGS + 1):
        for sector in range(N_SECTORS):
            i = ring * N_SECTORS + sector
            below = i + N_SECTORS
            if (f[i] > 0) != (f[below] > 0):
                return ring, sector, 3
            right = below + 1 if sector + 1 < N_SECTORS else below + 1 - N_SECTORS
            if (f[below] > 0) != (f[right] > 0):
                return ring, sector, 2
    return -1, 0, 0
