"""Match edge points with segments of visible contours, by distance and orientation (oriented chamfer matching)."""

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import FAR2, FAST_MATH, ONE, ZERO, njit
from tracker.estimation.fitting.contour_arrays import Scratch, ViewArrays
from tracker.evidence.contours.pieces import JOINED, PIECE_PX, StaticContours
from tracker.evidence.contours.static_cache import mark_covered_segments, store_pieces, trace_static
from tracker.evidence.contours.surfaces import Surfaces
from tracker.geometry.arrays import FloatArray, IntArray
from tracker.geometry.segment_distance import LANES, cells_within

_NONE = np.int32(-1)
"""Index where no segment is near."""


@njit(**FAST_MATH)
def nearest_oriented_segment(
    u: FloatArray, v: FloatArray, nu: FloatArray, nv: FloatArray, rows: IntArray, segments: FloatArray, n: int,
    wanted: NDArray[np.bool_], turn: float, reach: float, best: FloatArray, nearest: NDArray[np.int32],
) -> None:  # fmt: skip
    """Update the nearest wanted segment within reach of each point (u, v) with normal (nu, nv), (N,) each.

    The angle between edge and segment counts as squared distance. A segment beyond the reach may be named, with its
    distance. As in `segment_distance.nearest_segment`, a segment is compared only with nearby points.

    Args:
        u: columns of the points, (N,), px.
        v: rows of the points, (N,), px.
        nu: u of their normals, (N,).
        nv: v of their normals, (N,).
        rows: cells of the sorted points.
        segments: see `Scratch.segments`.
        n: number of segments.
        wanted: which segments to compare with, (room,).
        turn: squared distance that a right angle counts, px^2.
        reach: largest distance, px.
        best: updated squared distances, (N,), px^2.
        nearest: updated indices of segments, (N,); smaller than those of the wanted segments before.
    """
    far, weight = np.float32(reach), np.float32(turn)
    for k in range(n):
        if not wanted[k]:
            continue
        x, y, dx, dy, inverse = segments[0, k], segments[1, k], segments[2, k], segments[3, k], segments[4, k]
        nx, ny, index = segments[5, k], segments[6, k], np.int32(k)
        left, right, top, bottom = cells_within(x, y, x + dx, y + dy, far, rows)
        for strip in range(left, right + 1):
            first, last = np.uint64(rows[strip, top]), np.uint64(rows[strip, bottom])
            for j in range((last - first + np.uint64(LANES - 1)) // np.uint64(LANES) * np.uint64(LANES)):
                i = first + j
                from_u, from_v = u[i] - x, v[i] - y
                t = (from_u * dx + from_v * dy) * inverse
                t = t if t > ZERO else ZERO
                t = t if t < ONE else ONE
                off_u, off_v = from_u - t * dx, from_v - t * dy
                alike = nu[i] * nx + nv[i] * ny
                squared = off_u * off_u + off_v * off_v + weight * (ONE - alike * alike)
                closer = squared < best[i]
                # Later segments have larger indices. As a plain choice this would be a masked store, which is slow.
                found = index if closer else _NONE
                nearest[i] = found if found > nearest[i] else nearest[i]
                best[i] = squared if closer else best[i]


@njit(**FAST_MATH)
def pack_visible(n_parts: int, scratch: Scratch) -> int:
    """Pack the visible pieces and join them to segments; return the number of segments."""
    traced, pieces, segments, of_segment = scratch.traced, scratch.pieces, scratch.segments, scratch.of_segment
    ends, middles, edges, occluded, firsts = traced.ends, traced.middles, traced.edges, traced.occluded, traced.firsts
    half, packed, n, edge, one = np.float32(0.5), np.uint64(0), np.uint64(0), -1, np.uint64(1)
    for part in range(n_parts):
        scratch.firsts[part] = packed
        for i in range(np.uint64(firsts[part]), np.uint64(firsts[part + 1])):
            if occluded[i]:
                edge = -1
                continue
            x, y, x1, y1 = ends[0, i], ends[1, i], ends[2, i], ends[3, i]
            dx, dy = x1 - x, y1 - y
            length = np.sqrt(max(dx * dx + dy * dy, np.float32(1e-12)))
            nx, ny = -dy / length, dx / length
            pieces[0, packed], pieces[1, packed], pieces[2, packed] = half * (x + x1), half * (y + y1), length
            pieces[3, packed], pieces[4, packed] = nx, ny
            pieces[5, packed], pieces[6, packed], pieces[7, packed] = middles[0, i], middles[1, i], middles[2, i]
            if edges[i] != edge or of_segment[1, n - one] == JOINED:
                edge = edges[i]
                segments[0, n], segments[1, n], segments[5, n], segments[6, n] = x, y, nx, ny
                of_segment[0, n], of_segment[1, n], of_segment[2, n] = packed, 0, part
                n += one
            k = n - one
            of_segment[1, k] += 1
            dx, dy = x1 - segments[0, k], y1 - segments[1, k]
            segments[2, k], segments[3, k] = dx, dy
            segments[4, k] = ONE / max(dx * dx + dy * dy, np.float32(1e-12))
            packed += one
    scratch.firsts[n_parts] = packed
    return int(n)


@njit(**FAST_MATH)
def _match_segments(
    view: int, n: int, views: ViewArrays, turn: float, scratch: Scratch, best: FloatArray, nearest: NDArray[np.int32]
) -> None:  # fmt: skip
    """Compare the points of a view with n segments, where wanted."""
    start, stop, theta = views.firsts[view], views.firsts[view + 1], views.thetas[view]
    # Rows first: a slice along both axes need not be contiguous, and would not be vectorized.
    u, v, nu, nv = views.points[0], views.points[1], views.points[2], views.points[3]
    nearest_oriented_segment(
        u[start:stop], v[start:stop], nu[start:stop], nv[start:stop], views.rows[view], scratch.segments, n,
        scratch.wanted, turn * np.float32(theta * theta), theta, best, nearest,
    )  # fmt: skip


@njit(**FAST_MATH)
def match_points(
    view: int, n_segments: int, views: ViewArrays, turn: float, static: StaticContours, scratch: Scratch
) -> None:
    """Fill the nearest segment of each point of a view and its squared distance."""
    start, stop = views.firsts[view], views.firsts[view + 1]
    best, nearest, wanted, of, n = scratch.best, scratch.nearest, scratch.wanted, scratch.of_segment, stop - start
    if static.best.shape[0] == 0:
        best[:n], nearest[:n], wanted[:n_segments] = FAR2, _NONE, True
    else:
        for j in range(np.uint64(n)):
            best[j], nearest[j] = static.best[np.uint64(start) + j], _NONE
        for k in range(n_segments):
            wanted[k] = static.moves[of[2, k]]
        if mark_covered_segments(view, scratch.traced, static):
            _rematch_covered(view, n_segments, views, static, scratch)
    _match_segments(view, n_segments, views, turn, scratch, best, nearest)


@njit(**FAST_MATH)
def _rematch_covered(view: int, n_segments: int, views: ViewArrays, static: StaticContours, scratch: Scratch) -> None:
    """Match the points again whose nearest static segment is covered by moving parts."""
    start, stop, reach = views.firsts[view], views.firsts[view + 1], np.float32(views.thetas[view])
    best, segments, before, limit = scratch.best, scratch.segments, static.nearest[start:stop], reach * reach
    us, vs = views.points[0][start:stop], views.points[1][start:stop]
    u0 = v0 = FAR2
    u1 = v1 = -FAR2
    for j in range(np.uint64(stop - start)):
        if best[j] < limit and static.covered[before[j]]:
            u0, u1, v0, v1 = min(u0, us[j]), max(u1, us[j]), min(v0, vs[j]), max(v1, vs[j])
            best[j] = FAR2
    u0, u1, v0, v1 = u0 - reach, u1 + reach, v0 - reach, v1 + reach
    for k in range(np.uint64(n_segments)):
        x, y = segments[0, k], segments[1, k]
        x1, y1 = x + segments[2, k], y + segments[3, k]
        if max(x, x1) >= u0 and min(x, x1) <= u1 and max(y, y1) >= v0 and min(y, y1) <= v1:
            scratch.wanted[k] = True


@njit(**FAST_MATH)
def store_static(
    view: int, surfaces: Surfaces, views: ViewArrays, turn: float, static: StaticContours,
    scratch: Scratch,
) -> None:  # fmt: skip
    """Cache the static contours of a view and the points nearest to them."""
    trace_static(views.P[view], views.eyes[view], surfaces, PIECE_PX, static, scratch.traced)
    store_pieces(view, scratch.traced, static)
    n_segments, segment, visible = pack_visible(static.moves.shape[0], scratch), -1, 0
    at = static.firsts[view, 0]
    for i in range(scratch.traced.firsts[-1]):
        if scratch.traced.occluded[i]:
            continue
        if segment + 1 < n_segments and scratch.of_segment[0, segment + 1] == visible:
            segment += 1
        static.segments[at + i] = segment
        visible += 1
    start, stop = views.firsts[view], views.firsts[view + 1]
    best, nearest = static.best[start:stop], static.nearest[start:stop]
    best[:], nearest[:], scratch.wanted[:n_segments] = FAR2, _NONE, True
    _match_segments(view, n_segments, views, turn, scratch, best, nearest)
