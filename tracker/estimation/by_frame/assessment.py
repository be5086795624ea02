"""Assess the pose of a person on a frame: quality, status, notes and covariance."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.limbs import Search
from tracker.body.model import PosedBody
from tracker.estimation.by_frame.frame_problem import Assessment, Bodies, FrameProblem, PersonFit
from tracker.estimation.fitting.contour_residuals import PartCosts
from tracker.estimation.fitting.gauss_newton import covariance
from tracker.estimation.fitting.hypothesis import Hypothesis
from tracker.estimation.tracking import confidence
from tracker.estimation.tracking.confidence import PoseQuality, Status, may_be_elsewhere, worst
from tracker.estimation.tracking.tracker import NormalMatrix
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array


class PersonEstimate(NamedTuple):
    """The estimate of one person on one frame, besides the pose."""

    status: Status
    note: str
    """Note for people to read; empty where nothing was unusual."""
    part_costs_px: Array
    """Mean distance of each part's contour to the edges, (n_parts,), px of the footage; NaN where hidden."""
    covariance: Array
    """Covariance of the pose, (n_dofs, n_dofs), rad and metres."""
    evaluations: int
    """Number of poses that the best-first search scored."""
    quality: PoseQuality | None
    """Features from which the status follows; None for a keyframe."""
    alternatives: tuple[tuple[Array, ...], ...] = ()
    """Poses of all people, (n_values,) each, in which this person is elsewhere and which are about as good, best
    first."""
    normal_matrix: NormalMatrix | None = None
    """How well the contours determine the pose, if the method says."""
    trace: tuple[Search, ...] | None = ()
    """See `PersonFit.trace`."""

    def after(self, searches: tuple[Search, ...]) -> "PersonEstimate":
        """Return the estimate with searches before its own."""
        return self._replace(trace=(*searches, *(self.trace or ())))

    def in_doubt(self, note: str, alternatives: Sequence[tuple[Array, ...]]) -> "PersonEstimate":
        """Return the estimate with more alternatives, at most doubtful."""
        notes = ", ".join(n for n in (self.note, note) if n)
        return self._replace(
            status=worst([self.status, "doubtful"]), note=notes, alternatives=(*self.alternatives, *alternatives)
        )


def estimate_fixed(problem: FrameProblem, person: int, bodies: Bodies) -> PersonEstimate:
    """Return the estimate of a person whose pose is a keyframe; it is not assessed."""
    model = bodies[person].model
    costs = problem.residuals(person, bodies).part_costs(bodies[person].values)
    zero = np.zeros((model.n_dofs, model.n_dofs))
    return PersonEstimate("good", "", part_costs_px(problem.views, costs), zero, 0, None)


def assess_given_pose(
    problem: FrameProblem, person: int, bodies: Bodies, alternatives: Sequence[Array] = ()
) -> PersonEstimate:
    """Assess a person in the pose that they have.

    Args:
        problem: of the frame.
        person: whom to assess.
        bodies: all people.
        alternatives: poses of the person that are about as good, (n_values,) each.
    """
    residuals = problem.residuals(person, bodies, everywhere=True)
    blocks = [residuals, *problem.priors(person, bodies)]
    fit = problem.solve(person, bodies[person].values, blocks, max_iterations=0)
    others = tuple(Hypothesis(PosedBody(bodies[person].model, pose)) for pose in alternatives)
    found = PersonFit(residuals, bodies, fit, bodies[person], alternatives=others)
    return finalize(problem, person, bodies, found)


def assess(problem: FrameProblem, person: int, bodies: Bodies, found: PersonFit) -> Assessment:
    """Compute the features of a fit from which its status follows."""
    known = problem.people[person].colors
    colors = None if known is None else problem.colors(person, bodies).score(found.fit.pose, known)
    costs = found.residuals.part_costs(found.fit.pose)
    predicted, freed = problem.people[person].predicted, problem.freed(person, found)
    quality = confidence.quality(found.body, freed, costs, problem.views, problem.thetas_px, predicted, colors)
    return Assessment(quality, costs)


def finalize(problem: FrameProblem, person: int, bodies: Bodies, found: PersonFit) -> PersonEstimate:
    """Turn a fit into an estimate: assess it unless that is done, and note its alternatives."""
    quality, costs = found.assessment or assess(problem, person, bodies, found)
    model = found.body.model
    out = PersonEstimate(
        confidence.classify(quality), ", ".join(found.notes) or confidence.reason(quality),
        part_costs_px(problem.views, costs), covariance(model, found.fit), found.evaluations, quality,
        trace=found.trace,
    )  # fmt: skip
    if not found.alternatives:
        return out
    poses = tuple(b.values for b in bodies)
    return out.in_doubt(
        may_be_elsewhere(found.body, found.alternatives),
        [(*poses[:person], other.pose, *poses[person + 1 :]) for other in found.alternatives],
    )


def part_costs_px(views: Sequence[ViewEvidence], costs: PartCosts) -> Array:
    """Return the mean distance of each part's contour to the edges over all views, (n_parts,), px of the footage."""
    scales = np.array([v.scale for v in views])
    length = (costs.length_px / scales[:, None]).sum(axis=0)
    far = np.nansum(costs.forward_px * costs.length_px / scales[:, None] ** 2, axis=0)
    return np.divide(far, length, out=np.full_like(length, np.nan), where=length > 0)
