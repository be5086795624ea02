"""The consensus of several estimates of a pose, and how far they lie apart.

The median of each point of the body withstands estimates that are far off, as long as they are fewer than half.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.fitting.gauss_newton import OTHER_BODY_M, PointTargets, solve, weak_pull
from tracker.geometry.arrays import Array


class Consensus(NamedTuple):
    """The consensus of several estimates of a pose."""

    pose: Array
    """(n_values,)."""
    distances_m: Array
    """Distance of each point of the body in the other estimates from the consensus, (n, n_points), metres."""
    spread_m: Array
    """Their weighted median, (n_points,), metres."""
    covariances: Array
    """Mean square of the steps from the consensus to the other estimates, of each point, (n_points, 3, 3), m^2."""


def consensus(
    model: BodyModel, pose: Array, others: Array, trust: Array, active: NDArray[np.bool_] | None = None
) -> Consensus:
    """Return the consensus of a pose and of estimates that each lack a part of the data.

    Args:
        model: the body.
        pose: estimate by all data, (n_values,).
        others: estimates without a part of the data each, (n, n_values).
        trust: weight of each limb of the estimates, the first by all data, (n + 1, n_limbs), at least 0.
        active: degrees of freedom that may move, (n_dofs,); None: all.
    """
    points = np.array([model.points_world(p) for p in (pose, *others)])
    weights = _of_points(model, trust)
    median = weighted_median(points, np.broadcast_to(weights[..., None], points.shape))
    targets = PointTargets(np.arange(len(median)), median, np.full(len(median), 1 / OTHER_BODY_M))
    found = solve(model, pose, [targets, weak_pull(model, pose)], active).pose
    return _agreement(model, found, points[1:], weights[1:])


def agreement(model: BodyModel, pose: Array, others: Array, trust: Array) -> Consensus:
    """Return how far estimates that each lack a part of the data lie from a pose that stays.

    Args:
        model: the body.
        pose: the pose, (n_values,).
        others: the estimates, (n, n_values).
        trust: weight of each of their limbs, (n, n_limbs), at least 0.
    """
    return _agreement(model, pose, np.array([model.points_world(p) for p in others]), _of_points(model, trust))


def _agreement(model: BodyModel, pose: Array, points: Array, weights: Array) -> Consensus:
    steps = points - model.points_world(pose)
    lengths = np.linalg.norm(steps, axis=-1)
    spread = weighted_median(lengths, weights)
    # A single estimate that is far off counts as the median one: it lacks the data that hold the others together.
    steps = steps * np.minimum(1.0, spread / np.maximum(lengths, 1e-9))[..., None]
    return Consensus(pose, lengths, spread, np.einsum("tpi,tpj->pij", steps, steps) / len(points))


def _of_points(model: BodyModel, trust: Array) -> Array:
    """Return the weight of each point, (n, n_points), by that of its limb; the trunk has that of the best one."""
    out = np.repeat(trust.max(axis=1, keepdims=True), len(model.point_names), axis=1)
    for weights, limb in zip(trust.T, limbs(model), strict=True):
        out[:, np.isin(model.point_parts, limb.parts)] = weights[:, None]
    return out


def weighted_median(values: Array, weights: Array) -> Array:
    """Return the weighted median along the first axis; the mean of the two in the middle where both qualify.

    Args:
        values: (n, ...).
        weights: at least 0, of the same shape. If all are 0, they count alike.
    """
    weights = np.where(weights.sum(axis=0) > 0, weights, 1.0)
    order = np.argsort(values, axis=0)
    values, weights = (np.take_along_axis(x, order, axis=0) for x in (values, weights))
    below = np.cumsum(weights, axis=0) / weights.sum(axis=0)
    low, high = ((below < bound).sum(axis=0)[None] for bound in (0.5 - 1e-9, 0.5 + 1e-9))
    middle = [np.take_along_axis(values, np.minimum(at, len(values) - 1), axis=0)[0] for at in (low, high)]
    return np.asarray(0.5 * (middle[0] + middle[1]))
