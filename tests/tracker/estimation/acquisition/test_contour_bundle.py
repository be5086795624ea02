"""The fit of people and cameras: sums of a kernel against those of numpy, and the derivatives of its cost."""

import numpy as np
import pytest
from rig_oracle import columns, motions_of_points, sums_of_rows
from rig_scenes import CAMERAS, viewed

from tracker.calibration.check.fault_search import as_tracked, prior_sigmas
from tracker.calibration.check.judged_frames import seen_people
from tracker.estimation.acquisition.contour_bundle import ContourBundle
from tracker.estimation.acquisition.part_derivatives import N_MOTIONS, part_jacobian
from tracker.estimation.acquisition.piece_sums import (
    OF_CAMERA,
    OF_PART,
    GroupSums,
    SeenPieces,
    _camera_motions,
    sums_of_views,
)
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.geometry.camera_correction import DRIFT, N_CORRECTIONS, ROTATION, TIME, corrected
from tracker.geometry.camera_derivatives import project_with_columns
from tracker.geometry.rigid import so3_exp

CORRECTION = np.array([0.004, -0.003, 0.002, 0.01, -0.005, 0.01, 0.003, 0.0, 0.0])


@pytest.fixture(scope="module")
def pieces():
    """The residuals of one view under a corrected camera, with body, pose and camera."""
    (frame,) = viewed({}, [0])
    body, camera = frame.bodies[0], corrected(CAMERAS[0], CORRECTION)
    return ContourResiduals([frame.views[0]], frame.bodies).piece_sums(body.kinematics, camera=camera)[1], body, camera


def summed(pieces, with_shapes):
    """The pieces summed by the kernel, and all of their columns: those of the part and then of its camera, by ours."""
    sums, body, camera = pieces
    n = N_MOTIONS if with_shapes else 9
    (found,), all_columns = sums_of_views([(camera, sums)], body.model, body.kinematics, n), np.zeros((n + TIME, n + 1))
    all_columns[:n, OF_PART] = np.eye(n)
    all_columns[n:, OF_CAMERA] = _camera_motions(camera.T_camera_world, so3_exp(CORRECTION[ROTATION]))
    return found, all_columns


@pytest.mark.parametrize("with_shapes", [False, True])
def test_the_kernel_sums_as_numpy_does(pieces, with_shapes):
    sums, body, camera = pieces
    (b, M), columns_of = summed(pieces, with_shapes)
    Ts, shapes = body.kinematics.Ts_world_part[sums.parts], body.model.shapes
    half_axes = np.array([s.half_axes for s in shapes])[sums.parts]
    local = body.model.centers_part[sums.parts] + sums.unit_points * half_axes
    points = np.einsum("nij,nj->ni", Ts[:, :3, :3], local) + Ts[:, :3, 3]
    of_part = motions_of_points(shapes, sums.parts, Ts, points, sums.unit_points, with_shapes)
    by_point = project_with_columns(camera, points).by_point
    rows = np.concatenate([by_point @ of_part, columns(camera, CORRECTION, points)], axis=2)
    expected_b, expected_M = sums_of_rows(sums, rows, len(shapes))
    np.testing.assert_allclose(b @ columns_of.T, expected_b, rtol=1e-9, atol=1e-9 * np.abs(expected_b).max())
    found_M = columns_of @ M @ columns_of.T
    np.testing.assert_allclose(found_M, expected_M, rtol=1e-9, atol=1e-9 * np.abs(expected_M).max())


@pytest.mark.parametrize("with_shapes", [False, True])
def test_sums_are_converted_as_all_columns_at_once(pieces, with_shapes):
    _, body, camera = pieces
    parameters, velocity = SizeParameters(body.model), np.random.default_rng(1).normal(size=body.model.n_dofs)
    by_sizes = parameters.derivatives(np.zeros(len(parameters.names)))
    J = part_jacobian(body.model, body.kinematics, by_sizes, with_shapes)
    sums, columns_of = summed(pieces, with_shapes)
    moving = J[:, :, -len(velocity) :] @ velocity
    found = GroupSums.zeros(2 * N_CORRECTIONS, J.shape[2])
    by_parts = np.zeros((2 * N_CORRECTIONS, J.shape[0] * J.shape[1]))
    found.add_camera(SeenPieces(1, camera, 0.0, pieces[0]), sums, CORRECTION, moving, 0.7, by_parts)
    found.add_body([sums], J, by_parts)
    n_parts, n_motions, n = len(J), J.shape[1], 2 * N_CORRECTIONS + J.shape[2]
    whole = np.zeros((n_parts, len(columns_of), n))
    whole[:, :n_motions, 2 * N_CORRECTIONS :] = J
    whole[:, n_motions:, N_CORRECTIONS : N_CORRECTIONS + TIME] = np.eye(TIME)
    whole[:, :n_motions, N_CORRECTIONS + TIME] = moving
    whole[:, :n_motions, N_CORRECTIONS + DRIFT] = 0.7 * moving
    whole = columns_of.T @ whole
    equations = found.equations(0.0)
    np.testing.assert_allclose(equations.gradient, np.einsum("pik,pi->k", whole, sums.b), atol=1e-6)
    expected = np.sum(whole.transpose(0, 2, 1) @ sums.M @ whole, axis=0)
    np.testing.assert_allclose(equations.hessian, expected, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize("column", [0, 1, 3, 4])
def test_the_gradient_by_a_correction_is_the_slope_of_the_cost(column):
    frames = viewed({1: CORRECTION}, [0, 1])
    parameters = [SizeParameters(frames[0].bodies[0].model)]
    state = as_tracked(frames, parameters)
    problem = ContourBundle(seen_people(frames), parameters, state.corrections, prior_sigmas(30.0))

    def cost(h):
        step = np.zeros(problem.n_shared)
        step[N_CORRECTIONS + column] = h
        return problem.linearize(problem.moved(state, step, np.zeros((2, parameters[0].base.n_dofs)))).cost

    slope = (cost(3e-4) - cost(-3e-4)) / 6e-4
    assert problem.linearize(state).gradient[N_CORRECTIONS + column] == pytest.approx(slope, rel=0.15)


def test_a_sole_candidate_is_taken_at_any_cost():
    frames = viewed({}, [0])
    parameters = [SizeParameters(frames[0].bodies[0].model)]
    state = as_tracked(frames, parameters)
    problem = ContourBundle(seen_people(frames), parameters, state.corrections, prior_sigmas(30.0))
    whole = problem.linearize(state)
    dear, cheap = (problem.linearize(state, below) for below in (whole.cost, whole.cost + 1e-6))
    assert dear.cost == cheap.cost == whole.cost
    assert not dear.hessian.any()
    np.testing.assert_array_equal(cheap.hessian, whole.hessian)
