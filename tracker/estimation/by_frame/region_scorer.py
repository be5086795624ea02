"""Score poses of a person by contours and the region evidence of a run together."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import NamedTuple

import numpy as np

from tracker.body.limbs import Limb
from tracker.body.model import PosedBody
from tracker.estimation.appearance.region_limb_scorer import RegionLimbScorer
from tracker.estimation.appearance.region_model import RegionFrame, RegionModel
from tracker.estimation.by_frame.frame_problem import Bodies, with_body
from tracker.estimation.by_frame.pose_score import PoseScorer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array


class FrameEvidence(NamedTuple):
    """The evidence of a frame on which poses are compared."""

    views: Sequence[ViewEvidence]
    """Evidence around all people, with all edges that may be theirs; see `common_evidence`."""
    known: RegionModel
    """Appearance of the people and places of the run."""
    regions: RegionFrame
    """Region evidence of the frame."""


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


def with_regions(
    plain: PoseScorer, evidence: FrameEvidence, bodies: Bodies, person: int, limb: Limb | None = None
) -> RegionScorer:
    """Return a scorer that adds region evidence to a plain one; see `RegionScorer`."""
    own = {f.name: getattr(plain, f.name) for f in fields(PoseScorer)}
    return RegionScorer(**own, evidence=evidence, bodies=bodies, person=person, limb=limb)
