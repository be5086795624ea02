"""The solve of a whole path against a general minimizer, and what stays in it."""

import numpy as np
import pytest
from bodies import MODELS
from gaussian_prior import GaussianPrior
from scipy.optimize import minimize

from tracker.compute.progress import result_of
from tracker.estimation.trajectory import solve
from tracker.estimation.trajectory.motion_model import MotionModel, motion_points
from tracker.estimation.trajectory.solve import PosedPath, solve_path

T, FPS = 8, 30.0
MODEL = MODELS["gavrila22"]


def measured(n_frames=T, sigma=0.02):
    """A body that turns evenly, measured with noise: the poses, and the evidence of each frame."""
    rng, n = np.random.default_rng(0), MODEL.n_dofs
    rate, at = 0.02 * rng.normal(size=n), range(n_frames)
    poses = [MODEL.clip(MODEL.retract(MODEL.neutral(), t * rate + sigma * rng.normal(size=n))) for t in at]
    return np.array(poses), [[GaussianPrior(pose, np.eye(n) / sigma**2)] for pose in poses]


def path_of(poses, evidence, fixed=(), active=None):
    at = np.isin(np.arange(len(poses)), fixed)
    return PosedPath(MODEL, np.arange(len(poses)) / FPS, poses, evidence.__getitem__, at, active)


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


def solved(path):
    return result_of(solve_path(path)).poses


@pytest.mark.slow
def test_no_other_path_costs_less(monkeypatch):
    """With a motion that is known, a general minimizer that begins at the solution finds nothing better."""
    poses, evidence = measured()
    groups = motion_points(MODEL).groups
    motion = MotionModel(groups, np.full(len(groups), 1e-4))
    monkeypatch.setattr(MotionModel, "learned", lambda *_: motion)
    path = path_of(poses, evidence)
    solution = solved(path)

    def cost(steps):
        moved = zip(solution, steps.reshape(T, -1), strict=True)
        return cost_of(path, [MODEL.clip(MODEL.retract(pose, step)) for pose, step in moved], motion)

    monkeypatch.setattr(solve._Solver, "_learn", lambda self, here, inverse: setattr(self, "motion", motion))
    solution = solved(path)  # without the variance that learning adds
    start = np.zeros(T * MODEL.n_dofs)
    best = minimize(cost, start, method="L-BFGS-B", options={"maxiter": 20})
    assert cost(start) < cost_of(path, poses, motion) - 10
    assert best.fun > cost(start) - 1  # nat


def test_fixed_poses_and_locked_degrees_of_freedom_stay():
    poses, evidence = measured()
    active = np.arange(MODEL.n_dofs) % 3 > 0
    start = np.tile(MODEL.neutral(), (T, 1))
    start[2] = poses[2]
    found, covariances = result_of(solve_path(path_of(start, evidence, fixed=[2], active=active)))
    np.testing.assert_array_equal(found[2], poses[2])
    assert not covariances[2].any()
    assert not covariances[:, ~active].any()
    assert not covariances[..., ~active].any()
    assert np.linalg.eigvalsh(np.delete(covariances, 2, axis=0)[:, active][..., active]).min() > 0
    others = np.delete(found, 2, axis=0)
    locked = MODEL.dof_value[~active]
    np.testing.assert_array_equal(others[:, locked], np.delete(start, 2, axis=0)[:, locked])
    assert np.abs(others - MODEL.neutral()).max() > 0.01


class Counted(GaussianPrior):
    """Evidence that counts how often it is read."""

    n_reads = 0

    def linearize(self, model, pose, kinematics):
        Counted.n_reads += 1
        return super().linearize(model, pose, kinematics)


def test_limits_do_not_mislead_the_angles_that_depend_on_them(monkeypatch):
    """Each frame wants many angles beyond their limits, and others depend on these: its evidence shows half of them.

    Few readings of the evidence lead to the path. With limits that only cut steps, 405 led to one 50 nats dearer.
    """
    rng, n = np.random.default_rng(0), MODEL.n_dofs
    J = rng.normal(size=(n // 2, n)) / 0.02
    wanted = [MODEL.neutral() + rng.normal(size=n) for _ in range(T)]
    evidence = [[Counted(pose, J.T @ J + np.eye(n))] for pose in wanted]
    groups = motion_points(MODEL).groups
    motion = MotionModel(groups, np.full(len(groups), 1e-2))
    monkeypatch.setattr(MotionModel, "learned", lambda *_: motion)
    path = path_of(np.tile(MODEL.neutral(), (T, 1)), evidence)
    monkeypatch.setattr(Counted, "n_reads", 0)
    poses = solved(path)
    assert Counted.n_reads <= 15 * T
    assert cost_of(path, poses, motion) < 605


def far_apart(one, other):
    return max(np.abs(MODEL.points_world(a) - MODEL.points_world(b)).max() for a, b in zip(one, other, strict=True))


def in_blocks(monkeypatch, n_frames, overlap):
    monkeypatch.setattr(solve, "_BLOCK_FRAMES", n_frames)
    monkeypatch.setattr(solve, "_OVERLAP_FRAMES", overlap)
    monkeypatch.setattr(solve, "FRAMES_AT_ONCE", n_frames)


def test_blocks_give_nearly_what_one_piece_gives(monkeypatch):
    path = path_of(*measured(n_frames=45))
    whole = solved(path)
    in_blocks(monkeypatch, 25, 20)
    assert 0 < far_apart(solved(path), whole) < 0.005


def test_frames_are_counted_once_as_their_evidence_is_read(monkeypatch):
    in_blocks(monkeypatch, 5, 2)
    counts = list(solve_path(path_of(*measured(n_frames=10))))
    assert counts == sorted(counts)
    assert counts[-1] == 10
    assert len(counts) == 14


def test_covariances_are_those_of_a_linear_problem(monkeypatch):
    """With a Gaussian motion that is known, the inverse of the normal matrix of all frames at once."""
    poses, evidence = measured()
    groups = motion_points(MODEL).groups
    motion = MotionModel(groups, np.full(len(groups), 1e-2), np.inf)
    monkeypatch.setattr(MotionModel, "learned", lambda *_: motion)
    found, covariances = result_of(solve_path(path_of(poses, evidence)))
    n, c = MODEL.n_dofs, np.array([1.0, -2.0, 1.0])
    kinematics = [MODEL.kinematics(pose) for pose in found]
    _, J = motion_points(MODEL).linearized(found)
    H = np.zeros((T, n, T, n))
    for t, pose in enumerate(found):
        H[t, :, t] += evidence[t][0].linearize(MODEL, pose, kinematics[t]).hessian
    for t in range(T - 2):
        for i in range(3):
            for k in range(3):
                H[t + i, :, t + k] += c[i] * c[k] * J[t + i].T @ J[t + k] / 1e-2
    expected = np.linalg.inv(H.reshape(T * n, T * n)).reshape(T, n, T, n)
    for t in range(T):
        np.testing.assert_allclose(covariances[t], expected[t, :, t], rtol=0.02, atol=1e-6)


@pytest.mark.parametrize("n_frames", [1, 160, 161, 330, 1000])
def test_blocks_cover_a_run_once_and_are_solved_with_few_frames(n_frames):
    blocks = solve.even_blocks(n_frames)
    assert [k for own, _ in blocks for k in range(n_frames)[own]] == list(range(n_frames))
    assert len(blocks) == (1 if n_frames <= solve.FRAMES_AT_ONCE else -(-n_frames // 120))
    for own, used in blocks:
        assert used.stop - used.start <= solve.FRAMES_AT_ONCE
        assert (used.start, used.stop) == (max(0, own.start - 20), min(n_frames, own.stop + 20)) or len(blocks) == 1
