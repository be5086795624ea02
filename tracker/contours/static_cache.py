"""Contours of what is_static still while parts of the scene move, static from pose to pose.

A search of a limb, or a refinement of one of several people, asks for many poses in which most parts stand. Their
pieces, what they hide of each other and the points that are nearest to them are the same each time; only what moves
is traced, and what it hides.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.compute.numba_options import FAST_MATH, NO_REFCOUNT
from tracker.contours.generator import MAX_POINTS
from tracker.contours.occluding_contours import Pieces, focal_px, mark_all_occluded, place_eye, trace_part
from tracker.contours.surfaces import Surfaces
from tracker.geometry.arrays import Array, FloatArray, IntArray


class StaticContours(NamedTuple):
    """The contours of what is_static, in all views; without any room where nothing does."""

    moves: NDArray[np.bool_]
    """Which parts move, (P,); the others are expected to stand, and are static anew where they do not."""
    Ts: Array
    """Poses of all parts when what is_static was static, (P, 4, 4), metres; NaN before."""
    ends: FloatArray
    """As the following three see `Pieces`; those of one view after those of another, (4, room), undistorted px."""
    middles: FloatArray
    """(3, room)."""
    edges: NDArray[np.int32]
    """(room,)."""
    occluded: NDArray[np.bool_]
    """Whether another part that is_static hides the piece, (room,)."""
    firsts: IntArray
    """Index of the first piece of each part in each view, and after the last, (V, P + 1)."""
    boxes: Array
    """Bounds u0, v0, u1, v1 of each part in each view, (V, P, 4), px."""
    segments: NDArray[np.int32]
    """Index of the segment that each visible piece is joined to, in its view, (room,)."""
    covered: NDArray[np.bool_]
    """Of the segments of one view, whether what moves hides some of them, (room,)."""
    best: FloatArray
    """Squared distance of each point of the image to the nearest segment, (N,); see `matching.Scratch`."""
    nearest: NDArray[np.int32]
    """Index of that segment, in its view, (N,)."""


def static_contours_buffer(n_views: int, room: int, n_points: int, moves: NDArray[np.bool_]) -> StaticContours:
    """Room for what is_static where the parts in `moves`, (P,), move, in views with room for as many pieces each."""
    n_parts, any_static = len(moves), not moves.all()
    pieces, points = (n_views * room, n_points) if any_static else (0, 0)
    return StaticContours(
        moves, np.full((n_parts, 4, 4), np.nan), np.empty((4, pieces), np.float32), np.empty((3, pieces), np.float32),
        np.empty(pieces, np.int32), np.empty(pieces, np.bool_), np.zeros((n_views, n_parts + 1), np.int64),
        np.empty((n_views, n_parts, 4)), np.empty(pieces, np.int32), np.zeros(room if any_static else 0, np.bool_),
        np.empty(points, np.float32), np.empty(points, np.int32),
    )  # fmt: skip


@njit(**NO_REFCOUNT)
def is_static_unchanged(Ts: Array, moves: NDArray[np.bool_], static: Array) -> bool:
    """Whether all parts but those that move are where they were static, poses (P, 4, 4), to the last digit."""
    for part in range(Ts.shape[0]):
        if not moves[part]:
            for i in range(3):
                for k in range(4):
                    if Ts[part, i, k] != static[part, i, k]:
                        return False
    return True


@njit(**NO_REFCOUNT)
def copy_poses(Ts: Array, static: Array) -> None:
    """Note where all parts are, poses (P, 4, 4), when what is_static is static."""
    for part in range(Ts.shape[0]):
        for i in range(3):
            for k in range(4):
                static[part, i, k] = Ts[part, i, k]


@njit(**FAST_MATH)
def trace_static(
    P: Array, eye: Array, surfaces: Surfaces, piece_px: float, static: StaticContours, out: Pieces
) -> None:
    """Fill the pieces of one view with those of the parts that stand, all being placed, as if the others were not
    there."""
    n_parts, focal = static.moves.shape[0], focal_px(P)
    n = edge = 0
    place_eye(eye, out)
    for part in range(n_parts):
        out.firsts[part], out.is_static[part] = n, False
        if not static.moves[part]:
            n, edge = trace_part(part, P, focal, surfaces, piece_px, n, edge, out)
    out.firsts[n_parts] = n
    for i in range(n):
        out.occluded[i] = False
    mark_all_occluded(n_parts, surfaces, out)


@njit(**FAST_MATH)
def store_pieces(view: int, traced: Pieces, static: StaticContours) -> None:
    """Keep the pieces of a view after those of the views before it."""
    n_parts = traced.firsts.shape[0] - 1
    at = static.firsts[view - 1, n_parts] if view > 0 else 0
    for i in range(np.uint64(traced.firsts[n_parts])):
        k = np.uint64(at) + i
        for c in range(4):
            static.ends[c, k] = traced.ends[c, i]
        for c in range(3):
            static.middles[c, k] = traced.middles[c, i]
        static.edges[k], static.occluded[k] = traced.edges[i], traced.occluded[i]
    for part in range(n_parts):
        static.firsts[view, part] = at + traced.firsts[part]
        for c in range(4):
            static.boxes[view, part, c] = traced.boxes[part, c]
    static.firsts[view, n_parts] = at + traced.firsts[n_parts]


@njit(**FAST_MATH)
def trace_moving_parts(
    view: int, P: Array, eye: Array, surfaces: Surfaces, piece_px: float, static: StaticContours, out: Pieces
) -> int:
    """Fill the pieces of one view as `contours.trace_pieces` does, those of what is_static as they were static."""
    n_parts, room = static.moves.shape[0], out.edges.shape[0]
    # The edges of what is_static keep their numbers; there are fewer of them.
    n, edge, focal = 0, n_parts * MAX_POINTS, focal_px(P)
    place_eye(eye, out)
    for part in range(n_parts):
        out.firsts[part], out.is_static[part] = n, not static.moves[part]
        if static.moves[part]:
            n, edge = trace_part(part, P, focal, surfaces, piece_px, n, edge, out)
            out.occluded[out.firsts[part] : n] = False
            continue
        first = np.uint64(static.firsts[view, part])
        count = np.uint64(min(static.firsts[view, part + 1] - static.firsts[view, part], room - n))
        for j in range(count):
            i, k = np.uint64(n) + j, first + j
            for c in range(4):
                out.ends[c, i] = static.ends[c, k]
            for c in range(3):
                out.middles[c, i] = static.middles[c, k]
            out.edges[i], out.occluded[i] = static.edges[k], static.occluded[k]
        for c in range(4):
            out.boxes[part, c] = static.boxes[view, part, c]
        n += int(count)
    out.firsts[n_parts] = n
    mark_all_occluded(n_parts, surfaces, out)
    return n


@njit(**FAST_MATH)
def mark_covered_segments(view: int, traced: Pieces, static: StaticContours) -> bool:
    """Mark the static segments of a view of which something that moves hides a piece; whether there are any."""
    static.covered[: static.firsts[view, -1] - static.firsts[view, 0]] = False
    some = False
    for part in range(static.moves.shape[0]):
        if static.moves[part]:
            continue
        k = static.firsts[view, part]
        for i in range(traced.firsts[part], traced.firsts[part + 1]):
            if traced.occluded[i] and not static.occluded[k]:
                static.covered[static.segments[k]] = some = True
            k += 1
    return some
