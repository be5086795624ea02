"""Lost limbs found again: a limb is tried everywhere it can be, the best places refined (DESIGN section 10).

Some thousand poses of the limb are ranked by a quick look along its axis: the colours under it, and edges at both its
sides. The best that are not all in one place improve by small random steps, each by itself, by the same look; then they
go through the costs that all poses go through, and the cheapest are refined. Limbs that are lost together are searched
together.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple, TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.appearance.part_colors import Colors, PartColors
from tracker.body.kinematics import chain_poses
from tracker.body.limbs import Limb
from tracker.body.model import BodyModel
from tracker.compute.threads import N_HELPERS, dealt_out, helpers
from tracker.fitting.contour_residuals import MIN_DECREASE, ContourResiduals
from tracker.fitting.gauss_newton import Fit, ResidualBlock
from tracker.fitting.gauss_newton_compiled import solve_compiled
from tracker.geometry.arrays import Array, IntArray

T = TypeVar("T")

APART_M, _SAME_M = 0.12, 0.06
"""How far apart the places are that are improved; poses nearer to each other than the second lead to the same one."""
LEAST_GAIN = 3.0
"""What a pose must cost less to take the place of the one at hand: it must be some 20 times likelier. Poses whose costs
differ by less are about equally good."""


@dataclass(frozen=True)
class RecoverSettings:
    """How lost limbs are searched for."""

    proposals: int = 1024
    """Poses of a limb that are looked at; a power of two, so that they fill the space evenly."""
    reach_rad: float = float(np.radians(35))
    """Spread of those proposals that lie around the pose, rad; half of them lie anywhere within the joint limits."""
    improved: int = 48
    """Of these, how many are improved."""
    scored: int = 48
    """Of those, how many are improved to the end and have their contours scored."""
    shakes: int = 16
    """Steps that are tried around each of them in a round."""
    shakes_rad: tuple[float, ...] = tuple(np.radians([16.0, 11.0, 7.0, 4.0]).tolist())
    """Their size, rad, round by round."""
    refined: int = 10
    """Proposals whose limb is refined alone."""
    finished: int = 3
    """Of these, how many go through a refinement of the whole body."""
    kept: int = 3
    """Poses that are kept while the next limb is searched, at most."""
    anew: bool = True
    """Whether places for that limb are looked for anew from each of them; else once, and scored with each."""
    gain: float = 0.0
    """Decrease of the cost that is worth another step of a refinement of the whole body."""
    margin: float = 40.0
    """What they may cost more than the best: more than another limb can make good."""
    colors: float = 0.2
    """Weight of the colours against edges; neighbouring pixels say the same, so it is well below 1."""
    trust_rad: float = 1.0
    """Standard deviation of the prediction of a limb that seems lost, rad: nearly none."""
    finish: float = np.inf
    """What a proposal may cost more than the best pose, its limb refined alone, to be refined with the whole body; the
    margin, if that is more, where another limb is searched after it."""


@dataclass(frozen=True, eq=False)
class Judge:
    """Compares poses of one person on one frame: contours, colours and priors together."""

    match: ContourResiduals
    priors: Sequence[ResidualBlock]
    colors: Colors
    known: PartColors | None
    """Colours of the parts; None where nobody has shown them."""
    settings: RecoverSettings
    free: NDArray[np.bool_] | None = None
    """The degrees of freedom that may move, (n_dofs,); None: all. Limbs are given without the others."""

    @property
    def blocks(self) -> list[ResidualBlock]:
        """What `gauss_newton.solve` is to minimize."""
        return [self.match, *self.priors]

    @cached_property
    def _for_threads(self) -> list["Judge"]:
        return [replace(self, match=self.match.clone_for_thread()) for _ in range(N_HELPERS)]

    def of_limb(self, limb: Limb) -> "Judge":
        """The same, quicker, for poses that differ in a limb alone; not to be used beside this one."""
        out = replace(self)
        out.__dict__["_for_threads"] = [replace(j, match=j.match.restricted_to(limb.parts)) for j in self._for_threads]
        return out

    def each(self, work: Callable[["Judge", Array], T], poses: Sequence[Array] | Array) -> list[T]:
        """What some work makes of each of several poses, (n_values,) each, in threads side by side, each with a judge
        of its own."""
        return dealt_out(work, self._for_threads, list(poses))

    def cost(self, fit: Fit) -> float:
        """Cost of a refined pose with its colours."""
        return fit.cost + float(self._of_colors(fit.pose[None])[0])

    def costs(self, candidates: Array) -> Array:
        """Costs of poses, (n, n_values), without refinement, (n,); priors are left to the refinement."""
        costs = np.empty(len(candidates))

        def score(i: int, judge: Judge) -> None:
            own = candidates[i::N_HELPERS]
            costs[i::N_HELPERS] = judge.match.costs(own) + judge._of_colors(own)

        list(helpers().map(score, range(N_HELPERS), self._for_threads))
        return costs

    def _of_colors(self, poses: Array) -> Array:
        """What the colours add to the costs of poses, (n, n_values), (n,)."""
        if self.known is None or not len(poses):
            return np.zeros(len(poses))
        return -self.settings.colors * self.colors.nats(poses, self.known)


class Searched(NamedTuple):
    """What a search of limbs came to."""

    best: Fit
    """What is cheapest; the pose at hand where nothing is by far."""
    others: tuple[Fit, ...] = ()
    """Poses about as good, with a limb elsewhere, cheapest first."""


def for_several(settings: RecoverSettings) -> RecoverSettings:
    """The same with half the work in each search: limbs of people who hide each other are searched several times as
    often, and who is found is refined again with the others where they are.

    (Where 86 searches on three recordings found something better, it was always among the 32 that looked best. Of 724
    searches on 17 simulated couples 64 brought a limb nearer to the truth by 5 cm or more: those that did cost 4 more
    than the pose at hand at most before the whole body was refined, and of 44 of them all were among the 32 that looked
    best after half of the rounds. How places look is no reason to give up: a leg that stands where the other belongs
    looks best where it is.)
    """
    return replace(settings, scored=min(32, settings.scored), anew=False, gain=MIN_DECREASE, finish=10.0)


def search_limbs(
    model: BodyModel, suspects: Sequence[Limb], here: Fit, others: Sequence[Array], judge: Judge, iterations: int
) -> Searched:
    """Search the limbs that seem lost, one after the other.

    A limb may stand where another belongs, and each alone looks best as it is: therefore the best few poses of each,
    worse ones too, are kept while the next is searched.

    Args:
        model: the body.
        suspects: the limbs that seem lost.
        here: the pose at hand.
        others: poses whose limbs are tried as they are, e.g. that of the frame before, (n_values,) each.
        judge: compares poses.
        iterations: most steps of a refinement of the whole body.
    """
    start = _Found(here, judge.cost(here))
    kept = [start]
    for limb in suspects:
        margin, finish = judge.settings.margin, judge.settings.finish
        kept = [x for x in kept if x.cost < kept[0].cost + margin]
        enough = kept[0].cost + (finish if limb is suspects[-1] else max(finish, margin))
        away = [p for x in suspects if x is not limb for p in x.parts]
        poses = [x.fit.pose for x in kept]
        together = [[pose] for pose in poses] if judge.settings.anew else [poses]
        found = [
            x for some in together for x in _search_limb(model, limb, away, some, others, judge, iterations, enough)
        ]
        kept = _distinct(model, [*kept, *found], judge.settings.kept, _SAME_M)
    best = kept[0] if kept[0].cost < start.cost - LEAST_GAIN else start
    rivals = [x for x in (*kept, start) if x is not best and x.cost < best.cost + LEAST_GAIN]
    places = _distinct(model, [best._replace(cost=-np.inf), *rivals], judge.settings.kept, APART_M)
    return Searched(best.fit, tuple(x.fit for x in places[1:]))


class _Found(NamedTuple):
    """A refined pose."""

    fit: Fit
    cost: float
    """With its colours."""


def _search_limb(
    model: BodyModel, limb: Limb, away: list[int], kept: Sequence[Array], others: Sequence[Array], judge: Judge,
    iterations: int, enough: float,
) -> list[_Found]:  # fmt: skip
    """The best poses of one limb, refined with the whole body; parts that are `away` hide nothing at first.

    What costs `enough` or more where the limb is refined alone is left out.

    Places are looked for around the first of the poses that are `kept`, (n_values,) each. They differ in limbs that are
    away, so that the places are as good for all of them; which go together their contours tell.
    """

    def alone(judge: Judge, pose: Array) -> _Found:
        fit = solve_compiled(model, pose, judge.blocks, limb.dofs, max_iterations=4, tolerance=1e-2, gain=MIN_DECREASE)
        return _Found(fit, judge.cost(fit))

    def whole(judge: Judge, pose: Array) -> _Found:
        fit = solve_compiled(
            model, pose, judge.blocks, judge.free, iterations, tolerance=1e-3, gain=judge.settings.gain
        )
        return _Found(fit, judge.cost(fit))

    of_limb = judge.of_limb(limb)
    poses = _candidates(model, limb, away, kept[0], others, of_limb)
    if len(kept) > 1:
        poses = np.array([*poses, *(_with_limb(model, k, pose, limb) for k in kept[1:] for pose in poses)])
        poses = poses[np.argsort(of_limb.costs(poses), kind="stable")[: judge.settings.refined]]
    tried = [x for x in of_limb.each(alone, poses) if x.cost < enough]
    return judge.each(whole, [x.fit.pose for x in _distinct(model, tried, judge.settings.finished, _SAME_M)])


def _candidates(
    model: BodyModel, limb: Limb, away: list[int], here: Array, others: Sequence[Array], judge: Judge
) -> Array:
    """The few poses of a limb that are worth a refinement, (n, n_values)."""
    settings = judge.settings
    look = judge.colors.limb_scorer(here, limb.parts, judge.known, away)
    proposals = _proposals(model, limb, here, settings)
    looks = np.concatenate(_in_parts(look, proposals))
    best = _best_apart(model, limb, proposals, looks, settings.improved, APART_M)
    dofs, n_rounds = np.flatnonzero(limb.dofs), len(settings.shakes_rad)
    # Each improves by itself, so that threads need not wait for one another in between.
    for rounds in (range(n_rounds // 2), range(n_rounds // 2, n_rounds)):
        steps = [
            np.random.default_rng(i).normal(0.0, settings.shakes_rad[i], (len(best), settings.shakes, len(dofs)))
            for i in rounds
        ]
        improved = _in_parts(lambda *some: _improved(model, dofs, look, *some), best, *steps)
        best, looks = (np.concatenate(x) for x in zip(*improved, strict=True))
        best = best[np.sort(np.argsort(-looks, kind="stable")[: settings.scored])]
    best = np.array([*best, *(_with_limb(model, here, other, limb) for other in others)])
    return _best_apart(model, limb, best, -judge.costs(best), settings.refined, _SAME_M)


def _best_apart(model: BodyModel, limb: Limb, poses: Array, scores: Array, n: int, apart_m: float) -> Array:
    """The best of many poses of a limb, no two of them near each other: one good place does not crowd out all others.

    Args:
        model: the body.
        limb: the one whose joints are compared.
        poses: (m, n_values); they differ in the limb alone, as far as it matters.
        scores: of each, (m,); more is better.
        n: how many are wanted.
        apart_m: least distance of the joint that is farthest from its place in the other pose, metres.
    """
    points = np.flatnonzero(np.isin(model.point_parts, limb.parts))
    Ts = chain_poses(model.tree, model.kinematics(poses[0]), limb.parts, poses)
    places = np.empty((len(poses), len(points), 3))
    _put(Ts, np.searchsorted(limb.parts, model.point_parts[points]), model.points_part[points], places)
    return poses[_apart(places, np.argsort(-scores), n, apart_m)]


def _distinct(model: BodyModel, found: Sequence[_Found], n: int, apart_m: float) -> list[_Found]:
    """The cheapest of several poses, no two of them nearer to each other than that, cheapest first."""
    if not found:
        return []
    places = np.array([model.points_world(x.fit.pose) for x in found])
    order = np.argsort([x.cost for x in found], kind="stable")
    return [found[i] for i in _apart(places, order, n, apart_m)]


@njit(nogil=True, cache=True)
def _apart(places: Array, order: IntArray, n: int, apart_m: float) -> IntArray:
    """The first few indices, in an order, of places (m, k, 3) that all differ by more than `apart_m` in some point."""
    kept = np.empty(min(n, len(order)), np.int64)
    n_kept = 0
    for i in order:
        if n_kept == len(kept):
            break
        alone = True
        for j in kept[:n_kept]:
            farthest = 0.0
            for k in range(places.shape[1]):
                x, y, z = places[i, k] - places[j, k]
                farthest = max(farthest, x * x + y * y + z * z)
            if farthest <= apart_m * apart_m:
                alone = False
                break
        if alone:
            kept[n_kept] = i
            n_kept += 1
    return kept[:n_kept]


@njit(nogil=True, cache=True)
def _put(Ts: Array, parts: IntArray, points: Array, places: Array) -> None:
    """Fill where points (k, 3) of parts, indices (k,), are in poses of these, (m, n, 4, 4), in the world, (m, k, 3)."""
    for m in range(places.shape[0]):
        for k in range(places.shape[1]):
            T, x, y, z = Ts[m, parts[k]], points[k, 0], points[k, 1], points[k, 2]
            for i in range(3):
                places[m, k, i] = T[i, 0] * x + T[i, 1] * y + T[i, 2] * z + T[i, 3]


def _with_limb(model: BodyModel, values: Array, other: Array, limb: Limb) -> Array:
    """A pose with the limb of another."""
    change = np.where(limb.dofs, model.difference(other, values), 0.0)
    return model.clip(model.retract(values, change))


def _proposals(model: BodyModel, limb: Limb, values: Array, settings: RecoverSettings) -> Array:
    """Poses with the limb elsewhere, (n, n_values): every other one nearby, the others anywhere."""
    dofs = np.flatnonzero(limb.dofs)
    even, normal = _even(settings.proposals, len(dofs))
    low, high = model.limits[dofs].T
    low, high = np.maximum(low, -np.pi), np.minimum(high, np.pi)
    now = model.difference(values, model.neutral())[dofs]
    near = normal * settings.reach_rad
    anywhere = low + even * (high - low) - now
    # Joints that people bend little stay near: a collarbone needs no search of its own.
    anywhere = np.where(np.isfinite(model.spreads[dofs]), near, anywhere)
    steps = np.where(np.arange(len(even))[:, None] % 2, near, anywhere)
    steps[1::4] *= 0.5
    return _moved(model, np.repeat(values[None], len(steps), axis=0), dofs, steps)


def _in_parts(work: Callable[..., T], *arrays: Array) -> list[T]:
    """What some work makes of parts of arrays of the same length, in order, one for each of the threads."""
    return list(helpers().map(work, *(np.array_split(a, N_HELPERS) for a in arrays)))


def _improved(
    model: BodyModel, dofs: IntArray, look: Callable[[Array], Array], poses: Array, *rounds: Array
) -> tuple[Array, Array]:
    """Poses, (n, n_values), after rounds of steps, (n, shakes, len(dofs)) each, of which each takes its best; how they
    look, (n,)."""
    looks = np.empty(0) if rounds else look(poses)
    for steps in rounds:
        (n, shakes), n_values = steps.shape[:2], poses.shape[1]
        moved = _moved(model, np.repeat(poses, shakes, axis=0), dofs, steps.reshape(n * shakes, len(dofs)))
        around = np.concatenate([poses[:, None], moved.reshape(n, shakes, n_values)], axis=1)
        of_each = look(around.reshape(n * (1 + shakes), n_values)).reshape(n, 1 + shakes)
        at = np.arange(n), of_each.argmax(axis=1)
        poses, looks = around[at], of_each[at]
    return poses, looks


def _moved(model: BodyModel, poses: Array, dofs: IntArray, steps: Array) -> Array:
    """Poses (n, n_values) after steps (n, len(dofs)) in some degrees of freedom, within the joint limits."""
    if all(model.joints[j].kind == "revolute" for j in model.dof_joint[dofs]):
        out, at = poses.copy(), model.dof_value[dofs]
        out[:, at] = np.clip(poses[:, at] + steps, *model.limits[dofs].T)
        return out
    changes = np.zeros((len(poses), model.n_dofs))
    changes[:, dofs] = steps
    return np.array([model.clip(model.retract(pose, change)) for pose, change in zip(poses, changes, strict=True)])


@lru_cache(maxsize=16)
def _even(n: int, dims: int) -> tuple[Array, Array]:
    """Points that fill the unit cube evenly, the same ones each time, (n, dims); the same normally distributed."""
    # Take a third of a second, which who searches nothing need not wait.
    from scipy.special import ndtri
    from scipy.stats import qmc

    even = np.asarray(qmc.Sobol(dims, seed=7).random(n))
    return even, np.asarray(ndtri(0.002 + 0.996 * even))
