"""Cameras from key points of several people, with names in the files or without."""

from dataclasses import replace

import numpy as np
import pytest
from detected_people import danced, detected
from filmed_people import FOCAL_PX, STATURE_M, aligned, blanks, dancing, observed, rig
from observed_people import BODY_25

from tracker.calibration.self_calibration.keypoint_calibration import calibrate_by_person
from tracker.calibration.self_calibration.named_people import people_by_name
from tracker.calibration.self_calibration.people_matching import match_across_cameras
from tracker.calibration.self_calibration.seen_joints import own_columns
from tracker.errors import CalibrationError
from tracker.geometry.robust_triangulation import Views

CAMERAS = rig()
ANN_BOB = np.array([["ann", "bob"]] * 4)
JOINTS = danced(12)


def median_error_m(found, joints=JOINTS):
    """Median error of the joints after the best similarity, and its scale."""
    of = BODY_25.counterparts(BODY_25.points)
    own = [i for i, n in enumerate(BODY_25.points) if len(of[n]) <= 1]
    rows, true = found.world.joints_world.reshape(-1, 3), joints[:, :, own].reshape(-1, 3)
    known = np.isfinite(rows).all(axis=1) & np.isfinite(true).all(axis=1)
    scale, R, t = aligned(rows[known], true[known])
    return float(np.median(np.linalg.norm(scale * rows[known] @ R.T + t - true[known], axis=1))), scale


def swapped(observations, is_swapped):
    """The same key points, with the names of ann and bob exchanged in some pictures, (F, V)."""
    tracks = observations.points.tracks
    other = np.where(tracks == "ann", "bob", np.where(tracks == "bob", "ann", ""))
    return replace(
        observations, points=replace(observations.points, tracks=np.where(is_swapped[..., None], other, tracks))
    )


def true_persons(observations):
    """The person of each detection by its true name; -1 where nobody is."""
    return np.select([observations.points.tracks == "ann", observations.points.tracks == "bob"], [0, 1], -1)


@pytest.mark.slow
def test_one_person_is_calibrated_as_before_there_were_several():
    calibration = calibrate_by_person(observed(CAMERAS, dancing(12)), blanks(CAMERAS), STATURE_M)
    focal = [505.6339933105496, 505.04707894689125, 505.99188644479096, 505.42333759770105]
    np.testing.assert_allclose([c.K[0, 0] for c in calibration.cameras], focal, rtol=1e-9)
    assert calibration.volume.expected_m == pytest.approx(0.0025141291258745, rel=1e-9)
    center = [-0.06283313120575862, 3.976285101545119, 1.7199562364937797]
    np.testing.assert_allclose(calibration.cameras[2].center_world, center, atol=1e-9)
    assert calibration.identified == (("person",), 0, 0)


def test_people_are_matched_without_names():
    observations = detected(CAMERAS, JOINTS, tracks=ANN_BOB)
    true = true_persons(observations)
    matches = match_across_cameras(observations, Views(CAMERAS), np.full_like(true, -1), 0)
    assert matches.n_people == 2
    used = matches.persons >= 0
    assert used.sum() > 0.8 * (true >= 0).sum()
    first = true[used][0] != matches.persons[used][0]  # persons are numbered in any order
    assert np.array_equal(np.where(used, matches.persons ^ first, -1)[used], true[used])


def test_names_are_votes():
    observations = detected(CAMERAS, JOINTS, tracks=ANN_BOB)
    true = true_persons(observations)
    named = true.copy()
    named[3:6, 1][true[3:6, 1] >= 0] ^= 1
    matches = match_across_cameras(observations, Views(CAMERAS), named, 2)
    used = matches.persons >= 0
    assert np.array_equal(matches.persons[used], true[used])
    assert np.array_equal(matches.is_exchanged, used & (named != true))
    assert matches.is_exchanged.any()


def test_people_who_cannot_be_told_apart_are_left_out():
    twins = np.repeat(JOINTS[:, :1], 2, axis=1)
    observations = detected(CAMERAS[:2], twins, gross=0, offset_px=0)
    nobody = np.full(observations.points.is_known.shape[:3], -1)
    matches = match_across_cameras(observations, Views(CAMERAS[:2]), nobody, 0)
    assert np.mean(matches.persons >= 0) < 0.1  # twice as near by chance


def test_a_person_whom_one_camera_shows_is_nobody():
    observations = detected(CAMERAS, JOINTS, tracks=ANN_BOB)
    true = true_persons(observations)
    observations.points.confidence[:, 1:][true[:, 1:] == 1] = 0
    matches = match_across_cameras(observations, Views(CAMERAS), np.full_like(true, -1), 0)
    assert (matches.persons[true == 1] < 0).all()
    assert matches.n_people == 1


@pytest.mark.parametrize(
    ("third", "renamed"),
    [
        pytest.param(("ann", "bob"), (), marks=pytest.mark.slow),
        (("bob", "ann"), ("cam2",)),
        pytest.param(("7", "4"), ("cam2",), marks=pytest.mark.slow),
    ],
)
def test_names_of_a_camera_are_compared_with_those_of_others(third, renamed):
    observations = detected(CAMERAS, JOINTS, tracks=[ANN_BOB[0], ANN_BOB[0], third, ANN_BOB[0]])
    true = true_persons(detected(CAMERAS, JOINTS, tracks=ANN_BOB))
    found = people_by_name(observations.points, CAMERAS, own_columns(observations))
    assert (found.names, found.renamed, found.named_by) == (("ann", "bob"), renamed, "cam0")
    assert np.array_equal(found.persons, true)


def test_files_name_nobody_where_one_does_not():
    observations = detected(CAMERAS, JOINTS, tracks=[*ANN_BOB[:3], ["", ""]])
    assert people_by_name(observations.points, CAMERAS, own_columns(observations)) is None
    alone = detected(CAMERAS, JOINTS[:, :1], tracks=ANN_BOB[:, :1])
    assert people_by_name(alone.points, CAMERAS, own_columns(alone)) is None


@pytest.mark.slow
def test_two_people_with_names_give_cameras_and_scale():
    observations = detected(CAMERAS, JOINTS, tracks=ANN_BOB)
    calibration = calibrate_by_person(observations, blanks(CAMERAS), {"ann": STATURE_M, "bob": STATURE_M})
    error_m, scale = median_error_m(calibration)
    assert error_m < 0.04  # offsets and noise of 3.6 px are 29 mm at 4 m
    assert scale == pytest.approx(1, abs=0.03)
    assert calibration.cameras[0].K[0, 0] == pytest.approx(FOCAL_PX, rel=0.05)
    assert calibration.identified.names == ("ann", "bob")
    assert calibration.identified.n_exchanged == 0
    assert calibration.world.joints_world.shape[0] == 24
    alone = calibrate_by_person(observed(CAMERAS, dancing(12)), CAMERAS, STATURE_M, has_lenses=True)
    assert calibration.scale_sigma == pytest.approx(alone.scale_sigma / np.sqrt(2))
    one = calibrate_by_person(observations, CAMERAS, {"bob": 1.5 * STATURE_M}, has_lenses=True)
    assert median_error_m(one)[1] == pytest.approx(1 / 1.5, abs=0.02)


@pytest.mark.slow
def test_people_without_names_follow_from_one_who_is_alone():
    observations = detected(CAMERAS, danced(24), alone=10)
    calibration = calibrate_by_person(observations, CAMERAS, STATURE_M, has_lenses=True)
    assert calibration.identified.names == ("person 1", "person 2")
    assert (
        calibration.seen.is_seen[12:].sum()
        > 1.6 * calibration.seen.is_seen[12:, :, : len(calibration.seen.names)].sum()
    )
    assert any("the height was taken for that of each of the 2 people" in note for note in calibration.notes)
    assert median_error_m(calibration, danced(24))[0] < 0.04


@pytest.mark.slow
def test_exchanged_names_are_mended_or_refused():
    observations = detected(CAMERAS, JOINTS, tracks=ANN_BOB)
    some = np.zeros((12, 4), dtype=bool)
    some[2:4, 1] = True
    calibration = calibrate_by_person(swapped(observations, some), CAMERAS, STATURE_M, has_lenses=True)
    assert 2 <= calibration.identified.n_exchanged <= 4
    assert any("times a file gives a person the name of another" in note for note in calibration.notes)
    assert median_error_m(calibration)[0] < 0.04
    half = np.random.default_rng(0).random((12, 4)) < 0.5
    with pytest.raises(
        CalibrationError, match=r"names that mean one person in all cameras, found \d+ of \d+ in camera"
    ):
        calibrate_by_person(swapped(observations, half), CAMERAS, STATURE_M, has_lenses=True)


@pytest.mark.slow
def test_names_that_mean_nothing_are_left_where_one_person_is_alone():
    observations = detected(CAMERAS, danced(24), alone=10, tracks=ANN_BOB)
    half = np.random.default_rng(0).random((24, 4)) < 0.5
    calibration = calibrate_by_person(swapped(observations, half), CAMERAS, STATURE_M, has_lenses=True)
    assert calibration.identified == (("person 1", "person 2"), calibration.identified.n_left_out, 0)
    assert "the names of the people contradict each other in the cameras and were not used" in calibration.notes


@pytest.mark.slow
def test_people_whom_first_cameras_do_not_recognize_are_refused():
    wrong = detected(CAMERAS, danced(24), alone=10)
    px = wrong.points.points_px
    px[10:, 2:] = 640 - px[10:, 2:]  # the first cameras do not fit these pictures
    with pytest.raises(
        CalibrationError, match=r"people who fit between the cameras, found \d+ of \d+ in pictures who do"
    ):
        calibrate_by_person(wrong, CAMERAS, STATURE_M, has_lenses=True)


@pytest.mark.slow
def test_heights_of_others_are_refused():
    with pytest.raises(CalibrationError, match="whom the files name, found 'eve' and the people ann, bob; correct the"):
        calibrate_by_person(detected(CAMERAS, JOINTS, tracks=ANN_BOB), CAMERAS, {"eve": 1.7}, has_lenses=True)
    with pytest.raises(CalibrationError, match="whom the files name, found 'ann' and no names of people in the files"):
        calibrate_by_person(observed(CAMERAS, dancing(4)), CAMERAS, {"ann": 1.7}, has_lenses=True)
