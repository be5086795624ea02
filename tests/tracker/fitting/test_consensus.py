"""The consensus of several estimates of a pose."""

from itertools import permutations

import numpy as np
import pytest

from tracker.body.limbs import limbs
from tracker.fitting.consensus import consensus, weighted_median


def test_the_weighted_median_is_that_of_repeated_values():
    rng = np.random.default_rng(1)
    for n in (2, 3, 5, 6):
        values = rng.normal(size=(n, 4, 3))
        np.testing.assert_allclose(weighted_median(values, np.ones_like(values)), np.median(values, axis=0))
        counts = rng.integers(1, 4, n)
        weights = np.broadcast_to(counts[:, None, None], values.shape)
        repeated = np.repeat(values, counts, axis=0)
        np.testing.assert_allclose(weighted_median(values, weights), np.median(repeated, axis=0))


def test_values_without_weight_do_not_count_unless_none_has_any():
    values = np.array([1.0, 5.0, 100.0])
    for order in permutations(range(3)):
        own = values[list(order)]
        assert weighted_median(own, np.where(own > 50, 0.0, 1.0)) == 3.0
        assert weighted_median(own, np.zeros(3)) == 5.0


@pytest.fixture
def estimates(gavrila):
    """A pose with an arm off by a turn of 0.5 rad at the shoulder, and four estimates without that."""
    true, name = gavrila.neutral(), "left_forearm"
    limb = next(x for x in limbs(gavrila) if x.name == name)
    step = np.zeros(gavrila.n_dofs)
    step[np.flatnonzero(limb.dofs)[0]] = 0.5
    rng = np.random.default_rng(2)
    others = np.array([gavrila.retract(true, 0.01 * rng.normal(size=gavrila.n_dofs)) for _ in range(4)])
    return gavrila.retract(true, step), others, true


def off_m(model, pose, true):
    return np.linalg.norm(model.points_world(pose) - model.points_world(true), axis=1).max()


def test_an_estimate_is_outvoted(gavrila, estimates):
    pose, others, true = estimates
    trust = np.ones((5, len(limbs(gavrila))))
    found = consensus(gavrila, pose, others, trust)
    assert off_m(gavrila, pose, true) > 0.2
    assert off_m(gavrila, found.pose, true) < 0.05
    assert found.spread_m.max() < 0.05
    # A single estimate that is far off does not say that the consensus is: it lacks the data.
    far = others.copy()
    far[0] = pose
    assert consensus(gavrila, true, far, trust).spread_m.max() < 0.05


def test_estimates_that_lie_apart_have_a_large_spread(gavrila, estimates):
    pose, others, true = estimates
    trust = np.ones((5, len(limbs(gavrila))))
    far = others.copy()
    far[:2] = pose
    found = consensus(gavrila, true, far, trust)
    arm = np.isin(gavrila.point_parts, next(x for x in limbs(gavrila) if x.name == "left_forearm").parts)
    assert found.spread_m[arm].max() > 0.05
    assert found.spread_m[~arm].max() < 0.05
    sigmas = np.sqrt(np.trace(found.covariances, axis1=1, axis2=2))
    assert np.all(sigmas <= found.spread_m + 1e-9)


def test_estimates_that_lost_a_limb_do_not_count_there(gavrila, estimates):
    pose, others, true = estimates
    far = others.copy()
    far[:3] = pose
    trust = np.ones((5, len(limbs(gavrila))))
    assert off_m(gavrila, consensus(gavrila, pose, far, trust).pose, true) > 0.2
    trust[:4, [x.name for x in limbs(gavrila)].index("left_forearm")] = 0.0
    assert off_m(gavrila, consensus(gavrila, pose, far, trust).pose, true) < 0.05


def test_locked_degrees_of_freedom_stay(gavrila, estimates):
    pose, others, _ = estimates
    active = np.zeros(gavrila.n_dofs, dtype=bool)
    active[:3] = True
    found = consensus(gavrila, pose, others, np.ones((5, len(limbs(gavrila)))), active).pose
    np.testing.assert_array_equal(found[6:], pose[6:])
