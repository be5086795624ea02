"""Rows of `quadrille bench` on the adjustment of cameras to points."""

from functools import partial

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix

from app.bench.rows import Row, Yardstick, in_yardsticks
from tracker.calibration.check.lens_priors import CALIBRATED, prior_sigmas
from tracker.calibration.check.point_problem import PointProblem, triangulate_all
from tracker.calibration.check.rig_adjustment import Observations, Prior, Rig
from tracker.estimation.fitting.bundle import solve_bundle
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.camera_derivatives import POSE, camera_difference, moved_camera, n_camera_parameters
from tracker.geometry.cameras import Camera

_N_CAMERAS, _N_POINTS, _NOISE_PX, _SIGMA_PX = 4, 1200, 0.5, 5.0
_GAIN = 1e-6
"""Relative decrease of the cost at which both solvers end."""


def adjustment(yardstick: Yardstick) -> list[Row]:
    """Adjust four moved cameras and 1,200 points to reprojection errors, and the same by scipy's sparse solver."""
    problem, start = _problem()
    solve = partial(solve_bundle, problem, start, tolerance=_GAIN)
    fit, timed = solve(), yardstick.beside(solve, 7)
    theirs = yardstick.beside(partial(_by_scipy, problem, start), 1)
    what = f"{_N_CAMERAS} cameras and {_N_POINTS} points adjusted"
    note = f"{fit.evaluations} evaluations; {theirs.work_us / timed.work_us:.0f} times faster than scipy"
    must = min(in_yardsticks(100), theirs.work_us / theirs.yardstick_us / 8)
    rows = [Row("adjust_points", what, *timed, must, must / 2, note)]
    found = _by_scipy(problem, start)
    note = f"cost {problem.linearize(found).cost:.2f} where the own solver ends at {fit.cost:.2f}"
    return [
        *rows,
        Row("adjust_points_scipy", "the same by scipy's least_squares with a sparse Jacobian", *theirs, note=note),
    ]


def _problem() -> tuple[PointProblem, Rig]:
    """Return cameras in a circle that were moved since, and their observations of points in the middle."""
    random = np.random.default_rng(0)
    cameras = [_camera(f"cam{i}", 2 * np.pi * i / _N_CAMERAS) for i in range(_N_CAMERAS)]
    points = random.uniform(-0.8, 0.8, (_N_POINTS, 3))
    px = np.concatenate([c.project(points) for c in cameras])
    px += _NOISE_PX * random.normal(size=px.shape)
    seen = Observations(np.repeat(np.arange(_N_CAMERAS), _N_POINTS), np.tile(np.arange(_N_POINTS), _N_CAMERAS), px)
    moved = []
    for camera in cameras:
        step = np.zeros(n_camera_parameters(camera))
        step[POSE] = random.normal(size=6) * ([np.radians(0.5)] * 3 + [0.02] * 3)
        moved.append(moved_camera(camera, step))
    prior = Prior(tuple(moved), tuple(prior_sigmas(c, CALIBRATED, lens=False) for c in moved))
    # No error is gross beside this noise, so that both solve the same problem.
    problem = PointProblem(seen, prior, _N_POINTS, np.full(_N_CAMERAS, _SIGMA_PX))
    return problem, Rig(tuple(moved), triangulate_all(moved, seen)[0])


def _camera(name: str, angle: float) -> Camera:
    """Return a camera 4 m from the middle of the world, which it looks at."""
    z = -np.array([np.cos(angle), np.sin(angle), 0.3]) / np.hypot(1.0, 0.3)
    x = np.array([-np.sin(angle), np.cos(angle), 0.0])
    pose = rigid.transform(np.stack([x, np.cross(z, x), z], axis=1), -4 * z)
    K = np.array([[600.0, 0.0, 319.5], [0.0, 600.0, 239.5], [0.0, 0.0, 1.0]])
    return Camera(name, (640, 480), K, np.array([-0.2, 0.05, 0.001, -0.001, 0.01]), pose)


def _by_scipy(problem: PointProblem, start: Rig) -> Rig:
    """Minimize the same squares by scipy's trust region solver, with the sparsity of the Jacobian."""
    n, m, seen = len(problem.precision), 3 * len(start.own), problem.observations

    def residuals(x: Array) -> Array:
        rig = problem.moved(start, x[:n], x[n:].reshape(-1, 3))
        moves = zip(start.cameras, rig.cameras, problem.columns, strict=True)
        offsets = np.concatenate([camera_difference(before, now)[columns] for before, now, columns in moves])
        reprojection = problem.errors_px(rig) / problem.sigmas_px[0]
        return np.concatenate([reprojection.ravel(), offsets * np.sqrt(problem.precision)])

    rows = np.arange(2 * len(seen.px)).reshape(-1, 2)
    of_camera = problem.ends[seen.cameras][:, None] + np.arange(int(problem.ends[1]))
    of_point = n + 3 * seen.groups[:, None] + np.arange(3)
    columns = np.concatenate([of_camera, of_point], axis=1)
    at = (
        np.broadcast_to(rows[:, :, None], (*rows.shape, columns.shape[1])),
        np.broadcast_to(columns[:, None], (*rows.shape, columns.shape[1])),
    )
    priors = 2 * len(seen.px) + np.arange(n)
    index = np.concatenate([at[0].ravel(), priors]), np.concatenate([at[1].ravel(), np.arange(n)])
    pattern = csr_matrix((np.ones(len(index[0])), index), shape=(2 * len(seen.px) + n, n + m))
    found = least_squares(
        residuals, np.zeros(n + m), jac_sparsity=pattern, method="trf", x_scale="jac", ftol=_GAIN, max_nfev=30
    )
    return problem.moved(start, found.x[:n], found.x[n:].reshape(-1, 3))
