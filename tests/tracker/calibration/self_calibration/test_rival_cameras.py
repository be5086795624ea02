"""Cameras that see near and far exchanged, which explain the joints of a person far away as well as the true ones."""

from dataclasses import replace

import numpy as np
import pytest
from detected_people import acted, detected
from filmed_people import STATURE_M, blanks, dancing, joint_errors_m, observed, rig

from tracker.calibration.self_calibration.joint_adjustment import Gauge, adjust_joints
from tracker.calibration.self_calibration.keypoint_calibration import calibrate_by_person
from tracker.calibration.self_calibration.rival_cameras import (
    Solution,
    compared,
    misfits,
    reversed_in_depth,
    turned_half,
)
from tracker.calibration.self_calibration.seen_joints import joints_of_people
from tracker.errors import CalibrationError
from tracker.simulate.stage.camera_rig import make_cameras

MIDDLE = np.array([0.0, 0.0, 1.0])


def distant(factor):
    """Cameras that are farther away by a factor, with lenses that show the person as large as before."""
    out = []
    for camera in rig():
        K, T = camera.K.copy(), camera.T_world_camera.copy()
        K[[0, 1], [0, 1]] *= factor
        T[:3, 3] = MIDDLE + factor * (T[:3, 3] - MIDDLE)
        out.append(replace(camera, K=K, T_world_camera=T))
    return out


def adjusted(cameras, reach=0.0, sigma_px=3.0):
    joints = joints_of_people(
        observed(cameras, dancing(8, reach=reach), sigma_px), np.zeros((8, len(cameras), 1), dtype=int), 1
    )
    return Solution(adjust_joints(cameras, joints.observations(), joints.n_joints, Gauge(0, 1)), Gauge(0, 1)), joints


def test_reflected_joints_look_the_same_in_distant_cameras_that_are_turned_half():
    points = MIDDLE + 0.8 * np.random.default_rng(0).uniform(-1, 1, (50, 3))
    for factor, apart_px in ((1, 100), (100, 2)):
        cameras = distant(factor)
        for camera, turned in zip(cameras, turned_half(cameras, MIDDLE), strict=True):
            off = np.linalg.norm(turned.project(2 * MIDDLE - points) - camera.project(points), axis=1)
            assert off.max() < apart_px
            assert off.max() > apart_px / 10
            np.testing.assert_allclose(turned.project(MIDDLE[None]), camera.project(MIDDLE[None]), atol=1e-9)
            np.testing.assert_allclose(turned.center_world, camera.center_world)


@pytest.mark.slow
def test_the_reversal_of_reversed_cameras_is_chosen():
    true, joints = adjusted(distant(1))
    wrong = reversed_in_depth(true, joints, None)
    own, others = misfits([true.adjusted, wrong.adjusted], joints)
    assert others > own + 100
    comparison = compared([wrong], joints, None)
    assert comparison.rivals == ()
    for a, b in zip(comparison.chosen.adjusted.cameras, true.adjusted.cameras, strict=True):
        np.testing.assert_allclose(a.T_world_camera[:3, :3], b.T_world_camera[:3, :3], atol=0.02)


@pytest.mark.slow
def test_equal_solutions_are_no_rivals_and_the_first_is_chosen():
    true, joints = adjusted(distant(1))
    comparison = compared([true, Solution(true.adjusted, Gauge(1, 2))], joints, None)
    assert comparison.chosen is true
    assert comparison.rivals == ()


@pytest.mark.slow
def test_both_solutions_of_distant_cameras_are_rivals():
    true, joints = adjusted(distant(32))
    comparison = compared([true], joints, None)
    assert comparison.chosen is true
    assert len(comparison.rivals) == 1


def test_joints_that_a_solution_does_not_determine_are_gross_errors():
    true, joints = adjusted(distant(1))
    few = joints.on_frames(np.arange(4))
    half = adjust_joints(true.adjusted.cameras, few.observations(), few.n_joints, Gauge(0, 1))
    own, others = misfits([true.adjusted, half], joints)
    assert others > own + 0.8 * 8 * len(few.observations().px) / true.adjusted.share - own / 2


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "seed", "has_lenses"), [("exercise", 1, True), ("walk_in_place", 5, False)])
def test_a_person_on_one_spot_is_not_seen_reversed(scene, seed, has_lenses):
    cameras = make_cameras(4, (640, 480), seed)
    lenses = cameras if has_lenses else blanks(cameras)
    calibration = calibrate_by_person(detected(cameras, acted(scene, 20, seed)[0], seed), lenses, 1.78, has_lenses)
    assert min(c.center_world[2] for c in calibration.cameras) > 1.5  # all are 2.2 m high


@pytest.mark.slow
def test_a_small_motion_before_distant_cameras_is_refused():
    cameras, points = distant(32), dancing(20, reach=0.0)
    with pytest.raises(
        CalibrationError,
        match=r"one arrangement of the cameras, found another one, as with near and far exchanged, "
        ".*; let the person walk towards",
    ):
        calibrate_by_person(observed(cameras, points), cameras, STATURE_M, has_lenses=True)


@pytest.mark.slow
def test_a_person_who_walks_before_distant_cameras_is_not_refused():
    cameras, points = distant(16), dancing(20, reach=1.0)
    calibration = calibrate_by_person(observed(cameras, points), cameras, STATURE_M, has_lenses=True)
    assert np.median(joint_errors_m(calibration, points)[1]) < 0.035
