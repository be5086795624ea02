"""Project contour generators and cut them into short straight pieces.

The kernels take the arrays that they need one by one: passing a tuple of thirty arrays costs more than the work.
Kernels that are called once for each part or pair of parts are inlined, because passing even half a dozen arrays costs
as much.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import FAST_MATH, njit
from tracker.evidence.contours.generator import MAX_POINTS
from tracker.evidence.contours.surfaces import Surfaces
from tracker.evidence.contours.visibility import LANES
from tracker.geometry.arrays import Array, FloatArray, IntArray

PIECE_PX = 4.0
"""Longest piece of contour that is scored or occluded as a whole, px."""
JOINED = 10
"""Largest number of pieces of a segment: longer segments would reach too many points. Edges are straight, so that only
speed depends on it. In all views of frame 0 of `walk` and `fast_arms`, 2,395 visible pieces make 1,082 segments; with
half the number 1,173, with double 1,065."""
_THIN2 = np.float32(0.1**2)
"""Squared distance from the line between its neighbours below which a projected point is left out, px^2."""


class Pieces(NamedTuple):
    """Pieces of contour as long arrays, with the scratch of tracing, for kernels that score many poses."""

    ends: FloatArray
    """u0, v0, u1, v1, (4, room), undistorted px."""
    middles: FloatArray
    """Middle of each piece in the unit coordinates of its part, (3, room + LANES)."""
    edges: NDArray[np.int32]
    """Index of the straight edge that each piece is cut from, (room,)."""
    occluded: NDArray[np.bool_]
    """Whether another part occludes the piece, (room,)."""
    firsts: NDArray[np.int64]
    """Index of the first piece of each part, then the number of pieces, (P + 1,)."""
    Ts_world_unit: Array
    """From the unit coordinates of each part to the world, (P, 3, 4), metres."""
    Ts_unit_world: Array
    """The inverse, with the eye in unit coordinates as last column, (P, 3, 5)."""
    boxes: Array
    """Bounds u0, v0, u1, v1 of each part in the image, (P, 4), px."""
    distances: Array
    """From the eye to the centre of each part, (P,), metres."""
    generator: FloatArray
    """Points of one generator, (3, MAX_POINTS + LANES), unit coordinates."""
    image: FloatArray
    """Their u, v, px, and depths, metres, (3, MAX_POINTS + LANES)."""
    half: FloatArray
    """One side of a generator, (3, MAX_POINTS), unit coordinates."""
    f: FloatArray
    """A function on the grid of a part, (rings * sectors,)."""
    between: FloatArray
    """From the unit coordinates of a part to those of a possible occluder, and the eye there, (P, P, 3, 5)."""
    related: NDArray[np.bool_]
    """Whether `between` is filled but for the eye, (P, P). Most pairs meet in no view, others in several."""
    unit_eye: Array
    """Eye in the unit coordinates of one part, (3,)."""
    shared: FloatArray
    """Interval of each line of sight inside a part, (2, room + LANES)."""
    is_static: NDArray[np.bool_]
    """Whether the pieces of each part come from the cache of static contours, (P,); see `static_cache`."""


def piece_buffer(surfaces: Surfaces, room: int) -> Pieces:
    """Return room for the pieces of a view, filled by `trace_pieces`."""
    n_parts, grid_size = surfaces.offsets.shape
    return Pieces(
        np.empty((4, room), np.float32), np.zeros((3, room + LANES), np.float32), np.empty(room, np.int32),
        np.empty(room, np.bool_), np.empty(n_parts + 1, np.int64), np.empty((n_parts, 3, 4)),
        np.empty((n_parts, 3, 5)), np.empty((n_parts, 4)), np.empty(n_parts),
        np.zeros((3, MAX_POINTS + LANES), np.float32), np.empty((3, MAX_POINTS + LANES), np.float32),
        np.empty((3, MAX_POINTS), np.float32), np.empty(grid_size, np.float32),
        np.empty((n_parts, n_parts, 3, 5), np.float32), np.empty((n_parts, n_parts), np.bool_), np.empty(3),
        np.empty((2, room + LANES), np.float32), np.empty(n_parts, np.bool_),
    )  # fmt: skip


class StaticContours(NamedTuple):
    """Contours of the static parts in all views; without room if all parts move."""

    moves: NDArray[np.bool_]
    """Which parts move, (P,). The others are expected to be static; if they move, the cache is refilled."""
    Ts: Array
    """Poses of all parts when the cache was filled, (P, 4, 4), metres; NaN before."""
    ends: FloatArray
    """See `Pieces`, as the next three; one view after the other, (4, room), undistorted px."""
    middles: FloatArray
    """(3, room)."""
    edges: NDArray[np.int32]
    """(room,)."""
    occluded: NDArray[np.bool_]
    """Whether another static part occludes the piece, (room,)."""
    firsts: IntArray
    """Index of the first piece of each part in each view, then the index after the last, (V, P + 1)."""
    boxes: Array
    """Bounds u0, v0, u1, v1 of each part in each view, (V, P, 4), px."""
    segments: NDArray[np.int32]
    """Index, within its view, of the segment that each visible piece is joined to, (room,)."""
    covered: NDArray[np.bool_]
    """Whether moving parts occlude some of each segment of one view, (room,)."""
    best: FloatArray
    """Squared distance of each image point to the nearest segment, (N,); see `contour_arrays.Scratch`."""
    nearest: NDArray[np.int32]
    """Index of that segment within its view, (N,)."""


def static_contours_buffer(n_views: int, room: int, n_points: int, moves: NDArray[np.bool_]) -> StaticContours:
    """Return room for the static contours of views with a number of pieces each.

    Args:
        n_views: number of views.
        room: largest number of pieces of a view.
        n_points: number of image points of all views.
        moves: which parts move, (P,).
    """
    n_parts, any_static = len(moves), not moves.all()
    pieces, points = (n_views * room, n_points) if any_static else (0, 0)
    return StaticContours(
        moves, np.full((n_parts, 4, 4), np.nan), np.empty((4, pieces), np.float32), np.empty((3, pieces), np.float32),
        np.empty(pieces, np.int32), np.empty(pieces, np.bool_), np.zeros((n_views, n_parts + 1), np.int64),
        np.empty((n_views, n_parts, 4)), np.empty(pieces, np.int32), np.zeros(room if any_static else 0, np.bool_),
        np.empty(points, np.float32), np.empty(points, np.int32),
    )  # fmt: skip


@njit(inline="always", **FAST_MATH)
def place_parts(Ts: Array, surfaces: Surfaces, out: Pieces) -> None:
    """Fill the transforms between the parts' unit coordinates and the world, which all views share."""
    to_world, to_unit = out.Ts_world_unit, out.Ts_unit_world
    centers, half_axes = surfaces.centers, surfaces.half_axes
    out.related[:] = False
    for part in range(Ts.shape[0]):
        for i in range(3):
            center = Ts[part, i, 3]
            for k in range(3):
                to_world[part, i, k] = Ts[part, i, k] * half_axes[part, k]
                center += Ts[part, i, k] * centers[part, k]
            to_world[part, i, 3] = center
        for i in range(3):
            inverse = 1.0 / half_axes[part, i]
            to_unit[part, i, 3] = 0.0
            for k in range(3):
                to_unit[part, i, k] = Ts[part, k, i] * inverse
                to_unit[part, i, 3] -= to_unit[part, i, k] * to_world[part, k, 3]


@njit(inline="always", **FAST_MATH)
def place_eye(eye: Array, out: Pieces) -> None:
    """Fill the eye in the unit coordinates of placed parts, and its distance from them."""
    to_world, to_unit = out.Ts_world_unit, out.Ts_unit_world
    for part in range(to_world.shape[0]):
        x, y, z = eye[0] - to_world[part, 0, 3], eye[1] - to_world[part, 1, 3], eye[2] - to_world[part, 2, 3]
        out.distances[part] = np.sqrt(x * x + y * y + z * z)
        for i in range(3):
            to_unit[part, i, 4] = to_unit[part, i, 0] * x + to_unit[part, i, 1] * y + to_unit[part, i, 2] * z


@njit(inline="always", **FAST_MATH)
def project_generator(
    part: int, P: Array, n: int, Ts_world_unit: Array, generator: FloatArray, image: FloatArray, boxes: Array
) -> int:
    """Close a generator of n points, project and thin it, and fill its bounds; return the number of its edges."""
    W = Ts_world_unit
    for i in range(3):
        generator[i, n] = generator[i, 0]
    a0, b0, c0, d0 = _image_row(np.int64(0), part, P, W)  # literals would compile `_image_row` three times
    a1, b1, c1, d1 = _image_row(np.int64(1), part, P, W)
    a2, b2, c2, d2 = _image_row(np.int64(2), part, P, W)
    for k in range(np.uint64(n // LANES * LANES + LANES)):  # whole vectors; values beyond the generator are not used
        x, y, z = generator[0, k], generator[1, k], generator[2, k]
        w = a2 * x + b2 * y + c2 * z + d2
        inverse = np.float32(1) / w
        image[0, k] = (a0 * x + b0 * y + c0 * z + d0) * inverse
        image[1, k] = (a1 * x + b1 * y + c1 * z + d1) * inverse
        image[2, k] = w
    n_kept = last = 0
    u0 = u1 = u = image[0, 0]
    v0 = v1 = v = image[1, 0]
    for k in range(1, n + 1):
        uk, vk = image[0, k], image[1, k]
        if k < n and k == last + 1:  # never drop two in a row, so that errors do not add up
            bu, bv = image[0, k + 1] - u, image[1, k + 1] - v
            off = (uk - u) * bv - (vk - v) * bu
            if off * off <= _THIN2 * (bu * bu + bv * bv):
                continue
        n_kept, last = n_kept + 1, k
        u, v = uk, vk
        u0, u1, v0, v1 = min(u0, u), max(u1, u), min(v0, v), max(v1, v)
        image[0, n_kept], image[1, n_kept], image[2, n_kept] = u, v, image[2, k]
        for i in range(3):
            generator[i, n_kept] = generator[i, k]
    boxes[part, 0], boxes[part, 1], boxes[part, 2], boxes[part, 3] = u0, v0, u1, v1
    return n_kept


@njit(**FAST_MATH)
def _image_row(i: int, part: int, P: Array, W: Array) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Return row i of the projection from the unit coordinates of a part to the image."""
    p, q, r = P[i, 0], P[i, 1], P[i, 2]
    return (
        np.float32(p * W[part, 0, 0] + q * W[part, 1, 0] + r * W[part, 2, 0]),
        np.float32(p * W[part, 0, 1] + q * W[part, 1, 1] + r * W[part, 2, 1]),
        np.float32(p * W[part, 0, 2] + q * W[part, 1, 2] + r * W[part, 2, 2]),
        np.float32(p * W[part, 0, 3] + q * W[part, 1, 3] + r * W[part, 2, 3] + P[i, 3]),
    )


@njit(inline="always", **FAST_MATH)
def cut_into_pieces(
    n_edges: int, edge: int, piece_px: float, n: int, generator: FloatArray, image: FloatArray, ends: FloatArray,
    middles: FloatArray, edges: NDArray[np.int32],
) -> int:  # fmt: skip
    """Cut the edges of a projected generator into pieces and append them; return the new number of pieces."""
    per_px, half, one, room = np.float32(1.0 / piece_px), np.float32(0.5), np.float32(1), edges.shape[0]
    for k in range(n_edges):
        u, v, w0, w1 = image[0, k], image[1, k], image[2, k], image[2, k + 1]
        x, y, z = generator[0, k], generator[1, k], generator[2, k]
        du, dv = image[0, k + 1] - u, image[1, k + 1] - v
        dx, dy, dz = generator[0, k + 1] - x, generator[1, k + 1] - y, generator[2, k + 1] - z
        count = min(int(np.ceil(np.sqrt(du * du + dv * dv) * per_px)), room - n)
        if count == 1:
            i = np.uint64(n)
            # The middle in the image is not the middle in space; 1/depth is linear along the projected edge.
            m = w0 / (w0 + w1)
            ends[0, i], ends[1, i], ends[2, i], ends[3, i] = u, v, u + du, v + dv
            middles[0, i], middles[1, i], middles[2, i] = x + m * dx, y + m * dy, z + m * dz
            edges[i] = edge + k
            n += 1
        elif count > 1:
            share = one / np.float32(count)
            du, dv = du * share, dv * share
            for j in range(count):
                i, a = np.uint64(n + j), np.float32(j)
                m = (a + half) * share
                m = m * w0 / (w1 + m * (w0 - w1))
                ends[0, i], ends[1, i], ends[2, i], ends[3, i] = (
                    u + a * du,
                    v + a * dv,
                    u + (a + one) * du,
                    v + (a + one) * dv,
                )
                middles[0, i], middles[1, i], middles[2, i] = x + m * dx, y + m * dy, z + m * dz
                edges[i] = edge + k
            n += count
    return n
