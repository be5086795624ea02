"""One frame of a recording: its evidence, and where everybody stands so far.

The prediction of each person is first refined on the edges around it (`refine`), the others standing where they are as
far as is known (GD96 Fig. 2), then everybody once more with all others found. Only where the outcome is not credible
(`confidence`) the best-first search of the paper is spent, on the whole body, and proposals on single limbs
(`recover`); the cheapest refined pose wins.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from tracker.appearance.part_colors import Colors
from tracker.body.limbs import Limb, limb_display_name
from tracker.body.model import PosedBody
from tracker.compute.threads import side_by_side
from tracker.evidence.view_evidence import ACCEPTED_SHARE, ViewEvidence
from tracker.fitting.contour_residuals import MIN_DECREASE, ContourResiduals, PartCosts
from tracker.fitting.gauss_newton import Fit, ResidualBlock, covariance, with_locked_dofs
from tracker.fitting.gauss_newton_compiled import solve_compiled
from tracker.fitting.interpenetration import BodyPenetration
from tracker.geometry.arrays import Array
from tracker.images.static_edges import StaticEdgeModel
from tracker.search.best_first import COARSE_SEARCH, SearchSettings
from tracker.tracking import confidence
from tracker.tracking.chamfer.limb_recovery import LEAST_GAIN, Judge, for_several, search_limbs
from tracker.tracking.chamfer.settings import TrackSettings, prior_blocks, search_frame
from tracker.tracking.confidence import Quality, Status
from tracker.tracking.evidence_assignment import Shares, Sharing
from tracker.tracking.person_memory import Memory
from tracker.tracking.view_regions import px_per_m, visible_outline

_ITERATIONS = 15
_TOLERANCE = 1e-3  # rad or metres: a tenth of a pixel on a limb
_AT_ONCE = 2
"""Limbs that are searched in a frame at most, the likeliest to be lost first; the others come in the next frames."""
_MOVED_RAD, _ANEW_RAD = 0.05, 0.3
"""A search of a limb was not in vain where a joint turned farther; the limb is elsewhere where it turned this far."""
_MOST_EXCESS = 60.0
"""What two people's predictions may speak against their exchange for it to be tried: more no image makes good."""
_STILL_M = 0.002
"""In the joint refinement a person is refined anew when another has moved farther since, metres."""
_SHARED_M = 0.01
"""Evidence is shared out anew when somebody has moved farther, metres."""


class Found(NamedTuple):
    """One person on one frame."""

    status: Status
    remark: str
    parts_px: Array
    covariance: Array
    evaluations: int
    quality: Quality | None
    others: tuple[tuple[Array, ...], ...] = ()
    """What is about as good: poses of everybody, (n_values,) each, in which this person is elsewhere, best first."""


def _in_doubt(found: Found, remark: str, others: Sequence[tuple[Array, ...]]) -> Found:
    """The same where the evidence goes as well with other poses."""
    status: Status = "doubtful" if found.status == "good" else found.status
    remarks = ", ".join(r for r in (found.remark, remark) if r)
    return found._replace(status=status, remark=remarks, others=(*found.others, *others))


class _Seen(NamedTuple):
    """One person as far as they are found."""

    match: ContourResiduals
    """The evidence that they were fitted to."""
    poses: tuple[Array, ...]
    """Where everybody stood when that was made, (n_values,) each."""
    fit: Fit
    anew: tuple[Limb, ...] | None = None
    """Limbs whose prediction is not trusted, where the person was searched anew; None where that was not needed."""
    told: tuple[Quality, PartCosts] | None = None
    """What the evidence says of the fit, and the costs of its parts, where that has been asked."""
    evaluations: int = 0
    """Poses that the best-first search scored."""
    remarks: tuple[str, ...] = ()
    """What was done to find them."""
    rivals: tuple[Array, ...] = ()
    """Poses that are about as good, (n_values,) each, best first."""


class Scene:
    """One frame: its evidence, and where everybody stands so far."""

    def __init__(
        self, views: Sequence[ViewEvidence], memories: Sequence[Memory], poses: Sequence[Array], settings: TrackSettings
    ) -> None:
        """Begin with everybody where they are expected.

        Args:
            views: the evidence of the frame.
            memories: of each person.
            poses: where each is expected, or given, (n_values,).
            settings: of the tracker.
        """
        self.poses = list(poses)
        """Where each person stands so far, (n_values,)."""
        self._views, self._settings = views, settings
        self._memories, self._models, self._predicted = memories, [m.model for m in memories], tuple(poses)
        self._sharing, self._shares = Sharing(views), list[Shares]()
        self._placed: dict[tuple[int, int], PosedBody] = {}  # poses are kept: no other gets their number
        self._thetas = np.array([v.outlier_px(settings.theta_px) for v in views])

    def teach(self, static_edges: Sequence[StaticEdgeModel]) -> None:
        """Show what remembers the room the edges away from everybody, of views whose silhouette nothing tells."""
        for view, room in zip(self._views, static_edges, strict=True):
            if view.segments is not None and view.silhouette is None:
                pieces = visible_outline(self._bodies(), view.camera)
                room.update(view.segments, view.corner_px, view.camera.size, pieces, ACCEPTED_SHARE * view.theta_px)

    def colors(self, person: int) -> Colors:
        """The colours of this frame under a person."""
        return Colors(self._views, *self._around(person))

    def held(self, person: int) -> Found:
        """Judge nobody: a pose that was given is taken as it is."""
        match, n = self._match(person), self._models[person].n_dofs
        costs = match.part_costs(self.poses[person])
        return Found("good", "", self._parts_px(costs), np.zeros((n, n)), 0, None)

    def judged(self, person: int, rivals: Sequence[Array] = ()) -> Found:
        """Judge a person where they stand, with poses that are about as good, (n_values,) each."""
        match = self._match(person, everywhere=True)
        blocks, free = [match, *self._priors(person)], self._memories[person].free
        fit = solve_compiled(self._models[person], self.poses[person], blocks, free, max_iterations=0)
        return self._judged(person, _Seen(match, tuple(self.poses), fit, rivals=tuple(rivals)))

    def estimate(self, people: Sequence[int]) -> dict[int, Found]:
        """Find the poses of some people, one after the other, then together; they take their places in `poses`."""
        if self._settings.estimate == "search":
            return {p: self._judged(p, self._searched(p)) for p in people}
        # One after the other: where all are refined at once, each takes what belongs to who has not got there yet.
        seen = {p: self._refined(p) for p in people}
        self._refine_together(seen)
        self._recover(seen)
        if any(s.anew is not None for s in seen.values()):
            self._refine_together(seen)
        found = dict(zip(seen, side_by_side(lambda p: self._judged(p, seen[p]), [*seen]), strict=True))
        for (p, q), poses in self._exchanges(seen).items():
            for one, other in ((p, q), (q, p)):
                found[one] = _in_doubt(found[one], f"may be exchanged with person {other + 1}", [poses])
        return found

    def _searched(self, person: int) -> _Seen:
        """Search a person by best-first search alone."""
        match = self._match(person)
        evaluations, values = self._search(person, self.poses[person], self._settings.search)
        blocks = [match, *self._priors(person)]
        fit = solve_compiled(self._models[person], values, blocks, self._memories[person].free, max_iterations=0)
        self.poses[person] = values
        return _Seen(match, tuple(self.poses), fit, evaluations=evaluations)

    def _refined(self, person: int, before: _Seen | None = None) -> _Seen:
        """Refine a person from where they stand, as they were seen before if they were."""
        anew = None if before is None else before.anew
        match = self._match(person, everywhere=anew is not None)
        blocks = [match, *self._priors(person, anew or ())]
        model, free = self._models[person], self._memories[person].free
        gain = MIN_DECREASE if len(self._models) > 1 else 0.0  # who moves a little is refined again with the others
        poses, fit = (
            tuple(self.poses),
            solve_compiled(model, self.poses[person], blocks, free, _ITERATIONS, _TOLERANCE, gain),
        )
        self.poses[person] = fit.pose
        if before is None:
            return _Seen(match, poses, fit)
        return before._replace(match=match, poses=poses, fit=fit, told=None)

    def _refine_together(self, seen: dict[int, _Seen]) -> None:
        """Refine people again and again, each with the others where they were found, until nobody needs it."""
        for _ in range(self._settings.rounds if len(self._models) > 1 else 0):
            again = False
            for person, before in seen.items():
                if not self._stand(before.poses, np.where(np.arange(len(self.poses)) == person, _SHARED_M, _STILL_M)):
                    seen[person], again = self._refined(person, before), True
            if not again:
                break

    def _moved_m(self, person: int, was: Array, now: Array) -> float:
        """How far apart the points of a person are in two poses, (n_values,), at most, metres."""
        if was is now:
            return 0.0
        there, here = self._body(person, was), self._body(person, now)
        return float(np.linalg.norm(here.points_world - there.points_world, axis=1).max())

    def _stand(self, poses: Sequence[Array], within_m: Array) -> bool:
        """Whether everybody stands as in some poses, (n_values,) each, each within some metres, (K,)."""
        return all(
            self._moved_m(i, was, now) < within_m[i] for i, (was, now) in enumerate(zip(poses, self.poses, strict=True))
        )

    def _recover(self, seen: dict[int, _Seen]) -> None:
        """Search what the refinement alone did not find, if anything, and put people there.

        They are searched side by side, each with the others as they were refined, so that nothing depends on who is
        done first.
        """
        told = dict(zip(seen, side_by_side(lambda p: self._told(p, seen[p]), [*seen]), strict=True))
        seen.update({p: s._replace(told=told[p]) for p, s in seen.items()})
        blind = not any(len(v.points_px) for v in self._views)  # then there is nothing to search in
        if self._settings.recover is None or blind:
            return
        alone, due = len(self._models) == 1, dict[int, list[Limb]]()
        for person, (found, _) in told.items():
            limbs = self._memories[person].due(found)[:_AT_ONCE]
            if limbs or (found.suspects(alone) if alone else found.doubted(alone)) or found.body_lost:
                due[person] = limbs
        if not due:
            return
        own = dict(zip(due, self._own([*due], everywhere=True), strict=True))
        anew = side_by_side(lambda p: self._recovered(p, seen[p], due[p], own[p]), [*due])
        for person, recovered in zip(due, anew, strict=True):
            seen[person], self.poses[person] = recovered, recovered.fit.pose

    def _recovered(self, person: int, seen: _Seen, due: Sequence[Limb], own: Sequence[ViewEvidence]) -> _Seen:
        """Search limbs whose turn it is, and the body if it is lost, among all edges.

        The prediction may have refused the right ones.
        """
        memory, settings = self._memories[person], self._settings
        assert settings.recover is not None
        assert seen.told is not None
        found, alone = seen.told[0], len(self._models) == 1
        model, free, suspects = memory.model, memory.free, tuple(memory.suspects(found))
        priors = self._priors(person, suspects)
        match, poses = self._match_on(own, person, everywhere=True), tuple(self.poses)
        fit = solve_compiled(model, seen.fit.pose, [match, *priors], free, _ITERATIONS, _TOLERANCE, gain=MIN_DECREASE)
        if not due and not found.body_lost:  # whose turn it is not yet are no longer drawn to what was predicted
            return _Seen(match, poses, fit, suspects)
        colors = Colors(own, *self._around(person))
        how = settings.recover if alone else for_several(settings.recover)
        judge = Judge(match, priors, colors, memory.known, how, free)
        remarks: list[str] = []
        evaluations = 0
        if found.body_lost:
            evaluations, fit = self._search_body(person, fit, judge)
            remarks.append("body searched anew")
        others = (memory.past[-1], self._predicted[person])
        better, rivals = search_limbs(model, due, fit, others, judge, _ITERATIONS)
        turned = np.abs(model.difference(better.pose, fit.pose))
        for limb in due:
            memory.searched(limb, found, turned[limb.dofs].max() > _MOVED_RAD)
            if turned[limb.dofs].max() > _ANEW_RAD:
                remarks.append(f"{limb_display_name(limb.name)} searched anew")
        return _Seen(match, poses, better, suspects, None, evaluations, tuple(remarks), tuple(r.pose for r in rivals))

    def _judged(self, person: int, seen: _Seen) -> Found:
        """What was found of a person, with the judgement of it."""
        found, costs = seen.told or self._told(person, seen)
        out = Found(
            confidence.judge(found), ", ".join(seen.remarks) or confidence.reason(found), self._parts_px(costs),
            covariance(self._models[person], seen.fit), seen.evaluations, found,
        )  # fmt: skip
        if not seen.rivals:
            return out
        model = self._models[person]
        turned = np.abs([model.difference(rival, seen.fit.pose) for rival in seen.rivals]).max(axis=0)
        names = [limb_display_name(x.name) for x in confidence.limbs(model) if turned[x.dofs].max() > _ANEW_RAD]
        remark = f"{' and '.join(names) or 'body'} may be elsewhere"
        return _in_doubt(out, remark, [self._with(person, rival) for rival in seen.rivals])

    def _exchanges(self, seen: Mapping[int, _Seen]) -> dict[tuple[int, int], tuple[Array, ...]]:
        """Pairs of people who might as well be each other, and the poses of everybody if they were.

        Each takes the other's pose and is refined there, held by the own prediction and the own colours.
        """
        exchanges = {}
        for p, q in combinations(seen, 2):
            if self._models[p].value_names != self._models[q].value_names or not self._may_be_exchanged(p, q):
                continue
            before, colors = list(self.poses), self._settings.recover.colors if self._settings.recover else 0.0
            here = sum(seen[i].fit.cost - colors * self._nats(i) for i in (p, q))
            self.poses[p], self.poses[q] = self.poses[q], self.poses[p]
            there = 0.0
            for i in (p, q):
                there += self._refined(i, seen[i]).fit.cost - colors * self._nats(i)
            if there < here + LEAST_GAIN:
                exchanges[p, q] = tuple(self.poses)
            self.poses = before
        return exchanges

    def _may_be_exchanged(self, p: int, q: int) -> bool:
        """Whether two people are where each was expected to be about as much as where the other was."""
        excess = 0.0
        for i, other in ((p, q), (q, p)):
            model, expected = self._models[i], self._priors(i)[0]
            costs = [expected.linearize(model, self.poses[k], model.kinematics(self.poses[k])).cost for k in (other, i)]
            excess += costs[0] - costs[1]
        return excess < _MOST_EXCESS

    def _nats(self, person: int) -> float:
        """What the colours say for a person where they stand; nothing where nobody has shown them."""
        known = self._memories[person].known
        return 0.0 if known is None else float(self.colors(person).nats(self.poses[person][None], known)[0])

    def _with(self, person: int, values: Array) -> tuple[Array, ...]:
        """Where everybody stands, but for one person."""
        return (*self.poses[:person], values, *self.poses[person + 1 :])

    def _priors(self, person: int, suspects: Sequence[Limb] = ()) -> list[ResidualBlock]:
        """What holds a pose besides the image: its prediction, but for limbs that seem lost, how people bend, and the
        others."""
        settings, model = self._settings, self._models[person]
        sigma = np.where(model.dof_is_length, settings.trust_m, settings.trust_rad)
        for limb in suspects:
            assert settings.recover is not None
            sigma[limb.dofs] = settings.recover.trust_rad
        blocks = prior_blocks(model, self._predicted[person], sigma)
        if len(self._models) > 1 and settings.apart > 0:
            blocks.append(BodyPenetration(self._bodies(), person, settings.apart))
        return blocks

    def _search_body(self, person: int, fit: Fit, judge: Judge) -> tuple[int, Fit]:
        """Best-first search from the prediction and from the last good pose; the best of what refines from there."""
        memory, predicted, best, evaluations = self._memories[person], self._predicted[person], fit, 0
        for start in (predicted, memory.last_good):
            scored, values = self._search(
                person, with_locked_dofs(memory.model, start, predicted, memory.free), COARSE_SEARCH
            )
            evaluations += scored
            refined = solve_compiled(
                memory.model, values, judge.blocks, memory.free, _ITERATIONS, _TOLERANCE, gain=MIN_DECREASE
            )
            if judge.cost(refined) < judge.cost(best):
                best = refined
        return evaluations, best

    def _search(self, person: int, start: Array, how: SearchSettings) -> tuple[int, Array]:
        """Best-first search of one person from a pose, (n_values,): how many poses were scored, and the best."""
        evaluations, found, free = 0, start, self._memories[person].free
        bodies, index = self._around(person)
        models, poses = [b.model for b in bodies], [b.values for b in bodies]
        poses[index] = start
        masks = None if free is None else [free] * len(bodies)  # only that of the person counts
        for step in search_frame(self._views, models, poses, replace(self._settings, search=how), [index], masks):
            found, evaluations = step.best[index], step.evaluations
        return evaluations, with_locked_dofs(self._models[person], found, start, free)

    def _told(self, person: int, seen: _Seen) -> tuple[Quality, PartCosts]:
        known, colors = self._memories[person].known, None
        if known is not None:
            colors = self.colors(person).score(seen.fit.pose, known), known
        trusts = np.array([0.0 if v.silhouette is None else v.silhouette.trust for v in self._views])
        body = self._body(person, seen.fit.pose)
        scale = px_per_m([v.camera for v in self._views], body)
        costs = seen.match.part_costs(seen.fit.pose)
        return confidence.quality(body, seen.fit, costs, self._thetas, trusts, scale, colors), costs

    def _parts_px(self, costs: PartCosts) -> Array:
        """Mean distance of each part's contour to the edges, (n_parts,), px of the footage."""
        scales = np.array([v.scale for v in self._views])
        length = (costs.length_px / scales[:, None]).sum(axis=0)
        far = np.nansum(costs.forward_px * costs.length_px / scales[:, None] ** 2, axis=0)
        return np.divide(far, length, out=np.full_like(length, np.nan), where=length > 0)

    def _match(self, person: int, everywhere: bool = False) -> ContourResiduals:
        """The residuals of a person's contours against evidence of their own, the others where they stand."""
        (own,) = self._own([person], everywhere)
        return self._match_on(own, person, everywhere)

    def _match_on(self, own: Sequence[ViewEvidence], person: int, everywhere: bool) -> ContourResiduals:
        bodies, index = self._around(person)
        settings = self._settings
        # Of segments a prediction accepts those near it: to look for what is farther costs more than it saves.
        everywhere = everywhere or settings.segments
        return ContourResiduals(own, bodies, index, settings.match, settings.theta_px, everywhere)

    def _own(self, people: Sequence[int], everywhere: bool = False) -> list[tuple[ViewEvidence, ...]]:
        """Of each of some people the evidence without what the others explain, as it was shared out when everybody
        stood about here."""
        bodies = self._bodies()
        if len(bodies) == 1 or not self._settings.occlusion:
            return [self._sharing.everything if everywhere else self._sharing.views] * len(people)
        for shares in reversed(self._shares):
            if self._stand(shares.poses, np.full(len(bodies), _SHARED_M)):
                return [shares.own(p, everywhere) for p in people]
        self._shares.append(Shares(self._sharing, bodies))
        return [self._shares[-1].own(p, everywhere) for p in people]

    def _around(self, person: int) -> tuple[list[PosedBody], int]:
        """Who is in the scene for a person, and their index there."""
        bodies = self._bodies()
        return (bodies, person) if self._settings.occlusion else ([bodies[person]], 0)

    def _bodies(self) -> list[PosedBody]:
        """Everybody where they stand so far."""
        return [self._body(i, pose) for i, pose in enumerate(self.poses)]

    def _body(self, person: int, values: Array) -> PosedBody:
        """A person in a pose, (n_values,); each is asked for many times."""
        key = person, id(values)  # people who are exchanged take each other's poses
        if key not in self._placed:
            self._placed[key] = PosedBody(self._models[person], values)
        return self._placed[key]
