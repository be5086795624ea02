"""Compare hypotheses of a start on a frame: fit all, search around some, and track the best."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from tracker.body.limbs import limb_display_name, limbs
from tracker.estimation.fitting.hypothesis import BEAM_NATS, CLEAR_NATS, Hypothesis, distinct, limbs_elsewhere
from tracker.estimation.initialization.start_fit import StartFitter, StartTrack, track_back

_N_SEARCHED = 4
"""Starts of a frame that are searched around."""


class ComparedStarts(NamedTuple):
    """The starts of a person, compared."""

    searched: list[Hypothesis]
    """The starts that were searched, with their costs on the frame, the best first."""
    tracked: list[StartTrack]
    """The starts that were tracked and fill the silhouettes, with their costs on all frames, the best first."""
    is_lost: bool
    """Whether the person is lost on a short track from the best."""

    @property
    def is_facing_sure(self) -> bool:
        """Whether the contours tell left from right."""
        best = self.tracked[0].start
        tracked, searched = (
            [s.cost for s in own if s.faces_away_from(best)] for own in ([t.start for t in self.tracked], self.searched)
        )
        gaps = [c - best.cost for c in tracked] or [c - self.searched[0].cost for c in searched]
        return bool(gaps) and min(gaps) > CLEAR_NATS

    @property
    def rivals_note(self) -> str:
        """A sentence on the limbs that are elsewhere in starts about as good as the best; empty if none is."""
        best, *others = (t.start for t in self.tracked)
        close = [o for o in others if o.cost < best.cost + CLEAR_NATS]
        found = {limb for o in close for limb in limbs_elsewhere(best.body, o.body)}
        names = [limb_display_name(limb.name) for limb in limbs(best.model) if limb.name in found]
        return f"another start is about as good, with {', '.join(names)} elsewhere" if names else ""


def compare_starts(
    fitter: StartFitter, proposals: Sequence[Hypothesis], filling: Callable[[Sequence[StartTrack]], list[StartTrack]]
) -> ComparedStarts:
    """Fit, search and track starts. A different pose after tracking there and back is another start."""
    tried = distinct(fitter.scored([fitter.fit(p) for p in proposals]))
    kept, rest = tried[:_N_SEARCHED], tried[_N_SEARCHED:]
    if not any(h.faces_away_from(kept[0]) for h in kept):
        kept += [h for h in rest if h.faces_away_from(kept[0])][:1]
    searched = distinct(fitter.scored([fitter.search(h) for h in kept]))
    runs = [fitter.track(h) for h in searched if h.cost < searched[0].cost + BEAM_NATS]
    best, *_ = tracked = filling(fitter.compared(runs))
    returned, is_lost = track_back(best)
    if returned:
        runs += [fitter.track(fitter.search(h)) for h in returned]
        tracked = filling(fitter.compared(runs))
    return ComparedStarts(searched, tracked, is_lost if tracked[0].poses is best.poses else tracked[0].is_lost)
