"""The fit of a rig: sums of a kernel against those of numpy, and the derivatives of its cost."""

import numpy as np
import pytest
from rig_oracle import columns
from rig_scenes import CAMERAS, viewed

from tracker.calibration.check.fault_search import prior_sigmas
from tracker.calibration.check.viewed_frames import seen_people
from tracker.estimation.acquisition.contour_bundle import GroupSums, RigProblem, RigState, part_motions, sums_of_pieces
from tracker.estimation.acquisition.part_motions import rows_of_pieces
from tracker.estimation.acquisition.piece_kernels import N_PART, OF_CAMERA, OF_PART, _camera_motions
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.geometry.camera_correction import DRIFT, N_CORRECTIONS, ROTATION, TIME, corrected
from tracker.geometry.rigid import so3_exp

CORRECTION = np.array([0.004, -0.003, 0.002, 0.01, -0.005, 0.01, 0.003, 0.0, 0.0])


@pytest.fixture(scope="module")
def pieces():
    """The residuals of one view under a corrected camera, with body, pose and camera."""
    (frame,) = viewed({}, [0])
    body, camera = frame.bodies[0], corrected(CAMERAS[0], CORRECTION)
    return ContourResiduals([frame.views[0]], frame.bodies).piece_sums(body.kinematics, camera=camera)[1], body, camera


def summed(pieces):
    """The pieces summed by the kernel, and all of their columns: those of the part and then of its camera, by ours."""
    sums, body, camera = pieces
    half_axes = np.array([s.half_axes for s in body.model.shapes])
    found, all_columns = sums_of_pieces(sums, body.model, body.kinematics, camera, half_axes), np.zeros((16, 10))
    all_columns[:N_PART, OF_PART] = np.eye(N_PART)
    all_columns[N_PART:, OF_CAMERA] = _camera_motions(camera.T_camera_world, so3_exp(CORRECTION[ROTATION]))
    return found, all_columns


def test_the_kernel_sums_as_numpy_does(pieces):
    sums, body, camera = pieces
    (b, M), columns_of = summed(pieces)
    rows = rows_of_pieces([(camera, sums)], body.model, body.kinematics, with_shapes=False)
    of_camera = columns(camera, CORRECTION, rows.points_world, rows.px_by_point)
    rows = rows._replace(rows=np.concatenate([rows.rows[:, :, :N_PART], of_camera], axis=2))
    expected_b, expected_M = rows.sums(len(body.model.parts))
    np.testing.assert_allclose(b @ columns_of.T, expected_b, rtol=1e-9, atol=1e-9 * np.abs(expected_b).max())
    found_M = columns_of @ M @ columns_of.T
    np.testing.assert_allclose(found_M, expected_M, rtol=1e-9, atol=1e-9 * np.abs(expected_M).max())


def test_sums_are_converted_as_all_columns_at_once(pieces):
    _, body, camera = pieces
    parameters, velocity = SizeParameters(body.model), np.random.default_rng(1).normal(size=body.model.n_dofs)
    by_sizes = parameters.derivatives(np.zeros(len(parameters.names)))
    J = part_motions(body.model, body.kinematics, by_sizes)
    sums, columns_of = summed(pieces)
    moving = J[:, :, -len(velocity) :] @ velocity
    found = GroupSums.zeros(2 * N_CORRECTIONS, J.shape[2], len(J))
    found.add_camera(1, sums, camera, CORRECTION, moving, 0.7)
    found.add_body(sums, J)
    n_parts, n = len(J), 2 * N_CORRECTIONS + J.shape[2]
    whole = np.zeros((n_parts, len(columns_of), n))
    whole[:, :N_PART, 2 * N_CORRECTIONS :] = J
    whole[:, N_PART:, N_CORRECTIONS : N_CORRECTIONS + TIME] = np.eye(TIME)
    whole[:, :N_PART, N_CORRECTIONS + TIME] = moving
    whole[:, :N_PART, N_CORRECTIONS + DRIFT] = 0.7 * moving
    whole = columns_of.T @ whole
    equations = found.equations(0.0)
    np.testing.assert_allclose(equations.gradient, np.einsum("pik,pi->k", whole, sums.b), atol=1e-6)
    expected = np.sum(whole.transpose(0, 2, 1) @ sums.M @ whole, axis=0)
    np.testing.assert_allclose(equations.hessian, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("column", [0, 1, 3, 4])
def test_the_gradient_by_a_correction_is_the_slope_of_the_cost(column):
    frames = viewed({1: CORRECTION}, [0, 1])
    parameters = [SizeParameters(frames[0].bodies[0].model)]
    state = RigState(
        np.zeros((4, N_CORRECTIONS)), (np.zeros(len(parameters[0].names)),), tuple(f.bodies[0].values for f in frames)
    )
    problem = RigProblem(seen_people(frames), parameters, prior_sigmas(30.0), state.corrections)

    def cost(h):
        step = np.zeros(problem.n_shared)
        step[N_CORRECTIONS + column] = h
        return problem.linearize(problem.moved(state, step, np.zeros((2, parameters[0].base.n_dofs)))).cost

    slope = (cost(3e-4) - cost(-3e-4)) / 6e-4
    assert problem.linearize(state).gradient[N_CORRECTIONS + column] == pytest.approx(slope, rel=0.15)


def test_where_the_cost_is_not_low_enough_it_is_all_that_is_found():
    frames = viewed({}, [0])
    parameters = [SizeParameters(frames[0].bodies[0].model)]
    state = RigState(np.zeros((4, N_CORRECTIONS)), (np.zeros(len(parameters[0].names)),), (frames[0].bodies[0].values,))
    problem = RigProblem(seen_people(frames), parameters, prior_sigmas(30.0), state.corrections)
    whole = problem.linearize(state)
    dear, cheap = (problem.linearize(state, below) for below in (whole.cost, whole.cost + 1e-6))
    assert dear.cost == cheap.cost == whole.cost
    assert not dear.hessian.any()
    np.testing.assert_array_equal(cheap.hessian, whole.hessian)
