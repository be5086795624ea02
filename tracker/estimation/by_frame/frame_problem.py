"""The fitting problem of one frame: the evidence, residuals and priors of each person, for any poses of all people.

Nothing here moves a person: bodies come in as arguments, and fits are returned.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import Limb, Search
from tracker.body.model import BodyModel, PosedBody
from tracker.body.motion.pose_steps import PredictSettings, shortest_step
from tracker.estimation.appearance.part_colors import Colors, PartColors
from tracker.estimation.by_frame.settings import MAX_ITERATIONS, OWN_TRUST, TOLERANCE, EstimationSettings
from tracker.estimation.fitting.clocked_residuals import ClockedResiduals, PersonResiduals, person_residuals
from tracker.estimation.fitting.contour_residuals import MIN_DECREASE, PartCosts
from tracker.estimation.fitting.gauss_newton import Fit, PosePrior, ResidualBlock
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled_or_plain
from tracker.estimation.fitting.hypothesis import SETTLED_M, Hypothesis, distance_m
from tracker.estimation.fitting.interpenetration import BodyPenetration, SelfPenetration
from tracker.estimation.fitting.keypoints import keypoint_blocks
from tracker.estimation.tracking.confidence import PoseQuality
from tracker.estimation.tracking.evidence_assignment import EvidenceAssignment, EvidencePool
from tracker.evidence.contours.occluding_contours import Contour
from tracker.evidence.view_evidence import ViewEvidence, outliers_px
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import ROUNDING_PX2

Bodies = tuple[PosedBody, ...]
"""All people in their poses."""


class PersonPrior(NamedTuple):
    """Knowledge of a person before a frame."""

    model: BodyModel
    predicted: Array
    """Predicted pose, (n_values,)."""
    active_dofs: NDArray[np.bool_] | None = None
    """The degrees of freedom that may move, (n_dofs,); None: all."""
    colors: PartColors | None = None
    """Colours of the parts; None before the first frame."""
    velocity: Array | None = None
    """Predicted change of the pose from one frame to the next, (n_dofs,); None where no view needs it."""
    step_frames: int | None = None
    """Frames since the last pose, from which the velocity of another pose follows; None if it stays as predicted."""

    def moving(self, pose: Array, settings: PredictSettings) -> PosedBody:
        """Return the person in a pose, (n_values,), with the velocity that brought them there, within the bounds."""
        if self.velocity is None or self.step_frames is None:
            return PosedBody(self.model, pose, self.velocity)
        bound = np.where(self.model.dof_is_length, settings.bound_m, settings.bound_rad)
        change = shortest_step(self.model, pose, self.predicted) / self.step_frames
        return PosedBody(self.model, pose, np.clip(self.velocity + change, -bound, bound))


class Assessment(NamedTuple):
    """How well a pose fits the evidence."""

    quality: PoseQuality
    part_costs: PartCosts


class PersonFit(NamedTuple):
    """One person fitted to a frame."""

    residuals: PersonResiduals
    """The residuals that were minimized."""
    bodies: Bodies
    """All people when the residuals were made."""
    fit: Fit
    body: PosedBody
    """The person in the pose that was found."""
    untrusted_limbs: tuple[Limb, ...] | None = None
    """Limbs whose prediction is not trusted, if the person was recovered; None if that was not needed."""
    assessment: Assessment | None = None
    """None before the fit is assessed."""
    evaluations: int = 0
    """Number of poses that the best-first search scored."""
    notes: tuple[str, ...] = ()
    """Notes for people to read on how the person was found."""
    alternatives: tuple[Hypothesis, ...] = ()
    """Poses that are about as good, best first."""
    trace: tuple[Search, ...] | None = ()
    """The searches that led to it; None where they are not known."""
    is_predicted: bool = True
    """Whether the prediction is a term of the fit."""


class FrameProblem:
    """The fitting problem of one frame.

    It caches how evidence is assigned to people, per set of poses. The cache lives as long as the frame. Evidence must
    not be asked for by several threads at a time.
    """

    def __init__(
        self,
        views: Sequence[ViewEvidence],
        people: Sequence[PersonPrior],
        settings: EstimationSettings,
        predicted: tuple[Bodies, Sequence[Contour]] | None = None,
    ) -> None:
        """Prepare the problem.

        Args:
            views: the evidence of the frame.
            people: what is known of each person.
            settings: of the tracker.
            predicted: all people as predicted, and their contours in each view, if those have been traced.
        """
        self.views, self.people, self.settings = tuple(views), tuple(people), settings
        self.thetas_px = outliers_px(views, settings.theta_px)
        """Outlier distance of each view, (V,), working px."""
        self._predicted = predicted
        self._assignments = list[EvidenceAssignment]()
        self._colors: dict[int, tuple[Bodies, Colors]] = {}

    @cached_property
    def _pool(self) -> EvidencePool:
        return EvidencePool(self.views)

    def refine(self, person: int, bodies: Bodies, before: PersonFit | None = None) -> PersonFit:
        """Refine the pose of one person, and return the fit.

        Args:
            person: whom to refine, from the pose in `bodies`.
            bodies: all people.
            before: a former fit on this frame. Its notes are kept, and its untrusted limbs stay untrusted.
        """
        untrusted = None if before is None else before.untrusted_limbs
        residuals = self.residuals(person, bodies, everywhere=untrusted is not None)
        blocks = [residuals, *self.priors(person, bodies, untrusted or ())]
        fit = self.solve(person, bodies[person].values, blocks, self.settings.max_iterations, MIN_DECREASE)
        body = self._moving(person, fit.pose)
        if before is None:
            return PersonFit(residuals, bodies, fit, body)
        return before._replace(residuals=residuals, bodies=bodies, fit=fit, body=body, assessment=None)

    def converge(self, person: int, found: PersonFit) -> PersonFit:
        """Refine a fit again from its pose, which takes the place of the prediction.

        The prediction holds the first refinement back where the person moves otherwise than predicted. The result has
        the normal matrix with the prediction. With `EstimationSettings.measure_noise` the contours have the variance
        of the first refinement's distances, if that is below 1 px^2. Priors then pull less where the body fits well.
        """
        prediction, own, *others = self._priors_of(person, found)
        if isinstance(found.residuals, ClockedResiduals) and found.body.velocity is not None:
            found = found._replace(residuals=found.residuals.with_velocity(found.body.velocity))
        model, residuals = self.people[person].model, self._as_precise_as_measured(found)
        fit = self.solve(person, own.pose, [residuals, own, *others], MAX_ITERATIONS, MIN_DECREASE)
        if residuals is found.residuals:
            fit = fit.with_prior(model, own, prediction)
        else:
            fit = self.solve(person, fit.pose, [found.residuals, prediction, *others], 0)
        return found._replace(fit=fit, body=self._moving(person, fit.pose), assessment=None)

    def _moving(self, person: int, pose: Array) -> PosedBody:
        return self.people[person].moving(pose, self.settings.predict)

    def _as_precise_as_measured(self, found: PersonFit) -> PersonResiduals:
        """Return the residuals of a fit with the variance of their distances, if that is wanted and below 1 px^2."""
        if not self.settings.measure_noise:
            return found.residuals
        variance_px2 = _variance_px2(found.residuals.part_costs(found.fit.pose))
        return found.residuals.with_information(1 / variance_px2) if variance_px2 < 1 else found.residuals

    def freed(self, person: int, found: PersonFit) -> Fit:
        """Return a fit as if its pose, little trusted, were the prediction of all limbs, if it has one."""
        if not found.is_predicted:
            return found.fit
        predicted, sigma = self.people[person].predicted, self._sigma_of(person, found.untrusted_limbs or ())
        return found.fit.with_prior(
            self.people[person].model, PosePrior(predicted, 1 / sigma), self._own(person, found)
        )

    def _own(self, person: int, found: PersonFit) -> PosePrior:
        """Return the pose of a fit as a weak prior."""
        return PosePrior(found.fit.pose, 1 / (OWN_TRUST * self.sigma(person)))

    def _priors_of(self, person: int, found: PersonFit) -> tuple[PosePrior, PosePrior, *tuple[ResidualBlock, ...]]:
        """Return the prediction of a fit, its pose as a weak prior in that place, and the other prior terms."""
        prediction, *others = self.priors(person, found.bodies, found.untrusted_limbs or ())
        assert isinstance(prediction, PosePrior)
        return prediction, self._own(person, found), *others

    def solve(
        self, person: int, start: Array, blocks: Sequence[ResidualBlock], max_iterations: int, min_decrease: float = 0.0
    ) -> Fit:
        """Minimize the cost of some blocks from a pose, (n_values,)."""
        model, active = self.people[person].model, self.people[person].active_dofs
        return solve_compiled_or_plain(model, start, blocks, active, max_iterations, TOLERANCE, min_decrease)

    def sigma(self, person: int) -> Array:
        """Return the standard deviations of a prediction, (n_dofs,), rad or metres."""
        return prediction_sigmas(self.people[person].model, self.settings)

    def _sigma_of(self, person: int, untrusted: Sequence[Limb]) -> Array:
        """Return `sigma`, large for untrusted limbs."""
        sigma = self.sigma(person)
        for limb in untrusted:
            assert self.settings.recover is not None
            sigma[limb.dofs] = self.settings.recover.trust_rad
        return sigma

    def priors(self, person: int, bodies: Bodies, untrusted: Sequence[Limb] = ()) -> list[ResidualBlock]:
        """Build the terms beside the contours: prediction (first, weak for untrusted limbs), joint spread, penetration,
        key points."""
        model, sigma = self.people[person].model, self._sigma_of(person, untrusted)
        blocks = [
            *prior_blocks(model, self.people[person].predicted, sigma),
            *penetration(bodies, person, self.settings),
        ]
        if any(v.keypoints for v in self.views):
            blocks += keypoint_blocks(self.views, person, bodies[person].velocity)
        return blocks

    def residuals(self, person: int, bodies: Bodies, everywhere: bool = False) -> PersonResiduals:
        """Build the residuals of a person's contours against the evidence assigned to them.

        Args:
            person: whom to fit.
            bodies: all people; the others occlude.
            everywhere: keep edges far from the contours too, for poses far from these.
        """
        (own,) = self.own_evidence([person], bodies, everywhere)
        return self.residuals_on(own, person, bodies, everywhere)

    def residuals_on(
        self, own: Sequence[ViewEvidence], person: int, bodies: Bodies, everywhere: bool
    ) -> PersonResiduals:
        """Build the same against given evidence of the person."""
        settings, (around, index) = self.settings, self.around(person, bodies)
        # Of segments a prediction accepts those near it: to look for what is farther costs more than it saves.
        everywhere = everywhere or settings.segments
        contours = None
        if self._predicted is not None and bodies == self._predicted[0] and len(around) == len(bodies):
            contours = self._predicted[1]
        return person_residuals(own, around, index, settings.match, settings.theta_px, everywhere, contours)

    def own_evidence(
        self, people: Sequence[int], bodies: Bodies, everywhere: bool = False
    ) -> list[tuple[ViewEvidence, ...]]:
        """Return for each of some people the evidence of each view without what the others explain.

        An assignment made for poses within a centimetre is used again.
        """
        if len(bodies) == 1 or not self.settings.occlusion:
            return [self._pool.all_edges if everywhere else self.views] * len(people)
        assignment = next((a for a in reversed(self._assignments) if _are_near(a.bodies, bodies)), None)
        if assignment is None:
            assignment = EvidenceAssignment(self._pool, bodies)
            self._assignments.append(assignment)
        return [assignment.own(p, everywhere) for p in people]

    def colors(self, person: int, bodies: Bodies) -> Colors:
        """Return the colours of the frame under a person. Those of the last bodies are kept."""
        known = self._colors.get(person)
        if known is None or known[0] != bodies:
            known = self._colors[person] = bodies, Colors(self.views, *self.around(person, bodies))
        return known[1]

    def color_nats(self, person: int, bodies: Bodies) -> float:
        """Return the log-likelihood ratio of the colours under a person, nats; 0 where their colours are unknown."""
        known = self.people[person].colors
        return 0.0 if known is None else float(self.colors(person, bodies).nats(bodies[person].values[None], known)[0])

    def around(self, person: int, bodies: Bodies) -> tuple[list[PosedBody], int]:
        """Return the bodies that may occlude a person, the person included, and the person's index among them."""
        return (list(bodies), person) if self.settings.occlusion else ([bodies[person]], 0)


def _variance_px2(costs: PartCosts) -> float:
    """Estimate the variance of the contours' distances to the edges, px^2; 1 where nothing is visible.

    It follows from the mean distance as for a normal distribution, and is at least that of rounding to whole pixels.
    """
    length_px = costs.length_px.sum()
    if length_px == 0:
        return 1.0
    mean_px = np.nansum(costs.forward_px * costs.length_px) / length_px
    return float(max(np.pi / 2 * mean_px**2, ROUNDING_PX2))


def with_body(bodies: Bodies, person: int, body: PosedBody) -> Bodies:
    """Return all people with one in another pose, at the former velocity if that of the pose is not known."""
    if body.velocity is None and bodies[person].velocity is not None:
        body = replace(body, velocity=bodies[person].velocity)
    return (*bodies[:person], body, *bodies[person + 1 :])


def _are_near(before: Sequence[PosedBody], now: Sequence[PosedBody]) -> bool:
    """Return whether evidence assigned to people in some poses may be used for others."""
    return all(distance_m(a, b) < SETTLED_M for a, b in zip(before, now, strict=True))


def penetration(bodies: Bodies, person: int, settings: EstimationSettings) -> list[ResidualBlock]:
    """Return the term against the penetration of other bodies, if there are any and it is wanted."""
    return [BodyPenetration(bodies, person, settings.apart)] if len(bodies) > 1 and settings.apart > 0 else []


def prediction_sigmas(model: BodyModel, settings: EstimationSettings) -> Array:
    """Return the standard deviations of a prediction, (n_dofs,), rad or metres."""
    return np.where(model.dof_is_length, settings.trust_m, settings.trust_rad)


def prior_blocks(model: BodyModel, predicted: Array, sigmas: Array) -> list[ResidualBlock]:
    """Build the prior terms of one body: prediction, joint spread and self-penetration.

    Args:
        model: the body.
        predicted: the predicted pose, (n_values,).
        sigmas: its standard deviations, (n_dofs,), rad or metres.
    """
    return [PosePrior(predicted, 1 / sigmas), PosePrior.of_spreads(model), SelfPenetration()]
