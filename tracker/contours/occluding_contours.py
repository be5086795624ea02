"""Visible occluding contours of posed bodies in one camera (the synthesis of GD96 Sect. 4.2).

The contour generator of each part is a closed curve on its surface (see `outlines`). It is projected and cut into
short pieces, and pieces that a part hides are marked (see `hiding`). Parts that adjoin at a joint hide each other also
where they lie less than `JOINT_MARGIN_M` behind the line, so that no contour runs across the body where its parts
merely meet.

All of it is one compiled kernel per view, because a search evaluates thousands of poses a second.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.body.model import PosedBody
from tracker.compute.numba_options import FAST_MATH
from tracker.contours.generator import MAX_POINTS, grid_outline, revolved_outline
from tracker.contours.surfaces import Surfaces, surfaces_of
from tracker.contours.visibility import JOINT_MARGIN_M, LANES, mark_occluded
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.cameras import NEAR_PLANE_M, Camera

PIECE_PX = 4.0
"""Longest piece of contour that is scored or occluded as a whole, px."""
MAX_PIECES = 6000
"""Room for the pieces of one view; a 22-DOF body that fills a 640x480 image has some 600."""
_SAG_PX = 0.2
"""How far the middle of a chord around a part may lie inside the arc, px; the grid of other parts leaves as much."""
_THIN2 = np.float32(0.1**2)
"""A point of an outline less than this off the line between its neighbours is left out, px squared."""


class Contour(NamedTuple):
    """Short straight pieces of occluding contours in one view."""

    pieces_px: FloatArray
    """End points x0, y0, x1, y1, (N, 4), undistorted px."""
    parts: NDArray[np.int32]
    """Index of the part of each piece, counted through all bodies, (N,)."""
    occluded: NDArray[np.bool_]
    """Whether another part hides the piece, (N,)."""
    points_world: FloatArray
    """Middle of each piece on the surface, (N, 3), metres."""


class Pieces(NamedTuple):
    """The same as long arrays, with the room that tracing works in; for kernels that score many poses."""

    ends: FloatArray
    """u0, v0, u1, v1, (4, room), undistorted px."""
    middles: FloatArray
    """Middle of each piece in the unit coordinates of its part, (3, room + LANES)."""
    edges: NDArray[np.int32]
    """Number of the straight edge that each piece is cut from, (room,)."""
    occluded: NDArray[np.bool_]
    """Whether another part hides the piece, (room,)."""
    firsts: NDArray[np.int64]
    """Index of the first piece of each part, and the number of all, (P + 1,)."""
    Ts_world_unit: Array
    """From the unit coordinates of each part to the world, (P, 3, 4), metres."""
    Ts_unit_world: Array
    """Back, and the eye in unit coordinates as last column, (P, 3, 5)."""
    boxes: Array
    """Bounds u0, v0, u1, v1 of each part in the image, (P, 4), px."""
    distances: Array
    """From the eye to the centre of each part, (P,), metres."""
    outline: FloatArray
    """Points of one outline, (3, MAX_POINTS + LANES), unit coordinates."""
    image: FloatArray
    """Their u, v in px and depths, (3, MAX_POINTS + LANES)."""
    half: FloatArray
    """One side of an outline, (3, MAX_POINTS)."""
    f: FloatArray
    """A function on the grid of a part, (rings * sectors,)."""
    between: FloatArray
    """From the unit coordinates of a part to those of one that may hide it, and the eye there, (P, P, 3, 5)."""
    related: NDArray[np.bool_]
    """Whether that has been filled, but for the eye, (P, P): most pairs meet in no view, others in several."""
    unit_eye: Array
    """The eye in unit coordinates of one part, (3,)."""
    shared: FloatArray
    """What lines of sight share with a part, (2, room + LANES)."""
    is_static: NDArray[np.bool_]
    """Whether the pieces of each part come from the cache of static contours, (P,); see `static_cache`."""


def part_poses(bodies: Sequence[PosedBody]) -> Array:
    """World poses of all parts of all bodies, (P, 4, 4), metres."""
    return np.concatenate([b.kinematics.Ts_world_part for b in bodies])


def trace(bodies: Sequence[PosedBody], camera: Camera, piece_px: float = PIECE_PX) -> Contour:
    """Trace the occluding contours of all bodies in a view, occluded pieces included and marked.

    Args:
        bodies: everybody in the scene; they hide one another.
        camera: the view; its lens distortion is left out (undistorted pixels).
        piece_px: longest piece, px.
    """
    surfaces = surfaces_of(tuple(b.model for b in bodies))
    out = contour_buffer(camera, len(bodies), piece_px)
    n = trace_view(camera.projection, camera.center_world, part_poses(bodies), surfaces, piece_px, out)
    return Contour(out.pieces_px[:n], out.parts[:n], out.occluded[:n], out.points_world[:n])


def contour_room(camera: Camera, n_bodies: int, piece_px: float = PIECE_PX) -> int:
    """Number of pieces that a view may have."""
    return int(MAX_PIECES * max(1.0, PIECE_PX / piece_px) * max(1.0, camera.width / 640) * n_bodies)


def contour_buffer(camera: Camera, n_bodies: int, piece_px: float = PIECE_PX) -> Contour:
    """Uninitialized room for the contours of a view, to be filled by `trace_view`."""
    room = contour_room(camera, n_bodies, piece_px)
    return Contour(
        np.empty((room, 4), np.float32), np.empty(room, np.int32), np.empty(room, np.bool_),
        np.empty((room, 3), np.float32),
    )  # fmt: skip


@njit(nogil=True, cache=True)
def piece_buffer(surfaces: Surfaces, room: int) -> Pieces:
    """Uninitialized room for the pieces of a view, to be filled by `trace_pieces`."""
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


# The kernels below take the arrays they need one by one: handing over a tuple of thirty costs more than the work is.
# Those called once for each part or pair of parts are inlined, with `mark_occluded` and `revolved_outline`: even half
# a dozen arrays take as long to hand over as the work does.


@njit(inline="always", **FAST_MATH)
def place_parts(Ts: Array, surfaces: Surfaces, out: Pieces) -> None:
    """Fill the motions between the parts' unit coordinates and the world, which are the same in all views."""
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
    """Fill where the eye is in the unit coordinates of parts that are placed, and how far it is from them."""
    to_world, to_unit = out.Ts_world_unit, out.Ts_unit_world
    for part in range(to_world.shape[0]):
        x, y, z = eye[0] - to_world[part, 0, 3], eye[1] - to_world[part, 1, 3], eye[2] - to_world[part, 2, 3]
        out.distances[part] = np.sqrt(x * x + y * y + z * z)
        for i in range(3):
            to_unit[part, i, 4] = to_unit[part, i, 0] * x + to_unit[part, i, 1] * y + to_unit[part, i, 2] * z


@njit(inline="always", **FAST_MATH)
def _project(
    part: int, P: Array, n: int, Ts_world_unit: Array, outline: FloatArray, image: FloatArray, boxes: Array
) -> int:
    """Close an outline of n points by its first, project, thin and bound it; returns the number of its edges."""
    W = Ts_world_unit
    for i in range(3):
        outline[i, n] = outline[i, 0]
    a0, b0, c0, d0 = _image_row(0, part, P, W)
    a1, b1, c1, d1 = _image_row(1, part, P, W)
    a2, b2, c2, d2 = _image_row(2, part, P, W)
    for k in range(np.uint64(n // LANES * LANES + LANES)):  # whole vectors, whatever is beyond the outline
        x, y, z = outline[0, k], outline[1, k], outline[2, k]
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
        if k < n and k == last + 1:  # of two in a row one is kept: else the error would add up
            bu, bv = image[0, k + 1] - u, image[1, k + 1] - v
            off = (uk - u) * bv - (vk - v) * bu
            if off * off <= _THIN2 * (bu * bu + bv * bv):
                continue
        n_kept, last = n_kept + 1, k
        u, v = uk, vk
        u0, u1, v0, v1 = min(u0, u), max(u1, u), min(v0, v), max(v1, v)
        image[0, n_kept], image[1, n_kept], image[2, n_kept] = u, v, image[2, k]
        for i in range(3):
            outline[i, n_kept] = outline[i, k]
    boxes[part, 0], boxes[part, 1], boxes[part, 2], boxes[part, 3] = u0, v0, u1, v1
    return n_kept


@njit(**FAST_MATH)
def _image_row(i: int, part: int, P: Array, W: Array) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Row i of the projection from the unit coordinates of a part."""
    p, q, r = P[i, 0], P[i, 1], P[i, 2]
    return (
        np.float32(p * W[part, 0, 0] + q * W[part, 1, 0] + r * W[part, 2, 0]),
        np.float32(p * W[part, 0, 1] + q * W[part, 1, 1] + r * W[part, 2, 1]),
        np.float32(p * W[part, 0, 2] + q * W[part, 1, 2] + r * W[part, 2, 2]),
        np.float32(p * W[part, 0, 3] + q * W[part, 1, 3] + r * W[part, 2, 3] + P[i, 3]),
    )


@njit(inline="always", **FAST_MATH)
def _cut(
    n_edges: int, edge: int, piece_px: float, n: int, outline: FloatArray, image: FloatArray, ends: FloatArray,
    middles: FloatArray, edges: NDArray[np.int32],
) -> int:  # fmt: skip
    """Cut the edges of an outline into pieces and append those; returns the new count of pieces."""
    per_px, half, one, room = np.float32(1.0 / piece_px), np.float32(0.5), np.float32(1), edges.shape[0]
    for k in range(n_edges):
        u, v, w0, w1 = image[0, k], image[1, k], image[2, k], image[2, k + 1]
        x, y, z = outline[0, k], outline[1, k], outline[2, k]
        du, dv = image[0, k + 1] - u, image[1, k + 1] - v
        dx, dy, dz = outline[0, k + 1] - x, outline[1, k + 1] - y, outline[2, k + 1] - z
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


@njit(inline="always", **FAST_MATH)
def mark_all_occluded(n_parts: int, surfaces: Surfaces, out: Pieces) -> None:
    """Mark what parts hide of one another: those whose boxes in the image meet, and that are not all behind.

    What two parts that both stand hide of each other is marked already.
    """
    boxes, distances, radii, firsts, adjoining = (
        out.boxes,
        out.distances,
        surfaces.radii,
        out.firsts,
        surfaces.adjoining,
    )
    to_unit, to_world, middles, shared, occluded = (
        out.Ts_unit_world, out.Ts_world_unit, out.middles, out.shared, out.occluded
    )  # fmt: skip
    solids, is_static, related = surfaces.solids, out.is_static, out.related
    for a in range(n_parts):
        if firsts[a] == firsts[a + 1]:
            continue
        u0, v0, u1, v1 = boxes[a, 0], boxes[a, 1], boxes[a, 2], boxes[a, 3]
        behind = distances[a] + radii[a] + JOINT_MARGIN_M
        for b in range(n_parts):
            if (
                b == a
                or firsts[b] == firsts[b + 1]
                or distances[b] - radii[b] > behind
                or (is_static[a] and is_static[b])
            ):
                continue
            if boxes[b, 0] > u1 or boxes[b, 2] < u0 or boxes[b, 1] > v1 or boxes[b, 3] < v0:
                continue
            Q = out.between[a, b]
            if not related[a, b]:
                related[a, b] = True
                for i in range(3):
                    p, q, r = to_unit[b, i, 0], to_unit[b, i, 1], to_unit[b, i, 2]
                    for k in range(3):
                        Q[i, k] = p * to_world[a, 0, k] + q * to_world[a, 1, k] + r * to_world[a, 2, k]
                    Q[i, 3] = p * to_world[a, 0, 3] + q * to_world[a, 1, 3] + r * to_world[a, 2, 3] + to_unit[b, i, 3]
            for i in range(3):
                Q[i, 4] = to_unit[b, i, 4]
            margin = JOINT_MARGIN_M / distances[a] if adjoining[a, b] else 0.0
            mark_occluded(b, solids, Q, margin, middles, firsts[a], firsts[a + 1], shared, occluded)


@njit(inline="always", **FAST_MATH)
def focal_px(P: Array) -> float:
    """Focal length of a projection matrix, (3, 4), px."""
    return np.sqrt(P[0, 0] ** 2 + P[0, 1] ** 2 + P[0, 2] ** 2)


@njit(inline="always", **FAST_MATH)
def trace_part(
    part: int, P: Array, focal: float, surfaces: Surfaces, piece_px: float, n: int, edge: int, out: Pieces
) -> tuple[int, int]:  # fmt: skip
    """Append the pieces of a part that is placed; returns the new counts of pieces and of edges."""
    unit_eye, to_world, to_unit, half_axes = out.unit_eye, out.Ts_world_unit, out.Ts_unit_world, surfaces.half_axes
    outline, image, n_points = out.outline, out.image, 0
    depth = P[2, 3]
    for i in range(3):
        depth += P[2, i] * to_world[part, i, 3]
        unit_eye[i] = to_unit[part, i, 4]
    # A part that reaches the plane of the camera has no contour that could be drawn.
    if depth >= surfaces.radii[part] + NEAR_PLANE_M:
        n_profile = surfaces.profile_sizes[part]
        if n_profile > 0:
            radius = max(half_axes[part, 0], half_axes[part, 1])
            turn = np.float32(min(max(np.sqrt(8 * _SAG_PX * depth / (radius * focal)), 0.05), 0.6))
            n_points = revolved_outline(part, n_profile, surfaces.profiles, unit_eye, turn, out.half, outline)
        else:
            n_points = grid_outline(part, unit_eye, surfaces, out.f, outline)
    if n_points > 0:
        n_edges = _project(part, P, n_points, to_world, outline, image, out.boxes)
        n = _cut(n_edges, edge, piece_px, n, outline, image, out.ends, out.middles, out.edges)
        edge += n_edges
    return n, edge


@njit(**FAST_MATH)
def trace_pieces(P: Array, eye: Array, surfaces: Surfaces, piece_px: float, out: Pieces) -> int:
    """Fill the pieces of parts that are placed in one view; returns their number. See `trace_view`."""
    n_parts, focal = surfaces.radii.shape[0], focal_px(P)
    n = edge = 0
    place_eye(eye, out)
    for part in range(n_parts):
        out.firsts[part], out.is_static[part] = n, False
        n, edge = trace_part(part, P, focal, surfaces, piece_px, n, edge, out)
    out.firsts[n_parts] = n
    for i in range(n):
        out.occluded[i] = False
    mark_all_occluded(n_parts, surfaces, out)
    return n


@njit(nogil=True, cache=True)
def trace_view(P: Array, eye: Array, Ts: Array, surfaces: Surfaces, piece_px: float, out: Contour) -> int:
    """Fill a contour buffer for one view; returns the number of pieces. See `trace`.

    Args:
        P: projection matrix, (3, 4), px; its third row gives depths in metres.
        eye: camera centre in the world, (3,), metres.
        Ts: part poses, (P, 4, 4).
        surfaces: the shapes of the parts.
        piece_px: longest piece, px.
        out: room for the pieces; what does not fit is left out.
    """
    pieces = piece_buffer(surfaces, out.parts.shape[0])
    place_parts(Ts, surfaces, pieces)
    n = trace_pieces(P, eye, surfaces, piece_px, pieces)
    points, W = out.points_world, pieces.Ts_world_unit
    for part in range(Ts.shape[0]):
        for i in range(pieces.firsts[part], pieces.firsts[part + 1]):
            out.parts[i], out.occluded[i] = part, pieces.occluded[i]
            x, y, z = pieces.middles[0, i], pieces.middles[1, i], pieces.middles[2, i]
            for k in range(4):
                out.pieces_px[i, k] = pieces.ends[k, i]
            for k in range(3):
                points[i, k] = W[part, k, 0] * x + W[part, k, 1] * y + W[part, k, 2] * z + W[part, k, 3]
    return n
