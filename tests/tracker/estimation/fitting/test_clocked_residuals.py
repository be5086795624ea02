"""Residuals of views whose pictures were taken between frames."""

from dataclasses import replace

import numpy as np
import pytest
from staging import cameras_around, own_evidence, posed, shaken

from tracker.body.model import PosedBody
from tracker.estimation.fitting.clocked_residuals import ClockedResiduals, person_residuals
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.estimation.fitting.gauss_newton import PosePrior
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled_or_plain
from tracker.estimation.search.chamfer_cost import ChamferCost

CAMERAS = cameras_around(4)
LATE = 1
"""The view whose picture is taken half a frame later."""


class Moving:
    """A person in motion, seen by one camera half a frame later than by the others."""

    def __init__(self, model):
        rng = np.random.default_rng(5)
        self.model, self.truth = model, posed(model, 3)
        self.velocity = rng.normal(0, np.where(model.dof_is_length, 0.04, 0.12))
        self.body = PosedBody(model, self.truth, self.velocity)
        views = [own_evidence([self.body.ahead(0.5 * (i == LATE))], [c])[0] for i, c in enumerate(CAMERAS)]
        self.untimed = tuple(views)
        self.views = tuple(replace(v, ahead_frames=0.5 * (i == LATE)) for i, v in enumerate(views))
        self.start = PosedBody(model, shaken(model, self.truth, rng, 0.04, 0.01), self.velocity)

    def error_mm(self, views):
        """Mean error of the points after a fit to views."""
        blocks = [person_residuals(views, [self.start]), PosePrior.of_spreads(self.model)]
        found = solve_compiled_or_plain(self.model, self.start.values, blocks, max_iterations=30)
        off = PosedBody(self.model, found.pose).points_world - self.body.points_world
        return 1000 * np.linalg.norm(off, axis=1).mean()


@pytest.fixture(scope="module")
def moving(gavrila):
    return Moving(gavrila)


def test_late_picture_is_compared_with_the_pose_of_its_time(moving):
    assert moving.error_mm(moving.views) < 0.5 * moving.error_mm(moving.untimed)


def test_without_clocks_or_velocities_nothing_changes(moving):
    still = PosedBody(moving.model, moving.truth)
    assert isinstance(person_residuals(moving.untimed, [moving.body]), ContourResiduals)
    assert isinstance(person_residuals(moving.views, [still]), ContourResiduals)


def test_groups_are_those_of_the_views_at_their_times(moving):
    found = person_residuals(moving.views, [moving.body])
    assert isinstance(found, ClockedResiduals)
    then = moving.body.ahead(0.5)
    late = ContourResiduals([moving.views[LATE]], [then])
    others = ContourResiduals([v for i, v in enumerate(moving.views) if i != LATE], [moving.body])
    expected = [b.linearize(moving.model, x.values, x.kinematics) for b, x in ((others, moving.body), (late, then))]
    linear = found.linearize(moving.model, moving.truth, moving.body.kinematics)
    assert linear.cost == pytest.approx(sum(e.cost for e in expected))
    np.testing.assert_allclose(linear.gradient, sum(e.gradient for e in expected), atol=1e-9)
    assert found.costs(moving.truth[None])[0] == pytest.approx(linear.cost, rel=1e-6)
    costs = found.part_costs(moving.truth)
    np.testing.assert_allclose(costs.length_px[LATE], late.part_costs(then.values).length_px[0])


def test_shown_cost_is_that_at_the_time_of_each_picture(moving):
    timed, untimed = (ChamferCost(v, [moving.body]) for v in (moving.views, moving.untimed))
    assert timed.at_prediction().view_costs_px[LATE] < 0.5 * untimed.at_prediction().view_costs_px[LATE]
    np.testing.assert_allclose(timed([moving.truth]).view_costs_px, timed.at_prediction().view_costs_px, rtol=1e-5)
