"""Poses carried from frame to frame, and the cheapest way through them."""

from itertools import product

import numpy as np
import pytest
from staging import posed

from tracker.body.model import PosedBody
from tracker.fitting.hypothesis import CLEAR_NATS, Hypothesis
from tracker.tracking.estimation.pose_paths import (
    _ACCELERATION_SIGMA_M,
    _MAX_ACCELERATION_COST,
    _MAX_CANDIDATES,
    ROUNDS,
    Candidates,
    propagate_candidates,
    select_alternatives,
    viterbi_path,
)


def cost_of(points, costs, before, after, way):
    """What a way costs, said plainly."""
    path = [*before, *(p[k] for p, k in zip(points, way, strict=True)), *after]
    total = sum(c[k] for c, k in zip(costs, way, strict=True))
    for a, b, c in zip(path, path[1:], path[2:], strict=False):
        for x, y, z in zip(a, b, c, strict=True):
            nats = np.sum((x - 2 * y + z) ** 2) / (2 * _ACCELERATION_SIGMA_M**2)
            total += nats / (1 + nats / _MAX_ACCELERATION_COST)
    return total


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("known", [(2, 2), (1, 0), (0, 2)])
def test_the_cheapest_way_is_that_of_all_ways_tried(seed, known):
    rng = np.random.default_rng(seed)
    points = [rng.normal(0, 0.1, (n, 4, 3)) for n in (2, 3, 1, 4, 2, 3)]
    costs = [rng.normal(0, 6.0, len(p)) for p in points]
    before, after = ([rng.normal(0, 0.1, (4, 3)) for _ in range(n)] for n in known)
    ways = list(product(*(range(len(p)) for p in points)))
    best = min(ways, key=lambda way: cost_of(points, costs, before, after, way))
    stay = cost_of(points, costs, before, after, (0,) * 6)
    assert stay - cost_of(points, costs, before, after, best) > CLEAR_NATS
    assert tuple(viterbi_path(points, costs, before, after)) == best


def test_what_is_hardly_cheaper_changes_nothing():
    points = [np.zeros((2, 4, 3))] * 4
    little, much = [np.array([0.0, -CLEAR_NATS / 5])] * 4, [np.array([0.0, -CLEAR_NATS / 3])] * 4
    assert viterbi_path(points, little, [], []) == [0] * 4
    assert viterbi_path(points, much, [], []) == [1] * 4


@pytest.mark.parametrize("n", [1, 2])
def test_of_few_frames_the_cheapest_poses_are_taken(n):
    points, costs = [np.zeros((2, 4, 3))] * n, [np.array([2 * CLEAR_NATS, 0.0])] * n
    assert viterbi_path(points, costs, [], []) == [1] * n
    assert viterbi_path(points, [-c for c in costs], [], []) == [0] * n


def raised(gavrila, rad=0.0, cost=0.0):
    """A hypothesis with an arm raised further."""
    step = np.zeros(gavrila.n_dofs)
    step[gavrila.dof_names.index("left_shoulder.abduction")] = rad
    return Hypothesis(PosedBody(gavrila, gavrila.retract(posed(gavrila, 1), step)), "", cost)


def test_frames_that_agree_outweigh_what_none_says_alone(gavrila):
    own, other = raised(gavrila), raised(gavrila, 0.5, -4.0)
    assert select_alternatives([[own, other]], 6.0) == [0]
    assert select_alternatives([[own, other]] * 2, 6.0) == [1, 1]
    assert select_alternatives([[own, raised(gavrila, -0.5), other]] * 4, 6.0) == [2] * 4
    assert select_alternatives([[own]] * 3, 6.0) == [0] * 3


def test_an_arm_that_jumps_there_and_back_is_not_taken(gavrila):
    own, other = raised(gavrila), raised(gavrila, 0.5, -4.0)
    assert select_alternatives([[own]] * 2 + [[own, other]] * 3 + [[own]] * 2, 6.0) == [0] * 7
    # Here it is the pose of three frames that jumps.
    path = [raised(gavrila, 0.5)]
    assert select_alternatives([path] * 2 + [[own, other]] * 3 + [path] * 2, 6.0) == [0, 0, 1, 1, 1, 0, 0]


def test_stretches_apart_are_judged_apart(gavrila):
    own, other = raised(gavrila), raised(gavrila, 0.01, -4.0)  # a step without a jump
    assert select_alternatives([[own, other], [own], [own, other]], 6.0) == [1, 0, 1]
    assert select_alternatives([[own, other], [own], [own], [own, other]], 6.0) == [0] * 4


SIGMA = None
"""The stand-in below refines without it."""


class Valley:
    """Stands for what a frame shows: costs grow with the distance from a pose, and refinement goes half way there."""

    def __init__(self, best):
        self.best = best

    def costs_with_priors(self, model, poses):
        return np.array([100 * np.sum((v - self.best) ** 2) for v in poses])

    def refined(self, model, poses, sigma):
        return np.array([v + 0.5 * (self.best - v) for v in poses])


def test_what_one_frame_knows_all_come_to_know(gavrila):
    base, step = posed(gavrila, 1), np.zeros(gavrila.n_dofs)
    step[gavrila.dof_names.index("left_shoulder.abduction")] = 0.5
    right, wrong = base, gavrila.retract(base, step)
    frames = [Candidates(gavrila, [right if i == 2 else wrong]) for i in range(5)]
    visited = list(propagate_candidates(gavrila, frames, lambda i: Valley(right), (None, None), SIGMA))
    assert visited == [0, 1, 2, 3, 4, 4, 3, 2, 1, 0] * ROUNDS
    for frame in frames:
        assert np.abs(frame.poses[int(np.argmin(frame.costs))] - right).max() < 1e-9
        np.testing.assert_array_equal(frame.costs, Valley(right).costs_with_priors(gavrila, frame.poses))


def test_poses_before_and_after_are_carried_in(gavrila):
    base, step = posed(gavrila, 1), np.zeros(gavrila.n_dofs)
    step[gavrila.dof_names.index("left_shoulder.abduction")] = 0.5
    for ends in ((base, None), (None, base)):
        frames = [Candidates(gavrila, [gavrila.retract(base, step)]) for _ in range(3)]
        list(propagate_candidates(gavrila, frames, lambda i: Valley(base), ends, SIGMA))
        assert all(min(f.costs) < 1e-9 for f in frames)


def test_of_poses_that_are_alike_the_cheaper_is_kept_and_those_found_stay(gavrila):
    base, dof = posed(gavrila, 1), gavrila.dof_names.index("left_shoulder.abduction")

    def turned(rad):
        step = np.zeros(gavrila.n_dofs)
        step[dof] = rad
        return gavrila.retract(base, step)

    sight, frame = Valley(base), Candidates(gavrila, [turned(1.0), turned(0.9)])
    frame.score(sight)
    frame.add(np.array([turned(1.001), turned(0.5), turned(0.52), turned(0.48)]), sight)
    np.testing.assert_array_equal(frame.poses, [turned(1.0), turned(0.9), turned(0.48)])
    rng = np.random.default_rng(0)
    many = [gavrila.retract(base, rng.normal(0, 0.5, gavrila.n_dofs)) for _ in range(3 * _MAX_CANDIDATES)]
    frame.add(np.array(many), sight)
    assert len(frame.poses) == len(frame.points) == len(frame.costs) == _MAX_CANDIDATES
    np.testing.assert_array_equal(frame.poses[:2], [turned(1.0), turned(0.9)])
    expected = np.sort([*sight.costs_with_priors(gavrila, [turned(0.48)]), *sight.costs_with_priors(gavrila, many)])[
        : _MAX_CANDIDATES - 2
    ]
    np.testing.assert_allclose(frame.costs[2:], expected)


def test_other_poses_are_taken_in_at_first_sight(gavrila):
    base, step = posed(gavrila, 1), np.zeros(gavrila.n_dofs)
    step[gavrila.dof_names.index("left_shoulder.abduction")] = 0.5
    wrong, sight = gavrila.retract(base, step), Valley(base)
    frame = Candidates(gavrila, [wrong], [base, wrong])
    frame.score(sight)
    np.testing.assert_array_equal(frame.poses, [wrong, base])
    np.testing.assert_array_equal(frame.costs, sight.costs_with_priors(gavrila, [wrong, base]))


def test_rivals_cost_hardly_more_and_are_elsewhere(gavrila):
    base, dof = posed(gavrila, 1), gavrila.dof_names.index("left_shoulder.abduction")
    poses = [base.copy() for _ in range(5)]
    for pose, turn in zip(poses, (0.0, 0.05, 0.8, 0.85, -0.8), strict=True):
        pose[dof] += turn
    frame = Candidates(gavrila, poses)
    costs = [0.0, -1.0, CLEAR_NATS / 2, -2.0, 2 * CLEAR_NATS]
    frame.hypotheses = [Hypothesis(PosedBody(gavrila, p), "", c) for p, c in zip(poses, costs, strict=True)]
    np.testing.assert_array_equal(frame.alternatives(0), [poses[3]])
    np.testing.assert_array_equal(frame.alternatives(4), [poses[3], poses[1]])
