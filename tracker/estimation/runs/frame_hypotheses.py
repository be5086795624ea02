"""A person on one frame of a run: the evidence around all proposals, and the hypotheses of the pose there."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody, parts_of
from tracker.compute.threads import kernel_pool
from tracker.estimation.appearance.part_colors import Colors, PartColors
from tracker.estimation.appearance.region_residuals import region_residuals
from tracker.estimation.by_frame.frame_problem import Bodies, prediction_sigmas, with_body
from tracker.estimation.by_frame.pose_score import (
    FrameEvidence,
    PoseScorer,
    RegionScorer,
    with_regions,
    without_prediction,
)
from tracker.estimation.by_frame.settings import OWN_TRUST, EstimationSettings, RecoverSettings
from tracker.estimation.fitting.contour_residuals import PartCosts
from tracker.estimation.fitting.gauss_newton import ResidualBlock, with_locked_dofs
from tracker.estimation.fitting.hypothesis import distance_m
from tracker.estimation.fitting.keypoints import keypoint_blocks, keypoints_of
from tracker.estimation.tracking.confidence import views_of_limbs
from tracker.estimation.trajectory.hypotheses import DISTINCT_M, HypothesisSet
from tracker.estimation.trajectory.motion_model import motion_points
from tracker.geometry.arrays import Array, IntArray, Mask


class Proposal(NamedTuple):
    """A pose that a person may have on a frame."""

    pose: Array
    """(n_values,)."""
    source: str
    """Name of what proposed it."""


class FrameHypotheses:
    """A person on one frame: evidence, and hypotheses, no two of them alike."""

    def __init__(
        self, evidence: FrameEvidence, bodies: Bodies, person: int, settings: EstimationSettings,
        active_dofs: Mask | None = None,
    ) -> None:  # fmt: skip
        """Prepare the evidence; there is no hypothesis yet.

        Args:
            evidence: of the frame.
            bodies: all people; the others stay.
            person: index of the person.
            settings: of the tracker.
            active_dofs: degrees of freedom of the person that may move, (n_dofs,); None: all.
        """
        self.evidence, self.bodies, self.person, self._settings = evidence, bodies, person, settings
        self.model: BodyModel = bodies[person].model
        views = evidence.views
        residuals, self._priors, keypoints = without_prediction(views, bodies, person, settings)
        recover, colors = settings.recover or RecoverSettings(), Colors(views, bodies, person)
        self._scorer = PoseScorer.of(residuals, [*self._priors, *keypoints], colors, None, recover, active_dofs)
        self._keypoints = [keypoint_blocks([view], person, bodies[person].velocity) for view in views]
        self._sigma = OWN_TRUST * prediction_sigmas(self.model, settings)
        self._tried: list[Array] = []
        self._found: HypothesisSet | None = None
        self.anchor: HypothesisSet | None = None
        """The keyframe of the person, alone, through which every path goes; None without one."""

    @property
    def found(self) -> HypothesisSet:
        """The hypotheses."""
        assert self._found is not None, "a frame has hypotheses once some are proposed"
        return self._found

    @property
    def on_path(self) -> HypothesisSet:
        """The hypotheses that a path may go through."""
        return self.found if self.anchor is None else self.anchor

    def anchored(self, pose: Array) -> None:
        """Let every path go through a pose, (n_values,): a keyframe."""
        self.anchor = self._scored(pose[None], ("keyframe",))
        self._join(self.anchor)

    def keep(self, chosen: IntArray) -> None:
        """Drop the hypotheses but those of some indices."""
        self._found = self.found.only(chosen)

    def propose(self, proposals: Sequence[Proposal]) -> None:
        """Refine proposals that no former one is alike, and add them to the hypotheses."""
        new = [p for p in self._with_locked_dofs(proposals) if self._is_new(p.pose)]
        if new:
            poses = self._scorer.refined(self.model, [p.pose for p in new], self._sigma)
            self._join(self._scored(poses, tuple(p.source for p in new)))

    def add(self, proposals: Sequence[Proposal]) -> None:
        """Add proposals to the hypotheses unrefined."""
        poses = [p.pose for p in self._with_locked_dofs(proposals)]
        self._join(self._scored(np.array(poses), tuple(p.source for p in proposals)))

    def among(self, bodies: Bodies) -> "FrameHypotheses":
        """Return the same person and hypotheses with the other people in other poses; itself where these are alike."""
        others = [(old, new) for i, (old, new) in enumerate(zip(self.bodies, bodies, strict=True)) if i != self.person]
        if all(distance_m(old, new) <= DISTINCT_M for old, new in others):
            return self
        out = FrameHypotheses(self.evidence, bodies, self.person, self._settings, self._scorer.active_dofs)
        out._tried = self._tried
        out._found = out._scored(self.found.poses, self.found.sources)
        if self.anchor is not None:
            out.anchor = out._scored(self.anchor.poses, self.anchor.sources)
        return out

    def region_nats(self, pose: Array) -> Array:
        """Return the region evidence for each part of the person in each view, (V, P), nats."""
        own = parts_of([b.model for b in self.bodies], self.person)
        return self.evidence.known.score(self.evidence.regions, self.posed(pose)).nats[:, own]

    def nats(self, pose: Array) -> float:
        """Return the cost of a pose, (n_values,), on the evidence of the hypotheses."""
        return float(self._scored(pose[None], ("",)).costs()[0])

    def part_costs(self, pose: Array) -> PartCosts:
        """Return how the contours of the parts fit in a pose, (n_values,)."""
        return self._scorer.residuals.part_costs(pose)

    def views_of_limbs(self, pose: Array, costs: PartCosts) -> Mask:
        """Return whether contours or key points show each limb in each view in a pose, (n_values,): (V, n_limbs)."""
        shown = views_of_limbs(PosedBody(self.model, pose), costs, self.evidence.views)
        for of_view, view in zip(shown, self.evidence.views, strict=True):
            if (points := keypoints_of(view, self.person)) is not None:
                of_view |= [np.isin(limb.parts, points.parts).any() for limb in limbs(self.model)]
        return shown

    def blocks(self, pose: Array) -> list[ResidualBlock]:
        """Return the residual blocks of the frame near a pose, (n_values,)."""
        of_regions = region_residuals(self.evidence.known, self.evidence.regions, self.posed(pose), self.person)
        return [*self._scorer.blocks, of_regions]

    def posed(self, pose: Array) -> Bodies:
        """Return all people, the person in a pose, (n_values,)."""
        own = PosedBody(self.model, pose, self.bodies[self.person].velocity)
        return with_body(self.bodies, self.person, own)

    def part_colors(self, pose: Array) -> PartColors | None:
        """Return the colours of the parts in a pose, (n_values,). They rank proposals."""
        return Colors(self.evidence.views, self.posed(pose), self.person).learn()

    def limb_scorer(self, pose: Array, part_colors: PartColors | None) -> RegionScorer:
        """Return what compares poses with limbs elsewhere than in a pose, (n_values,)."""
        bodies = self.posed(pose)
        plain = self._scorer.with_part_colors(Colors(self.evidence.views, bodies, self.person), part_colors)
        return with_regions(plain, self.evidence, bodies, self.person)

    def _scored(self, poses: Array, sources: tuple[str, ...]) -> HypothesisSet:
        """Return poses, (K, n_values), as hypotheses."""
        points, clones = motion_points(self.model), self._scorer.clones
        nats, priors = np.empty((len(poses), len(self.evidence.views))), np.empty(len(poses))
        places, n = np.empty((len(poses), len(points.parts), 3)), len(clones)
        known, regions = self.evidence.known, self.evidence.regions

        def score(i: int) -> None:
            nats[i::n] = clones[i].view_costs(poses[i::n])
            for k in range(i, len(poses), n):
                at = poses[k], self.model.kinematics(poses[k])
                nats[k] += [sum(b.linearize(self.model, *at).cost for b in own) for own in self._keypoints]
                nats[k] -= known.score(regions, self.posed(poses[k])).nats.sum(axis=1)
                priors[k] = sum(b.linearize(self.model, *at).cost for b in self._priors)
                places[k] = points.at(at[1])

        list(kernel_pool().map(score, range(n)))
        return HypothesisSet(poses, places, nats, priors, sources)

    def _with_locked_dofs(self, proposals: Sequence[Proposal]) -> list[Proposal]:
        """Return proposals with the locked degrees of freedom of the frame; a keyframe beside it may have others."""
        here, active = self.bodies[self.person].values, self._scorer.active_dofs
        poses = with_locked_dofs(self.model, np.array([p.pose for p in proposals]), here, active) if proposals else ()
        return [p._replace(pose=pose) for p, pose in zip(proposals, poses, strict=True)]

    def _join(self, new: HypothesisSet) -> None:
        self._found = new if self._found is None else self._found.joined(new)

    def _is_new(self, pose: Array) -> bool:
        points = self.model.points_world(pose)
        if any(np.linalg.norm(points - other, axis=1).max() <= DISTINCT_M for other in self._tried):
            return False
        self._tried.append(points)
        return True
