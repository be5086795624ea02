"""Cameras and joints in one adjustment."""

from dataclasses import replace

import numpy as np
import pytest
from filmed_people import blanks, dancing, observed, rig

from tracker.calibration.boards.expected_error import expected_error
from tracker.calibration.check.lens_priors import CALIBRATED
from tracker.calibration.check.point_problem import PointProblem
from tracker.calibration.check.rig_adjustment import Observations, Prior, Rig, column_ends
from tracker.calibration.self_calibration.joint_adjustment import Gauge, UnknownLenses, adjust_joints
from tracker.calibration.self_calibration.seen_joints import joints_of_people
from tracker.geometry.camera_derivatives import FOCAL, POSE, SHIFT, moved_camera, n_camera_parameters

CAMERAS = rig(3)


def seen(sigma_px=0.0, gross=0.0, n_frames=4):
    observations = observed(CAMERAS, dancing(n_frames), sigma_px, gross)
    return joints_of_people(observations, np.zeros((n_frames, len(CAMERAS), 1), dtype=int), 1)


@pytest.mark.slow
def test_one_camera_and_one_coordinate_stay_where_they_were():
    joints = seen(1.0)
    adjusted = adjust_joints(CAMERAS, joints.observations(), joints.n_joints, Gauge(0, 2))
    np.testing.assert_array_equal(adjusted.cameras[0].T_world_camera, CAMERAS[0].T_world_camera)
    ends, sigmas = column_ends(CAMERAS), np.sqrt(np.diag(adjusted.fit.covariance))
    assert np.count_nonzero(sigmas[ends[0] : ends[1]]) == 0
    assert np.count_nonzero(sigmas[ends[1] : ends[2]][POSE]) == 6
    assert np.count_nonzero(sigmas[ends[2] : ends[3]][SHIFT]) == 2
    assert adjusted.fit.focal_sigmas.tolist() == [0, 0, 0]


@pytest.mark.slow
def test_errors_that_repeat_on_all_frames_count_once():
    """A detector that places a joint beside the true one does so on each frame."""
    joints = seen(1.0, n_frames=8)
    offsets = 3 * np.random.default_rng(0).normal(size=(1, 3, joints.n_joints, 2))
    alone = adjust_joints(CAMERAS, joints.observations(), joints.n_joints, Gauge(0, 2))
    shifted = replace(joints, px=joints.px + offsets)
    adjusted = adjust_joints(CAMERAS, shifted.observations(), joints.n_joints, Gauge(0, 2))
    assert alone.share < 1.3
    assert 4 < adjusted.share < 8.5


def test_cameras_that_see_no_joint_together_are_not_adjusted():
    joints = seen()
    alone = Observations(*(v[:0] for v in (joints.observations().cameras,) * 2), np.zeros((0, 2)))
    assert adjust_joints(CAMERAS, alone, joints.n_joints, Gauge(0, 2)) is None


def test_lenses_of_one_model_pull_each_other():
    means = blanks(CAMERAS)
    prior = Prior(
        tuple(means), tuple(np.where(np.arange(n_camera_parameters(c)) == FOCAL, 0.5, 0.0) for c in means), ((0, 1),)
    )
    alike = PointProblem(Observations(np.zeros(0, int), np.zeros(0, int), np.zeros((0, 2))), prior, 1, np.ones(3))

    def cost(logs):
        moved = []
        for camera, log in zip(means, logs, strict=True):
            step = np.zeros(n_camera_parameters(camera))
            step[FOCAL] = log
            moved.append(moved_camera(camera, step))
        return alike.linearize(Rig(tuple(moved), np.zeros((1, 3))))

    at = np.array([0.02, -0.01, 0.3])
    found = cost(at)
    apart = 0.5 * (0.015**2 + 0.015**2) / CALIBRATED.focal**2
    assert found.cost == pytest.approx(apart + 0.5 * np.sum(at**2) / 0.5**2)
    steps = 1e-5 * np.eye(3)
    slopes = [(cost(at + s).cost - cost(at - s).cost) / 2e-5 for s in steps]
    np.testing.assert_allclose(found.gradient, slopes, rtol=1e-6)
    np.testing.assert_allclose(found.hessian @ at, found.gradient, rtol=1e-9)


@pytest.mark.slow
def test_a_focal_length_comes_from_the_joints_not_from_the_mean():
    joints = seen(0.5, n_frames=8)
    lenses = UnknownLenses(tuple(blanks(CAMERAS)), ((0, 1, 2),))
    adjusted = adjust_joints(CAMERAS, joints.observations(), joints.n_joints, Gauge(0, 2), lenses)
    assert [c.K[0, 0] for c in adjusted.cameras] == pytest.approx([500] * 3, rel=0.03)


def test_a_common_scale_is_no_error_where_the_scale_is_unknown():
    points = dancing(2).reshape(-1, 3)
    ends = column_ends(CAMERAS)
    grow = np.zeros(ends[-1])
    for i, camera in enumerate(CAMERAS):  # all centres move away from the origin by 1%
        grow[ends[i] : ends[i + 1]][SHIFT] = 0.01 * camera.T_camera_world[:3, :3] @ camera.center_world
    covariance = np.outer(grow, grow)
    assert expected_error(CAMERAS, covariance, points).expected_m > 0.002
    assert expected_error(CAMERAS, covariance, points, with_scale=False).expected_m < 1e-6
