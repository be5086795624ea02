"""The solve of a whole path against a general minimizer, and what stays in it."""

import numpy as np
import pytest
from bodies import MODELS
from scipy.optimize import minimize

from tracker.fitting.gauss_newton import GaussianPrior
from tracker.trajectory import solve
from tracker.trajectory.motion_model import MotionModel, motion_points
from tracker.trajectory.solve import PosedPath, solve_path

T, FPS = 8, 30.0
MODEL = MODELS["gavrila22"]


def measured(n_frames=T, sigma=0.02):
    """A body that turns evenly, measured with noise: the poses, and the evidence of each frame."""
    rng, n = np.random.default_rng(0), MODEL.n_dofs
    rate, at = 0.02 * rng.normal(size=n), range(n_frames)
    poses = [MODEL.clip(MODEL.retract(MODEL.neutral(), t * rate + sigma * rng.normal(size=n))) for t in at]
    return np.array(poses), [[GaussianPrior(pose, np.eye(n) / sigma**2)] for pose in poses]


def path_of(poses, evidence, fixed=(), active=None, freedom=4.0):
    at = np.isin(np.arange(len(poses)), fixed)
    return PosedPath(MODEL, np.arange(len(poses)) / FPS, poses, evidence.__getitem__, at, active, freedom)


def cost_of(path, poses, motion):
    """The cost that the solve minimizes, written plainly."""
    kinematics = [MODEL.kinematics(pose) for pose in poses]
    own = sum(
        block.linearize(MODEL, pose, k).cost
        for t, (pose, k) in enumerate(zip(poses, kinematics, strict=True))
        for block in path.evidence(t)
    )
    places = np.array([motion_points(MODEL).at(k) for k in kinematics])
    return own + motion.nats(np.sum(np.diff(places, n=2, axis=0) ** 2, axis=-1))


@pytest.mark.slow
def test_no_other_path_costs_less():
    """With the motion that was learnt, a general minimizer that begins at the solution finds nothing better."""
    poses, evidence = measured()
    path = path_of(poses, evidence)
    found = solve_path(path)
    accelerations = np.diff([motion_points(MODEL).at(MODEL.kinematics(p)) for p in found.poses], n=2, axis=0)
    motion = MotionModel.learned(motion_points(MODEL).groups, np.sum(accelerations**2, axis=-1))
    again = solve_path(path_of(found.poses, evidence), motion=motion).poses

    def cost(steps):
        moved = zip(again, steps.reshape(T, -1), strict=True)
        return cost_of(path, [MODEL.clip(MODEL.retract(pose, step)) for pose, step in moved], motion)

    start = np.zeros(T * MODEL.n_dofs)
    best = minimize(cost, start, method="L-BFGS-B", options={"maxiter": 20})
    assert cost(start) < cost_of(path, poses, motion) - 10
    assert best.fun > cost(start) - 1  # nat


def test_fixed_poses_and_locked_degrees_of_freedom_stay():
    poses, evidence = measured()
    active = np.arange(MODEL.n_dofs) % 3 > 0
    start = np.tile(MODEL.neutral(), (T, 1))
    start[2] = poses[2]
    found = solve_path(path_of(start, evidence, fixed=[2], active=active))
    np.testing.assert_array_equal(found.poses[2], poses[2])
    others = np.delete(found.poses, 2, axis=0)
    locked = MODEL.dof_value[~active]
    np.testing.assert_array_equal(others[:, locked], np.delete(start, 2, axis=0)[:, locked])
    assert np.abs(others - MODEL.neutral()).max() > 0.01
    assert (found.covariances[2] == 0).all()
    assert (found.covariances[:, ~active] == 0).all()


def test_a_path_is_surer_than_its_frames():
    poses, evidence = measured()
    found = solve_path(path_of(poses, evidence, freedom=np.inf))
    inner = np.einsum("tii->ti", found.covariances)[2:-2]
    assert (inner < 0.02**2).all()
    assert inner.mean() < 0.75 * 0.02**2


@pytest.mark.slow
def test_blocks_give_what_one_piece_gives(monkeypatch):
    poses, evidence = measured(n_frames=70)
    path, groups = path_of(poses, evidence), motion_points(MODEL).groups
    motion = MotionModel(groups, np.full(len(groups), 1e-4))
    whole = solve_path(path, motion=motion).poses
    monkeypatch.setattr(solve, "_BLOCK_FRAMES", 35)
    parts = solve_path(path, motion=motion).poses
    gaps = [MODEL.points_world(a) - MODEL.points_world(b) for a, b in zip(parts, whole, strict=True)]
    assert np.abs(gaps).max() < 0.002


def test_a_step_may_end_the_work():
    poses, evidence = measured()

    def stop():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solve_path(path_of(poses, evidence), stop)
