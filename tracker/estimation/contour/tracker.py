"""The contour tracker: a frame by the extremal contours of KRH08, made robust and symmetric, or as the paper does."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import PosedBody
from tracker.estimation.by_frame.assessment import PersonEstimate, assess
from tracker.estimation.by_frame.forward_pass import track_forward
from tracker.estimation.by_frame.frame_estimator import FrameEstimator
from tracker.estimation.by_frame.frame_problem import PersonFit, with_body
from tracker.estimation.by_frame.incremental_fit import fit_by_chains
from tracker.estimation.by_frame.settings import EstimationSettings
from tracker.estimation.contour.fit_steps import paper_residuals, unlimited_views
from tracker.estimation.contour.image_contours import select_contours
from tracker.estimation.contour.settings import ContourSettings
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.estimation.fitting.gauss_newton import NormalEquations
from tracker.estimation.tracking.person_memory import PersonMemory
from tracker.estimation.tracking.tracker import NormalMatrix, PoseEstimate, TrackingRun
from tracker.evidence.contours.occluding_contours import Contour
from tracker.evidence.view_evidence import ViewEvidence


class ContourEstimator(FrameEstimator):
    """Estimates the poses of all people in one frame; see `FrameEstimator`."""

    def __init__(
        self,
        views: Sequence[ViewEvidence],
        memories: Sequence[PersonMemory],
        bodies: Sequence[PosedBody],
        settings: EstimationSettings,
        contours: Sequence[Contour] | None = None,
    ) -> None:
        """Begin at the predicted poses; see `FrameEstimator`."""
        assert isinstance(settings, ContourSettings)
        self._contour_settings = settings
        chosen = [select_contours(v, settings.image_contours) for v in views]
        super().__init__(chosen, memories, bodies, settings, contours)
        self._is_first = [len(m.history) == 1 for m in memories]
        self._unlimited: list[ViewEvidence] = []

    def estimate(self, people: Sequence[int]) -> dict[int, PersonEstimate]:
        """Find the poses of some people and move them there."""
        if not self._contour_settings.paper:
            return super().estimate(people)
        self._unlimited = unlimited_views(self.problem.views, self._contour_settings)
        return {p: self.finalize(p, self.move(p, self._minimize(p))) for p in people}

    def finalize(self, person: int, found: PersonFit) -> PersonEstimate:
        """Turn the fit of a person into an estimate; by the paper with the rank of its normal matrix (Sect. 5.4)."""
        assessment = found.assessment or assess(self.problem, person, self.bodies, found)
        out = super().finalize(person, found._replace(assessment=assessment))
        model, active = found.body.model, self.problem.people[person].active_dofs
        n_dofs = model.n_dofs if active is None else int(active.sum())
        length_px = float(assessment.part_costs.length_px.sum())
        few = f"{length_px:.0f} px of contour are visible, fewer than the {n_dofs} degrees of freedom"
        if length_px < n_dofs:
            out = out._replace(status="lost", note=few)
        if not self._contour_settings.paper:
            return out
        linear = self._paper_residuals(person).linearize(model, found.fit.pose, model.kinematics(found.fit.pose))
        matrix = conditioning(linear, active)
        if length_px >= n_dofs and matrix.rank < n_dofs:
            few = f"the contours determine {matrix.rank} of {n_dofs} degrees of freedom"
            out = out._replace(note=", ".join(n for n in (out.note, few) if n))
        return out._replace(normal_matrix=matrix)

    def _minimize(self, person: int) -> PersonFit:
        """Minimize the squared chamfer distances of a person's contours from the pose so far (KRH08 Eq. 60)."""
        problem, bodies, settings = self.problem, self.bodies, self._contour_settings
        model, active = problem.people[person].model, problem.people[person].active_dofs
        start, blocks = bodies[person].values, [self._paper_residuals(person)]
        if self._is_first[person] and settings.incremental_start:
            for step in fit_by_chains(model, start, blocks, active):
                start = step.fit.pose
        fit = problem.solve(person, start, blocks, settings.max_iterations)
        body = PosedBody(model, fit.pose)
        # The status follows from the same features as that of other methods.
        residuals, found = problem.residuals(person, bodies), with_body(bodies, person, body)
        return PersonFit(residuals, found, fit, body, is_predicted=False)

    def _paper_residuals(self, person: int) -> ContourResiduals:
        around, index = self.problem.around(person, self.bodies)
        return paper_residuals(self._unlimited, around, index, self._contour_settings)


def conditioning(linear: NormalEquations, active_dofs: NDArray[np.bool_] | None) -> NormalMatrix:
    """Return rank and condition number of the normal matrix of contours, of the active degrees of freedom, (n_dofs,).

    Angles are in radians and lengths in metres.
    """
    n = len(linear.gradient)
    at = np.arange(n) if active_dofs is None else np.flatnonzero(active_dofs)
    if not len(at):
        return NormalMatrix(0, 0, np.inf)
    values = np.maximum(np.linalg.eigvalsh(linear.hessian[np.ix_(at, at)]), 0.0)
    least = len(at) * np.finfo(np.float32).eps * values[-1]  # the kernels' points are single precision
    condition = values[-1] / values[0] if values[0] > 0 else np.inf
    return NormalMatrix(int(np.sum(values > least)), len(at), float(condition))


@dataclass(frozen=True)
class ContourTracker:
    """Predict, observe, minimize and assess, one frame at a time."""

    settings: ContourSettings = field(default_factory=ContourSettings)

    def estimates(self, run: TrackingRun) -> Iterator[PoseEstimate]:
        """See `Tracker.estimates`."""
        return track_forward(run, self.settings, ContourEstimator)
