"""Evidence shared fairly among several people: what one body explains does not pull at another.

An edge that runs along the contour of one body and not along that of another belongs to the first. A segment of edges
is given away as a whole, as the prediction accepts it as a whole (`segments`), a point of the silhouette's contour by
itself. What several bodies explain, and what none does, stays with all of them: it is up to the residuals, where each
point draws the nearest piece of contour, whosever it is.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, reduce

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker import contours
from tracker.body import Body
from tracker.evidence import ACCEPTED_SHARE, ViewEvidence, findable, unfiltered, with_segments
from tracker.rigid import Array, FloatArray
from tracker.segments import Samples, Segments, sampled

_CLEARLY = 0.5
"""What is another's is nearer to that body than this share of its distance from one's own."""
_REACH = 2.0
"""Up to where distances are told apart, in outlier distances."""


class Sharing:
    """The evidence of one frame, to be shared out for whatever poses."""

    def __init__(self, views: Sequence[ViewEvidence]) -> None:
        """Take the evidence, the same for all people; views whose edges have no direction stay as they are."""
        self.views = tuple(views)
        """As they were observed."""

    @cached_property
    def everything(self) -> tuple[ViewEvidence, ...]:
        """The same with the edges that the predictions refused."""
        return tuple(map(unfiltered, self.views))

    @cached_property
    def samples(self) -> tuple[tuple[Samples | None, Samples | None], ...]:
        """What of each view is asked whose it is: its edges, and the points of its silhouette, each by itself; None of
        what there is not."""
        return tuple(_sampled(v) for v in self.views)


class Shares:
    """The evidence of one frame as it is shared out for some poses: distances are measured once for all people."""

    def __init__(self, sharing: Sharing, bodies: Sequence[Body]) -> None:
        """Take the evidence, and everybody where they stand as far as is known."""
        self.poses = tuple(b.values for b in bodies)
        """Where they stand, (n_values,) each."""
        self._sharing = sharing
        self._own: dict[tuple[int, bool], tuple[ViewEvidence, ...]] = {}
        self._bodies = list(bodies)

    def own(self, person: int, everywhere: bool = False) -> tuple[ViewEvidence, ...]:
        """The evidence of each view without the edges and the silhouette's points that clearly are somebody else's.

        Not to be asked by several threads at a time.

        Args:
            person: whose evidence is wanted.
            everywhere: whether poses far from the present one will be asked, among all edges, those that the prediction
                refused too; else views in which nobody else is near stay as they are, because nothing there is in
                reach.
        """
        if len(self._bodies) == 1:
            return self._sharing.everything if everywhere else self._sharing.views
        # Not in threads: a view takes a dozen kernels of some hundredths of a millisecond, and to get the interpreter's
        # lock back after each takes as long.
        if (person, everywhere) not in self._own:
            self._own[person, everywhere] = tuple(v.own(person, everywhere) for v in self._views)
        return self._own[person, everywhere]

    @cached_property
    def _views(self) -> list["_View"]:
        return [_View(v, *s, self._bodies) for v, s in zip(self._sharing.views, self._sharing.samples, strict=True)]


class _View:
    """What one view shows of several people in some poses. Distances are in px, cut off at the reach."""

    def __init__(
        self, view: ViewEvidence, edges: Samples | None, outline: Samples | None, bodies: Sequence[Body]
    ) -> None:
        self._view, self._edges, self._outline, self._bodies = view, edges, outline, bodies
        self._reach_px = _REACH * view.theta_px

    def own(self, person: int, everywhere: bool) -> ViewEvidence:
        """See `Shares.own`."""
        view, seen = self._view, self._view
        if view.segments is None or self._edges is None or not (everywhere or self._meets(person)):
            return unfiltered(view) if everywhere else view
        asked = view.accepted
        if everywhere or asked is None:
            asked = findable(view.segments, view.still)
        theirs = asked & _theirs(self._edges, self._to_edges, person, view.theta_px)
        if theirs.any():
            seen = with_segments(view, asked & ~theirs)
        elif everywhere:
            seen = unfiltered(view)
        if view.silhouette is None or self._outline is None:
            return seen
        mine = ~_theirs(self._outline, self._to_outline, person, view.theta_px)
        points, normals = view.silhouette.points_px[mine], view.silhouette.normals[mine]
        return replace(seen, silhouette=replace(view.silhouette, points_px=points, normals=normals))

    def _meets(self, person: int) -> bool:
        """Whether boxes around the contours of a person and of anybody else come within reach of each other."""
        low, high = self._boxes
        near = np.all((low[person] - self._reach_px < high) & (low - self._reach_px < high[person]), axis=1)
        near[person] = False
        return bool(near.any())

    @cached_property
    def _boxes(self) -> tuple[Array, Array]:
        """Bounds of each person's visible contours, (K, 2) each; of who shows none nothing lies between them."""
        low, high = np.full((len(self._bodies), 2), np.inf), np.full((len(self._bodies), 2), -np.inf)
        for pieces, a, b in zip(self._pieces, low, high, strict=True):
            _bound(pieces, a, b)
        return low, high

    @cached_property
    def _pieces(self) -> list[FloatArray]:
        """Visible pieces of each person's contour, x0, y0, x1, y1, (M, 4) each, px."""
        contour = contours.trace(self._bodies, self._view.camera)
        people = contours.surfaces_of(tuple(b.model for b in self._bodies)).people
        owners = np.where(contour.hidden, -1, people[contour.parts])
        return [contour.pieces_px[owners == person] for person in range(len(self._bodies))]

    @cached_property
    def _to_edges(self) -> list[FloatArray]:
        """How far the samples of the edges are from each person, (n,) each."""
        return [] if self._edges is None else [self._edges.distances(p, self._reach_px) for p in self._pieces]

    @cached_property
    def _to_outline(self) -> list[FloatArray]:
        """The same of the silhouette."""
        return [] if self._outline is None else [self._outline.distances(p, self._reach_px) for p in self._pieces]


def _sampled(view: ViewEvidence) -> tuple[Samples | None, Samples | None]:
    """See `Sharing.samples`."""
    silhouette, edges = view.silhouette, view.samples
    if silhouette is None or not len(silhouette.points_px):
        return edges, None
    points = silhouette.points_px
    return edges, sampled(Segments(points, silhouette.normals, np.arange(len(points) + 1)))


def _theirs(samples: Samples, distances: Sequence[FloatArray], person: int, theta_px: float) -> NDArray[np.bool_]:
    """Which segments, (S,), run along the others' contours and clearly not along one's own.

    Args:
        samples: of the segments.
        distances: of the samples from each person's contours, (n,) each, px.
        person: one's own index.
        theta_px: outlier distance, px.
    """
    others = reduce(np.minimum, [d for i, d in enumerate(distances) if i != person])
    to_others, to_own = samples.means(others), samples.means(distances[person])
    return np.asarray((to_others <= ACCEPTED_SHARE * theta_px) & (to_others < _CLEARLY * to_own))


@njit(nogil=True, cache=True)
def _bound(pieces: FloatArray, low: Array, high: Array) -> None:
    """Widen bounds, (2,) each, to those of pieces, (M, 4)."""
    for i in range(pieces.shape[0]):
        for k in range(4):
            low[k % 2], high[k % 2] = min(low[k % 2], pieces[i, k]), max(high[k % 2], pieces[i, k])
