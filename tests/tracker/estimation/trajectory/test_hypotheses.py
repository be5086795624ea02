"""The likeliest path through hypotheses, and the mass of all paths, against sums over every path."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.estimation.trajectory.hypotheses import (
    DISTINCT_M,
    HypothesisSet,
    Paths,
    motion_nats,
    path_marginals,
    reduce_log_sum,
    reduce_min,
)
from tracker.estimation.trajectory.motion_model import Group, MotionModel, acceleration

N_POINTS = 5
GROUPS = (
    Group(np.array([True, True, False, False, False]), 3.0),
    Group(np.array([False, False, True, True, True]), 4.0),
)
SIZES = st.lists(st.integers(1, 3), min_size=1, max_size=6)


def sets_of(sizes, seed, spread_m=0.3):
    rng = np.random.default_rng(seed)
    return [
        HypothesisSet(
            rng.normal(size=(k, 4)), rng.normal(0, spread_m, (k, N_POINTS, 3)) + 5.0, rng.normal(0, 2, (k, 3)),
            rng.normal(0, 2, k), tuple(f"{t}.{i}" for i in range(k)),
        )
        for t, k in enumerate(sizes)
    ]  # fmt: skip


def nats_of(path, sets, motion, coefficients):
    """The cost of one path, written plainly."""
    places = np.array([s.places[i] for s, i in zip(sets, path, strict=True)])
    own = sum(s.view_nats[i].sum() + s.prior_nats[i] for s, i in zip(sets, path, strict=True))
    steps = [c[0] * places[t] + c[1] * places[t + 1] + c[2] * places[t + 2] for t, c in enumerate(coefficients)]
    return own + (motion.nats(np.sum(np.square(steps), axis=-1)) if steps else 0.0)


def every_path(sets, motion, coefficients):
    return {path: nats_of(path, sets, motion, coefficients) for path in product(*(range(len(s.sources)) for s in sets))}


@pytest.mark.parametrize("freedom", [4.0, np.inf])
@settings(deadline=None, max_examples=10)
@given(sizes=SIZES, seed=st.integers(0, 1000))
def test_paths_cost_what_all_of_them_cost_one_by_one(freedom, sizes, seed):
    sets = sets_of(sizes, seed)
    rng = np.random.default_rng(seed)
    coefficients = acceleration(np.cumsum(rng.uniform(0.5, 2.0, len(sizes))))
    motion = MotionModel(GROUPS, np.array([0.02, 0.1]), freedom)
    nats = [motion_nats(motion, c, [s.places for s in sets[t : t + 3]]) for t, c in enumerate(coefficients)]
    known = every_path(sets, motion if len(coefficients) else None, coefficients)
    costs = [s.costs() for s in sets]
    if len(sizes) < 3:  # nothing shows their motion: each frame is on its own
        for reduced in (reduce_min, reduce_log_sum):
            for found, own in zip(path_marginals(costs, nats, reduced), costs, strict=True):
                np.testing.assert_array_equal(found, own)
        return
    least, together = path_marginals(costs, nats, reduce_min), path_marginals(costs, nats, reduce_log_sum)
    for t, size in enumerate(sizes):
        for i in range(size):
            own = np.array([cost for path, cost in known.items() if path[t] == i])
            assert least[t][i] == pytest.approx(own.min(), abs=1e-6)
            mass = -np.log(np.exp(own.min() - own).sum()) + own.min()
            assert together[t][i] == pytest.approx(mass, abs=1e-6)


def test_motion_costs_what_the_motion_model_says_of_each_triple():
    sets, coefficients = sets_of([2, 3, 4], 1), np.array([1.2, -2.2, 1.0])
    motion = MotionModel(GROUPS, np.array([0.02, 0.1]))
    found = motion_nats(motion, coefficients, [s.places for s in sets])
    assert found.shape == (2, 3, 4)
    for a, b, c in product(range(2), range(3), range(4)):
        places = sets[0].places[a], sets[1].places[b], sets[2].places[c]
        steps = sum(x * y for x, y in zip(coefficients, places, strict=True))
        expected = motion.nats(np.sum(np.square(steps), axis=-1)[None])
        assert found[a, b, c] == pytest.approx(expected, rel=1e-6)


def test_far_from_the_origin_a_path_without_acceleration_still_costs_nothing():
    """Squares of coordinates lose what differences keep."""
    places = [np.full((1, N_POINTS, 3), 1000.0 + 0.01 * t) for t in range(3)]
    motion = MotionModel(GROUPS, np.full(2, 1e-9))
    assert motion_nats(motion, np.array([1.0, -2.0, 1.0]), places)[0, 0, 0] < 0.01


def walk(n, seed=0):
    """Hypotheses of an even walk: the true one costs most on its frame, and two others leap."""
    rng, sets = np.random.default_rng(seed), []
    for t in range(n):
        true = np.full((N_POINTS, 3), 0.02 * t)
        places = np.stack([true, true + rng.normal(0, 0.4, true.shape), true + rng.normal(0, 0.4, true.shape)])
        sets.append(HypothesisSet(np.zeros((3, 4)), places, np.array([[3.0], [0.0], [0.0]]), np.zeros(3), ("",) * 3))
    return sets


def test_the_likeliest_path_learns_how_the_points_move():
    sets = walk(12)
    for s in sets[:3]:  # where the true one is clear
        s.view_nats[1:] = 60.0
    paths = Paths(acceleration(np.arange(12) / 30.0), GROUPS)
    assert [n.any() for n in paths.motion_nats(sets)] == [False] * 10  # none is known yet
    path, costs = paths.likeliest(sets)
    assert path.tolist() == [0] * 12
    assert np.sqrt(paths.motion.scales_m2).max() < 0.01
    found = path_marginals([s.costs() for s in sets], paths.motion_nats(sets), reduce_min)
    assert [c.argmin() for c in costs] == [c.argmin() for c in found] == [0] * 12


@pytest.mark.parametrize("n", [1, 2])
def test_few_frames_show_no_motion(n):
    paths = Paths(acceleration(np.arange(n) / 30.0), GROUPS)
    path, _ = paths.likeliest(walk(n))
    assert paths.motion is None
    assert path.tolist() == [1] * n


def test_a_view_can_be_left_out():
    (own,) = sets_of([3], 2)
    np.testing.assert_allclose(own.costs(), own.view_nats.sum(axis=1) + own.prior_nats)
    np.testing.assert_allclose(own.costs(0), own.view_nats[:, 1:].sum(axis=1) + own.prior_nats)
    np.testing.assert_allclose(own.costs(1), own.view_nats[:, [0, 2]].sum(axis=1) + own.prior_nats)


@settings(deadline=None, max_examples=30)
@given(seed=st.integers(0, 1000), sizes=st.tuples(st.integers(1, 6), st.integers(1, 6)))
def test_of_hypotheses_that_are_alike_the_cheapest_stays(seed, sizes):
    one, other = sets_of(sizes, seed, 0.6 * DISTINCT_M)
    both = one.joined(other)
    costs, places = np.concatenate([one.costs(), other.costs()]), np.concatenate([one.places, other.places])
    kept = [(*one.sources, *other.sources).index(name) for name in both.sources]
    assert costs[kept].tolist() == both.costs().tolist() == sorted(both.costs())
    gaps = np.linalg.norm(places[:, None] - places, axis=-1).max(axis=-1)
    assert (gaps[np.ix_(kept, kept)] + 2 * DISTINCT_M * np.eye(len(kept)) > DISTINCT_M).all()
    for i in set(range(len(costs))) - set(kept):  # it is near one that costs no more
        assert any(gaps[i, k] <= DISTINCT_M and costs[k] <= costs[i] for k in kept)
