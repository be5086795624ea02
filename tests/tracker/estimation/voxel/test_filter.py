"""The extended Kalman filter: derivatives, covariances over thousands of steps, normalized innovations."""

from dataclasses import replace

import numpy as np
import pytest
from filter_states import some_state
from scipy.stats import chi2

from tracker.estimation.voxel.figure import N_PARTS, point_shares
from tracker.estimation.voxel.kalman import LinearizedMeasurement, update
from tracker.estimation.voxel.labels import PartClouds
from tracker.estimation.voxel.measurement import MeasurementNoise, linearize, linearize_rotations, measure_parts
from tracker.estimation.voxel.motion_model import ProcessNoise, predict, process_covariance, transition
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.estimation.voxel.state import point_jacobians
from tracker.geometry import rigid

STEP = 1e-6
NOISE = MeasurementNoise(0.02, 0.2, 0.1, 0.02, None)
PROCESS = ProcessNoise(0.2, 6.0, 0.01, 0.02, 2.0, 1.5)
ALL = np.ones(N_PARTS, dtype=bool)


def differences(state, values):
    """Derivative of a function of a state by its error state, by central differences."""
    columns = []
    for i in range(state.layout.n):
        step = np.zeros(state.layout.n)
        step[i] = STEP
        columns.append((values(state.retract(step)) - values(state.retract(-step))) / (2 * STEP))
    return np.stack(columns, axis=-1)


def test_retract_and_difference_are_inverse():
    state = some_state()
    step = 0.3 * np.random.default_rng(1).normal(size=state.layout.n)
    step[state.layout.sizes_at] *= 0.02
    np.testing.assert_allclose(state.retract(step).difference(state), step, atol=1e-12)


@pytest.mark.slow
def test_derivatives_of_centers_and_joints():
    state = some_state()
    np.testing.assert_allclose(state.center_jacobian, differences(state, lambda s: s.centers), atol=1e-6)
    _, parts, shares = point_shares(state.figure)
    for i, a, found in zip(parts, shares, point_jacobians(state, parts, shares), strict=True):
        expected = differences(state, lambda s, i=i, a=a: s.centers[i] + s.rotations[i] @ (a * s.sizes[i]))
        np.testing.assert_allclose(found, expected, atol=1e-6)


def test_derivative_of_the_transition():
    state, dt = some_state(), 0.13
    F, step = transition(state, dt, PROCESS.damping)
    moved = state.retract(step)
    expected = differences(state, lambda s: s.retract(transition(s, dt, PROCESS.damping)[1]).difference(moved))
    np.testing.assert_allclose(F, expected, atol=1e-6)


def clouds_of(state, other):
    """The voxels of another state's parts, as seen from the parts of a state."""
    offsets = np.einsum("mji,mj->mi", state.rotations, other.centers - state.centers)
    turns = np.swapaxes(state.rotations, 1, 2) @ other.rotations
    variances = (state.figure.sigma_shares * other.sizes) ** 2
    return PartClouds(np.full(N_PARTS, 500.0), offsets, np.einsum("mij,mj,mkj->mik", turns, variances, turns))


def test_derivative_of_the_measurement():
    """Residuals of the same voxels from states nearby, against the Jacobian."""
    settings = VoxelSettings(sizes="always")
    state = some_state(3, settings)
    nudge = 0.02 * np.random.default_rng(4).normal(size=state.layout.n)
    nudge[state.layout.sizes_at] *= 0.05
    # Sizes that differ along all axes, so that no axis can be mistaken for another.
    scale = np.zeros(state.layout.n)
    scale[state.layout.sizes_at] = np.tile([0.0, 0.04, 0.1], N_PARTS)
    state = state.retract(scale)
    other = state.retract(nudge)

    def residual(s):
        equations = linearize(s, measure_parts(s, clouds_of(s, other), 0.01, by_size=False), NOISE, ALL, True)
        rows = equations.residual.reshape(N_PARTS, 9).copy()
        return rows

    equations = linearize(state, measure_parts(state, clouds_of(state, other), 0.01, by_size=False), NOISE, ALL, True)
    expected = -differences(state, residual).reshape(9 * N_PARTS, -1)
    np.testing.assert_allclose(equations.jacobian, expected, atol=1e-6)


def test_sizes_of_a_part_that_is_merged_with_another_count_less():
    """The trunk is as deep as it is wide where arms lie on it."""
    state, noise = some_state(3), NOISE._replace(independent_m3=0.0003)

    def size_variances(other):
        equations = linearize(
            state, measure_parts(state, clouds_of(state, other), 0.01, by_size=False), noise, ALL, True
        )
        return np.diag(equations.noise).reshape(N_PARTS, 9)[:, 6:]

    sizes = state.sizes.copy()
    sizes[0, :2] *= 2.0
    alone, merged = size_variances(state), size_variances(replace(state, sizes=sizes))
    assert np.all(merged[0] > 2 * alone[0])
    np.testing.assert_allclose(merged[1:], alone[1:])


def test_derivative_of_measured_rotations():
    state, other = some_state(5), some_state(6)
    linearized = linearize_rotations(state, other.rotations, 0.1)
    expected = -differences(state, lambda s: linearize_rotations(s, other.rotations, 0.1).residual)
    np.testing.assert_allclose(linearized.jacobian, expected, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("n_steps", [60, 3000])
@pytest.mark.parametrize("paper", [False, True])
def test_covariances_stay_positive_definite_over_thousands_of_steps(paper, n_steps):
    """Some steps measure nothing, some a single part, and some very precisely."""
    settings = VoxelSettings(sizes="always", turn_rates=not paper)
    state, rng = some_state(0, settings), np.random.default_rng(0)
    for k in range(n_steps):
        state = predict(state, (1 / 30, 0.1, 1e-3)[k % 3], PROCESS)
        target = state.retract(0.05 * rng.normal(size=state.layout.n) * (np.arange(state.layout.n) < 33))
        used = ALL if k % 5 else rng.random(N_PARTS) < 0.2
        noise = NOISE if k % 7 else NOISE._replace(across_m=1e-6, turn=1e-6)
        state = update(state, lambda s, t=target, u=used, n=noise: linearize(
            s, measure_parts(s, clouds_of(s, t), 0.05, by_size=False), n, u, True)).state  # fmt: skip
        if k % 50 == 0:
            assert np.linalg.eigvalsh(state.covariance).min() > 0
            np.testing.assert_allclose(state.covariance, state.covariance.T)
    assert np.linalg.eigvalsh(state.covariance).min() > 0
    np.testing.assert_allclose(np.linalg.norm(state.quaternions, axis=1), 1.0)


def simulated_innovations(process, noise, seed):
    """Squared normalized innovations of a filter that is told another noise than that of the data."""
    rng, dt = np.random.default_rng(seed), 1 / 30
    state = some_state(seed, VoxelSettings(sizes="frozen"))
    truth = state.retract(rng.multivariate_normal(np.zeros(state.layout.n), state.covariance))
    out, n_rows = [], 0
    for _ in range(60):
        truth = truth.retract(transition(truth, dt, PROCESS.damping)[1])
        truth = truth.retract(rng.multivariate_normal(np.zeros(truth.layout.n), process_covariance(truth, dt, PROCESS)))
        offsets = NOISE.across_m * rng.normal(size=(N_PARTS, 3))
        turned = truth.rotations @ rigid.so3_exp(NOISE.turn * rng.normal(size=(N_PARTS, 3)))

        def measure(s, centers=truth.centers + offsets, rotations=turned):
            linearized = linearize_rotations(s, rotations, noise.turn)
            H = np.concatenate([s.center_jacobian.reshape(3 * N_PARTS, -1), linearized.jacobian])
            R = np.diag(np.repeat([noise.across_m**2, noise.turn**2], 3 * N_PARTS))
            return LinearizedMeasurement(np.concatenate([(centers - s.centers).ravel(), linearized.residual]), H, R)

        result = update(predict(state, dt, process), measure)
        state, n_rows = result.state, result.n_rows
        out.append(result.normalized_innovation)
    return np.array(out), n_rows


@pytest.mark.slow
def test_normalized_innovations_lie_within_their_bounds():
    """Their sum is chi-square distributed where the filter knows the noise of the data."""
    found = [simulated_innovations(PROCESS, NOISE, seed) for seed in range(4)]
    total, freedom = sum(f[0].sum() for f in found), sum(len(f[0]) * f[1] for f in found)
    low, high = chi2.ppf([0.001, 0.999], freedom)
    assert low < total < high
    wrong, _ = simulated_innovations(PROCESS, NOISE._replace(turn=2 * NOISE.turn), 0)
    assert wrong.sum() < chi2.ppf(0.001, freedom / 4)
