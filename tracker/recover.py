"""Lost limbs found again: proposals beside the pose, the best of them refined (DESIGN section 10)."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.stats import norm, qmc

from tracker.appearance import Colors, PartColors
from tracker.body import BodyModel
from tracker.confidence import Limb
from tracker.fit import Block, Fit, solve
from tracker.refine import ContourMatch
from tracker.rigid import Array


@dataclass(frozen=True)
class RecoverSettings:
    """How lost limbs are searched for."""

    proposals: int = 64
    """Poses of a limb that are scored; a power of two, so that they fill the space evenly."""
    reach_rad: float = float(np.radians(35))
    """Spread of the proposals around the pose, rad."""
    refined: int = 6
    """Proposals whose limb is refined alone."""
    finished: int = 2
    """Of these, how many go through a refinement of the whole body."""
    colors: float = 0.1
    """Weight of the colours against edges; neighbouring pixels say the same, so it is far below 1."""


@dataclass(frozen=True, eq=False)
class Judge:
    """Compares poses of one person on one frame: contours, colours and priors together."""

    match: ContourMatch
    priors: Sequence[Block]
    colors: Colors
    known: PartColors | None
    """Colours of the parts; None where nobody has shown them."""
    settings: RecoverSettings

    def cost(self, model: BodyModel, fit: Fit) -> float:
        """Cost of a refined pose with its colours."""
        return fit.cost + self._of_colors(fit.values)

    def costs(self, model: BodyModel, candidates: Sequence[Array]) -> Array:
        """Costs of poses without refinement, (n,); priors are left to the refinement."""
        found = self.match.costs(np.array(candidates))
        return found + np.array([self._of_colors(values) for values in candidates])

    def _of_colors(self, values: Array) -> float:
        if self.known is None:
            return 0.0
        return -self.settings.colors * self.colors.score(values, self.known).nats


def search_limb(model: BodyModel, limb: Limb, here: Fit, others: Sequence[Array], judge: Judge, iterations: int) -> Fit:
    """Search one limb around a pose and in other poses; returns what is cheapest, `here` where nothing is better.

    Args:
        model: the body.
        limb: the one that seems lost.
        here: the pose at hand.
        others: poses whose limb is tried as it is, e.g. that of the frame before, (n_values,) each.
        judge: compares poses.
        iterations: most steps of a refinement of the whole body.
    """
    settings, blocks = judge.settings, [judge.match, *judge.priors]
    candidates = [_with_limb(model, here.values, other, limb) for other in others]
    for step in _steps(settings.proposals, int(limb.dofs.sum())):
        change = np.zeros(model.n_dofs)
        change[limb.dofs] = step * settings.reach_rad
        candidates.append(model.clip(model.retract(here.values, change)))
    order = np.argsort(judge.costs(model, candidates))[: settings.refined]
    alone = [solve(model, candidates[i], blocks, limb.dofs, max_iterations=4, tolerance=1e-2) for i in order]
    alone.sort(key=lambda fit: judge.cost(model, fit))
    best, best_cost = here, judge.cost(model, here)
    for start in alone[: settings.finished]:
        fit = solve(model, start.values, blocks, max_iterations=iterations, tolerance=1e-3)
        cost = judge.cost(model, fit)
        if cost < best_cost:
            best, best_cost = fit, cost
    return best


def _with_limb(model: BodyModel, values: Array, other: Array, limb: Limb) -> Array:
    """A pose with the limb of another."""
    change = np.where(limb.dofs, model.difference(other, values), 0.0)
    return model.clip(model.retract(values, change))


@lru_cache(maxsize=16)
def _steps(n: int, dims: int) -> Array:
    """Normally distributed steps that fill the space evenly, the same ones each time, (n, dims); half of them short."""
    even = norm.ppf(qmc.Sobol(dims, seed=7).random(n) * 0.998 + 0.001)
    even[::2] *= 0.5
    return np.asarray(even)
