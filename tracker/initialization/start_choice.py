"""Compare the starts of a person on a frame: fit all, search around some, and track from the best."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from tracker.body.model import PosedBody
from tracker.geometry.arrays import Array
from tracker.initialization.generators.start_generators import StartCandidate
from tracker.initialization.start_fit import FittedStart, StartFitter, track_back

_N_TRACKED = 4
"""Starts of a frame that are tracked."""
_SAME_M = 0.03
"""Mean distance of the joints up to which two fits are the same, metres."""
_CUES_PX = 0.05
"""Reduction of the cost of a track for each cue for its direction, px."""
_TRACKED_RATIO = 1.25
"""Ratio of the costs on the frame of the start above which a start is not tracked."""
_OPPOSITE = 0.0
"""Largest cosine of the angle between two directions that count as opposite."""

Start: TypeAlias = tuple[StartCandidate, FittedStart]


class ComparedStarts(NamedTuple):
    """The starts of a person, compared."""

    searched: list[Start]
    """The starts that were searched, with their costs on the frame."""
    tracked: list[Start]
    """The starts that were tracked and fill the silhouettes, the cheapest first."""
    is_lost: bool
    """Whether the person is lost on a short track from the cheapest."""


def compare_starts(
    fitter: StartFitter, candidates: Sequence[StartCandidate], filling: Callable[[Sequence[Start]], list[Start]]
) -> ComparedStarts:
    """Fit, search and track starts. A different pose after tracking there and back is another start."""

    def tracked(candidate: StartCandidate, fit: FittedStart) -> Start:
        return candidate, fitter.track(PosedBody(candidate.model, fit.pose), fit)

    tried = [(c, fitter.fit(PosedBody(c.model, c.pose))) for c in candidates]
    searched = [(c, fitter.search(PosedBody(c.model, f.pose))) for c, f in _kept(_distinct(tried))]
    runs = [tracked(*start) for start in _worth_a_track(_distinct(searched))]
    best, fit = filling(sorted(runs, key=weighed_px))[0]
    returned = track_back(PosedBody(best.model, fit.pose), fit)
    runs += [tracked(best, fitter.search(PosedBody(best.model, pose))) for pose in returned.poses]
    found = filling(sorted(runs, key=weighed_px))
    is_lost = returned.is_lost if found[0][1] is fit else found[0][1].is_lost
    return ComparedStarts(searched, found, is_lost)


def _worth_a_track(searched: Sequence[Start]) -> list[Start]:
    """Return the starts that short tracks may make the best ones."""
    most = _TRACKED_RATIO * min(map(weighed_px, searched))
    return [s for s in searched if weighed_px(s) <= most]


def _distinct(fits: Sequence[Start]) -> list[Start]:
    """Return the fits without those that end where the fit of an earlier start does: methods give the best first."""
    kept, others = list[Start](), list[Array]()
    for candidate, fit in fits:
        points = candidate.model.points_world(fit.pose)
        if all(np.linalg.norm(points - o, axis=1).mean() > _SAME_M for o in others):
            kept.append((candidate, fit))
            others.append(points)
    return kept


def face_opposite(start: StartCandidate, other: StartCandidate) -> bool:
    """Return whether two starts face opposite ways."""
    return bool(start.forward @ other.forward < _OPPOSITE)


def weighed_px(start: Start) -> float:
    """Return the cost of a start, px, less what the cues say for its direction."""
    return start[1].cost_px - _CUES_PX * start[0].cues


def _kept(tried: Sequence[Start]) -> list[Start]:
    """Return the starts to track: the cheapest ones, and the cheapest that faces the other way than the first."""
    order = sorted(tried, key=weighed_px)
    kept, rest = order[:_N_TRACKED], order[_N_TRACKED:]
    if not any(face_opposite(c, kept[0][0]) for c, _ in kept):
        kept += [t for t in rest if face_opposite(t[0], kept[0][0])][:1]
    return kept
