"""Hypotheses of a person's pose on each frame of a run, and the likeliest path through them.

A path costs the nats of its hypotheses, and those of its accelerations (`motion_model`). Its state is the pair of
hypotheses of two frames, since three frames show an acceleration. The cheapest path is found by dynamic programming
(A. Viterbi 1967, IEEE Trans. Inf. Theory 13:260). The same recursion with sums in place of minima gives the mass of all
paths through a hypothesis (L. R. Rabiner 1989, Proc. IEEE 77:257, Eq. 19-27).
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from tracker.estimation.fitting.hypothesis import apart
from tracker.estimation.trajectory.motion_model import LEARNING_ROUNDS, Group, MotionModel
from tracker.geometry.arrays import Array, IntArray

DISTINCT_M = 0.05
"""Hypotheses are distinct if a point of the body is farther apart, metres: half of `SAME_POSE_M`, since poses that
refinement on one frame would join have different accelerations."""


class HypothesisSet(NamedTuple):
    """Hypotheses of a person's pose on one frame."""

    poses: Array
    """(K, n_values)."""
    places: Array
    """Points that show the motion, (K, P, 3), metres, world; see `motion_model.motion_points`."""
    view_nats: Array
    """Cost by the evidence of each view, (K, V)."""
    prior_nats: Array
    """Cost by what holds on every frame, (K,)."""
    sources: tuple[str, ...]
    """Name of what proposed each, (K,)."""

    def costs(self, without: int | None = None) -> Array:
        """Return the cost of each hypothesis, (K,), nats; without a view if one is given."""
        used = np.arange(self.view_nats.shape[1]) != (-1 if without is None else without)
        return np.asarray(self.view_nats[:, used].sum(axis=1) + self.prior_nats)

    def joined(self, other: "HypothesisSet") -> "HypothesisSet":
        """Return the distinct ones of both, the cheapest of those that are alike."""
        both = HypothesisSet(
            np.concatenate([self.poses, other.poses]), np.concatenate([self.places, other.places]),
            np.concatenate([self.view_nats, other.view_nats]), np.concatenate([self.prior_nats, other.prior_nats]),
            (*self.sources, *other.sources),
        )  # fmt: skip
        order = np.argsort(both.costs(), kind="stable")
        return both.only(apart(both.places, order, len(order), DISTINCT_M))

    def only(self, at: IntArray) -> "HypothesisSet":
        """Return those of some indices, in their order."""
        sources = tuple(self.sources[i] for i in at)
        return HypothesisSet(self.poses[at], self.places[at], self.view_nats[at], self.prior_nats[at], sources)


def motion_nats(motion: MotionModel, coefficients: Array, places: Sequence[Array]) -> Array:
    """Return the cost of the accelerations of all triples of hypotheses of three frames, (Ka, Kb, Kc), nats.

    Args:
        motion: how the points move.
        coefficients: of the three frames, (3,); see `motion_model.acceleration`.
        places: of the points in the hypotheses of each frame, (K, P, 3) each, metres.
    """
    origin = places[1][:1]  # near the points: inner products lose no digits
    moved = [c * (x - origin) for c, x in zip(coefficients, places, strict=True)]
    sums = np.stack([_squares(moved, group) for group in motion.groups], axis=-1)
    return motion.nats_of_sums(sums / motion.scales_m2)


def _squares(terms: Sequence[Array], group: Group) -> Array:
    """Return the squared lengths of the sums of three vectors, one of each, over the points of a group: (Ka, Kb, Kc).

    The coefficients of an acceleration sum to 0, so that a common origin leaves it as it is.
    """
    a, b, c = (x[:, group.points].reshape(len(x), -1) for x in terms)
    lengths = [np.einsum("ki,ki->k", x, x) for x in (a, b, c)]
    ab, ac, bc = 2 * a @ b.T, 2 * a @ c.T, 2 * b @ c.T
    sums = (lengths[0][:, None] + lengths[1] + ab)[:, :, None] + lengths[2] + ac[:, None] + bc
    return np.asarray(np.maximum(sums, 0.0))


def path_marginals(
    costs: Sequence[Array], motion: Sequence[Array], reduced: Callable[[Array, int], Array]
) -> list[Array]:
    """Return the reduced cost of all paths through each hypothesis, (K,) for each frame, nats.

    Args:
        costs: of the hypotheses of each frame, (K,) each.
        motion: cost of each triple of successive frames, (Ka, Kb, Kc) each; see `motion_nats`.
        reduced: reduces costs along an axis: `cheapest` or `reduce_log_sum`.
    """
    if len(costs) < 3:
        return list(costs)
    ahead = [costs[0][:, None] + costs[1]]
    for own, step in zip(costs[2:], motion, strict=True):
        ahead.append(reduced(ahead[-1][:, :, None] + step, 0) + own)
    back = [np.zeros_like(ahead[-1])]
    for own, step in zip(reversed(costs[2:]), reversed(motion), strict=True):
        back.append(reduced(step + (back[-1] + own), 2))
    pairs = [a + b for a, b in zip(ahead, reversed(back), strict=True)]
    return [reduced(pairs[0], 1), *(reduced(pair, 0) for pair in pairs)]


def reduce_min(costs: Array, axis: int) -> Array:
    """Return the least cost along an axis."""
    return np.asarray(costs.min(axis=axis))


def reduce_log_sum(costs: Array, axis: int) -> Array:
    """Return the negative logarithm of the sum of likelihoods along an axis."""
    least = costs.min(axis=axis, keepdims=True)
    return np.asarray(np.squeeze(least, axis) - np.log(np.exp(least - costs).sum(axis=axis)))


class Paths:
    """The paths through the hypotheses of successive frames, and how the points move along the likeliest one."""

    def __init__(self, coefficients: Array, groups: tuple[Group, ...]) -> None:
        """Begin without frames.

        Args:
            coefficients: of the accelerations, (T - 2, 3); see `motion_model.acceleration`.
            groups: of the points.
        """
        self.coefficients, self.groups = coefficients, groups
        self.motion: MotionModel | None = None

    def motion_nats(self, sets: Sequence[HypothesisSet]) -> list[Array]:
        """Return the cost of all triples of successive frames; see `motion_nats`."""
        places = [[s.places for s in sets[t : t + 3]] for t in range(len(self.coefficients))]
        if self.motion is None:
            return [np.zeros([len(x) for x in three]) for three in places]
        return [motion_nats(self.motion, c, three) for c, three in zip(self.coefficients, places, strict=True)]

    def likeliest(self, sets: Sequence[HypothesisSet]) -> tuple[IntArray, list[Array]]:
        """Return the hypothesis of each frame on the likeliest path, (T,), and the cost of the cheapest path through
        each hypothesis, (K,) each. The motion is learnt from the path, until the path stays."""
        path, found = np.full(len(sets), -1), list[Array]()
        for _ in range(LEARNING_ROUNDS):
            found = path_marginals([s.costs() for s in sets], self.motion_nats(sets), reduce_min)
            before, path = path, np.array([int(f.argmin()) for f in found])
            if np.array_equal(path, before):
                break
            self.motion = self._learned([s.places[i] for s, i in zip(sets, path, strict=True)])
        return path, found

    def _learned(self, places: Sequence[Array]) -> MotionModel | None:
        if not len(self.coefficients):
            return None
        x, c = np.array(places), self.coefficients[..., None, None]
        squares = np.sum(np.square(c[:, 0] * x[:-2] + c[:, 1] * x[1:-1] + c[:, 2] * x[2:]), axis=-1)
        motion = None
        for _ in range(LEARNING_ROUNDS):
            motion = MotionModel.learned(self.groups, squares, motion)
        return motion
