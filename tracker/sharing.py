"""Evidence shared fairly among several people: what one body explains does not pull at another.

An edge that runs along the contour of one body and not along that of another belongs to the first. A segment of edges
is given away as a whole, as the prediction accepts it as a whole (`segments`), a point of the silhouette's contour by
itself. What several bodies explain, and what none does, stays with all of them: it is up to the residuals, where each
point draws the nearest piece of contour, whosever it is.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tracker import contours
from tracker.body import Body
from tracker.contours import FloatArray
from tracker.evidence import ACCEPTED_SHARE, Silhouette, ViewEvidence, with_segments
from tracker.kernels import helpers
from tracker.rigid import Array
from tracker.segments import Segments, distances

_CLEARLY = 0.5
"""What is another's is nearer to that body than this share of its distance from one's own."""
_REACH = 2.0
"""Up to where distances are told apart, in outlier distances."""


def own_views(
    views: Sequence[ViewEvidence], bodies: Sequence[Body], person: int, everywhere: bool = False
) -> tuple[ViewEvidence, ...]:
    """The evidence of each view without the edges and the silhouette's points that clearly are somebody else's.

    Args:
        views: the evidence, the same for all people; views whose edges have no direction stay as they are.
        bodies: everybody, where they stand as far as is known.
        person: whose evidence is wanted.
        everywhere: whether poses far from the present one will be asked; else views in which nobody else is near stay
            as they are, because nothing there is in reach.
    """
    if len(bodies) == 1:
        return tuple(views)
    people = contours.surfaces_of(tuple(b.model for b in bodies)).people

    def of_view(view: ViewEvidence) -> ViewEvidence:
        return _own_view(view, contours.trace(bodies, view.camera), people, person, everywhere)

    return tuple(helpers().map(of_view, views))


def _own_view(
    view: ViewEvidence, contour: contours.Contour, people: NDArray[np.int64], person: int, everywhere: bool
) -> ViewEvidence:
    owners, shown = people[contour.parts], ~contour.hidden
    mine, others = (contour.pieces_px[shown & of] for of in (owners == person, owners != person))
    if view.segments is None or not (everywhere or _meet(mine, others, _REACH * view.theta_px)):
        return view
    known = np.ones(len(view.segments.firsts) - 1, np.bool_) if view.accepted is None else view.accepted
    theirs = _theirs(view.segments, known, mine, others, view.theta_px)
    if theirs.any():
        view = with_segments(view, known & ~theirs)
    if view.silhouette is not None and len(view.silhouette.points_px):
        view = replace(view, silhouette=_own_silhouette(view.silhouette, mine, others, view.theta_px))
    return view


def _meet(mine: FloatArray, others: FloatArray, reach_px: float) -> bool:
    """Whether boxes around pieces, (M, 4) each, come as near to each other."""
    if not (len(mine) and len(others)):
        return False
    boxes = [(p.reshape(-1, 2).min(axis=0), p.reshape(-1, 2).max(axis=0)) for p in (mine, others)]
    (low, high), (other_low, other_high) = boxes
    return bool(np.all(low - reach_px < other_high) and np.all(other_low - reach_px < high))


def _own_silhouette(silhouette: Silhouette, mine: FloatArray, others: FloatArray, theta_px: float) -> Silhouette:
    points, normals = silhouette.points_px, silhouette.normals
    each = Segments(points, normals, np.arange(len(points) + 1))
    kept = ~_theirs(each, np.ones(len(points), np.bool_), mine, others, theta_px)
    return replace(silhouette, points_px=points[kept], normals=normals[kept])


def _theirs(
    segments: Segments, asked: NDArray[np.bool_], mine: FloatArray, others: FloatArray, theta_px: float
) -> NDArray[np.bool_]:
    """Which of the segments that are asked, (S,), run along the others' pieces, (M, 4), and clearly not along one's
    own."""
    reach = _REACH * theta_px
    to_others: Array = distances(segments, others, reach, asked)
    near = asked & (to_others <= ACCEPTED_SHARE * theta_px)
    return near & (to_others < _CLEARLY * distances(segments, mine, reach, near))
