"""Lost limbs found again: a limb is tried everywhere it can be, the best places refined (DESIGN section 10).

A thousand poses of the limb are ranked by a quick look along its axis: the colours under it, and edges at both its
sides. The first few go through the costs that all poses go through, then through refinement, and the cheapest stays.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np
from scipy.stats import norm, qmc

from tracker.appearance import Colors, PartColors
from tracker.body import BodyModel
from tracker.confidence import Limb
from tracker.fit import Block, Fit, solve
from tracker.kinematics import IntArray
from tracker.refine import ContourMatch
from tracker.rigid import Array

_LEAST_GAIN = 0.1
"""What a pose must cost less to count as another one: to refine the same pose once more gains a little too."""


@dataclass(frozen=True)
class RecoverSettings:
    """How lost limbs are searched for."""

    proposals: int = 2048
    """Poses of a limb that are looked at; a power of two, so that they fill the space evenly."""
    reach_rad: float = float(np.radians(35))
    """Spread of those proposals that lie around the pose, rad; half of them lie anywhere within the joint limits."""
    rounds: tuple[tuple[int, float], ...] = ((64, float(np.radians(18))), (32, float(np.radians(8))))
    """Of how many of the best proposals the surroundings are looked at, and how far around, rad; round by round."""
    shakes: int = 16
    """Poses around each of these; a power of two."""
    scored: int = 24
    """Proposals whose contours are scored."""
    refined: int = 6
    """Proposals whose limb is refined alone."""
    finished: int = 2
    """Of these, how many go through a refinement of the whole body."""
    colors: float = 0.1
    """Weight of the colours against edges; neighbouring pixels say the same, so it is far below 1."""
    trust_rad: float = 1.0
    """Standard deviation of the prediction of a limb that seems lost, rad: nearly none."""


@dataclass(frozen=True, eq=False)
class Judge:
    """Compares poses of one person on one frame: contours, colours and priors together."""

    match: ContourMatch
    priors: Sequence[Block]
    colors: Colors
    known: PartColors | None
    """Colours of the parts; None where nobody has shown them."""
    settings: RecoverSettings

    def cost(self, fit: Fit) -> float:
        """Cost of a refined pose with its colours."""
        return fit.cost + self._of_colors(fit.values)

    def costs(self, candidates: Sequence[Array]) -> Array:
        """Costs of poses without refinement, (n,); priors are left to the refinement."""
        return self.match.costs(np.array(candidates)) + np.array([self._of_colors(v) for v in candidates])

    def _of_colors(self, values: Array) -> float:
        if self.known is None:
            return 0.0
        return -self.settings.colors * self.colors.score(values, self.known).nats


def search_limb(model: BodyModel, limb: Limb, here: Fit, others: Sequence[Array], judge: Judge, iterations: int) -> Fit:
    """Search one limb; returns what is cheapest, `here` itself where nothing is better.

    Args:
        model: the body.
        limb: the one that seems lost.
        here: the pose at hand.
        others: poses whose limb is tried as it is, e.g. that of the frame before, (n_values,) each.
        judge: compares poses.
        iterations: most steps of a refinement of the whole body.
    """
    settings, blocks = judge.settings, [judge.match, *judge.priors]
    look = partial(judge.colors.along_limb, limb=limb.parts, known=judge.known)
    proposals = _proposals(model, limb, here.values, settings)
    for promising, spread_rad in settings.rounds:
        best_of = proposals[np.argsort(-look(proposals))[:promising]]
        proposals = np.concatenate([best_of, _shaken(model, limb, best_of, settings.shakes, spread_rad)])
    candidates = [_with_limb(model, here.values, other, limb) for other in others]
    candidates += list(proposals[np.argsort(-look(proposals))[: settings.scored]])
    order = np.argsort(judge.costs(candidates))[: settings.refined]
    alone = [solve(model, candidates[i], blocks, limb.dofs, max_iterations=4, tolerance=1e-2) for i in order]
    alone.sort(key=judge.cost)
    best, best_cost = here, judge.cost(here) - _LEAST_GAIN
    for start in alone[: settings.finished]:
        fit = solve(model, start.values, blocks, max_iterations=iterations, tolerance=1e-3)
        cost = judge.cost(fit)
        if cost < best_cost:
            best, best_cost = fit, cost
    return best


def _with_limb(model: BodyModel, values: Array, other: Array, limb: Limb) -> Array:
    """A pose with the limb of another."""
    change = np.where(limb.dofs, model.difference(other, values), 0.0)
    return model.clip(model.retract(values, change))


def _proposals(model: BodyModel, limb: Limb, values: Array, settings: RecoverSettings) -> Array:
    """Poses with the limb elsewhere, (n, n_values): every other one nearby, the others anywhere."""
    dofs = np.flatnonzero(limb.dofs)
    even = _even(settings.proposals, len(dofs))
    low, high = model.limits[dofs].T
    low, high = np.maximum(low, -np.pi), np.minimum(high, np.pi)
    now = model.difference(values, model.neutral())[dofs]
    near = norm.ppf(0.002 + 0.996 * even) * settings.reach_rad
    anywhere = low + even * (high - low) - now
    # Joints that people bend little stay near: a collarbone needs no search of its own.
    anywhere = np.where(np.isfinite(model.spreads[dofs]), near, anywhere)
    steps = np.where(np.arange(len(even))[:, None] % 2, near, anywhere)
    steps[1::4] *= 0.5
    return _moved(model, np.repeat(values[None], len(steps), axis=0), dofs, steps)


def _shaken(model: BodyModel, limb: Limb, poses: Array, shakes: int, spread_rad: float) -> Array:
    """Poses with the limb around where it is in each of some, (n, n_values): the best of many is still far off."""
    dofs = np.flatnonzero(limb.dofs)
    steps = norm.ppf(0.002 + 0.996 * _even(shakes * len(poses), len(dofs))) * spread_rad
    return _moved(model, np.repeat(poses, shakes, axis=0), dofs, steps)


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
def _even(n: int, dims: int) -> Array:
    """Points that fill the unit cube evenly, the same ones each time, (n, dims)."""
    return np.asarray(qmc.Sobol(dims, seed=7).random(n))
