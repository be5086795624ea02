"""Bundle adjustment of points: against scipy's sparse solver, and with gross errors."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.sparse import lil_matrix
from seen_points import cloud, moved_rig, ring_of, seen_points

from tracker.calibration.check.lens_priors import CALIBRATED, prior_sigmas
from tracker.calibration.check.point_problem import PointProblem, require_spread, triangulate_all
from tracker.calibration.check.rig_adjustment import Observations, Prior, Rig, fit_rig
from tracker.errors import CalibrationError
from tracker.estimation.fitting.bundle import solve_bundle
from tracker.geometry.camera_derivatives import camera_difference


def scipys_minimum(problem, rig):
    """The same squared errors, without robustness, by scipy's sparse solver with numeric derivatives."""
    n, P = len(problem.precision), len(rig.own)
    groups, cameras = problem.observations.groups, problem.observations.cameras

    def residuals(x):
        moved = problem.moved(rig, x[:n], x[n:].reshape(P, 3))
        offsets = [camera_difference(*pair)[c] for *pair, c in zip(rig.cameras, moved.cameras, problem.columns)]  # noqa: B905
        return np.concatenate(
            [problem.errors_px(moved).ravel() / problem.sigmas_px[0], np.concatenate(offsets) * problem.precision**0.5]
        )

    pattern = lil_matrix((2 * len(groups) + n, n + 3 * P), dtype=int)
    for k, (c, g) in enumerate(zip(cameras, groups, strict=True)):
        pattern[2 * k : 2 * k + 2, problem.ends[c] : problem.ends[c + 1]] = 1
        pattern[2 * k : 2 * k + 2, n + 3 * g : n + 3 * g + 3] = 1
    pattern[2 * len(groups) + np.arange(n), np.arange(n)] = 1
    found = least_squares(
        residuals, np.zeros(n + 3 * P), jac_sparsity=pattern, method="trf", x_scale="jac", xtol=1e-12, ftol=1e-10
    )
    return problem.moved(rig, found.x[:n], found.x[n:].reshape(P, 3))


@pytest.mark.parametrize("lens", [False, True])
def test_the_minimum_is_that_of_scipy(lens):
    cameras, points = ring_of(3), cloud(40)
    seen = seen_points(cameras, points, sigma_px=0.3)
    start = moved_rig(cameras)
    found, determined = triangulate_all(start, seen)
    assert determined.all()
    prior = Prior(tuple(start), tuple(prior_sigmas(c, CALIBRATED, lens=lens) for c in start))
    # With so large a noise no error is gross, so that robust squares are plain ones to a thousandth.
    problem = PointProblem(seen, prior, len(points), np.full(3, 30.0))
    mine = solve_bundle(problem, Rig(tuple(start), found), tolerance=1e-12).state
    theirs = scipys_minimum(problem, Rig(tuple(start), found))
    np.testing.assert_allclose(mine.own, theirs.own, atol=2e-4)
    for a, b in zip(mine.cameras, theirs.cameras, strict=True):
        np.testing.assert_allclose(camera_difference(a, b), 0, atol=2e-4)


def adjusted(start, seen):
    """Fit of cameras that were calibrated once, and of points."""
    points, determined = triangulate_all(start, seen)
    prior = Prior(tuple(start), tuple(prior_sigmas(c, CALIBRATED, lens=False) for c in start))
    problem = PointProblem(seen.of_groups(determined), prior, int(determined.sum()), np.ones(len(start)))
    return fit_rig(problem, Rig(tuple(start), points[determined]))


def test_gross_errors_have_no_influence():
    cameras, points = ring_of(4), cloud(300)
    start = moved_rig(cameras)
    clean = adjusted(start, seen_points(cameras, points))
    spoilt = adjusted(start, seen_points(cameras, points, gross=0.1))
    for a, b in zip(clean.rig.cameras, spoilt.rig.cameras, strict=True):
        step = camera_difference(a, b)
        assert np.degrees(np.abs(step[:3]).max()) < 0.05
    np.testing.assert_allclose(spoilt.sigmas_px, 0.5, rtol=0.1)
    assert np.mean(spoilt.weights < 0.1) == pytest.approx(0.1, abs=0.03)


@pytest.mark.slow
def test_the_covariance_is_that_of_the_errors():
    """Squared errors of cameras that moved as the prior says, in their covariance, have a mean of 1 each."""
    points, cameras, means = cloud(80), ring_of(4), []
    for seed in range(12):
        start = moved_rig(cameras, seed, degrees=1.0, metres=0.05)
        found = adjusted(start, seen_points(cameras, points, 0.3, seed=seed))
        moves = [camera_difference(a, b) for a, b in zip(cameras, found.rig.cameras, strict=True)]
        error = np.concatenate([m[:6] for m in moves])
        poses = np.concatenate([np.arange(6) + i * len(moves[0]) for i in range(4)])
        means.append(error @ np.linalg.solve(found.covariance[np.ix_(poses, poses)], error) / len(error))
    assert np.mean(means) == pytest.approx(1.0, abs=0.35)  # of 288 squares: three standard deviations and more


def test_points_of_one_camera_are_not_determined():
    cameras = ring_of(3)
    seen = seen_points(cameras, cloud(5))
    alone = Observations(*(rows[seen.of_camera(0)] for rows in (seen.cameras, seen.groups, seen.px)))
    assert not triangulate_all(cameras, alone)[1].any()
    points, determined = triangulate_all(cameras, seen)
    assert determined.all()
    np.testing.assert_allclose(points, cloud(5), atol=0.02)


@pytest.mark.parametrize("sigma_px", [0.0, 0.5])
def test_points_on_a_line_are_refused(sigma_px):
    cameras = ring_of(3)
    line = np.linspace([-0.5, -0.2, 0.9], [0.6, 0.3, 1.4], 30)
    for start in (cameras, moved_rig(cameras, degrees=0.3, metres=0.01)):
        seen = seen_points(start, line, sigma_px)
        with pytest.raises(CalibrationError, match="do not all lie on one line"):
            require_spread(Rig(tuple(cameras), triangulate_all(cameras, seen)[0]), seen)
    beside = np.concatenate([line[::5], line[::5] + np.array([0.0, 0.0, 0.3])])
    seen = seen_points(cameras, beside, sigma_px)
    require_spread(Rig(tuple(cameras), triangulate_all(cameras, seen)[0]), seen)
