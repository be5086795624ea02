"""Repair the pose of a person on one frame: refine it without the prediction, and search every limb.

A tracker searches the limbs that seem lost. Most wrong limbs do not: they lie on edges, and the search would have found
the right place. Therefore all are searched, and poses are compared by contours and region evidence together.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.appearance.part_colors import PartColors
from tracker.appearance.region_limb_scorer import RegionLimbScorer
from tracker.appearance.region_model import RegionFrame, RegionModel
from tracker.body.limbs import Limb, limbs, movable
from tracker.body.model import BodyModel, PosedBody
from tracker.body.searches import Search
from tracker.evidence.view_evidence import ViewEvidence
from tracker.fitting.hypothesis import CLEAR_NATS, Hypothesis
from tracker.geometry.arrays import Array
from tracker.tracking.estimation.frame_problem import Bodies, with_body
from tracker.tracking.estimation.limb_recovery import search_entry, search_limbs
from tracker.tracking.estimation.pose_score import PoseScorer, scorer_without_prediction
from tracker.tracking.estimation.settings import EstimationSettings

MIN_GAIN_NATS = 2 * CLEAR_NATS
"""Smallest gain for which a tracked pose is replaced, nats: the other is then 400 times more likely."""


class FrameEvidence(NamedTuple):
    """The evidence of a frame on which poses are compared."""

    views: Sequence[ViewEvidence]
    """Evidence around all people, with all edges that may be theirs; see `common_evidence`."""
    known: RegionModel
    """Appearance of the people and places of the run."""
    regions: RegionFrame
    """Region evidence of the frame."""
    part_colors: PartColors | None = None
    """Colours of the person's parts, which rank proposals; None where they are unknown."""
    active_dofs: NDArray[np.bool_] | None = None
    """Degrees of freedom of the person that may move, (n_dofs,); None: all."""


class Repair(NamedTuple):
    """The best pose of a person on a frame."""

    pose: Array
    """Pose, (n_values,): the tracked one unless a limb is better elsewhere by `MIN_GAIN_NATS`."""
    cost: float
    """Its cost, nats; that of the refined one where it stays as tracked."""
    gain: float
    """How much less the best pose costs than the refined one with all limbs where they were tracked, nats, at least
    0."""
    alternatives: tuple[Hypothesis, ...]
    """Poses about as good as the best, with a limb elsewhere, cheapest first."""
    entry: Search
    """Of the search."""
    refined: Array
    """The refined pose with all limbs where they were tracked, (n_values,)."""

    @property
    def is_better(self) -> bool:
        """Whether a limb is better elsewhere."""
        return self.gain > MIN_GAIN_NATS


@dataclass(frozen=True, eq=False)
class RegionScorer(PoseScorer):
    """Scores poses by contours, priors and region evidence. Colours of parts only rank proposals."""

    evidence: FrameEvidence
    bodies: Bodies
    """All people; the scored person may be in any pose."""
    person: int
    """Index of the scored person."""
    limb: Limb | None = None
    """The limb in which poses differ; None if they may differ everywhere."""
    limb_scorers: dict[bytes, RegionLimbScorer] = field(default_factory=dict)
    """Scorer of the limb by the rest of the pose."""

    def restricted_to(self, limb: Limb) -> "RegionScorer":
        """See `PoseScorer.restricted_to`."""
        return with_regions(super().restricted_to(limb), self.evidence, self.bodies, self.person, limb)

    def _color_costs(self, poses: Array) -> Array:
        if self.limb is None:
            known, regions = self.evidence.known, self.evidence.regions
            return -np.array([known.nats(regions, self._bodies(pose)) for pose in poses])
        moves = np.isin(np.arange(poses.shape[1]), self.bodies[self.person].model.dof_value[self.limb.dofs])
        rests, nats = [pose[~moves].tobytes() for pose in poses], np.zeros(len(poses))
        for rest in set(rests):
            own = np.array([r == rest for r in rests])
            nats[own] = self._limb_nats(rest, poses[own])
        return -nats

    def _limb_nats(self, rest: bytes, poses: Array) -> Array:
        """Return the evidence for poses, (n, n_values), of one rest, (n,), nats."""
        assert self.limb is not None
        scorer = self.limb_scorers.get(rest)
        if scorer is None:
            known, regions = self.evidence.known, self.evidence.regions
            scorer = RegionLimbScorer(known, regions, self._bodies(poses[0]), self.person, self.limb.parts)
            self.limb_scorers[rest] = scorer
        return scorer(poses) + scorer.static_nats

    def _bodies(self, pose: Array) -> Bodies:
        return with_body(self.bodies, self.person, PosedBody(self.bodies[self.person].model, pose))


def limbs_to_search(model: BodyModel, elsewhere: Array) -> list[Limb]:
    """Return the limbs of several parts that are clearly likelier elsewhere, (n_limbs,), nats, the likeliest first; see
    `region_deficit.elsewhere_nats`."""
    of_body = limbs(model)
    return [of_body[i] for i in np.argsort(-elsewhere) if elsewhere[i] > CLEAR_NATS and len(of_body[i].parts) > 1]


def better_limbs(
    evidence: FrameEvidence, bodies: Bodies, person: int, settings: EstimationSettings, searched: Sequence[Limb],
    others: Sequence[Array] = (), tried: Sequence[Limb] = (),
) -> Repair:  # fmt: skip
    """Refine the pose of a person without the prediction, and search limbs.

    Args:
        evidence: of the frame.
        bodies: all people as tracked; the others stay.
        person: index of the person.
        settings: of the tracker.
        searched: the limbs to search, likeliest lost first; see `limbs_to_search`.
        others: poses whose limbs are tried as they are, such as those of the frames around, (n_values,) each.
        tried: limbs that are only tried where others have them.
    """
    model, tracked = bodies[person].model, bodies[person].values
    searched, tried = (movable(some, evidence.active_dofs) for some in (searched, tried))
    at = evidence.views, bodies, person, settings
    plain = scorer_without_prediction(*at, evidence.part_colors, evidence.active_dofs)
    scorer = with_regions(plain, evidence, bodies, person)
    start = scorer.fitted(model, tracked)
    unproposed = [x for x in tried if x.name not in [s.name for s in searched]]
    best, *rest = search_limbs(model, searched, start, others, scorer, unproposed)
    gain = start.cost - best.cost
    is_better = gain > MIN_GAIN_NATS
    entry = search_entry("repair", [*searched, *unproposed], start, [best, *rest])._replace(taken=is_better)
    if is_better:
        return Repair(best.pose, best.cost, gain, tuple(rest), entry, start.pose)
    return Repair(tracked, start.cost, gain, (best, *rest), entry, start.pose)


def with_regions(
    plain: PoseScorer, evidence: FrameEvidence, bodies: Bodies, person: int, limb: Limb | None = None
) -> RegionScorer:
    """Return a scorer that adds region evidence to a plain one; see `RegionScorer`."""
    own = {f.name: getattr(plain, f.name) for f in fields(PoseScorer)}
    return RegionScorer(**own, evidence=evidence, bodies=bodies, person=person, limb=limb)
