"""How well posed bodies explain the edges of all views: the robust chamfer distance of GD96 Sect. 4.1.

The directed distance of the model's visible contour to the image's edges is read from a distance image; that of
the image's edges to the model's contour is measured point by piece. Both are normalized, averaged (Eq. 1-3), and
averaged over the views. Costs are in undistorted pixels of the footage; images may be matched at a smaller scale.
"""

import os
import threading
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.body.kinematics import Tree, forward_kinematics
from tracker.body.model import BodyModel, PosedBody, parts_of
from tracker.compute.numba_options import FAST_MATH
from tracker.compute.threads import kernel_pool
from tracker.contours import occluding_contours
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.segment_distance import (
    RowSortedPoints,
    Segments,
    nearest_segment,
    segment_buffer,
    sort_points,
    stack_rows,
    within_reach,
)
from tracker.images.distance_transform import bilinear

Outliers = Literal["truncated", "paper"]

_ZERO, _HALF, _ONE = np.float32(0.0), np.float32(0.5), np.float32(1.0)  # plain numbers would make it all float64
_JOINED = 10
"""Pieces in a row on one straight edge that are matched as one segment: longer ones would reach too many points."""

_WORTH_SHARING = 6
"""Fewer candidates than this are scored sooner than another thread is awake."""


class Cost(NamedTuple):
    """Undirected normalized chamfer distance (GD96 Eq. 3)."""

    total_px: float
    """Mean over the views that have any edges, px of the footage."""
    view_costs_px: Array
    """Cost of each view, (V,), px of the footage; NaN for a view without edges."""
    forward_px: Array
    """Model to image, (V,), px of the footage."""
    backward_px: Array
    """Image to model, (V,), px of the footage."""


class _ViewArrays(NamedTuple):
    """The evidence of all views as arrays, for the kernels; lengths in working px."""

    P: Array
    """Projection matrices, (V, 3, 4)."""
    eyes: Array
    """Camera centres in the world, (V, 3), metres."""
    sizes: NDArray[np.int64]
    """Image widths and heights, (V, 2)."""
    distances: FloatArray
    """The distance images, one after the other, row by row."""
    points: FloatArray
    """u and v of the edge points near the prediction, one view (see `RowSortedPoints`) after the other, (2, N)."""
    rows: NDArray[np.int64]
    """Index of the first point of each strip and row among those of its view, (V, strips, largest height + 1)."""
    firsts: NDArray[np.int64]
    """Index of the first edge point of each view, and the number of all, (V + 1,)."""
    counts: NDArray[np.int64]
    """Number of edge points of each view, (V,)."""
    thetas: Array
    """Outlier distances, (V,)."""


class _Scratch(NamedTuple):
    """Room that the kernels work in."""

    pieces: occluding_contours.Pieces
    segments: Segments
    """Visible pieces, joined where they are straight."""
    visible: FloatArray
    """Of each visible piece u and v of its middle, px, and its squared length, px^2, (3, room)."""
    lengths: FloatArray
    """Length of each visible piece, (room,)."""
    distances: FloatArray
    """Distances, of pieces or of edge points, (room,)."""
    ones: FloatArray
    """Weights of edge points, (room,)."""


class _Contours(NamedTuple):
    """Contours of predicted bodies in all views, one view after the other; empty where poses are to be traced."""

    ends: FloatArray
    """u0, v0, u1, v1 of each piece, (4, N), undistorted working px."""
    occluded: NDArray[np.bool_]
    """Whether a part hides the piece, (N,)."""
    edges: NDArray[np.int32]
    """Number of the straight edge that each piece is cut from, (N,)."""
    firsts: NDArray[np.int64]
    """Index of the first piece of each view, and the number of all, (V + 1,); (0,) where there are none."""


class ChamferCost:
    """The cost of poses against fixed evidence; what a search minimizes.

    The image-to-model direction sees only the edge points within theta of the predicted contours: edges elsewhere
    belong to other things. The selection is made once, so that the cost compares like with like during a search.
    """

    def __init__(
        self,
        views: Sequence[ViewEvidence],
        predicted: Sequence[PosedBody],
        theta_px: float | None = None,
        outliers: Outliers = "truncated",
        threads: int = 2,
    ) -> None:
        """Prepare the evidence for the kernels.

        Args:
            views: the evidence of each view.
            predicted: everybody in the scene, as predicted.
            theta_px: outlier distance, px of the footage; by default that of each view.
            outliers: "truncated" takes min(d, theta) over all points; "paper" rejects points beyond theta and then
                beyond mean + 2 standard deviations (GD96 Sect. 4.1), and a direction of which fewer than half is
                kept costs theta.
            threads: how many score candidates at a time, where there are as many processors.
        """
        self._threads = min(threads, os.cpu_count() or 1)
        self.models: tuple[BodyModel, ...] = tuple(b.model for b in predicted)
        self.outliers = outliers
        self._surfaces = occluding_contours.surfaces_of(self.models)
        self._scales = np.array([v.scale for v in views])
        thetas = [v.outlier_px(theta_px) for v in views]
        widest = max((v.camera for v in views), key=lambda camera: camera.width)
        room = occluding_contours.contour_room(widest, len(self.models))
        self._predicted, self._contours = tuple(b.values for b in predicted), self._traced(views, predicted, room)
        near = [
            _near(v, *pieces, theta) for v, pieces, theta in zip(views, self._pieces_by_view(), thetas, strict=True)
        ]
        self._seen = np.array([bool(len(v.points_px)) for v in views], dtype=bool)
        self._arrays = _ViewArrays(
            np.stack([v.camera.projection for v in views]),
            np.stack([v.camera.center_world for v in views]),
            np.array([v.camera.size for v in views], dtype=np.int64),
            _distances(tuple(views)),
            np.concatenate([n.points for n in near], axis=1),
            stack_rows([n.rows for n in near]),
            np.concatenate([[0], np.cumsum([n.points.shape[1] for n in near])]).astype(np.int64),
            np.array([n.n_points for n in near], dtype=np.int64),
            np.array(thetas),
        )
        self._room = max(room, self._arrays.points.shape[1])
        self._own = threading.local()

    def __call__(self, poses: Sequence[Array]) -> Cost:
        """Cost of one pose of everybody; `poses` holds the values of each body."""
        return self._cost(self._directed(0, poses[0][None], poses)[0])

    def at_prediction(self) -> Cost:
        """Cost of the predicted poses, whose contours are traced already."""
        return self._cost(self._directed(0, self._predicted[0][None], self._predicted, self._contours)[0])

    def _cost(self, directed: Array) -> Cost:
        directed_px = directed / self._scales[:, None]
        view_costs_px = self._blank_unseen(directed_px.mean(axis=-1))
        return Cost(float(self._mean(view_costs_px)), view_costs_px, directed_px[:, 0], directed_px[:, 1])

    def of_person(self, person: int, candidates: Array, poses: Sequence[Array]) -> tuple[Array, Array]:
        """Costs of many candidate poses of one person, the others held at `poses`.

        Args:
            person: index of the body that varies.
            candidates: its poses, (C, n_values).
            poses: the values of each body; that of `person` is not used.

        Returns:
            The total costs, (C,), and those of each view, (C, V), px of the footage; NaN for views without edges.
        """
        view_costs_px = self._blank_unseen(self._directed(person, candidates, poses).mean(axis=-1) / self._scales)
        return self._mean(view_costs_px), view_costs_px

    @property
    def edge_points_px(self) -> tuple[FloatArray, ...]:
        """The edge points that count, of each view, (n, 2), working px."""
        arrays = self._arrays
        return tuple(
            arrays.points[:, first : first + n].T for first, n in zip(arrays.firsts[:-1], arrays.counts, strict=True)
        )

    @property
    def predicted_pieces_px(self) -> list[FloatArray]:
        """The visible contours of the predicted bodies in each view, u0, v0, u1, v1, (M, 4), working px."""
        return [pieces[~occluded] for pieces, occluded in self._pieces_by_view()]

    def _pieces_by_view(self) -> Iterator[tuple[FloatArray, NDArray[np.bool_]]]:
        """Pieces of the predicted contours in each view, (N, 4), and whether they are hidden, (N,)."""
        ends, occluded, _, firsts = self._contours
        for a, b in pairwise(firsts.tolist()):
            yield np.ascontiguousarray(ends[:, a:b].T), occluded[a:b]

    def _traced(self, views: Sequence[ViewEvidence], bodies: Sequence[PosedBody], room: int) -> _Contours:
        """Trace the contours of posed bodies in all views."""
        out = _Contours(
            np.empty((4, room * len(views)), np.float32), np.empty(room * len(views), np.bool_),
            np.empty(room * len(views), np.int32), np.zeros(len(views) + 1, np.int64),
        )  # fmt: skip
        n = _trace_views(
            np.stack([v.camera.projection for v in views]),
            np.stack([v.camera.center_world for v in views]),
            occluding_contours.part_poses(bodies), self._surfaces,
            occluding_contours.piece_buffer(self._surfaces, room), out,
        )  # fmt: skip
        return _Contours(out.ends[:, :n].copy(), out.occluded[:n].copy(), out.edges[:n].copy(), out.firsts)

    def _directed(
        self, person: int, candidates: Array, poses: Sequence[Array], contours: _Contours | None = None
    ) -> Array:
        """The directed costs of candidates of a person, see `of_person`, (C, V, 2), working px.

        One kernel for all who ask: another would take the sums of single precision in another order.
        """
        model = self.models[person]
        first = parts_of(self.models, person).start
        directed = np.empty((len(candidates), len(self._seen), 2))
        poses_of = np.ascontiguousarray(candidates, dtype=np.float64)
        Ts, paper = self._part_poses(poses), self.outliers == "paper"
        traced = contours or _no_contours()

        def score(share: slice) -> None:
            _score_candidates(
                poses_of[share], first, model.n_dofs, model.tree, Ts, self._surfaces, self._arrays, paper,
                traced, self._scratch(), directed[share],
            )  # fmt: skip

        if self._threads > 1 and len(candidates) >= _WORTH_SHARING:
            shares = np.linspace(0, len(candidates), self._threads + 1).astype(int)
            slices = [slice(a, b) for a, b in pairwise(shares)]
            others = [kernel_pool().submit(score, s) for s in slices[1:]]
            score(slices[0])
            for other in others:
                other.result()
        else:
            score(slice(None))
        return directed

    def _part_poses(self, poses: Sequence[Array]) -> Array:
        return occluding_contours.part_poses([PosedBody(m, p) for m, p in zip(self.models, poses, strict=True)])

    def _scratch(self) -> _Scratch:
        """Room of the calling thread's own: several threads may score at a time."""
        scratch: _Scratch | None = getattr(self._own, "scratch", None)
        if scratch is None:
            room = self._room
            scratch = self._own.scratch = _Scratch(
                occluding_contours.piece_buffer(self._surfaces, room),
                segment_buffer(room), np.empty((3, room), np.float32),
                np.empty(room, np.float32), np.empty(room, np.float32), np.ones(room, np.float32),
            )  # fmt: skip
        return scratch

    def _blank_unseen(self, view_costs_px: Array) -> Array:
        view_costs_px[..., ~self._seen] = np.nan
        return view_costs_px

    def _mean(self, view_costs_px: Array) -> Array:
        """Mean over the views with edges, (..., V) to (...); where there is none, that of the outlier distances."""
        if not self._seen.any():
            return np.full(view_costs_px.shape[:-1], np.mean(self._arrays.thetas / self._scales))
        return view_costs_px[..., self._seen].mean(axis=-1)


@lru_cache(maxsize=1)  # a hand makes dozens of costs a second from the same views
def _distances(views: tuple[ViewEvidence, ...]) -> FloatArray:
    """The distance images, one after the other, row by row."""
    return np.concatenate([v.distance.ravel() for v in views])


@lru_cache(maxsize=1)
def _no_contours() -> _Contours:
    """No contours: poses are to be traced."""
    return _Contours(np.empty((4, 0), np.float32), np.empty(0, np.bool_), np.empty(0, np.int32), np.empty(0, np.int64))


def _near(view: ViewEvidence, pieces_px: FloatArray, occluded: NDArray[np.bool_], theta: float) -> RowSortedPoints:
    """Edge points within theta of the visible model contour."""
    everything = sort_points(view.points_px, view.camera.size)
    return within_reach(everything, pieces_px, occluded, theta)


@njit(**FAST_MATH)
def _robust_mean(d: FloatArray, w: FloatArray, n: int, theta: float, paper: bool) -> float:
    """Mean of n distances with weights w, outliers treated as `ChamferCost` says; theta where there are none."""
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
    """Distance at a pixel; outside the image, that of the nearest border pixel and the way to it."""
    inside = bilinear(image, width, height, u, v)[0]
    half_u, half_v = _HALF * np.float32(width - 1), _HALF * np.float32(height - 1)
    off_u, off_v = abs(u - half_u) - half_u, abs(v - half_v) - half_v
    off_u, off_v = off_u if off_u > _ZERO else _ZERO, off_v if off_v > _ZERO else _ZERO
    return inside + np.sqrt(off_u * off_u + off_v * off_v)


@njit(**FAST_MATH)
def _forward(n: int, image: FloatArray, width: int, height: int, theta: float, visible: FloatArray) -> float:
    """Mean distance of n visible pieces, see `_Scratch`, cut off at theta; theta where none is visible.

    It stores nothing, so that it runs on whole vectors of pieces.
    """
    limit = np.float32(theta)
    spared = weight = 0.0
    for i in range(np.uint64(n)):
        d = _distance(image, width, height, visible[0, i], visible[1, i])
        length = np.sqrt(visible[2, i])
        spared += float(length * (limit - d if d < limit else _ZERO))
        weight += float(length)
    return theta - spared / weight if weight > 0.0 else theta


@njit(**FAST_MATH)
def _forward_paper(n: int, image: FloatArray, width: int, height: int, theta: float, scratch: _Scratch) -> float:
    """The same by the paper's robust mean."""
    visible, lengths, d = scratch.visible, scratch.lengths, scratch.distances
    for i in range(n):
        d[i] = _distance(image, width, height, visible[0, i], visible[1, i])
        lengths[i] = np.sqrt(visible[2, i])
    return _robust_mean(d, lengths, n, theta, True)


@njit(**FAST_MATH)
def _take_visible(
    n: int, pieces: occluding_contours.Pieces, visible: FloatArray, segments: Segments
) -> tuple[int, int]:
    """Take the visible ones of n pieces, and join them to segments; the number of both."""
    ends, occluded, edges = pieces.ends, pieces.occluded, pieces.edges
    su, sv, du, dv = segments.u, segments.v, segments.du, segments.dv
    joined, edge, k, m = 0, -1, np.uint64(0), np.uint64(0)
    for i in range(np.uint64(n)):
        if occluded[i]:
            edge = -1
            continue
        x0, y0, x1, y1 = ends[0, i], ends[1, i], ends[2, i], ends[3, i]
        if edges[i] != edge or joined == _JOINED:
            edge, joined = edges[i], 0
            su[k], sv[k] = x0, y0
            k += np.uint64(1)
        joined += 1
        last = k - np.uint64(1)
        du[last], dv[last] = x1 - su[last], y1 - sv[last]
        visible[0, m], visible[1, m] = _HALF * (x0 + x1), _HALF * (y0 + y1)
        visible[2, m] = (x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0)
        m += np.uint64(1)
    return int(m), int(k)


@njit(nogil=True, cache=True)
def _trace_views(
    P: Array, eyes: Array, Ts: Array, surfaces: occluding_contours.Surfaces, pieces: occluding_contours.Pieces,
    out: _Contours,
) -> int:  # fmt: skip
    """Fill the contours of posed parts in all views; their number."""
    occluding_contours.place_parts(Ts, surfaces, pieces)
    at = 0
    for view in range(P.shape[0]):
        n = occluding_contours.trace_pieces(P[view], eyes[view], surfaces, occluding_contours.PIECE_PX, pieces)
        out.firsts[view] = at
        out.ends[:, at : at + n] = pieces.ends[:, :n]
        out.occluded[at : at + n] = pieces.occluded[:n]
        out.edges[at : at + n] = pieces.edges[:n]
        at += n
    out.firsts[P.shape[0]] = at
    return at


@njit(**FAST_MATH)
def _take_traced(view: int, contours: _Contours, pieces: occluding_contours.Pieces) -> int:
    """Copy the pieces of a view that are traced already; their number."""
    first, last = contours.firsts[view], contours.firsts[view + 1]
    n = last - first
    for i in range(n):
        for k in range(4):
            pieces.ends[k, i] = contours.ends[k, first + i]
        pieces.occluded[i], pieces.edges[i] = contours.occluded[first + i], contours.edges[first + i]
    return n


@njit(**FAST_MATH)
def _score(
    Ts: Array,
    surfaces: occluding_contours.Surfaces,
    views: _ViewArrays,
    paper: bool,
    contours: _Contours,
    scratch: _Scratch,
    directed: Array,
) -> None:
    """Fill the directed costs of one pose, (V, 2): model to image and image to model, working px."""
    d, pixel = scratch.distances, 0
    traced = contours.firsts.shape[0] > 0
    if not traced:
        occluding_contours.place_parts(Ts, surfaces, scratch.pieces)
    for view in range(views.P.shape[0]):
        width, height, theta = views.sizes[view, 0], views.sizes[view, 1], views.thetas[view]
        if traced:
            n = _take_traced(view, contours, scratch.pieces)
        else:
            n = occluding_contours.trace_pieces(
                views.P[view], views.eyes[view], surfaces, occluding_contours.PIECE_PX, scratch.pieces
            )
        n_visible, n_segments = _take_visible(n, scratch.pieces, scratch.visible, scratch.segments)
        image = views.distances[pixel : pixel + width * height]
        if paper:
            directed[view, 0] = _forward_paper(n_visible, image, width, height, theta, scratch)
        else:
            directed[view, 0] = _forward(n_visible, image, width, height, theta, scratch.visible)
        first, last = views.firsts[view], views.firsts[view + 1]
        u, v = views.points[0][first:last], views.points[1][first:last]
        nearest_segment(u, v, views.rows[view], scratch.segments, n_segments, theta, d)
        directed[view, 1] = _robust_mean(d, scratch.ones, views.counts[view], theta, paper)
        pixel += width * height


@njit(nogil=True, cache=True)
def _score_candidates(
    candidates: Array, first: int, n_dofs: int, tree: Tree, Ts: Array,
    surfaces: occluding_contours.Surfaces, views: _ViewArrays, paper: bool, contours: _Contours, scratch: _Scratch,
    directed: Array,
) -> None:  # fmt: skip
    """`_score` for many poses of the person whose parts begin at `first`; directed is (C, V, 2)."""
    last = first + tree.parents.shape[0]
    own = Ts.copy()
    axes, origins = np.empty((n_dofs, 3)), np.empty((n_dofs, 3))
    for c in range(candidates.shape[0]):
        forward_kinematics(candidates[c], tree, own[first:last], axes, origins)
        _score(own, surfaces, views, paper, contours, scratch, directed[c])
