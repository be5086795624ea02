"""Region evidence as a residual block, on a figure in its clothes."""

from dataclasses import replace

import numpy as np
import pytest
from gaussian_prior import GaussianPrior
from region_scenes import Walk
from staging import SUIT

from tracker.body.model import PosedBody
from tracker.estimation.appearance.region_kernels import RegionTables
from tracker.estimation.appearance.region_residuals import region_residuals
from tracker.estimation.fitting.gauss_newton import solve

pytestmark = pytest.mark.slow  # its kernels are compiled for the benchmark alone

FRAME = 6
STEPS = 0.02, 0.05
"""Largest step of a displaced pose, metres and rad."""


@pytest.fixture(scope="module")
def run(gavrila):
    return Walk(gavrila, SUIT)


def displaced(run, seed):
    """The true pose, moved at random."""
    steps = np.where(run.model.dof_is_length, *STEPS) * np.random.default_rng(seed).uniform(-1, 1, run.model.n_dofs)
    return run.model.clip(run.model.retract(run.true[FRAME][0].values, steps))


def linear(run, known, regions, bodies, person, pose):
    block = region_residuals(known, regions, bodies, person)
    return block.linearize(run.model, pose, run.model.kinematics(pose))


def refined(run, regions, bodies, covariance, active=None):
    """The likeliest pose by region evidence and the covariance of where it starts."""
    start = bodies[0].values
    blocks = [GaussianPrior(start, np.linalg.inv(covariance)), region_residuals(run.known, regions, bodies, 0)]
    return solve(run.model, start, blocks, active).pose


def off_m(run, pose):
    """Mean distance of the points of the body from the truth, metres."""
    return np.linalg.norm(run.model.points_world(pose) - run.true[FRAME][0].points_world, axis=1).mean()


def test_the_gradient_is_that_of_the_evidence(run):
    """Central differences over many cells, because the evidence is a sum of whole ones."""
    model, regions = run.model, run.known.frame(run.views[FRAME], run.true[FRAME])
    found, expected, hessians = [], [], []
    for seed in range(4):
        pose = displaced(run, seed)
        here = linear(run, run.known, regions, run.true[FRAME], 0, pose)
        assert here.cost == pytest.approx(-run.known.nats(regions, [PosedBody(model, pose)]))
        for i, step in enumerate(np.diag(np.where(model.dof_is_length, *STEPS))):
            around = [model.retract(pose, s) for s in (step, -step)]
            if all(np.array_equal(p, model.clip(p)) for p in around):
                more, less = (-run.known.nats(regions, [PosedBody(model, p)]) for p in around)
                expected.append((more - less) / 2)
                found.append(here.gradient[i] * step[i])
                hessians.append(here.hessian[i, i])
    assert np.std(expected) > 1  # nats
    assert np.corrcoef(found, expected)[0, 1] > 0.9
    assert np.polyfit(expected, found, 1)[0] == pytest.approx(1, abs=0.25)
    assert min(hessians) >= 0


def test_a_displaced_pose_comes_back(run):
    model, regions = run.model, run.known.frame(run.views[FRAME], run.true[FRAME])
    covariance = np.diag(np.where(model.dof_is_length, *STEPS) ** 2)
    before, after = [], []
    for seed in range(4):
        bodies = (PosedBody(model, displaced(run, seed)),)
        before.append(off_m(run, bodies[0].values))
        after.append(off_m(run, refined(run, regions, bodies, covariance)))
    assert np.mean(before) > 0.03 > 2 * np.mean(after)


def test_locked_degrees_of_freedom_stay(run):
    model, regions = run.model, run.known.frame(run.views[FRAME], run.true[FRAME])
    active = np.arange(model.n_dofs) % 3 > 0
    bodies = (PosedBody(model, displaced(run, 0)),)
    covariance = np.diag(np.where(model.dof_is_length, *STEPS) ** 2)
    found = refined(run, regions, bodies, covariance, active)
    assert np.array_equal(found[model.dof_value[~active]], bodies[0].values[model.dof_value[~active]])
    assert not np.allclose(found, bodies[0].values)


def test_a_body_that_moves_away_keeps_its_evidence(run):
    """Its contours shrink, but what they hold is larger."""
    model, true = run.model, run.true[FRAME][0]
    regions = run.known.frame(run.views[FRAME], [true])
    regions = regions._replace(views=(regions.views[0], None))
    axis = np.concatenate([regions.views[0].camera.projection[2, :3], np.zeros(model.n_dofs - 3)])
    nats = [run.known.nats(regions, [PosedBody(model, model.retract(true.values, s * axis))]) for s in (0.1, -0.1)]
    found = linear(run, run.known, regions, [true], 0, true.values).gradient @ axis
    assert found == pytest.approx((nats[1] - nats[0]) / 0.2, abs=0.15 * run.known.nats(regions, [true]))


def test_parts_are_counted_through_all_people(run):
    """Somebody else whom no view shows changes nothing."""
    both = with_somebody(run)
    bodies = moved(run, 100.0), run.true[FRAME][0]
    pose, regions = displaced(run, 1), run.known.frame(run.views[FRAME], run.true[FRAME])
    alone = linear(run, run.known, regions, run.true[FRAME], 0, pose)
    for found, expected in zip(linear(run, both, regions, bodies, 1, pose), alone, strict=True):
        np.testing.assert_allclose(found, expected)


def test_views_of_other_times_see_people_there(run):
    """Pictures that are half a frame early, and poses half a frame later."""
    model, ahead, both = run.model, 0.5, with_somebody(run)
    velocity = np.where(model.dof_is_length, 0.06, 0.12) * np.sign(np.sin(np.arange(model.n_dofs)))
    pose, somebody = displaced(run, 2), moved(run, 0.3)
    later, somebody_later = (model.retract(p, ahead * velocity) for p in (pose, somebody.values))
    on_time = run.known.frame(run.views[FRAME], run.true[FRAME])
    regions = on_time._replace(views=tuple(v and v._replace(ahead_frames=-ahead) for v in on_time.views))
    expected = linear(run, both, on_time, (somebody, PosedBody(model, pose)), 1, pose)
    bodies = tuple(PosedBody(model, p, velocity) for p in (somebody_later, later))
    found = linear(run, both, regions, bodies, 1, later)
    assert found.cost == pytest.approx(expected.cost, abs=1e-3)
    np.testing.assert_allclose(found.gradient, expected.gradient, atol=1e-3 * np.abs(expected.gradient).max())


def with_somebody(run):
    """The appearance of two people who are dressed alike."""
    tables = RegionTables(*(np.concatenate([t, t], axis=1) for t in run.known.tables))
    return replace(run.known, models=(run.model, run.model), tables=tables)


def moved(run, height_m):
    """The true pose, so much higher."""
    step = np.where(np.arange(run.model.n_dofs) == 2, height_m, 0.0)
    return PosedBody(run.model, run.model.retract(run.true[FRAME][0].values, step))
