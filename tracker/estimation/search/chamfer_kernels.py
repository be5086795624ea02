"""Kernels of the chamfer cost: trace the contours of poses and measure them against the edges of all views."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Tree, forward_kinematics
from tracker.compute.jit import FAST_MATH, HALF, ZERO, njit
from tracker.evidence.contours.occluding_contours import trace_pieces
from tracker.evidence.contours.pieces import JOINED, PIECE_PX, Pieces, place_parts
from tracker.evidence.contours.surfaces import Surfaces
from tracker.evidence.images.distance_transform import bilinear
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.segment_distance import Segments, nearest_segment

_PAPER = np.bool_(True)  # a literal would compile `_robust_mean` once more


class ScoredViews(NamedTuple):
    """The evidence of all views as arrays; lengths in working px."""

    P: Array
    """Projection matrices, (V, 3, 4)."""
    eyes: Array
    """Camera centres in the world, (V, 3), metres."""
    sizes: NDArray[np.int64]
    """Image widths and heights, (V, 2), px."""
    distances: FloatArray
    """Distance images, one after the other, row by row."""
    points: FloatArray
    """u and v of the edge points near the prediction, (2, N), one view (see `segment_distance.RowSortedPoints`) after
    the other."""
    rows: NDArray[np.int64]
    """Index of the first point of each strip and row within its view, (V, strips, largest height + 1)."""
    firsts: NDArray[np.int64]
    """Index of the first edge point of each view, then the number of all, (V + 1,)."""
    counts: NDArray[np.int64]
    """Number of edge points of each view, (V,)."""
    thetas: Array
    """Outlier distances, (V,), px."""


class ScoreBuffers(NamedTuple):
    """Buffers of the kernels, used by one thread at a time."""

    pieces: Pieces
    segments: Segments
    """Visible pieces, joined where they are straight."""
    visible: FloatArray
    """u and v of the middle of each visible piece, px, and its squared length, px^2, (3, room)."""
    lengths: FloatArray
    """Length of each visible piece, (room,), px."""
    distances: FloatArray
    """Distances of pieces or of edge points, (room,), px."""
    ones: FloatArray
    """Weights of edge points, (room,)."""
    axes: Array
    """Room for the axes of one person's degrees of freedom, (most dofs, 3); see `forward_kinematics`."""
    origins: Array
    """Room for their origins, (most dofs, 3)."""


class TracedContours(NamedTuple):
    """Contours of predicted bodies in all views, one view after the other."""

    ends: FloatArray
    """u0, v0, u1, v1 of each piece, (4, N), undistorted working px."""
    occluded: NDArray[np.bool_]
    """Whether another part occludes the piece, (N,)."""
    edges: NDArray[np.int32]
    """Index of the straight edge that each piece is cut from, (N,)."""
    firsts: NDArray[np.int64]
    """Index of the first piece of each view, then the number of all, (V + 1,)."""


@njit(**FAST_MATH)
def _robust_mean(d: FloatArray, w: FloatArray, n: int, theta: float, paper: bool) -> float:
    """Return the mean of n distances with weights w and outliers as in `ChamferCost`; theta without any."""
    total, weight = 0.0, 0.0
    if not paper:
        for i in range(n):
            total += w[i] * (d[i] if d[i] < theta else theta)
            weight += w[i]
        return total / weight if weight > 0 else theta
    everything, squares = 0.0, 0.0
    for i in range(n):
        everything += w[i]
        if d[i] <= theta:
            total += w[i] * d[i]
            squares += w[i] * d[i] * d[i]
            weight += w[i]
    if weight <= 0.0:
        return theta
    mean = total / weight
    bound = min(theta, mean + 2.0 * np.sqrt(max(0.0, squares / weight - mean * mean)))
    total, weight = 0.0, 0.0
    for i in range(n):
        if d[i] <= bound:
            total += w[i] * d[i]
            weight += w[i]
    return total / weight if weight >= 0.5 * everything else theta


@njit(**FAST_MATH)
def _distance(image: FloatArray, width: int, height: int, u: np.float32, v: np.float32) -> np.float32:
    """Return the distance at a pixel; outside the image, that of the nearest border pixel plus the distance to it."""
    inside = bilinear(image, width, height, u, v)[0]
    half_u, half_v = HALF * np.float32(width - 1), HALF * np.float32(height - 1)
    off_u, off_v = abs(u - half_u) - half_u, abs(v - half_v) - half_v
    off_u, off_v = off_u if off_u > ZERO else ZERO, off_v if off_v > ZERO else ZERO
    return inside + np.sqrt(off_u * off_u + off_v * off_v)


@njit(**FAST_MATH)
def _forward(n: int, image: FloatArray, width: int, height: int, theta: float, visible: FloatArray) -> float:
    """Return the mean distance of n visible pieces, see `ScoreBuffers`, cut off at theta; theta if none is visible.

    The loop stores nothing, so that it is vectorized.
    """
    limit = np.float32(theta)
    spared = weight = 0.0
    for i in range(np.uint64(n)):
        d = _distance(image, width, height, visible[0, i], visible[1, i])
        length = np.sqrt(visible[2, i])
        spared += float(length * (limit - d if d < limit else ZERO))
        weight += float(length)
    return theta - spared / weight if weight > 0.0 else theta


@njit(**FAST_MATH)
def _forward_paper(n: int, image: FloatArray, width: int, height: int, theta: float, scratch: ScoreBuffers) -> float:
    """Return the same by the paper's robust mean."""
    visible, lengths, d = scratch.visible, scratch.lengths, scratch.distances
    for i in range(n):
        d[i] = _distance(image, width, height, visible[0, i], visible[1, i])
        lengths[i] = np.sqrt(visible[2, i])
    return _robust_mean(d, lengths, n, theta, _PAPER)


@njit(**FAST_MATH)
def _take_visible(n: int, pieces: Pieces, visible: FloatArray, segments: Segments) -> tuple[np.int64, np.int64]:
    """Pack the visible ones of n pieces and join them to segments; return both numbers."""
    ends, occluded, edges = pieces.ends, pieces.occluded, pieces.edges
    su, sv, du, dv = segments.u, segments.v, segments.du, segments.dv
    joined, edge, k, m = 0, -1, np.uint64(0), np.uint64(0)
    for i in range(np.uint64(n)):
        if occluded[i]:
            edge = -1
            continue
        x0, y0, x1, y1 = ends[0, i], ends[1, i], ends[2, i], ends[3, i]
        if edges[i] != edge or joined == JOINED:
            edge, joined = edges[i], 0
            su[k], sv[k] = x0, y0
            k += np.uint64(1)
        joined += 1
        last = k - np.uint64(1)
        du[last], dv[last] = x1 - su[last], y1 - sv[last]
        visible[0, m], visible[1, m] = HALF * (x0 + x1), HALF * (y0 + y1)
        visible[2, m] = (x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0)
        m += np.uint64(1)
    return np.int64(m), np.int64(k)


@njit(**FAST_MATH)
def _take_traced(view: int, contours: TracedContours, pieces: Pieces) -> int:
    """Copy the traced pieces of a view; return their number."""
    first, last = contours.firsts[view], contours.firsts[view + 1]
    n = last - first
    for i in range(n):
        for k in range(4):
            pieces.ends[k, i] = contours.ends[k, first + i]
        pieces.occluded[i], pieces.edges[i] = contours.occluded[first + i], contours.edges[first + i]
    return n


@njit(**FAST_MATH)
def measure_view(
    view: int, n: int, pixel: int, views: ScoredViews, paper: bool, scratch: ScoreBuffers, directed: Array
) -> int:
    """Fill the directed costs of the n pieces of one view: model to image and image to model, (2,), working px.

    Compiled without the kernels that trace, so that both can be compiled side by side.

    Args:
        view: index of the view.
        n: number of pieces in the scratch.
        pixel: index of the first pixel of its distance image.
        views: the evidence.
        paper: whether outliers are those of the paper, see `ChamferCost`.
        scratch: with the pieces.
        directed: to fill.

    Returns:
        The index of the first pixel of the next view.
    """
    width, height, theta, d = views.sizes[view, 0], views.sizes[view, 1], views.thetas[view], scratch.distances
    n_visible, n_segments = _take_visible(n, scratch.pieces, scratch.visible, scratch.segments)
    image = views.distances[pixel : pixel + width * height]
    if paper:
        directed[0] = _forward_paper(n_visible, image, width, height, theta, scratch)
    else:
        directed[0] = _forward(n_visible, image, width, height, theta, scratch.visible)
    first, last = views.firsts[view], views.firsts[view + 1]
    u, v = views.points[0][first:last], views.points[1][first:last]
    nearest_segment(u, v, views.rows[view], scratch.segments, n_segments, theta, d)
    directed[1] = _robust_mean(d, scratch.ones, views.counts[view], theta, paper)
    return int(pixel + width * height)


@njit(**FAST_MATH)
def score_traced(
    contours: TracedContours, views: ScoredViews, paper: bool, scratch: ScoreBuffers, directed: Array
) -> None:
    """Fill the directed costs of contours that are traced already, (V, 2), see `score_candidates`."""
    pixel = np.int64(0)  # a literal would compile `measure_view` once more
    for view in range(views.P.shape[0]):
        n = _take_traced(view, contours, scratch.pieces)
        pixel = measure_view(view, n, pixel, views, paper, scratch, directed[view])


@njit(**FAST_MATH)
def score_candidates(
    candidates: Array, first: int, tree: Tree, Ts: Array, surfaces: Surfaces, views: ScoredViews, paper: bool,
    scratch: ScoreBuffers, directed: Array,
) -> None:  # fmt: skip
    """Fill the directed costs of many poses of the person whose parts begin at `first`, see `measure_view`.

    Args:
        candidates: the poses, (C, n_values).
        first: index of the person's first part.
        tree: of the person's body.
        Ts: poses of the parts of all people, (P, 4, 4), metres; those of the person are overwritten.
        surfaces: of all people.
        views: the evidence.
        paper: whether outliers are those of the paper, see `ChamferCost`.
        scratch: of this thread.
        directed: to fill, (C, V, 2), working px.
    """
    own = Ts[first : first + tree.parents.shape[0]]
    for c in range(candidates.shape[0]):
        forward_kinematics(candidates[c], tree, own, scratch.axes, scratch.origins)
        place_parts(Ts, surfaces, scratch.pieces)
        pixel = np.int64(0)
        for view in range(views.P.shape[0]):
            n = trace_pieces(views.P[view], views.eyes[view], surfaces, PIECE_PX, scratch.pieces)
            pixel = measure_view(view, n, pixel, views, paper, scratch, directed[c, view])
