"""Estimate the poses of all people in one frame.

The prediction of each person is first refined on the edges around it, the others in their poses so far (GD96 Fig. 2);
then all are refined again with the others where they were found. Only where the result is not credible (`confidence`)
the whole body is searched, if the method does that, and proposals of single limbs are scored (`limb_recovery`). The
cheapest refined pose wins.
"""

from collections.abc import Mapping, Sequence
from itertools import combinations

from tracker.body.limbs import Limb, Search, limb_display_name
from tracker.body.model import PosedBody
from tracker.compute.threads import map_parallel
from tracker.estimation.appearance.part_colors import Colors
from tracker.estimation.by_frame.assessment import PersonEstimate, assess, estimate_fixed, finalize
from tracker.estimation.by_frame.frame_problem import Bodies, FrameProblem, PersonFit, PersonPrior, with_body
from tracker.estimation.by_frame.limb_recovery import search_entry, search_limbs
from tracker.estimation.by_frame.pose_score import PoseScorer
from tracker.estimation.by_frame.settings import MAX_ITERATIONS, EstimationSettings
from tracker.estimation.fitting.contour_residuals import MIN_DECREASE
from tracker.estimation.fitting.gauss_newton import Fit, with_locked_dofs
from tracker.estimation.fitting.hypothesis import (
    BEAM_NATS,
    CLEAR_NATS,
    SAME_POSE_M,
    SETTLED_M,
    distance_m,
    limbs_elsewhere,
)
from tracker.estimation.tracking.person_memory import PersonMemory
from tracker.evidence.contours.occluding_contours import Contour
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array

_MAX_LIMBS = 2
"""Number of limbs of a person that are searched in a frame, the most likely lost first."""


class FrameEstimator:
    """Estimates the poses of all people in one frame; `bodies` are the poses so far."""

    def __init__(
        self,
        views: Sequence[ViewEvidence],
        memories: Sequence[PersonMemory],
        bodies: Sequence[PosedBody],
        settings: EstimationSettings,
        contours: Sequence[Contour] | None = None,
    ) -> None:
        """Begin at the predicted poses.

        Args:
            views: the evidence of the frame.
            memories: of each person.
            bodies: all people, as predicted or in their keyframes.
            settings: of the tracker.
            contours: of all bodies in each view, if they have been traced.
        """
        self.bodies: Bodies = tuple(bodies)
        """All people in their poses so far."""
        people = [
            PersonPrior(m.model, b.values, m.active_dofs, m.part_colors, b.velocity, m.step_frames)
            for m, b in zip(memories, bodies, strict=True)
        ]
        predicted = None if contours is None else (self.bodies, contours)
        self.problem = FrameProblem(views, people, settings, predicted)
        """The fitting problem of the frame."""
        self._memories, self.settings = memories, settings

    def estimate_fixed(self, person: int) -> PersonEstimate:
        """Return the estimate of a person whose pose is a keyframe; it is not assessed."""
        return estimate_fixed(self.problem, person, self.bodies)

    def estimate(self, people: Sequence[int]) -> dict[int, PersonEstimate]:
        """Find the poses of some people and move them there."""
        # One after the other: where all are refined at once, each takes edges of people who are still off. That costs
        # the second of `two_people` 1.8 mm and saves 8% of the processor time at most (docs/decisions/by_frame.md).
        fits = {p: self.move(p, self.problem.refine(p, self.bodies)) for p in people}
        self._refine_together(fits)
        self._converge(fits, people)
        self._recover(fits)
        if any(f.untrusted_limbs is not None for f in fits.values()):
            self._refine_together(fits)
            self._converge(fits, [p for p, f in fits.items() if f.untrusted_limbs is not None])
        finalized = map_parallel(lambda p: self.finalize(p, fits[p]), [*fits])
        estimates = dict(zip(fits, finalized, strict=True))
        for (p, q), poses in identity_swaps(self.problem, self.bodies, fits).items():
            for one, other in ((p, q), (q, p)):
                estimates[one] = estimates[one].in_doubt(f"may be swapped with person {other + 1}", [poses])
        return estimates

    def move(self, person: int, found: PersonFit) -> PersonFit:
        """Move a person to the pose of a fit, and return the fit."""
        self.bodies = with_body(self.bodies, person, found.body)
        return found

    def finalize(self, person: int, found: PersonFit) -> PersonEstimate:
        """Turn the fit of a person into an estimate, with all people where they are."""
        return finalize(self.problem, person, self.bodies, found)

    def _refine_together(self, fits: dict[int, PersonFit]) -> None:
        """Refine people again, each with the others where they were found, until nobody moves or rounds are over."""
        for _ in range(self.settings.rounds if len(self.bodies) > 1 else 0):
            done = True
            for person, before in fits.items():
                pairs = zip(before.bodies, self.bodies, strict=True)
                if not all(distance_m(then, now) < SETTLED_M for then, now in pairs):
                    fits[person] = self.move(person, self.problem.refine(person, self.bodies, before))
                    done = False
            if done:
                break

    def _converge(self, fits: dict[int, PersonFit], people: Sequence[int]) -> None:
        """Refine some people again in parallel, free of their prediction, each with the others as in their fit."""
        converged = map_parallel(lambda p: self.problem.converge(p, fits[p]), people)
        fits.update({p: self.move(p, fit) for p, fit in zip(people, converged, strict=True)})

    def _recover(self, fits: dict[int, PersonFit]) -> None:
        """Search for lost limbs and bodies, and move people to what was found.

        People are searched in parallel, each with the others as they were refined, so that the result does not depend
        on the order.
        """
        problem = self.problem
        assessments = map_parallel(lambda p: assess(problem, p, self.bodies, fits[p]), [*fits])
        fits.update({p: fits[p]._replace(assessment=a) for p, a in zip(list(fits), assessments, strict=True)})
        has_edges = any(len(v.points_px) for v in problem.views)
        if self.settings.recover is None or not has_edges:
            return
        limbs_of = dict[int, list[Limb]]()
        for person, (quality, _) in zip(fits, assessments, strict=True):
            limbs = self._memories[person].limbs_to_search(quality)[:_MAX_LIMBS]
            if limbs or quality.limbs_to_search or quality.is_body_lost:
                limbs_of[person] = limbs
        if not limbs_of:
            return
        people = [*limbs_of]
        own = dict(zip(people, problem.own_evidence(people, self.bodies, everywhere=True), strict=True))
        recovered = map_parallel(lambda p: self._recover_person(p, fits[p], limbs_of[p], own[p]), people)
        for person, found in zip(people, recovered, strict=True):
            fits[person] = self.move(person, found)

    def _recover_person(
        self, person: int, before: PersonFit, limbs: Sequence[Limb], own: Sequence[ViewEvidence]
    ) -> PersonFit:
        """Search some limbs of a person, and the body if it is lost.

        Args:
            person: whom to search.
            before: the refined and assessed fit.
            limbs: which are searched in this frame.
            own: evidence of the person with all edges; the prediction may have refused the right ones.
        """
        problem, memory, bodies, recover = self.problem, self._memories[person], self.bodies, self.settings.recover
        assert recover is not None
        assert before.assessment is not None
        quality, model = before.assessment.quality, memory.model
        untrusted = tuple(memory.search_candidates(quality))
        priors = problem.priors(person, bodies, untrusted)
        residuals = problem.residuals_on(own, person, bodies, everywhere=True)
        fit = problem.solve(person, before.fit.pose, [residuals, *priors], MAX_ITERATIONS, MIN_DECREASE)
        # Limbs that wait for their search are no longer drawn to their prediction.
        found = PersonFit(residuals, bodies, fit, PosedBody(model, fit.pose), untrusted)
        if not limbs and not quality.is_body_lost:
            return found
        scorer = PoseScorer.of(
            residuals, priors, Colors(own, *problem.around(person, bodies)), memory.part_colors,
            recover, memory.active_dofs,
        )  # fmt: skip
        notes, trace, evaluations = list[str](), list[Search](), 0
        searched = self._search_body(person, fit, scorer) if quality.is_body_lost else None
        if searched is not None:
            evaluations, fit, entry = searched
            notes.append("body searched")
            trace.append(entry)
        others = (memory.history[-1], problem.people[person].predicted)
        start = scorer.scored(model, fit)
        best, *alternatives = search_limbs(model, limbs, start, others, scorer)
        if limbs:
            trace.append(search_entry("limbs", limbs, start, [best, *alternatives]))
        moved, relocated = (limbs_elsewhere(start.body, best.body, m) for m in (SETTLED_M, SAME_POSE_M))
        for limb in limbs:
            memory.record_search(limb, quality, limb.name in moved)
            if limb.name in relocated:
                notes.append(f"{limb_display_name(limb.name)} relocated")
        assert best.fit is not None
        return found._replace(
            fit=best.fit, body=best.body, evaluations=evaluations, notes=tuple(notes), trace=tuple(trace),
            alternatives=tuple(alternatives),
        )  # fmt: skip

    def search_body(self, person: int, start: Array) -> tuple[int, Array] | None:
        """Search a lost person from a pose, (n_values,); methods that search whole bodies override it.

        Returns:
            The number of poses that were scored, and the best pose; None without a search.
        """
        del person, start
        return None

    def _search_body(self, person: int, fit: Fit, scorer: PoseScorer) -> tuple[int, Fit, Search] | None:
        """Search from the prediction and from the last good pose; return the evaluations, the best refined fit, and the
        entry of the search."""
        memory, predicted, evaluations = self._memories[person], self.problem.people[person].predicted, 0
        tried = list[Fit]()
        for start in (predicted, memory.last_good):
            found = self.search_body(person, with_locked_dofs(memory.model, start, predicted, memory.active_dofs))
            if found is None:
                return None
            evaluations += found[0]
            tried.append(self.problem.solve(person, found[1], scorer.blocks, MAX_ITERATIONS, MIN_DECREASE))
        other = min(tried, key=scorer.cost)
        before, after = scorer.cost(fit), scorer.cost(other)
        return evaluations, other if after < before else fit, Search.of("body", (), before, after, after < before)


def identity_swaps(
    problem: FrameProblem, bodies: Bodies, fits: Mapping[int, PersonFit]
) -> dict[tuple[int, int], tuple[Array, ...]]:
    """Return the pairs that may be swapped, and the poses of all people, (n_values,) each, with that pair swapped.

    Each of a pair takes the other's pose and is refined there, with their own prediction and their own colours.

    Args:
        problem: of the frame.
        bodies: all people as they were found.
        fits: of the people who were tracked.
    """
    swaps, recover = {}, problem.settings.recover
    color_weight = recover.colors if recover else 0.0
    for p, q in combinations(fits, 2):
        if bodies[p].model.value_names != bodies[q].model.value_names or not _is_plausible(problem, bodies, p, q):
            continue
        here = sum(fits[i].fit.cost - color_weight * problem.color_nats(i, bodies) for i in (p, q))
        swapped = with_body(bodies, p, PosedBody(bodies[p].model, bodies[q].values))
        swapped = with_body(swapped, q, PosedBody(bodies[q].model, bodies[p].values))
        there = 0.0
        for i in (p, q):
            refined = problem.refine(i, swapped, fits[i])
            swapped = with_body(swapped, i, refined.body)
            there += refined.fit.cost - color_weight * problem.color_nats(i, swapped)
        if there < here + CLEAR_NATS:
            swaps[p, q] = tuple(b.values for b in swapped)
    return swaps


def _is_plausible(problem: FrameProblem, bodies: Bodies, p: int, q: int) -> bool:
    """Return whether the predictions of two people admit a swap."""
    increase = 0.0
    for i, other in ((p, q), (q, p)):
        model, prediction = bodies[i].model, problem.priors(i, bodies)[0]
        swapped, own = (
            prediction.linearize(model, bodies[k].values, model.kinematics(bodies[k].values)).cost for k in (other, i)
        )
        increase += swapped - own
    return increase < BEAM_NATS
