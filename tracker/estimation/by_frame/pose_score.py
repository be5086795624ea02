"""The one score of a pose on a frame, in nats: by contours, colours and priors together."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics
from tracker.body.limbs import Limb
from tracker.body.model import BodyModel, PosedBody
from tracker.compute.threads import N_HELPERS, kernel_pool, map_chunked
from tracker.estimation.appearance.part_colors import Colors, PartColors
from tracker.estimation.appearance.region_limb_scorer import RegionLimbScorer
from tracker.estimation.appearance.region_model import RegionFrame, RegionModel
from tracker.estimation.by_frame.frame_problem import Bodies, penetration, with_body
from tracker.estimation.by_frame.settings import MAX_ITERATIONS, TOLERANCE, EstimationSettings, RecoverSettings
from tracker.estimation.fitting.clocked_residuals import PersonResiduals, person_residuals
from tracker.estimation.fitting.contour_residuals import MIN_DECREASE
from tracker.estimation.fitting.gauss_newton import Fit, PosePrior, ResidualBlock
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled_or_plain
from tracker.estimation.fitting.hypothesis import Hypothesis
from tracker.estimation.fitting.interpenetration import SelfPenetration
from tracker.estimation.fitting.keypoints import keypoint_blocks
from tracker.estimation.tracking.view_regions import accepting_pieces_px, regions
from tracker.evidence.observer import Observer
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class PoseScorer:
    """Scores poses of one person on one frame by contours, colours and priors together.

    It shares its thread clones with the scorers made from it; use one of them at a time.
    """

    residuals: PersonResiduals
    priors: Sequence[ResidualBlock]
    colors: Colors
    part_colors: PartColors | None
    """Colours of the parts; None where they are unknown."""
    settings: RecoverSettings
    active_dofs: NDArray[np.bool_] | None
    """The degrees of freedom that may move, (n_dofs,); None: all. Limbs are given without the others."""
    clones: tuple[PersonResiduals, ...]
    """The residuals once for each helper thread, each with scratch of its own."""

    @classmethod
    def of(
        cls, residuals: PersonResiduals, priors: Sequence[ResidualBlock], colors: Colors,
        part_colors: PartColors | None, settings: RecoverSettings, active_dofs: NDArray[np.bool_] | None = None,
    ) -> "PoseScorer":  # fmt: skip
        """Return a scorer with a clone for each helper thread."""
        clones = tuple(residuals.clone_for_thread() for _ in range(N_HELPERS))
        return cls(residuals, priors, colors, part_colors, settings, active_dofs, clones)

    @property
    def blocks(self) -> list[ResidualBlock]:
        """The residual blocks to minimize."""
        return [self.residuals, *self.priors]

    def restricted_to(self, limb: Limb) -> "PoseScorer":
        """Return a faster scorer for poses that differ in a limb alone. It works in the room of this one's clones."""
        return replace(self, clones=tuple(c.restricted_to(limb.parts) for c in self.clones))

    def with_part_colors(self, colors: Colors, part_colors: PartColors | None) -> "PoseScorer":
        """Return a scorer that ranks proposals by the colours of the parts, too. It works in the room of this one's
        clones."""
        return replace(self, colors=colors, part_colors=part_colors)

    def each(self, work: Callable[["PoseScorer", Array], T], poses: Sequence[Array] | Array) -> list[T]:
        """Apply work to each of several poses, (n_values,) each, in parallel; each thread has a scorer of its own."""
        return map_chunked(work, [replace(self, residuals=c) for c in self.clones], list(poses))

    def cost(self, fit: Fit) -> float:
        """Return the cost of a refined pose with its colours."""
        return fit.cost + float(self._color_costs(fit.pose[None])[0])

    def scored(self, model: BodyModel, fit: Fit) -> Hypothesis:
        """Return the hypothesis of a refined pose, with its cost."""
        return Hypothesis.refined(model, fit, self.cost(fit))

    def fitted(self, model: BodyModel, pose: Array) -> Hypothesis:
        """Return the hypothesis of a pose, (n_values,), after its refinement."""
        fit = solve_compiled_or_plain(
            model, pose, self.blocks, self.active_dofs, MAX_ITERATIONS, TOLERANCE, MIN_DECREASE
        )
        return self.scored(model, fit)

    def costs(self, candidates: Array) -> Array:
        """Return the costs of poses, (n, n_values), without refinement and without priors, (n,)."""
        costs, n = np.empty(len(candidates)), len(self.clones)

        def score(i: int, residuals: PersonResiduals) -> None:
            own = candidates[i::n]
            costs[i::n] = residuals.costs(own) + self._color_costs(own)

        list(kernel_pool().map(score, range(n), self.clones))
        return costs

    def _color_costs(self, poses: Array) -> Array:
        """Return what the colours add to the costs of poses, (n, n_values), (n,)."""
        if self.part_colors is None or not len(poses):
            return np.zeros(len(poses))
        return -self.settings.colors * self.colors.nats(poses, self.part_colors)

    def costs_with_priors(self, model: BodyModel, poses: Array) -> Array:
        """Return the costs of poses, (n, n_values), without refinement, (n,): those of `costs` and of all priors."""
        return self.costs(poses) + [sum(b.linearize(model, *at).cost for b in self.priors) for at in _at(model, poses)]

    def refined(self, model: BodyModel, poses: Sequence[Array], sigma: Array) -> Array:
        """Return each of several poses, (n_values,), refined as if it were the prediction of the frame.

        Args:
            model: the body.
            poses: the poses.
            sigma: standard deviations of a prediction, (n_dofs,), rad or metres.
        """

        def refine(own: PoseScorer, pose: Array) -> Array:
            blocks = [*own.blocks, PosePrior(pose, 1 / sigma)]
            return solve_compiled_or_plain(
                model, pose, blocks, own.active_dofs, MAX_ITERATIONS, TOLERANCE, MIN_DECREASE
            ).pose

        return np.array(self.each(refine, poses))


def _at(model: BodyModel, poses: Array) -> list[tuple[Array, Kinematics]]:
    return [(pose, model.kinematics(pose)) for pose in poses]


def common_evidence(
    observer: Observer, frame: int, guesses: Sequence[Bodies], settings: EstimationSettings
) -> tuple[ViewEvidence, ...]:
    """Return the evidence of a frame around several guesses of the poses of all people, to compare them on."""
    cameras = observer.working_cameras
    visible = accepting_pieces_px(observer, frame, guesses)
    where = regions(cameras, [body for g in guesses for body in g])
    return observer.evidence(frame, where, visible if settings.segments else None, edges=settings.edges)


def scorer_without_prediction(
    views: Sequence[ViewEvidence], bodies: Bodies, person: int, settings: EstimationSettings
) -> PoseScorer:
    """Return a scorer of the poses of one person on common evidence, whose priors are those of every frame."""
    residuals, priors, keypoints = without_prediction(views, bodies, person, settings)
    colors, recover = Colors(views, bodies, person), settings.recover or RecoverSettings()
    return PoseScorer.of(residuals, [*priors, *keypoints], colors, None, recover)


class FrameBlocks(NamedTuple):
    """Residual blocks of one person's pose: those of a frame, and priors of every frame."""

    residuals: PersonResiduals
    """Of contours."""
    priors: list[ResidualBlock]
    keypoints: list[ResidualBlock]


def without_prediction(
    views: Sequence[ViewEvidence], bodies: Bodies, person: int, settings: EstimationSettings
) -> FrameBlocks:
    """Return the residuals of one person on common evidence, and the priors of every frame; see above."""
    residuals = person_residuals(views, bodies, person, settings.match, settings.theta_px, everywhere=True)
    model, velocity = bodies[person].model, bodies[person].velocity
    priors = [PosePrior.of_spreads(model), SelfPenetration(), *penetration(bodies, person, settings)]
    return FrameBlocks(residuals, priors, keypoint_blocks(views, person, velocity))


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
