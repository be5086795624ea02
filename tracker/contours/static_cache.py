"""Contours of what stands still while parts of the scene move, kept from pose to pose.

A search of a limb, or a refinement of one of several people, asks for many poses in which most parts stand. Their
pieces, what they hide of each other and the points that are nearest to them are the same each time; only what moves
is traced, and what it hides.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.compute.numba_options import BORROW, FAST
from tracker.contours.generator import MAX_POINTS
from tracker.contours.occluding_contours import Pieces, face, focal_px, hide_all, trace_part
from tracker.contours.surfaces import Surfaces
from tracker.geometry.arrays import Array, FloatArray, IntArray


class Kept(NamedTuple):
    """The contours of what stands, in all views; without any room where nothing does."""

    moves: NDArray[np.bool_]
    """Which parts move, (P,); the others are expected to stand, and are kept anew where they do not."""
    Ts: Array
    """Poses of all parts when what stands was kept, (P, 4, 4), metres; NaN before."""
    ends: FloatArray
    """As the following three see `Pieces`; those of one view after those of another, (4, room), undistorted px."""
    middles: FloatArray
    """(3, room)."""
    edges: NDArray[np.int32]
    """(room,)."""
    hidden: NDArray[np.bool_]
    """Whether another part that stands hides the piece, (room,)."""
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


def kept_for(n_views: int, room: int, n_points: int, moves: NDArray[np.bool_]) -> Kept:
    """Room for what stands where the parts in `moves`, (P,), move, in views with room for as many pieces each."""
    n_parts, standing = len(moves), not moves.all()
    pieces, points = (n_views * room, n_points) if standing else (0, 0)
    return Kept(
        moves, np.full((n_parts, 4, 4), np.nan), np.empty((4, pieces), np.float32), np.empty((3, pieces), np.float32),
        np.empty(pieces, np.int32), np.empty(pieces, np.bool_), np.zeros((n_views, n_parts + 1), np.int64),
        np.empty((n_views, n_parts, 4)), np.empty(pieces, np.int32), np.zeros(room if standing else 0, np.bool_),
        np.empty(points, np.float32), np.empty(points, np.int32),
    )  # fmt: skip


@njit(**BORROW)
def still_stands(Ts: Array, moves: NDArray[np.bool_], kept: Array) -> bool:
    """Whether all parts but those that move are where they were kept, poses (P, 4, 4), to the last digit."""
    for part in range(Ts.shape[0]):
        if not moves[part]:
            for i in range(3):
                for k in range(4):
                    if Ts[part, i, k] != kept[part, i, k]:
                        return False
    return True


@njit(**BORROW)
def remember(Ts: Array, kept: Array) -> None:
    """Note where all parts are, poses (P, 4, 4), when what stands is kept."""
    for part in range(Ts.shape[0]):
        for i in range(3):
            for k in range(4):
                kept[part, i, k] = Ts[part, i, k]


@njit(**FAST)
def trace_standing(P: Array, eye: Array, surfaces: Surfaces, piece_px: float, kept: Kept, out: Pieces) -> None:
    """Fill the pieces of one view with those of the parts that stand, all being placed, as if the others were not
    there."""
    n_parts, focal = kept.moves.shape[0], focal_px(P)
    n = edge = 0
    face(eye, out)
    for part in range(n_parts):
        out.firsts[part], out.stands[part] = n, False
        if not kept.moves[part]:
            n, edge = trace_part(part, P, focal, surfaces, piece_px, n, edge, out)
    out.firsts[n_parts] = n
    for i in range(n):
        out.hidden[i] = False
    hide_all(n_parts, surfaces, out)


@njit(**FAST)
def keep_pieces(view: int, traced: Pieces, kept: Kept) -> None:
    """Keep the pieces of a view after those of the views before it."""
    n_parts = traced.firsts.shape[0] - 1
    at = kept.firsts[view - 1, n_parts] if view > 0 else 0
    for i in range(np.uint64(traced.firsts[n_parts])):
        k = np.uint64(at) + i
        for c in range(4):
            kept.ends[c, k] = traced.ends[c, i]
        for c in range(3):
            kept.middles[c, k] = traced.middles[c, i]
        kept.edges[k], kept.hidden[k] = traced.edges[i], traced.hidden[i]
    for part in range(n_parts):
        kept.firsts[view, part] = at + traced.firsts[part]
        for c in range(4):
            kept.boxes[view, part, c] = traced.boxes[part, c]
    kept.firsts[view, n_parts] = at + traced.firsts[n_parts]


@njit(**FAST)
def trace_moving(view: int, P: Array, eye: Array, surfaces: Surfaces, piece_px: float, kept: Kept, out: Pieces) -> int:
    """Fill the pieces of one view as `contours.trace_pieces` does, those of what stands as they were kept."""
    n_parts, room = kept.moves.shape[0], out.edges.shape[0]
    # The edges of what stands keep their numbers; there are fewer of them.
    n, edge, focal = 0, n_parts * MAX_POINTS, focal_px(P)
    face(eye, out)
    for part in range(n_parts):
        out.firsts[part], out.stands[part] = n, not kept.moves[part]
        if kept.moves[part]:
            n, edge = trace_part(part, P, focal, surfaces, piece_px, n, edge, out)
            out.hidden[out.firsts[part] : n] = False
            continue
        first = np.uint64(kept.firsts[view, part])
        count = np.uint64(min(kept.firsts[view, part + 1] - kept.firsts[view, part], room - n))
        for j in range(count):
            i, k = np.uint64(n) + j, first + j
            for c in range(4):
                out.ends[c, i] = kept.ends[c, k]
            for c in range(3):
                out.middles[c, i] = kept.middles[c, k]
            out.edges[i], out.hidden[i] = kept.edges[k], kept.hidden[k]
        for c in range(4):
            out.boxes[part, c] = kept.boxes[view, part, c]
        n += int(count)
    out.firsts[n_parts] = n
    hide_all(n_parts, surfaces, out)
    return n


@njit(**FAST)
def mark_covered(view: int, traced: Pieces, kept: Kept) -> bool:
    """Mark the kept segments of a view of which something that moves hides a piece; whether there are any."""
    kept.covered[: kept.firsts[view, -1] - kept.firsts[view, 0]] = False
    some = False
    for part in range(kept.moves.shape[0]):
        if kept.moves[part]:
            continue
        k = kept.firsts[view, part]
        for i in range(traced.firsts[part], traced.firsts[part + 1]):
            if traced.hidden[i] and not kept.hidden[k]:
                kept.covered[kept.segments[k]] = some = True
            k += 1
    return some
