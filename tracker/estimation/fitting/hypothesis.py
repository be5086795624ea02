"""A hypothesis of a person's pose, and when two of them are the same or equally likely.

Generators of starts, searches of limbs, exchanged sides, samples and both passes propose hypotheses. Their costs are
nats, so that differences are logarithms of odds. Hypotheses are compared only on common evidence.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.compute.jit import njit
from tracker.estimation.fitting.gauss_newton import Fit
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.same_place import INLIER_M

SAME_POSE_M = INLIER_M
"""Two poses are the same if no point of the body is farther apart, metres: the width of a limb. Contours nearer than
that overlap, so that refinement leads from one pose to the other. From nothing, with 0.10 and with 0.12, `fast_arms`
ended at 34.8 and 34.3 mm, and the simulated heavy man at 23.1 and 26.8 mm."""
SETTLED_M = 0.01
"""A pose has settled if no point of the body moves farther, metres: a third of the mean error of tracked joints."""
CLEAR_NATS = 3.0
"""Difference of the costs from which one hypothesis is clearly better, nats: it is then about 20 times more likely."""

BEAM_NATS = 40.0
"""Difference of the costs up to which a hypothesis is kept for a later comparison, nats: more than another limb, or
other frames, make up for. Starts that were 54 nats worse on one frame were 380 or more worse on seven."""
BEAM_WIDTH = 3
"""Most hypotheses that lead on to others: to those with another limb elsewhere, or on the neighbouring frame."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A pose that a person may have."""

    body: PosedBody
    source: str = ""
    """Name of the generator or search that proposed it."""
    cost: float = np.inf
    """Negative logarithm of its likelihood, nats, up to a constant of the evidence; infinite before it is known."""
    fit: Fit | None = None
    """The fit that refined it, of which `gauss_newton.covariance` is the covariance; None if it is a proposal."""
    is_measured: bool = True
    """Whether the height of the body was measured, or was known."""
    notes: tuple[str, ...] = ()
    """Sentences on what its source does not know."""

    @classmethod
    def refined(cls, model: BodyModel, fit: Fit, cost: float, source: str = "") -> "Hypothesis":
        """Return the hypothesis of a fit."""
        return cls(PosedBody(model, fit.pose), source, cost, fit)

    @property
    def model(self) -> BodyModel:
        """The body."""
        return self.body.model

    @property
    def pose(self) -> Array:
        """The pose, (n_values,)."""
        return self.body.values

    @property
    def forward(self) -> Array:
        """Unit direction in which the trunk faces, (3,)."""
        return np.asarray(self.body.kinematics.Ts_world_part[0, :3, 0])

    def faces_away_from(self, other: "Hypothesis") -> bool:
        """Return whether two hypotheses face opposite ways."""
        return bool(self.forward @ other.forward < 0)

    def at(self, pose: Array) -> "Hypothesis":
        """Return it in another pose, (n_values,), of unknown cost."""
        return replace(self, body=PosedBody(self.model, pose), cost=np.inf, fit=None)


def distance_m(one: PosedBody, other: PosedBody) -> float:
    """Return the largest distance between corresponding points of a body in two poses, metres."""
    if one is other:
        return 0.0
    return float(np.linalg.norm(one.points_world - other.points_world, axis=1).max())


def limbs_elsewhere(one: PosedBody, other: PosedBody, apart_m: float = SAME_POSE_M) -> tuple[str, ...]:
    """Return the names of the limbs of which a point is farther apart in two poses."""
    is_apart = np.linalg.norm(one.points_world - other.points_world, axis=1) > apart_m
    parts = set(one.model.point_parts[is_apart].tolist())
    return tuple(limb.name for limb in limbs(one.model) if not parts.isdisjoint(limb.parts.tolist()))


def distinct(found: Sequence[Hypothesis], n: int | None = None) -> list[Hypothesis]:
    """Return the n cheapest of some hypotheses, all by default, cheapest first, no two of them the same pose."""
    if not found:
        return []
    places = np.array([h.body.points_world for h in found])
    order = np.argsort([h.cost for h in found], kind="stable")
    return [found[i] for i in apart(places, order, len(found) if n is None else n, SAME_POSE_M)]


@njit(nogil=True, cache=True)
def apart(places: Array, order: IntArray, n: int, apart_m: float) -> IntArray:
    """Return the first n indices, in an order, of places (m, k, 3) of which each two differ by more than `apart_m`."""
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
