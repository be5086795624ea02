"""Find a limb again that its filter has lost: poses of the limb are ranked by the voxels that they explain.

The paper expects that "combining the predicted model configuration with an approach similar to the initialization
process may lead to a more robust tracking performance" (MTHC01 Sect. 5). Voxels label a limb only near its
prediction. A limb that moved farther leaves voxels behind that no part explains.
"""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.tracking.voxel.figure import LIMBS, TORSO
from tracker.tracking.voxel.frame_voxels import occupied_at
from tracker.tracking.voxel.limb_kernels import count_explained
from tracker.tracking.voxel.state import FilterState
from tracker.voxels.voxel_grid import Voxels

_N_PROPOSALS, _N_KEPT, _N_PERTURBED = 384, 6, 24
"""Poses that are ranked first, poses that are improved, and perturbations of each in a round."""
_NEAR_RAD, _ROUNDS_RAD = 0.6, (0.25, 0.12, 0.06)
"""Spread of the half of the poses that lie near the prediction, and of the perturbations of each round, rad."""
_MAX_BEND_RAD = 2.6
"""Largest bend of an elbow or knee, rad."""
_MAX_LEG_RAD = 2.2
"""Largest angle of a thigh from the trunk's axis, rad."""
_PLACES = np.linspace(0.1, 1.0, 8)
"""Places along a segment that must lie in voxels."""
_OUTSIDE = 3.0
"""Weight of the share of a limb outside of the voxels, against the share of voxels that it leaves unexplained."""
_SKIN = 1.2
"""Factor by which other parts are wider than their sizes: a visual hull is."""
_PRIOR, _PRIOR_RAD = 0.02, 0.5
"""Weight of the squared angle from the prediction, in this unit, rad."""


SUSPICIOUS, MIN_GAIN, MIN_FREE = 0.4, 0.2, 12
"""Cost above which a limb is searched, least gain of a place that is taken, and fewest voxels to search in."""


class LimbFit(NamedTuple):
    """How well a limb explains the voxels around it."""

    unexplained: float
    """Share of the voxels in its reach that no part explains, 0 to 1."""
    outside: float
    """Share of its axis outside of the voxels, 0 to 1."""
    n_free: int
    """Number of voxels in its reach that other parts leave."""

    @property
    def cost(self) -> float:
        """Lower is better."""
        return self.unexplained + _OUTSIDE * self.outside


class LimbProblem:
    """The voxels that other parts leave to one limb, and the cost of its poses."""

    def __init__(self, state: FilterState, limb: str, voxels: Voxels, is_free: NDArray[np.bool_]) -> None:
        """Prepare the search.

        Args:
            state: the figure.
            limb: one of `LIMBS`.
            voxels: of the frame.
            is_free: voxels that no other part explains, (N,).
        """
        self.state, self.parts, self._voxels = state, LIMBS[limb], voxels
        self._is_leg = limb.endswith("leg")
        upper, lower = self.parts
        self.root = state.centers[upper] + state.rotations[upper] @ (
            state.figure.own_shares[upper] * state.sizes[upper]
        )
        lengths = 2 * state.sizes[list(self.parts), 2]
        self._lengths = lengths
        size_m = voxels.grid.size_m
        self._reaches = state.sizes[list(self.parts), :2].max(axis=1) + size_m
        points = voxels.points_world[is_free]
        near = np.linalg.norm(points - self.root, axis=1) < lengths.sum() + size_m
        self._points = np.ascontiguousarray(points[near])
        self._directions = -state.rotations[list(self.parts), :, 2]

    def fit(self) -> LimbFit:
        """Return how well the limb fits where it is."""
        unexplained, outside = self._terms(self._directions[None])
        return LimbFit(float(unexplained[0]), float(outside[0]), len(self._points))

    def search(self) -> tuple[Array, LimbFit]:
        """Return the directions of both parts, (2, 3), that cost least, and their fit."""
        near_turns, anywhere = _proposals()
        near = _turned(self._directions, _NEAR_RAD * near_turns)
        poses = self._allowed(np.concatenate([self._directions[None], near, anywhere]))
        costs = self._costs(poses)
        for k, spread in enumerate(_ROUNDS_RAD):
            best = np.argsort(costs)[:_N_KEPT]
            steps = spread * _perturbations(k)
            tried = self._allowed(np.concatenate([poses[best], *(_turned(poses[b], steps) for b in best)]))
            poses, costs = tried, self._costs(tried)
        found = poses[int(costs.argmin())]
        unexplained, outside = self._terms(found[None])
        return found, LimbFit(float(unexplained[0]), float(outside[0]), len(self._points))

    def _costs(self, poses: Array) -> Array:
        unexplained, outside = self._terms(poses)
        cosines = np.clip(np.einsum("kpi,pi->kp", poses, self._directions), -1, 1)
        prior = _PRIOR * np.sum((np.arccos(cosines) / _PRIOR_RAD) ** 2, axis=1)
        return np.asarray(unexplained + _OUTSIDE * outside + prior)

    def _terms(self, poses: Array) -> tuple[Array, Array]:
        """Return the shares of unexplained voxels and of the axis outside of the voxels, (K,) each."""
        upper, lower = poses[:, 0] * self._lengths[0], poses[:, 1] * self._lengths[1]
        counts = np.zeros(len(poses))
        count_explained(self._points, self.root, upper, lower, self._reaches, counts)
        along = [
            self.root + _PLACES[:, None] * upper[:, None],
            (self.root + upper)[:, None] + _PLACES[:, None] * lower[:, None],
        ]
        outside = 1.0 - occupied_at(self._voxels, np.concatenate(along, axis=1)).mean(axis=1)
        return 1.0 - counts / max(1, len(self._points)), outside

    def _allowed(self, poses: Array) -> Array:
        """Return the poses that a joint allows, the first one included."""
        bend = np.arccos(np.clip(np.sum(poses[:, 0] * poses[:, 1], axis=1), -1, 1))
        allowed = bend <= _MAX_BEND_RAD
        if self._is_leg:
            R = self.state.rotations[TORSO]
            allowed &= -poses[:, 0] @ R[:, 2] >= np.cos(_MAX_LEG_RAD)
            # A knee bends the calf backwards, seen from a thigh that swings about the trunk's side axis.
            forward = np.cross(R[:, 1], poses[:, 0])
            allowed &= np.einsum("ki,ki->k", poses[:, 1], -forward) <= 0.15
        allowed[0] = True
        return poses[allowed]


def explained_by_others(
    points: Array, states: Sequence[FilterState], person: int, limb: tuple[int, int], size_m: float
) -> NDArray[np.bool_]:
    """Return which voxels, (N, 3), lie in parts other than those of one limb, (N,)."""
    found = np.zeros(len(points), dtype=bool)
    for p, state in enumerate(states):
        local = np.einsum("mji,nmj->nmi", state.rotations, points[:, None] - state.centers)
        inside = np.abs(local[..., 2]) <= state.sizes[:, 2] + size_m
        inside &= np.sum((local[..., :2] / (_SKIN * state.sizes[:, :2] + size_m)) ** 2, axis=2) <= 1.0
        if p == person:
            inside[:, list(limb)] = False
        found |= inside.any(axis=1)
    return found


def with_limb(state: FilterState, limb: str, directions: Array, turn_sigma: float, rate_sigma: float) -> FilterState:
    """Return a state in which a limb points elsewhere, with little known of it.

    Args:
        state: the state.
        limb: one of `LIMBS`.
        directions: unit vectors from the root along both parts, (2, 3).
        turn_sigma: standard deviation of its rotations, rad.
        rate_sigma: standard deviation of its angular velocities, rad/s.
    """
    at, step = state.layout, np.zeros(state.layout.n)
    P = state.covariance.copy()
    for part, direction in zip(LIMBS[limb], directions, strict=True):
        own = state.rotations[part].T @ -direction  # to which the z axis turns, in the part's frame
        turn = np.cross((0.0, 0.0, 1.0), own)
        sine, cosine = float(np.linalg.norm(turn)), float(own[2])
        turn = turn / sine if sine > 1e-9 else np.array([1.0, 0.0, 0.0])
        step[3 * part : 3 * part + 3] = np.arctan2(sine, cosine) * turn
        _forget(P, slice(3 * part, 3 * part + 3), turn_sigma)
        if at.turn_rates:
            rates = slice(at.turn_rates_at.start + 3 * part, at.turn_rates_at.start + 3 * part + 3)
            step[rates] = -state.turn_rates[part]
            _forget(P, rates, rate_sigma)
    return state.retract(step).with_covariance(P)


def _forget(P: Array, own: slice, sigma: float) -> None:
    """Make part of a state independent of the rest, with a standard deviation."""
    P[own, :], P[:, own] = 0.0, 0.0
    P[own, own] = np.eye(own.stop - own.start) * sigma**2


def _turned(directions: Array, turns: Array) -> Array:
    """Return directions, (2, 3), turned by rotation vectors, (K, 2, 3), rad, (K, 2, 3)."""
    return np.einsum("kpij,pj->kpi", rigid.so3_exp(turns), directions)


@cache
def _proposals() -> tuple[Array, Array]:
    """Return rotation vectors of unit spread, and directions all around, (n, 2, 3) each; the same in every run."""
    rng = np.random.default_rng(0)
    around = rng.normal(size=(_N_PROPOSALS // 2, 2, 3))
    return rng.normal(size=(_N_PROPOSALS // 2, 2, 3)), around / np.linalg.norm(around, axis=2, keepdims=True)


@cache
def _perturbations(k: int) -> Array:
    return np.random.default_rng(1 + k).normal(size=(_N_PERTURBED, 2, 3))
