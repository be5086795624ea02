"""Two poses are the same where no point is farther apart than a limb is wide, and costs are logarithms of odds."""

import numpy as np
import pytest

from tracker.body.model import PosedBody
from tracker.estimation.fitting.gauss_newton import PosePrior, solve
from tracker.estimation.fitting.hypothesis import SAME_POSE_M, Hypothesis, distance_m, distinct, limbs_elsewhere


def at(model, x_m=0.0, **angles):
    pose = model.neutral()
    pose[0] += x_m
    for name, angle in angles.items():
        pose[model.value_names.index(name.replace("__", "."))] += angle
    return PosedBody(model, pose)


def test_the_distance_is_that_of_the_farthest_point(gavrila):
    here, bent = at(gavrila), at(gavrila, left_knee__extension=0.6)
    points = np.linalg.norm(here.points_world - bent.points_world, axis=1)
    assert distance_m(here, bent) == pytest.approx(points.max())
    assert distance_m(here, here) == 0.0
    assert distance_m(here, at(gavrila, 0.03)) == pytest.approx(0.03)


def test_a_limb_that_is_bent_is_elsewhere(gavrila):
    assert limbs_elsewhere(at(gavrila), at(gavrila, left_knee__extension=0.6)) == ("left_calf",)
    assert limbs_elsewhere(at(gavrila), at(gavrila, left_knee__extension=0.2)) == ()
    assert len(limbs_elsewhere(at(gavrila), at(gavrila, 1.1 * SAME_POSE_M))) > 3


def test_of_hypotheses_that_are_the_same_the_cheapest_stays(gavrila):
    places = ((0.0, 3.0), (0.5 * SAME_POSE_M, 1.0), (1.2, 2.0), (2.4, 4.0))
    found = [Hypothesis(at(gavrila, x_m), "", cost) for x_m, cost in places]
    assert [h.cost for h in distinct(found)] == [1.0, 2.0, 4.0]
    assert [h.cost for h in distinct(found, 2)] == [1.0, 2.0]
    assert distinct([]) == []


def test_a_moved_hypothesis_is_a_proposal_again(gavrila):
    prior = PosePrior(gavrila.neutral(), np.full(gavrila.n_dofs, 10.0))
    fit = solve(gavrila, gavrila.neutral(), [prior])
    found = Hypothesis.refined(gavrila, fit, fit.cost, "test")
    assert (found.fit, found.cost) == (fit, fit.cost)
    moved = found.at(at(gavrila, 1.0).values)
    assert (moved.fit, moved.cost, moved.source) == (None, np.inf, "test")
