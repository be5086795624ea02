"""The chamfer tracker of GD96: a frame by its best-first search, of lost bodies or instead of all refinement."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

from tracker.body.model import PosedBody
from tracker.estimation.by_frame.assessment import PersonEstimate
from tracker.estimation.by_frame.forward_pass import track_forward
from tracker.estimation.by_frame.frame_estimator import FrameEstimator
from tracker.estimation.by_frame.frame_problem import PersonFit, with_body
from tracker.estimation.chamfer.settings import TrackSettings, search_frame
from tracker.estimation.fitting.gauss_newton import with_locked_dofs
from tracker.estimation.search.best_first import COARSE_SEARCH, SearchSettings
from tracker.estimation.tracking.tracker import PoseEstimate, Subjects, TrackingRun
from tracker.geometry.arrays import Array


class ChamferEstimator(FrameEstimator):
    """Estimates the poses of all people in one frame; see `FrameEstimator`."""

    def estimate(self, people: Sequence[int]) -> dict[int, PersonEstimate]:
        """Find the poses of some people and move them there."""
        if self._track_settings.estimate == "search":
            return {p: self.finalize(p, self.move(p, self._search_only(p))) for p in people}
        return super().estimate(people)

    def search_body(self, person: int, start: Array) -> tuple[int, Array]:
        """Search a lost person best first, coarsely; see `FrameEstimator.search_body`."""
        return self._search(person, start, COARSE_SEARCH)

    @property
    def _track_settings(self) -> TrackSettings:
        assert isinstance(self.settings, TrackSettings)
        return self.settings

    def _search_only(self, person: int) -> PersonFit:
        """Find a person by best-first search alone."""
        problem, bodies = self.problem, self.bodies
        residuals = problem.residuals(person, bodies)
        evaluations, pose = self._search(person, bodies[person].values, self._track_settings.search)
        blocks = [residuals, *problem.priors(person, bodies)]
        body = PosedBody(bodies[person].model, pose, bodies[person].velocity)
        fit = problem.solve(person, pose, blocks, max_iterations=0)
        return PersonFit(residuals, with_body(bodies, person, body), fit, body, evaluations=evaluations, trace=None)

    def _search(self, person: int, start: Array, how: SearchSettings) -> tuple[int, Array]:
        """Search one person from a pose, (n_values,), best first; return the number of poses scored and the best."""
        around, index = self.problem.around(person, self.bodies)
        active = self.problem.people[person].active_dofs
        subjects = Subjects.of([b.model for b in around], [index], [active] * len(around))  # only the person's counts
        poses = [b.values for b in around]
        poses[index] = start
        evaluations, found = 0, start
        velocities, settings = [b.velocity for b in around], replace(self._track_settings, search=how)
        for step in search_frame(self.problem.views, subjects, poses, settings, velocities):
            found, evaluations = step.best[index], step.evaluations
        return evaluations, with_locked_dofs(self.bodies[person].model, found, start, active)


@dataclass(frozen=True)
class ChamferTracker:
    """Predict, observe, estimate and assess, one frame at a time."""

    settings: TrackSettings = field(default_factory=TrackSettings)

    def estimates(self, run: TrackingRun) -> Iterator[PoseEstimate]:
        """See `Tracker.estimates`."""
        return track_forward(run, self.settings, ChamferEstimator)
