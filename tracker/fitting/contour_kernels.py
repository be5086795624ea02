"""The kernel under `refine`: one pose's contours traced, matched with the points of all views, summed part by part."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.compute.numba_options import FAST_MATH
from tracker.contours import occluding_contours
from tracker.contours.static_cache import (
    StaticContours,
    copy_poses,
    is_static_unchanged,
    mark_covered_segments,
    store_pieces,
    trace_moving_parts,
    trace_static,
)
from tracker.evidence.view_evidence import SCENE_SPACING_PX
from tracker.fitting.twists import add_twists
from tracker.geometry.arrays import Array, FloatArray, IntArray
from tracker.geometry.segment_distance import LANES, cells_within
from tracker.images.distance_transform import bilinear

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)  # plain numbers would turn the kernel's arithmetic into float64
_FAR2 = np.float32(1e12)
_JOINED = 10
"""Most pieces of a segment: longer ones would reach too many points."""


class ViewArrays(NamedTuple):
    """The evidence of all views as arrays, for the kernel; lengths in working px."""

    P: Array
    """Projection matrices, (V, 3, 4)."""
    eyes: Array
    """Camera centres in the world, (V, 3), metres."""
    sizes: NDArray[np.int64]
    """Widths and heights, (V, 2)."""
    distances: FloatArray
    """The distance images, one after the other, row by row."""
    points: FloatArray
    """The columns of `points_to_match`, (N_COLUMNS, N); one view after the other, each as `RowSortedPoints`; those that
    it is filled up with stand for nothing."""
    firsts: NDArray[np.int64]
    """Index of the first point of each view, and the number of all, (V + 1,)."""
    rows: NDArray[np.int64]
    """Index, within the view, of the first point of each strip and row, (V, strips, rows + 1)."""
    thetas: Array
    """Outlier distances, (V,)."""
    weights: Array
    """Information per pixel of contour, model to image and image to model, (V, 2)."""


class Scratch(NamedTuple):
    """Room that the kernel works in."""

    traced: occluding_contours.Pieces
    pieces: FloatArray
    """Visible pieces, part by part: u, v of the middle, length, normal's u, v, and the middle's x, y, z in the unit
    coordinates of its part, (8, room)."""
    firsts: NDArray[np.int64]
    """Index of the first visible piece of each part, and the number of all, (P + 1,)."""
    pulls: Array
    """Summed over the residuals of each visible piece, times their weights, (7, room): of those across the piece the
    squares of their image gradients and the gradients times the residuals; of others, at its ends, g_u^2, g_u g_v,
    g_v^2, and g_u and g_v times the residuals."""
    segments: FloatArray
    """Pieces in a row on one straight edge: u, v, du, dv, 1 / length^2, normal's u, v, (7, room)."""
    of_segment: NDArray[np.int32]
    """The first piece of each segment, the number of its pieces, and their part, (3, room)."""
    wanted: NDArray[np.bool_]
    """Whether points are held against each segment, (room,)."""
    best: FloatArray
    """Squared distance of each edge point to its segment, with the turn between them, (room,)."""
    nearest: NDArray[np.int32]
    """Index of that segment, (room,); -1 for what stands as it was static (see `static`)."""
    pull: FloatArray
    """What each edge point's residual weighs, (room,)."""


def scratch_buffer(surfaces: occluding_contours.Surfaces, room: int, n_points: int) -> Scratch:
    """Uninitialized room for as many pieces in a view and points in all."""
    return Scratch(
        occluding_contours.piece_buffer(surfaces, room), np.empty((8, room), np.float32),
        np.empty(len(surfaces.radii) + 1, np.int64), np.empty((7, room)), np.empty((7, room), np.float32),
        np.empty((3, room), np.int32), np.empty(room, np.bool_), np.empty(n_points, np.float32),
        np.empty(n_points, np.int32), np.empty(n_points, np.float32),
    )  # fmt: skip


class Sums(NamedTuple):
    """What the kernel adds up."""

    M: Array
    """Normal matrix of each part's twist, upper triangles, (P, 6, 6)."""
    b: Array
    """Gradient by each part's twist, (P, 6)."""
    parts: Array
    """Per view and part: visible length, its summed cut-off distance, explained points, (V, P, 3)."""
    silhouette: Array
    """Points of each view's silhouette that are explained, (V,)."""


@njit(**FAST_MATH)
def nearest_oriented_segment(
    u: FloatArray, v: FloatArray, nu: FloatArray, nv: FloatArray, rows: IntArray, segments: FloatArray, n: int,
    wanted: NDArray[np.bool_], turn: float, reach: float, best: FloatArray, nearest: NDArray[np.int32],
) -> None:  # fmt: skip
    """For each point (u, v) with normal (nu, nv), (N,) each, the nearest wanted segment within reach, or what was best.

    The turn between the point's edge and the segment counts as squared distance. Beyond the reach anything may be
    named, at a distance beyond it. As `nearest.nearest_segment`, segments are held only against points nearby.
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
                t = t if t > _ZERO else _ZERO
                t = t if t < _ONE else _ONE
                off_u, off_v = from_u - t * dx, from_v - t * dy
                alike = nu[i] * nx + nv[i] * ny
                squared = off_u * off_u + off_v * off_v + weight * (_ONE - alike * alike)
                closer = squared < best[i]
                nearest[i] = index if closer else nearest[i]
                best[i] = squared if closer else best[i]


@njit(**FAST_MATH)
def _pack_visible(n_parts: int, scratch: Scratch) -> int:
    """Pack the visible pieces, and join them to segments; returns the number of those."""
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
            if edges[i] != edge or of_segment[1, n - one] == _JOINED:
                edge = edges[i]
                segments[0, n], segments[1, n], segments[5, n], segments[6, n] = x, y, nx, ny
                of_segment[0, n], of_segment[1, n], of_segment[2, n] = packed, 0, part
                n += one
            k = n - one
            of_segment[1, k] += 1
            dx, dy = x1 - segments[0, k], y1 - segments[1, k]
            segments[2, k], segments[3, k] = dx, dy
            segments[4, k] = _ONE / max(dx * dx + dy * dy, np.float32(1e-12))
            packed += one
    scratch.firsts[n_parts] = packed
    return int(n)


@njit(**FAST_MATH)
def _model_to_image(
    view: int, first: int, last: int, pixel: int, views: ViewArrays, scale: float, with_jacobian: bool,
    static: StaticContours, scratch: Scratch, sums: Sums,
) -> float:  # fmt: skip
    """Add the residuals of the visible pieces of the parts from first to last; their cost."""
    width, height = views.sizes[view, 0], views.sizes[view, 1]
    theta, weight = np.float32(views.thetas[view]), np.float32(views.weights[view, 0])
    q, pulls, firsts = scratch.pieces, scratch.pulls, scratch.firsts
    image, right, bottom = (
        views.distances[pixel : pixel + width * height],
        np.float32(width - 1),
        np.float32(height - 1),
    )
    s2, cost = np.float32((scale * theta) ** 2), 0.0
    for part in range(first, last):
        seen = far = 0.0
        pulled = with_jacobian and static.moves[part]
        for k in range(np.uint64(firsts[part]), np.uint64(firsts[part + 1])):
            x, y, length = q[0, k], q[1, k], q[2, k]
            # What lies outside the image is neither explained nor refuted: a body may be cut off at the border.
            if x < _ZERO or y < _ZERO or x > right or y > bottom:
                continue
            d, along_u, along_v = bilinear(image, width, height, x, y)
            cut = min(d, theta)
            f = s2 / (s2 + cut * cut)
            seen += length
            far += length * cut
            cost += length * f * cut * cut
            if pulled and d < theta:
                across = q[3, k] * along_u + q[4, k] * along_v
                w = weight * length * (f * f) * across
                pulls[0, k] += w * across
                pulls[1, k] += w * d
        sums.parts[view, part, 0] += seen
        sums.parts[view, part, 1] += far
    return 0.5 * float(weight) * cost


@njit(**FAST_MATH)
def _match_segments(
    view: int, n: int, views: ViewArrays, turn: float, scratch: Scratch, best: FloatArray, nearest: NDArray[np.int32]
) -> None:  # fmt: skip
    """Hold the points of a view against those of n segments that are wanted."""
    start, stop, theta = views.firsts[view], views.firsts[view + 1], views.thetas[view]
    # Rows first: a slice of both would be of numbers that need not lie side by side, which is not vectorized.
    u, v, nu, nv = views.points[0], views.points[1], views.points[2], views.points[3]
    nearest_oriented_segment(
        u[start:stop], v[start:stop], nu[start:stop], nv[start:stop], views.rows[view], scratch.segments, n,
        scratch.wanted, turn * np.float32(theta * theta), theta, best, nearest,
    )  # fmt: skip


@njit(**FAST_MATH)
def _match_points(
    view: int, n_segments: int, views: ViewArrays, turn: float, static: StaticContours, scratch: Scratch
) -> None:
    """Fill the nearest segment of each point of a view, and how far it is."""
    start, stop = views.firsts[view], views.firsts[view + 1]
    best, nearest, wanted, of, n = scratch.best, scratch.nearest, scratch.wanted, scratch.of_segment, stop - start
    if static.best.shape[0] == 0:
        best[:n], wanted[:n_segments] = _FAR2, True
    else:
        for j in range(np.uint64(n)):
            best[j], nearest[j] = static.best[np.uint64(start) + j], np.int32(-1)
        for k in range(n_segments):
            wanted[k] = static.moves[of[2, k]]
        if mark_covered_segments(view, scratch.traced, static):
            _rematch_covered(view, n_segments, views, static, scratch)
    _match_segments(view, n_segments, views, turn, scratch, best, nearest)


@njit(**FAST_MATH)
def _rematch_covered(view: int, n_segments: int, views: ViewArrays, static: StaticContours, scratch: Scratch) -> None:
    """Let the points whose nearest segment something that moves covers be held against whatever is in reach of them."""
    start, stop, reach = views.firsts[view], views.firsts[view + 1], np.float32(views.thetas[view])
    best, segments, before, limit = scratch.best, scratch.segments, static.nearest[start:stop], reach * reach
    us, vs = views.points[0][start:stop], views.points[1][start:stop]
    u0 = v0 = _FAR2
    u1 = v1 = -_FAR2
    for j in range(np.uint64(stop - start)):
        if best[j] < limit and static.covered[before[j]]:
            u0, u1, v0, v1 = min(u0, us[j]), max(u1, us[j]), min(v0, vs[j]), max(v1, vs[j])
            best[j] = _FAR2
    u0, u1, v0, v1 = u0 - reach, u1 + reach, v0 - reach, v1 + reach
    for k in range(np.uint64(n_segments)):
        x, y = segments[0, k], segments[1, k]
        x1, y1 = x + segments[2, k], y + segments[3, k]
        if max(x, x1) >= u0 and min(x, x1) <= u1 and max(y, y1) >= v0 and min(y, y1) <= v1:
            scratch.wanted[k] = True


@njit(**FAST_MATH)
def _image_to_model(
    view: int, n_segments: int, views: ViewArrays, scale: float, turn: float, with_jacobian: bool,
    static: StaticContours, scratch: Scratch, sums: Sums,
) -> float:  # fmt: skip
    """Add the residuals of the view's edge points whose nearest piece is of a part that moves; the cost of all.

    The points are the same at every pose, so that their costs compare like with like: one that no piece is near, or
    that is nearest to somebody else, costs what a point at the outlier distance does.
    """
    theta, weight = views.thetas[view], np.float32(views.weights[view, 1] * SCENE_SPACING_PX)
    s2, limit, cost = np.float32((scale * theta) ** 2), np.float32(theta * theta), 0.0
    start, stop = views.firsts[view], views.firsts[view + 1]
    us, vs, q, of = views.points[0][start:stop], views.points[1][start:stop], scratch.segments, scratch.of_segment
    weights, counts, of_silhouette = (
        views.points[4][start:stop],
        views.points[5][start:stop],
        views.points[6][start:stop],
    )
    best, nearest, pulls = scratch.best, scratch.nearest, scratch.pulls
    _match_points(view, n_segments, views, turn, static, scratch)
    n, pull, explained = np.uint64(stop - start), scratch.pull, 0.0
    for j in range(n):
        squared = min(best[j], limit)
        f = s2 / (s2 + squared)
        cost += weights[j] * (f * squared)
        pull[j] = weight * weights[j] * (f * f)
    for j in range(n):
        if best[j] >= limit:
            continue
        if not with_jacobian:  # who asks for the costs of the parts counts what they explain
            explained += of_silhouette[j]
        if nearest[j] < 0:
            continue
        k = np.uint64(nearest[j])
        part = of[2, k]
        if not with_jacobian:
            sums.parts[view, part, 2] += counts[j]
            continue
        if not static.moves[part]:
            continue
        w, u, v, dx, dy, count = pull[j], us[j] - q[0, k], vs[j] - q[1, k], q[2, k], q[3, k], of[1, k]
        t = (u * dx + v * dy) * q[4, k]
        i = np.uint64(of[0, k] + min(max(int(t * np.float32(count)), 0), count - 1))
        if t > _ZERO and t < _ONE:
            pulls[0, i] += w
            pulls[1, i] -= w * (u * q[5, k] + v * q[6, k])
            continue
        if t > _ZERO:
            u, v = u - dx, v - dy
        d = np.sqrt(u * u + v * v)
        if d < np.float32(1e-3):
            gu, gv = q[5, k], q[6, k]
        else:
            gu, gv = -u / d, -v / d
        pulls[2, i] += w * gu * gu
        pulls[3, i] += w * gu * gv
        pulls[4, i] += w * gv * gv
        pulls[5, i] += w * d * gu
        pulls[6, i] += w * d * gv
    sums.silhouette[view] = explained
    return 0.5 * float(weight) * cost


@njit(**FAST_MATH)
def _store_static(
    view: int, surfaces: occluding_contours.Surfaces, views: ViewArrays, turn: float, static: StaticContours,
    scratch: Scratch,
) -> None:  # fmt: skip
    """Keep the contours of what stands in a view, and what they are nearest to."""
    trace_static(views.P[view], views.eyes[view], surfaces, occluding_contours.PIECE_PX, static, scratch.traced)
    store_pieces(view, scratch.traced, static)
    n_segments, segment, visible = _pack_visible(static.moves.shape[0], scratch), -1, 0
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
    best[:], scratch.wanted[:n_segments] = _FAR2, True
    _match_segments(view, n_segments, views, turn, scratch, best, nearest)


class ContourTerm(NamedTuple):
    """All that `accumulate_normal_equations` needs."""

    Ts: Array
    """World poses of all parts, (P, 4, 4), metres."""
    first: int
    """Index of the first part that is matched."""
    last: int
    """Index after the last of them; the others hide, and draw the points that are nearer to them."""
    surfaces: occluding_contours.Surfaces
    views: ViewArrays
    scale: float
    """See `refine.MatchSettings`."""
    turn: float
    """The same."""
    static: StaticContours
    scratch: Scratch
    sums: Sums
    """What it fills."""


WITH_JACOBIAN, COST_ONLY = np.bool_(True), np.bool_(False)
"""Values of `with_jacobian`. Literals in a kernel would have `accumulate_normal_equations` compiled once for each."""


@njit(**FAST_MATH)
def accumulate_normal_equations(term: ContourTerm, with_jacobian: bool) -> float:
    """Fill the sums for one pose of the parts from first to last, the other parts fixed; returns the cost.

    Without `with_jacobian` the normal matrices stay empty; with it those of parts that do not move (see `static`) do.
    """
    Ts, first, last, surfaces, views, scale, turn, static, scratch, sums = term
    sums.M[:] = 0.0
    sums.b[:] = 0.0
    sums.parts[:] = 0.0
    sums.silhouette[:] = 0.0
    pixel, cost, caches = np.int64(0), 0.0, static.best.shape[0] > 0  # a bare 0 is a type of its own to the compiler
    stale = caches and not is_static_unchanged(Ts, static.moves, static.Ts)
    occluding_contours.place_parts(Ts, surfaces, scratch.traced)
    for view in range(views.P.shape[0]):
        if stale:
            _store_static(view, surfaces, views, turn, static, scratch)
        if views.weights[view, 0] > 0.0 or views.weights[view, 1] > 0.0:
            P, eye, traced = views.P[view], views.eyes[view], scratch.traced
            if caches:
                trace_moving_parts(view, P, eye, surfaces, occluding_contours.PIECE_PX, static, traced)
            else:
                occluding_contours.trace_pieces(P, eye, surfaces, occluding_contours.PIECE_PX, traced)
            n_segments = _pack_visible(Ts.shape[0], scratch)
            scratch.pulls[:, : scratch.firsts[-1]] = 0.0
            # The costs of the parts need both directions.
            if views.weights[view, 0] > 0.0 or not with_jacobian:
                cost += _model_to_image(view, first, last, pixel, views, scale, with_jacobian, static, scratch, sums)
            if views.weights[view, 1] > 0.0:
                cost += _image_to_model(view, n_segments, views, scale, turn, with_jacobian, static, scratch, sums)
            if with_jacobian:
                for part in range(first, last):
                    if not static.moves[part]:
                        continue
                    span, W = scratch.firsts[part : part + 2], scratch.traced.Ts_world_unit[part]
                    add_twists(span, scratch.pieces, scratch.pulls, views.P[view], W, sums.M[part], sums.b[part])
        pixel += views.sizes[view, 0] * views.sizes[view, 1]
    if stale:
        copy_poses(Ts, static.Ts)
    return cost
