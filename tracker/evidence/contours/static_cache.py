"""Cache the contours of static parts while other parts move.

A search of one limb, or a refinement of one of several people, asks for many poses in which most parts are static. The
pieces of static parts, their mutual occlusion and the image points nearest to them do not change. Only moving parts are
traced, and what they occlude.
"""

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import FAST_MATH, NO_REFCOUNT, njit
from tracker.evidence.contours.generator import MAX_POINTS
from tracker.evidence.contours.occluding_contours import focal_px, mark_all_occluded, trace_part
from tracker.evidence.contours.pieces import Pieces, StaticContours, place_eye
from tracker.evidence.contours.surfaces import Surfaces
from tracker.geometry.arrays import Array


@njit(**NO_REFCOUNT)
def is_static_unchanged(Ts: Array, moves: NDArray[np.bool_], static: Array) -> bool:
    """Return whether all static parts are exactly where they were cached; poses are (P, 4, 4)."""
    for part in range(Ts.shape[0]):
        if not moves[part]:
            for i in range(3):
                for k in range(4):
                    if Ts[part, i, k] != static[part, i, k]:
                        return False
    return True


@njit(**NO_REFCOUNT)
def copy_poses(Ts: Array, static: Array) -> None:
    """Copy the poses of all parts, (P, 4, 4), when the cache is filled."""
    for part in range(Ts.shape[0]):
        for i in range(3):
            for k in range(4):
                static[part, i, k] = Ts[part, i, k]


@njit(**FAST_MATH)
def trace_static(
    P: Array, eye: Array, surfaces: Surfaces, piece_px: float, static: StaticContours, out: Pieces
) -> None:
    """Fill the pieces of the static parts in one view, as if the moving parts did not exist; parts are placed."""
    n_parts, focal = static.moves.shape[0], focal_px(P)
    n = edge = np.int64(0)
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
    """Store the pieces of a view after those of the views before it."""
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
    """Fill the pieces of one view as `occluding_contours.trace_pieces` does; static parts come from the cache."""
    n_parts, room = static.moves.shape[0], out.edges.shape[0]
    # Cached edges keep their numbers, which are smaller.
    n, edge, focal = np.int64(0), n_parts * MAX_POINTS, focal_px(P)
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
    return int(n)


@njit(**FAST_MATH)
def mark_covered_segments(view: int, traced: Pieces, static: StaticContours) -> bool:
    """Mark the cached segments of a view that moving parts occlude partly; return whether there are any."""
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
