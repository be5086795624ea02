"""Assign edges to people: an edge explained by one body does not attract another.

An edge that runs along the contour of one body and not along that of another belongs to the first. Segments of edges
are assigned as a whole, as the prediction accepts them (`edge_segments`); points of the silhouette's contour are
assigned one by one. Evidence that several bodies explain, or none, stays with all of them: in the residuals each point
is matched with the nearest piece of contour of any body.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import PosedBody, ahead
from tracker.compute.jit import njit
from tracker.estimation.fitting.contour_residuals import CAPTURE
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.occluding_contours import Contour, contour_buffer, store_contour, trace_pieces
from tracker.evidence.contours.pieces import PIECE_PX, Pieces, piece_buffer, place_parts
from tracker.evidence.contours.surfaces import Surfaces, surfaces_of
from tracker.evidence.images.edge_segments import (
    MAX_ANGLE_RAD,
    EdgeSegments,
    Samples,
    nearest_parallel_segment,
    sample_segments,
)
from tracker.evidence.view_evidence import (
    ACCEPTED_SHARE,
    ViewEvidence,
    foreground_segments,
    with_all_segments,
    with_segments,
)
from tracker.geometry.arrays import Array, FloatArray

_OWNERSHIP_RATIO = 0.5
"""Evidence is foreign to a body if its distance to another one is below this share of that to the body."""


class EvidencePool:
    """The evidence of one frame before it is assigned."""

    def __init__(self, views: Sequence[ViewEvidence]) -> None:
        """Take the evidence of each view. Edges without direction are not assigned."""
        self.views = tuple(views)
        """The views as observed."""

    @cached_property
    def all_edges(self) -> tuple[ViewEvidence, ...]:
        """The views with all edges, also those that the predictions refused."""
        return tuple(map(with_all_segments, self.views))

    @cached_property
    def samples(self) -> tuple[tuple[Samples | None, Samples | None], ...]:
        """Samples of the edges and of the silhouette's points of each view; None where there are none."""
        return tuple(_samples_of(v) for v in self.views)


class EvidenceAssignment:
    """The evidence of one frame, assigned to people in some poses. Distances are computed once for all people."""

    def __init__(self, pool: EvidencePool, bodies: Sequence[PosedBody]) -> None:
        """Prepare the assignment for posed bodies; nothing is computed yet."""
        self.bodies = tuple(bodies)
        """All people in the poses for which the evidence is assigned."""
        self._pool = pool
        self._own: dict[tuple[int, bool], tuple[ViewEvidence, ...]] = {}

    def own(self, person: int, everywhere: bool = False) -> tuple[ViewEvidence, ...]:
        """Return the evidence of each view without what clearly belongs to somebody else.

        It must not be called by several threads at a time.

        Args:
            person: whose evidence is wanted.
            everywhere: assign all edges, for poses far from the present one. Otherwise views in which nobody else is
                near stay as they are.
        """
        if len(self.bodies) == 1:
            return self._pool.all_edges if everywhere else self._pool.views
        if (person, everywhere) not in self._own:
            self._own[person, everywhere] = tuple(v.own(person, everywhere) for v in self._views)
        return self._own[person, everywhere]

    @cached_property
    def _views(self) -> list["_View"]:
        surfaces, pool = surfaces_of(tuple(b.model for b in self.bodies)), self._pool
        times = {v.ahead_frames for v in pool.views}
        Ts = {time: occluding_contours.part_poses(ahead(self.bodies, time)) for time in times}
        return [_View(v, *s, surfaces, Ts[v.ahead_frames]) for v, s in zip(pool.views, pool.samples, strict=True)]


class _View:
    """One view of several people in some poses."""

    def __init__(
        self, view: ViewEvidence, edges: Samples | None, silhouette: Samples | None, surfaces: Surfaces, Ts: Array
    ) -> None:
        self._view, self._edges, self._silhouette, self._surfaces, self._Ts = view, edges, silhouette, surfaces, Ts

    def own(self, person: int, everywhere: bool) -> ViewEvidence:
        """See `EvidenceAssignment.own`."""
        view, out = self._view, self._view
        if view.segments is None or self._edges is None or not (everywhere or self._ownership.near[person]):
            return with_all_segments(view) if everywhere else view
        asked = view.accepted
        if everywhere or asked is None:
            asked = foreground_segments(view.segments, view.is_static)
        foreign = asked & self._ownership.edges[person]
        if foreign.any():
            out = with_segments(view, asked & ~foreign)
        elif everywhere:
            out = with_all_segments(view)
        if view.silhouette is None or self._silhouette is None:
            return out
        own = ~self._ownership.silhouette[person]
        points, normals = view.silhouette.points_px[own], view.silhouette.normals[own]
        return replace(out, silhouette=replace(view.silhouette, points_px=points, normals=normals))

    @cached_property
    def _ownership(self) -> "_Ownership":
        view, n_people = self._view, int(self._surfaces.people[-1]) + 1
        edges, silhouette = self._edges or _no_samples(), self._silhouette or _no_samples()
        out = _Ownership(
            np.empty((n_people, len(edges.counts)), np.bool_), np.empty((n_people, len(silhouette.counts)), np.bool_),
            np.zeros(n_people, np.bool_),
        )  # fmt: skip
        room = occluding_contours.contour_room([view.camera], n_people)
        _assign(
            view.camera.projection, view.camera.center_world, self._Ts, self._surfaces,
            piece_buffer(self._surfaces, room), contour_buffer(room), edges, silhouette, view.theta_px, out,
        )  # fmt: skip
        return out


class _Ownership(NamedTuple):
    """Evidence of one view that is foreign to each person: it runs along others' contours and not along their own."""

    edges: NDArray[np.bool_]
    """Whether each segment is foreign, (K, S)."""
    silhouette: NDArray[np.bool_]
    """Whether each point of the silhouette is foreign, (K, N)."""
    near: NDArray[np.bool_]
    """Whether the box around the person's contour comes within reach of another person's, (K,)."""


def _samples_of(view: ViewEvidence) -> tuple[Samples | None, Samples | None]:
    """See `EvidencePool.samples`."""
    silhouette, edges = view.silhouette, view.samples
    if silhouette is None or not len(silhouette.points_px):
        return edges, None
    points = silhouette.points_px
    return edges, sample_segments(EdgeSegments(points, silhouette.normals, np.arange(len(points) + 1)))


@lru_cache(maxsize=1)  # not made by the import, which would load a kernel
def _no_samples() -> Samples:
    """Return samples of no segments."""
    return sample_segments(
        EdgeSegments(np.empty((0, 2), np.float32), np.empty((0, 2), np.float32), np.zeros(1, np.int64))
    )


# One call for each view: each call would release the interpreter lock and wait for it again.
@njit(nogil=True, cache=True)
def _assign(
    P: Array, eye: Array, Ts: Array, surfaces: Surfaces, pieces: Pieces, contour: Contour, edges: Samples,
    silhouette: Samples, theta_px: float, out: _Ownership,
) -> None:  # fmt: skip
    """Compute the ownership of the evidence of one view.

    Args:
        P: of the view; see `trace_pieces`.
        eye: of the view.
        Ts: poses of the parts of all people, (P, 4, 4), metres.
        surfaces: of all people.
        pieces: buffer for tracing.
        contour: buffer for the contours.
        edges: samples of the edges.
        silhouette: points of the silhouette, each a segment of its own.
        theta_px: outlier distance, px.
        out: is filled.
    """
    reach, n_people = CAPTURE * theta_px, out.near.shape[0]
    place_parts(Ts, surfaces, pieces)
    n = trace_pieces(P, eye, surfaces, PIECE_PX, pieces)
    store_contour(pieces, contour)
    own, boxes = np.empty((n, 4), np.float32), np.empty((n_people, 4))
    # Distances of the samples from each person's visible contours, px, cut off at the reach.
    to_edges = np.empty((n_people, edges.pixels.points.shape[1]), np.float32)
    to_silhouette = np.empty((n_people, silhouette.pixels.points.shape[1]), np.float32)
    for person in range(n_people):
        m = _take_own_pieces(person, n, contour, surfaces.people, own, boxes[person])
        nearest_parallel_segment(
            edges.pixels.points, edges.pixels.rows, own[:m], reach, MAX_ANGLE_RAD, to_edges[person]
        )
        nearest_parallel_segment(
            silhouette.pixels.points, silhouette.pixels.rows, own[:m], reach, MAX_ANGLE_RAD, to_silhouette[person]
        )
    for a in range(n_people):
        for b in range(n_people):
            if a != b and _are_near(boxes[a], boxes[b], reach):
                out.near[a] = True
    for person in range(n_people):
        _mark_foreign(edges, to_edges, person, theta_px, out.edges[person])
        _mark_foreign(silhouette, to_silhouette, person, theta_px, out.silhouette[person])


@njit(nogil=True, cache=True)
def _take_own_pieces(
    person: int, n: int, contour: Contour, people: NDArray[np.int64], own: FloatArray, box: Array
) -> int:
    """Copy a person's visible pieces among n, (n or more, 4), fill their box, (4,), and return their number."""
    box[:2], box[2:] = np.inf, -np.inf
    m = 0
    for i in range(n):
        if contour.occluded[i] or people[contour.parts[i]] != person:
            continue
        for k in range(4):
            own[m, k] = contour.pieces_px[i, k]
            box[k % 2], box[2 + k % 2] = min(box[k % 2], own[m, k]), max(box[2 + k % 2], own[m, k])
        m += 1
    return m


@njit(nogil=True, cache=True)
def _are_near(a: Array, b: Array, reach: float) -> bool:
    """Return whether two boxes u0, v0, u1, v1, (4,), come within reach of each other; an empty box does not."""
    return bool(a[0] - reach < b[2] and b[0] - reach < a[2] and a[1] - reach < b[3] and b[1] - reach < a[3])


@njit(nogil=True, cache=True, error_model="numpy")
def _mark_foreign(
    samples: Samples, distances: FloatArray, person: int, theta_px: float, foreign: NDArray[np.bool_]
) -> None:
    """Mark the segments, (S,), whose samples lie along others' contours and clearly not along a person's own.

    Args:
        samples: of the segments.
        distances: of the samples to each person's contours, (K, n or more), px.
        person: index of the person.
        theta_px: outlier distance, px.
        foreign: is filled.
    """
    to_own, to_others = np.zeros(foreign.shape[0]), np.zeros(foreign.shape[0])
    for i in range(samples.pixels.rows[-1, -1]):
        nearest = np.float32(np.inf)
        for other in range(distances.shape[0]):
            if other != person:
                nearest = min(nearest, distances[other, i])
        segment = int(samples.pixels.points[4, i])
        to_own[segment] += distances[person, i]
        to_others[segment] += nearest
    for s in range(foreign.shape[0]):
        own, others = to_own[s] / samples.counts[s], to_others[s] / samples.counts[s]
        foreign[s] = others <= ACCEPTED_SHARE * theta_px and others < _OWNERSHIP_RATIO * own
