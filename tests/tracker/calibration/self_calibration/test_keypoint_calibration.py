"""Cameras from key points of a simulated person, with noise of 3 px and gross errors, against the true ones."""

from dataclasses import replace

import numpy as np
import pytest
from detected_people import acted, detected
from filmed_people import FOCAL_PX, NAMES, STATURE_M, blanks, dancing, joint_errors_m, observed, rig

from tracker.calibration.self_calibration.keypoint_calibration import calibrate_by_person
from tracker.calibration.self_calibration.seen_joints import joints_of_people
from tracker.errors import CalibrationError
from tracker.interchange.observations.sides import with_sides_exchanged

SIDES = [(NAMES.index(n), NAMES.index("L" + n[1:])) for n in NAMES if n[0] == "R" and "L" + n[1:] in NAMES]


def center_errors_m(found, true, points):
    """Distances of the camera centres from the true ones, in the world of the joints."""
    scale, _, R = joint_errors_m(found, points)
    a = np.array([c.center_world for c in found.cameras]) @ R.T * scale
    b = np.array([c.center_world for c in true])
    return np.linalg.norm(a - a.mean(axis=0) - (b - b.mean(axis=0)), axis=1)


@pytest.mark.slow
def test_cameras_and_focal_lengths_are_found_from_nothing():
    cameras, points = rig(), dancing(12)
    calibration = calibrate_by_person(observed(cameras, points), blanks(cameras), STATURE_M)
    scale, errors, R = joint_errors_m(calibration, points)
    assert scale == pytest.approx(1.0, abs=0.03)
    assert np.median(errors) < 0.035  # 3 px are 24 mm at 4 m
    assert center_errors_m(calibration, cameras, points).max() < 0.15
    focal = np.array([c.K[0, 0] for c in calibration.cameras])
    assert np.all(np.abs(np.log(focal / FOCAL_PX)) < 3 * calibration.adjusted.fit.focal_sigmas)
    assert np.degrees(np.arccos(R[2, 2])) < 6
    assert calibration.world.joints_world[..., 2][np.isfinite(calibration.world.joints_world[..., 2])].min() > -0.25
    assert calibration.adjusted.sigma_px == pytest.approx(3.0, rel=0.15)
    assert 0.001 < calibration.volume.low_m < calibration.volume.expected_m < calibration.volume.high_m < 0.02
    assert 2 < np.median(calibration.held_out.px) < 4
    assert any("one focal length for pictures of one size" in note for note in calibration.notes)


@pytest.mark.slow
def test_gross_errors_and_exchanged_sides_have_no_influence():
    cameras, points = rig(), dancing(15, seed=3)
    observations = observed(cameras, points, gross=0.2)
    is_exchanged = np.zeros((15, 4), dtype=bool)
    is_exchanged[4:8, 1] = True
    px, known = observations.points.points_px[:, :, 0].copy(), observations.points.confidence[:, :, 0].copy()
    observations.points.points_px[:, :, 0] = with_sides_exchanged(px, SIDES, is_exchanged)
    observations.points.confidence[:, :, 0] = with_sides_exchanged(known, SIDES, is_exchanged)
    calibration = calibrate_by_person(observations, cameras, STATURE_M, has_lenses=True)
    assert np.median(joint_errors_m(calibration, points)[1]) < 0.035
    assert center_errors_m(calibration, cameras, points).max() < 0.1
    mended = np.linalg.norm(calibration.seen.px[4:8, 1] - px[4:8, 1], axis=-1)
    assert np.nanmean(mended < 1) > 0.8


@pytest.mark.slow
def test_two_cameras_with_lenses_suffice_and_without_are_refused():
    cameras, points = rig(2, arc=1.2), dancing(12)
    calibration = calibrate_by_person(observed(cameras, points), cameras, None, has_lenses=True)
    assert calibration.cameras[0].K[0, 0] == FOCAL_PX
    assert joint_errors_m(calibration, points)[0] == pytest.approx(1.70 / 1.75, abs=0.03)
    assert calibration.notes[0].startswith("no height was given: the scale is that of a person of 1.75 m")
    with pytest.raises(CalibrationError, match="two alone hardly tell their focal lengths"):
        calibrate_by_person(observed(cameras, points), blanks(cameras), STATURE_M)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("has_lenses", "message"),
    [
        (False, "focal length of camera 'cam0', found it not determined by this footage"),
        (True, "expected key points that determine the cameras to 100 mm, found an error of"),
    ],
)
def test_joints_on_one_line_are_refused(has_lenses, message):
    cameras, points = rig(), np.zeros((4, len(NAMES), 3))
    points[..., 2] = np.linspace(0.1, 1.7, len(NAMES))
    with pytest.raises(CalibrationError, match=message):
        calibrate_by_person(observed(cameras, points), cameras if has_lenses else blanks(cameras), 1.7, has_lenses)


@pytest.mark.slow
def test_cameras_side_by_side_are_refused():
    cameras = rig(2, arc=0.01)
    with pytest.raises(CalibrationError, match="two cameras see from different sides, found none; film the person by"):
        calibrate_by_person(observed(cameras, dancing(5)), cameras, STATURE_M, has_lenses=True)


def test_too_few_frames_are_refused():
    cameras = rig(2, arc=1.2)
    with pytest.raises(CalibrationError, match="in two cameras on at least 3 frames, found 2; film the person where"):
        calibrate_by_person(observed(cameras, dancing(2)), cameras, STATURE_M)


def test_pictures_of_several_people_do_not_count():
    cameras, points = rig(3), dancing(5)
    crowded = observed(cameras, points, crowd=(1,))
    with pytest.raises(
        CalibrationError,
        match=r"one person in camera 'cam1'.*found 0; 5 pictures show several people and were left out, because not "
        "all files name the people; film one person where they see the same place or name the people in the files",
    ):
        calibrate_by_person(crowded, cameras, STATURE_M)


def test_doubtful_joints_and_means_of_joints_do_not_count():
    observations = observed(rig(2, arc=1.2), dancing(3))
    observations.points.confidence[:, 0, 0, 2] = 0.4
    seen = joints_of_people(observations, np.zeros((3, 2, 1), dtype=int), 1)
    assert not seen.is_seen[:, 0, 2].any()
    assert np.isnan(seen.px[:, 0, 2]).all()
    assert seen.is_seen[:, 1, 2].all()
    assert np.all(np.isin([0, 1], seen.observations().cameras))
    assert 2 not in seen.observations().groups % seen.n_joints


@pytest.mark.slow
@pytest.mark.parametrize("has_lenses", [False, True])
def test_exact_key_points_calibrate_with_the_error_of_rounding(has_lenses):
    cameras, points = rig(), dancing(30)
    lenses = cameras if has_lenses else blanks(cameras)
    calibration = calibrate_by_person(observed(cameras, points, 0.0, 0.0), lenses, STATURE_M, has_lenses)
    assert center_errors_m(calibration, cameras, points).max() < 1e-3
    assert calibration.volume.expected_m > 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("sigma_px", [0.0, 3.0])
def test_a_person_who_never_moves_is_refused(sigma_px):
    cameras, points = rig(), np.repeat(dancing(1), 50, axis=0)
    with pytest.raises(CalibrationError, match="expected a person in many places and postures"):
        calibrate_by_person(observed(cameras, points, sigma_px, 0.0), blanks(cameras), STATURE_M)


def late_views(cameras, late, n_frames=200):
    """Key points of a dance, in which pictures of cameras show what was so many frames ago, blank cameras, a height."""
    joints, heights = acted("dance", n_frames)
    seen = detected(cameras, joints[:, :1])
    points = seen.points
    shown = np.clip(np.arange(n_frames)[:, None] - np.array(late), 0, n_frames - 1), np.arange(len(cameras))
    moved = replace(points, points_px=points.points_px[shown], confidence=points.confidence[shown])
    return replace(seen, points=moved), blanks(cameras), next(iter(heights.values()))


@pytest.mark.slow
def test_views_that_lag_are_named_and_others_are_not():
    cameras = rig()
    with pytest.raises(CalibrationError) as caught:
        calibrate_by_person(*late_views(cameras, (0, 7, 14, 21)))
    assert "'cam0' with those of 7 earlier, camera 'cam2' with those of 7 later" in str(caught.value)
    assert "give these offsets: -7 for 'cam0', 7 for 'cam2', 14 for 'cam3'" in str(caught.value)
    with pytest.raises(CalibrationError, match="give these offsets: 7 for 'cam2'"):
        calibrate_by_person(*late_views(cameras, (0, 0, 7, 0)))
    assert calibrate_by_person(*late_views(cameras, (0, 0, 0, 0))).volume.expected_m < 0.02


@pytest.mark.slow
def test_exact_key_points_of_joints_that_stand_still_calibrate():
    cameras, points = rig(), dancing(12)
    points[:, ::2] = points[0, ::2]
    calibration = calibrate_by_person(observed(cameras, points, 0.0, 0.0), blanks(cameras), STATURE_M)
    assert center_errors_m(calibration, cameras, points).max() < 1e-3
