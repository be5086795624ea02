"""Robust chamfer distance between the contours of posed bodies and the edges of all views (GD96 Sect. 4.1).

The directed distance from the model's visible contour to the edges is read from a distance image. The distance from
edges to the contour is measured point by piece. Both are normalized and averaged (Eq. 1-3), then averaged over the
views. Costs are in undistorted pixels of the footage; the views may have a smaller scale.
"""

import os
import threading
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody, ahead, parts_of
from tracker.compute.threads import kernel_pool
from tracker.estimation.search.chamfer_kernels import (
    ScoreBuffers,
    ScoredViews,
    TracedContours,
    measure_view,
    score_candidates,
    score_traced,
)
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.pieces import PIECE_PX, piece_buffer, place_parts
from tracker.evidence.contours.surfaces import Surfaces, surfaces_of
from tracker.evidence.view_evidence import ViewEvidence, outliers_px
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.cameras import projections
from tracker.geometry.segment_distance import near_points, segment_buffer

Outliers = Literal["truncated", "paper"]


_MIN_SHARED_CANDIDATES = 6
"""Smallest number of candidates that is worth waking another thread."""


class Cost(NamedTuple):
    """Undirected normalized chamfer distance (GD96 Eq. 3)."""

    total_px: float
    """Mean over the views with edges, px of the footage."""
    view_costs_px: Array
    """Cost of each view, (V,), px of the footage; NaN for a view without edges."""
    forward_px: Array
    """Model to image, (V,), px of the footage."""
    backward_px: Array
    """Image to model, (V,), px of the footage."""


class ChamferCost:
    """Cost of poses against fixed evidence, which a search minimizes. Thread-safe.

    The image-to-model direction uses only the edge points within theta of the predicted contours, because other edges
    belong to other things. They are selected once, so that costs are comparable during a search.
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
            views: evidence of each view.
            predicted: all bodies in the scene, as predicted.
            theta_px: outlier distance, px of the footage; by default that of each view.
            outliers: "truncated" takes min(d, theta) over all points. "paper" rejects points beyond theta and then
                beyond mean + 2 standard deviations (GD96 Sect. 4.1); a direction that keeps fewer than half of its
                points costs theta.
            threads: number of threads that score candidates, at most the number of processors.
        """
        self._threads = min(threads, os.cpu_count() or 1)
        self.models: tuple[BodyModel, ...] = tuple(b.model for b in predicted)
        self.outliers = outliers
        self._predicted = predicted
        self._times = np.array([v.ahead_frames for v in views])
        self._surfaces = surfaces_of(self.models)
        self._scales = np.array([v.scale for v in views])
        room = occluding_contours.contour_room([v.camera for v in views], len(self.models))
        self._contours = self._traced(views, predicted, room)
        self._seen = np.array([bool(len(v.points_px)) for v in views], dtype=bool)
        self._arrays = scored_views(views, outliers_px(views, theta_px), [*self._pieces_by_view()])
        self._room = max(room, self._arrays.points.shape[1])
        self._own = threading.local()

    def __call__(self, poses: Sequence[Array]) -> Cost:
        """Return the cost of one pose of every body, (n_values,) each."""
        return self._cost(self._directed(0, poses[0][None], poses)[0])

    def at_prediction(self) -> Cost:
        """Return the cost of the predicted poses, whose contours are already traced."""
        directed = np.empty((len(self._seen), 2))
        score_traced(self._contours, self._arrays, self.outliers == "paper", self._scratch(), directed)
        return self._cost(directed)

    def _cost(self, directed: Array) -> Cost:
        directed_px = directed / self._scales[:, None]
        view_costs_px = self._blank_unseen(directed_px.mean(axis=-1))
        return Cost(float(self._mean(view_costs_px)), view_costs_px, directed_px[:, 0], directed_px[:, 1])

    def of_person(self, person: int, candidates: Array, poses: Sequence[Array]) -> tuple[Array, Array]:
        """Return the costs of many candidate poses of one person, with the others fixed at `poses`.

        Args:
            person: index of the body that varies.
            candidates: its poses, (C, n_values).
            poses: pose of each body; that of `person` is not used.

        Returns:
            The total costs, (C,), and those of each view, (C, V), px of the footage; NaN for views without edges.
        """
        view_costs_px = self._blank_unseen(self._directed(person, candidates, poses).mean(axis=-1) / self._scales)
        return self._mean(view_costs_px), view_costs_px

    @property
    def edge_points_px(self) -> tuple[FloatArray, ...]:
        """Edge points of each view that count, (n, 2), working px."""
        arrays = self._arrays
        return tuple(
            arrays.points[:, first : first + n].T for first, n in zip(arrays.firsts[:-1], arrays.counts, strict=True)
        )

    @property
    def predicted_pieces_px(self) -> list[FloatArray]:
        """Visible contours of the predicted bodies in each view, u0, v0, u1, v1, (M, 4), working px."""
        return [pieces[~occluded] for pieces, occluded in self._pieces_by_view()]

    def _pieces_by_view(self) -> Iterator[tuple[FloatArray, NDArray[np.bool_]]]:
        """Yield the pieces of the predicted contours in each view, (N, 4), and whether they are occluded, (N,)."""
        ends, occluded, _, firsts = self._contours
        for a, b in pairwise(firsts.tolist()):
            yield np.ascontiguousarray(ends[:, a:b].T), occluded[a:b]

    def _traced(self, views: Sequence[ViewEvidence], bodies: Sequence[PosedBody], room: int) -> TracedContours:
        """Trace the contours of posed bodies in all views."""
        pieces, traced, time = piece_buffer(self._surfaces, room), [], None
        for view in views:
            if view.ahead_frames != time:
                time = view.ahead_frames
                place_parts(occluding_contours.part_poses(ahead(bodies, time)), self._surfaces, pieces)
            n = occluding_contours.trace_pieces(
                view.camera.projection, view.camera.center_world, self._surfaces, PIECE_PX, pieces
            )
            traced.append((pieces.ends[:, :n].copy(), pieces.occluded[:n].copy(), pieces.edges[:n].copy()))
        ends, occluded, edges = zip(*traced, strict=True)
        firsts = np.cumsum([0, *map(len, edges)]).astype(np.int64)
        return TracedContours(np.concatenate(ends, axis=1), np.concatenate(occluded), np.concatenate(edges), firsts)

    def _directed(self, person: int, candidates: Array, poses: Sequence[Array]) -> Array:
        """Return the directed costs of candidates of a person, see `of_person`, (C, V, 2), working px.

        Views of other times than the frame's see the poses moved by the velocities of the predicted bodies.
        """
        if not self._times.any() or all(b.velocity is None for b in self._predicted):
            return self._directed_on_frame(person, candidates, poses)
        directed = np.empty((len(candidates), len(self._seen), 2))
        for time in np.unique(self._times):
            then = [b.poses_ahead(p[None], time)[0] for b, p in zip(self._predicted, poses, strict=True)]
            at, moved = self._times == time, self._predicted[person].poses_ahead(candidates, time)
            directed[:, at] = self._directed_on_frame(person, moved, then)[:, at]
        return directed

    def _directed_on_frame(self, person: int, candidates: Array, poses: Sequence[Array]) -> Array:
        """Return the same in all views with all people where they are on the frame."""
        model = self.models[person]
        first = parts_of(self.models, person).start
        directed = np.empty((len(candidates), len(self._seen), 2))
        poses_of = np.ascontiguousarray(candidates, dtype=np.float64)
        Ts, paper = self._part_poses(poses), self.outliers == "paper"

        def score(share: slice) -> None:
            score_candidates(
                poses_of[share], first, model.tree, Ts.copy(), self._surfaces, self._arrays, paper, self._scratch(),
                directed[share],
            )  # fmt: skip

        if self._threads > 1 and len(candidates) >= _MIN_SHARED_CANDIDATES:
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

    def _scratch(self) -> ScoreBuffers:
        """Return the scratch of the calling thread."""
        scratch: ScoreBuffers | None = getattr(self._own, "scratch", None)
        if scratch is None:
            n_dofs = max(m.n_dofs for m in self.models)
            scratch = self._own.scratch = score_buffers(self._surfaces, self._room, n_dofs)
        return scratch

    def _blank_unseen(self, view_costs_px: Array) -> Array:
        view_costs_px[..., ~self._seen] = np.nan
        return view_costs_px

    def _mean(self, view_costs_px: Array) -> Array:
        """Return the mean over the views with edges, (..., V) to (...); without any, that of the outlier distances."""
        if not self._seen.any():
            return np.full(view_costs_px.shape[:-1], np.mean(self._arrays.thetas / self._scales))
        return view_costs_px[..., self._seen].mean(axis=-1)


def frame_cost(views: Sequence[ViewEvidence], bodies: Sequence[PosedBody]) -> Cost:
    """Return the cost of all people on a frame, which is shown and stored with their poses.

    It has one definition, whatever found the poses and by which settings: all edges of the whole pictures count, with
    the usual outlier distances.

    Args:
        views: evidence of the frame, `Observer.evidence` of `Observer.origin` without regions.
        bodies: all people, with their velocities where a view needs them.
    """
    return ChamferCost(views, bodies).at_prediction()


def score_buffers(surfaces: Surfaces, room: int, n_dofs: int) -> ScoreBuffers:
    """Return scratch for pieces and for edge points of one view, both at most `room`, and for a person's dofs."""
    return ScoreBuffers(
        piece_buffer(surfaces, room), segment_buffer(room), np.empty((3, room), np.float32),
        np.empty(room, np.float32), np.empty(room, np.float32), np.ones(room, np.float32),
        np.empty((n_dofs, 3)), np.empty((n_dofs, 3)),
    )  # fmt: skip


def scored_views(
    views: Sequence[ViewEvidence], thetas: Array, contours: Sequence[tuple[FloatArray, NDArray[np.bool_]]]
) -> ScoredViews:
    """Return the evidence as arrays, with the edge points near predicted contours.

    Args:
        views: evidence of each view.
        thetas: outlier distance of each view, (V,), working px.
        contours: pieces of the predicted contours in each view, (N, 4), and whether they are occluded, (N,).
    """
    sizes = [v.camera.size for v in views]
    near = near_points([v.points_px for v in views], sizes, contours, thetas.tolist())
    return ScoredViews(
        *projections([v.camera for v in views]),
        np.array(sizes, dtype=np.int64),
        _distances(tuple(views)),
        near.points,
        near.rows,
        near.firsts,
        near.counts,
        thetas,
    )


def compile_measure_kernels(views: Sequence[ViewEvidence], models: tuple[BodyModel, ...]) -> None:
    """Call the kernels that measure contours, without a contour; none that traces contours is needed."""
    no_pieces = np.empty((0, 4), np.float32), np.empty(0, np.bool_)
    arrays = scored_views(views, outliers_px(views, None), [no_pieces] * len(views))
    scratch = score_buffers(surfaces_of(models), arrays.points.shape[1], 1)
    measure_view(0, 0, 0, arrays, False, scratch, np.empty(2))


@lru_cache(maxsize=1)  # a hand makes dozens of costs a second from the same views
def _distances(views: tuple[ViewEvidence, ...]) -> FloatArray:
    """Return the distance images, one after the other, row by row."""
    return np.concatenate([v.distance.ravel() for v in views])
