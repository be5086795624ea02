"""Compiled kernels of voxel carving: blocks that are divided where a silhouette's edge is.

A block is enclosed in a sphere. The sphere's pixels in a view lie within a square, whose number of silhouette pixels
an integral image gives. If all squares are uniform the block is decided as a whole (an octree, Szeliski 1993).
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.geometry.arrays import Array, FloatArray, IntArray
from tracker.geometry.cameras import BEYOND_PX, NEAR_PLANE_M


class _BlockFlag(IntEnum):
    """Flags of a block in a view: some of its voxels may be out of the image, out of the silhouette, or within it."""

    UNSEEN = 1
    OUTSIDE = 2
    INSIDE = 4
    ANY = UNSEEN | OUTSIDE | INSIDE


class ViewTables(NamedTuple):
    """The views as flat arrays."""

    projections: FloatArray
    """World to camera coordinates, (n_views, 3, 4)."""
    lookups: NDArray[np.int16]
    """Tables of all views one after the other (see `SensorLookup.pixels`), (n, 2)."""
    lookup_layout: IntArray
    """First entry, rows and columns of each table, (n_views, 3)."""
    lookup_scale: FloatArray
    """Corner x and y, entries per unit and pixels per unit of each table, (n_views, 4)."""
    sums: NDArray[np.int32]
    """Integral images of the silhouettes' boxes, one after the other, (m,)."""
    sum_layout: IntArray
    """First entry of each integral image, its columns, and the silhouette's box u0, v0, u1, v1, (n_views, 6)."""
    sizes: IntArray
    """Width and height of each view, px, (n_views, 2)."""


STACK_COLUMNS = 7
"""Columns of a block on the stack: first voxel i, j, k, edge, and what its parent has settled: views within and outside
of the silhouettes, and a bit for each settled view."""


@njit(**NO_REFCOUNT)
def carve_blocks(
    views: ViewTables, origin: Array, size_m: float, rule: tuple[int, int], edge: int, turn: tuple[int, int],
    stack: IntArray, occupied: NDArray[np.bool_],
) -> int:  # fmt: skip
    """Set the occupied voxels, (nx, ny, nz), initially False; return the number of blocks and voxels that were tested.

    Args:
        views: the views, at most 62.
        origin: centre of the first voxel, (3,), metres.
        size_m: edge of a voxel, metres.
        rule: fewest views in whose silhouettes a voxel lies, and most views whose silhouettes it may miss.
        edge: voxels along the edge of the largest blocks, a power of two.
        turn: (i, n) to carve every n-th of the largest blocks from the i-th on.
        stack: scratch, (m, `STACK_COLUMNS`); seven blocks for each time that a block can be divided, and one.
        occupied: the result.
    """
    nx, ny, nz = occupied.shape
    n_tested, block = 0, 0
    for bi in range(0, nx, edge):
        for bj in range(0, ny, edge):
            for bk in range(0, nz, edge):
                block += 1
                if block % turn[1] != turn[0]:
                    continue
                _push(stack, 0, bi, bj, bk, edge, 0, 0, 0)
                n = 1
                while n:
                    n -= 1
                    i, j, k, e = stack[n, 0], stack[n, 1], stack[n, 2], stack[n, 3]
                    n_tested += 1
                    decided, n_inside, n_outside, settled = _decide(
                        views, origin, size_m, i, j, k, e, rule, stack[n, 4], stack[n, 5], stack[n, 6]
                    )
                    if decided == 0:
                        continue
                    if decided == 1:
                        for a in range(i, min(i + e, nx)):
                            for b in range(j, min(j + e, ny)):
                                for c in range(k, min(k + e, nz)):
                                    occupied[a, b, c] = True
                        continue
                    h = e // 2
                    for child in range(8):
                        x, y, z = i + h * (child >> 2), j + h * ((child >> 1) & 1), k + h * (child & 1)
                        if x < nx and y < ny and z < nz:
                            _push(stack, n, x, y, z, h, n_inside, n_outside, settled)
                            n += 1
    return n_tested


@njit(inline="always", **NO_REFCOUNT)
def _push(
    stack: IntArray, n: int, i: int, j: int, k: int, edge: int, n_inside: int, n_outside: int, settled: int
) -> None:
    stack[n, 0], stack[n, 1], stack[n, 2], stack[n, 3] = i, j, k, edge
    stack[n, 4], stack[n, 5], stack[n, 6] = n_inside, n_outside, settled


@njit(inline="always", **NO_REFCOUNT)
def _decide(
    views: ViewTables, origin: Array, size_m: float, i: int, j: int, k: int, edge: int, rule: tuple[int, int],
    n_inside: int, n_outside: int, settled: int,
) -> tuple[int, int, int, int]:  # fmt: skip
    """Decide on a block: 0 if no voxel is occupied, 1 if all are, 2 if it must be divided; a voxel is 0 or 1.

    Returns:
        The decision, and the views within and outside of whose silhouettes the block lies, with a bit for each of these
        and of the views that do not see it.
    """
    half = np.float32(0.5 * (edge - 1) * size_m)
    x = np.float32(origin[0] + i * size_m) + half
    y = np.float32(origin[1] + j * size_m) + half
    z = np.float32(origin[2] + k * size_m) + half
    radius = np.sqrt(np.float32(3)) * half
    n_maybe, n_maybe_outside, decided = n_inside, n_outside, 2
    for v in range(views.sizes.shape[0]):
        if settled >> v & 1:
            continue
        found = _view_test(views, v, x, y, z, radius)
        if found & (found - 1) == 0:  # all voxels alike
            settled |= 1 << v
        n_inside += found == _BlockFlag.INSIDE
        n_maybe += found & _BlockFlag.INSIDE != 0
        n_outside += found == _BlockFlag.OUTSIDE
        n_maybe_outside += found & _BlockFlag.OUTSIDE != 0
        if n_outside > rule[1]:
            decided = 0
            break
    if decided and n_maybe < rule[0]:
        decided = 0
    if decided and n_inside >= rule[0] and n_maybe_outside <= rule[1]:
        decided = 1
    return decided, n_inside, n_outside, settled


@njit(inline="always", **NO_REFCOUNT)
def _view_test(views: ViewTables, v: int, x: float, y: float, z: float, radius: float) -> int:
    """Return the flags of the voxels whose centres lie within a sphere, in one view."""
    P = views.projections[v]
    depth = P[2, 0] * x + P[2, 1] * y + P[2, 2] * z + P[2, 3]
    near = np.float32(NEAR_PLANE_M)
    if depth + radius < near:
        return _BlockFlag.UNSEEN
    if depth - radius < near:
        return _BlockFlag.ANY if radius > 0 else _BlockFlag.UNSEEN
    inverse = np.float32(1.0) / depth
    sx = (P[0, 0] * x + P[0, 1] * y + P[0, 2] * z + P[0, 3]) * inverse
    sy = (P[1, 0] * x + P[1, 1] * y + P[1, 2] * z + P[1, 3]) * inverse
    rows, columns = views.lookup_layout[v, 1], views.lookup_layout[v, 2]
    scale = views.lookup_scale[v, 2]
    fx, fy = (sx - views.lookup_scale[v, 0]) * scale, (sy - views.lookup_scale[v, 1]) * scale
    if radius == 0:
        if not (fx > np.float32(-0.5) and fy > np.float32(-0.5) and fx < columns - 0.5 and fy < rows - 0.5):
            return _BlockFlag.UNSEEN
        at = views.lookup_layout[v, 0] + int(fy + np.float32(0.5)) * columns + int(fx + np.float32(0.5))
        u, w = int(views.lookups[at, 0]), int(views.lookups[at, 1])
        if u < 0 or w < 0 or u >= views.sizes[v, 0] or w >= views.sizes[v, 1]:
            return _BlockFlag.UNSEEN
        return _BlockFlag.INSIDE if _count(views, v, u, w, u + 1, w + 1) else _BlockFlag.OUTSIDE
    # A point of the sphere lies within radius * sqrt(1 + s^2) / (depth - radius) of the centre's sensor coordinates.
    steepest = max(abs(sx), abs(sy))
    reach = radius * np.sqrt(np.float32(1.0) + steepest * steepest) / (depth - radius)
    entries = reach * scale + np.float32(1.0)
    if fx < -entries or fy < -entries or fx > columns - 1 + entries or fy > rows - 1 + entries:
        return _BlockFlag.UNSEEN
    if fx < entries or fy < entries or fx > columns - 1 - entries or fy > rows - 1 - entries:
        return _BlockFlag.ANY
    at = views.lookup_layout[v, 0] + int(fy + np.float32(0.5)) * columns + int(fx + np.float32(0.5))
    u, w = int(views.lookups[at, 0]), int(views.lookups[at, 1])
    if u == BEYOND_PX:
        return _BlockFlag.ANY
    d = int(entries / scale * views.lookup_scale[v, 3]) + 1  # one for the rounding of both pixels
    u0, v0, u1, v1 = u - d, w - d, u + d + 1, w + d + 1
    width, height = views.sizes[v, 0], views.sizes[v, 1]
    if u1 <= 0 or v1 <= 0 or u0 >= width or v0 >= height:
        return _BlockFlag.UNSEEN
    whole = u0 >= 0 and v0 >= 0 and u1 <= width and v1 <= height
    count = _count(views, v, u0, v0, u1, v1)
    if count == 0:
        return _BlockFlag.OUTSIDE if whole else _BlockFlag.UNSEEN | _BlockFlag.OUTSIDE
    return _BlockFlag.INSIDE if whole and count == (u1 - u0) * (v1 - v0) else _BlockFlag.ANY


@njit(inline="always", **NO_REFCOUNT)
def _count(views: ViewTables, v: int, u0: int, v0: int, u1: int, v1: int) -> int:
    """Return the number of silhouette pixels in a rectangle of a view."""
    layout = views.sum_layout[v]
    start, stride = layout[0], layout[1]
    u0, u1 = min(max(u0, layout[2]), layout[4]) - layout[2], min(max(u1, layout[2]), layout[4]) - layout[2]
    v0, v1 = min(max(v0, layout[3]), layout[5]) - layout[3], min(max(v1, layout[3]), layout[5]) - layout[3]
    sums, top, bottom = views.sums, start + v0 * stride, start + v1 * stride
    return sums[bottom + u1] - sums[bottom + u0] - sums[top + u1] + sums[top + u0]
