"""Evidence shared fairly among several people: what one body explains does not pull at another.

An edge that runs along the contour of one body and not along that of another belongs to the first. A segment of edges
is given away as a whole, as the prediction accepts it as a whole (`segments`), a point of the silhouette's contour by
itself. What several bodies explain, and what none does, stays with all of them: it is up to the residuals, where each
point draws the nearest piece of contour, whosever it is.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.body.model import PosedBody
from tracker.contours import occluding_contours
from tracker.contours.occluding_contours import PIECE_PX, Contour, trace_view
from tracker.contours.surfaces import Surfaces
from tracker.evidence.view_evidence import (
    ACCEPTED_SHARE,
    ViewEvidence,
    foreground_segments,
    with_all_segments,
    with_segments,
)
from tracker.geometry.arrays import Array, FloatArray
from tracker.images.edge_segments import MAX_ANGLE_RAD, Samples, Segments, nearest_parallel_segment, sample_segments

_OWNERSHIP_RATIO = 0.5
"""What is another's is nearer to that body than this share of its distance from one's own."""
_REACH = 2.0
"""Up to where distances are told apart, in outlier distances."""


class EvidencePool:
    """The evidence of one frame, to be shared out for whatever poses."""

    def __init__(self, views: Sequence[ViewEvidence]) -> None:
        """Take the evidence, the same for all people; views whose edges have no direction stay as they are."""
        self.views = tuple(views)
        """As they were observed."""

    @cached_property
    def all_edges(self) -> tuple[ViewEvidence, ...]:
        """The same with the edges that the predictions refused."""
        return tuple(map(with_all_segments, self.views))

    @cached_property
    def samples(self) -> tuple[tuple[Samples | None, Samples | None], ...]:
        """What of each view is asked whose it is: its edges, and the points of its silhouette, each by itself; None of
        what there is not."""
        return tuple(_samples_of(v) for v in self.views)


class EvidenceAssignment:
    """The evidence of one frame as it is shared out for some poses: distances are measured once for all people."""

    def __init__(self, sharing: EvidencePool, bodies: Sequence[PosedBody]) -> None:
        """Take the evidence, and everybody where they stand as far as is known."""
        self.bodies = tuple(bodies)
        """All people in the poses for which the evidence is assigned."""
        self._sharing = sharing
        self._own: dict[tuple[int, bool], tuple[ViewEvidence, ...]] = {}

    def own(self, person: int, everywhere: bool = False) -> tuple[ViewEvidence, ...]:
        """The evidence of each view without the edges and the silhouette's points that clearly are somebody else's.

        Not to be asked by several threads at a time.

        Args:
            person: whose evidence is wanted.
            everywhere: whether poses far from the present one will be asked, among all edges, those that the prediction
                refused too; else views in which nobody else is near stay as they are, because nothing there is in
                reach.
        """
        if len(self.bodies) == 1:
            return self._sharing.all_edges if everywhere else self._sharing.views
        if (person, everywhere) not in self._own:
            self._own[person, everywhere] = tuple(v.own(person, everywhere) for v in self._views)
        return self._own[person, everywhere]

    @cached_property
    def _views(self) -> list["_View"]:
        surfaces, Ts = (
            occluding_contours.surfaces_of(tuple(b.model for b in self.bodies)),
            occluding_contours.part_poses(self.bodies),
        )
        sharing = self._sharing
        return [_View(v, *s, surfaces, Ts) for v, s in zip(sharing.views, sharing.samples, strict=True)]


class _View:
    """What one view shows of several people in some poses."""

    def __init__(
        self, view: ViewEvidence, edges: Samples | None, outline: Samples | None, surfaces: Surfaces, Ts: Array
    ) -> None:
        self._view, self._edges, self._outline, self._surfaces, self._Ts = view, edges, outline, surfaces, Ts

    def own(self, person: int, everywhere: bool) -> ViewEvidence:
        """See `EvidenceAssignment.own`."""
        view, seen = self._view, self._view
        if view.segments is None or self._edges is None or not (everywhere or self._theirs.near[person]):
            return with_all_segments(view) if everywhere else view
        asked = view.accepted
        if everywhere or asked is None:
            asked = foreground_segments(view.segments, view.is_static)
        theirs = asked & self._theirs.edges[person]
        if theirs.any():
            seen = with_segments(view, asked & ~theirs)
        elif everywhere:
            seen = with_all_segments(view)
        if view.silhouette is None or self._outline is None:
            return seen
        mine = ~self._theirs.outline[person]
        points, normals = view.silhouette.points_px[mine], view.silhouette.normals[mine]
        return replace(seen, silhouette=replace(view.silhouette, points_px=points, normals=normals))

    @cached_property
    def _theirs(self) -> "_Ownership":
        view, n_people = self._view, int(self._surfaces.people[-1]) + 1
        edges, outline = self._edges or _nothing(), self._outline or _nothing()
        out = _Ownership(
            np.empty((n_people, len(edges.counts)), np.bool_), np.empty((n_people, len(outline.counts)), np.bool_),
            np.zeros(n_people, np.bool_),
        )  # fmt: skip
        _assign(
            occluding_contours.projection(view.camera), view.camera.center_world, self._Ts, self._surfaces,
            occluding_contours.contour_buffer(view.camera, n_people), edges, outline, view.theta_px, out,
        )  # fmt: skip
        return out


class _Ownership(NamedTuple):
    """Of each person what runs along the contours of the others and clearly not along their own, in one view."""

    edges: NDArray[np.bool_]
    """Which segments do, (K, S)."""
    outline: NDArray[np.bool_]
    """Which points of the silhouette do, (K, N)."""
    near: NDArray[np.bool_]
    """Whether boxes around the contours of the person and of anybody else come within reach of each other, (K,)."""


def _samples_of(view: ViewEvidence) -> tuple[Samples | None, Samples | None]:
    """See `EvidencePool.samples`."""
    silhouette, edges = view.silhouette, view.samples
    if silhouette is None or not len(silhouette.points_px):
        return edges, None
    points = silhouette.points_px
    return edges, sample_segments(Segments(points, silhouette.normals, np.arange(len(points) + 1)))


@lru_cache(maxsize=1)  # not made by the import, which would load a kernel
def _nothing() -> Samples:
    """Samples of no segments."""
    return sample_segments(Segments(np.empty((0, 2), np.float32), np.empty((0, 2), np.float32), np.zeros(1, np.int64)))


# One call for all that is asked of a view: of a dozen calls each hands the interpreter's lock over and waits for it.
@njit(nogil=True, cache=True)
def _assign(
    P: Array, eye: Array, Ts: Array, surfaces: Surfaces, contour: Contour, edges: Samples, outline: Samples,
    theta_px: float, out: _Ownership,
) -> None:  # fmt: skip
    """Tell in one view what is whose.

    Args:
        P: the view, as the following three see `contours.trace_view`.
        eye: of the view.
        Ts: of everybody.
        surfaces: of everybody.
        contour: room for the contours.
        edges: samples of the edges.
        outline: points of the silhouette, each its own segment.
        theta_px: outlier distance, px.
        out: what is filled.
    """
    reach, n_people = _REACH * theta_px, out.near.shape[0]
    n = trace_view(P, eye, Ts, surfaces, PIECE_PX, contour)
    own, boxes = np.empty((n, 4), np.float32), np.empty((n_people, 4))
    # Distances of the samples from each person's visible contours, px, cut off at the reach.
    to_edges = np.empty((n_people, edges.pixels.points.shape[1]), np.float32)
    to_outline = np.empty((n_people, outline.pixels.points.shape[1]), np.float32)
    for person in range(n_people):
        m = _take_own(person, n, contour, surfaces.people, own, boxes[person])
        nearest_parallel_segment(
            edges.pixels.points, edges.pixels.rows, own[:m], reach, MAX_ANGLE_RAD, to_edges[person]
        )
        nearest_parallel_segment(
            outline.pixels.points, outline.pixels.rows, own[:m], reach, MAX_ANGLE_RAD, to_outline[person]
        )
    for a in range(n_people):
        for b in range(n_people):
            if a != b and _meet(boxes[a], boxes[b], reach):
                out.near[a] = True
    for person in range(n_people):
        _mark_theirs(edges, to_edges, person, theta_px, out.edges[person])
        _mark_theirs(outline, to_outline, person, theta_px, out.outline[person])


@njit(nogil=True, cache=True)
def _take_own(person: int, n: int, contour: Contour, people: NDArray[np.int64], own: FloatArray, box: Array) -> int:
    """Take the visible ones of n pieces that are a person's, (n or more, 4), and bound them, (4,); their number."""
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
def _meet(a: Array, b: Array, reach: float) -> bool:
    """Whether two boxes u0, v0, u1, v1, (4,), come within reach; one that holds nothing meets none."""
    return bool(a[0] - reach < b[2] and b[0] - reach < a[2] and a[1] - reach < b[3] and b[1] - reach < a[3])


@njit(nogil=True, cache=True, error_model="numpy")
def _mark_theirs(
    samples: Samples, distances: FloatArray, person: int, theta_px: float, theirs: NDArray[np.bool_]
) -> None:
    """Mark the segments, (S,), whose samples lie along the others' contours and clearly not along a person's own.

    Args:
        samples: of the segments.
        distances: of the samples from each person's contours, (K, n or more), px.
        person: whose.
        theta_px: outlier distance, px.
        theirs: what is marked.
    """
    to_own, to_others = np.zeros(theirs.shape[0]), np.zeros(theirs.shape[0])
    for i in range(samples.pixels.rows[-1, -1]):
        nearest = np.float32(np.inf)
        for other in range(distances.shape[0]):
            if other != person:
                nearest = min(nearest, distances[other, i])
        segment = int(samples.pixels.points[4, i])
        to_own[segment] += distances[person, i]
        to_others[segment] += nearest
    for s in range(theirs.shape[0]):
        own, others = to_own[s] / samples.counts[s], to_others[s] / samples.counts[s]
        theirs[s] = others <= ACCEPTED_SHARE * theta_px and others < _OWNERSHIP_RATIO * own
