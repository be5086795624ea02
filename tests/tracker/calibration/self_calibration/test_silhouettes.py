"""Masks of a person, their ends and hulls, and the frontier points of two of them."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from filmed_people import rig
from person_outlines import outlined

from tracker.calibration.self_calibration.frontier_points import frontier_points, plane_angles
from tracker.calibration.self_calibration.person_silhouettes import Flaw, measure_silhouette
from tracker.calibration.self_calibration.silhouette_chain import cameras_over_floor, on_floor
from tracker.geometry import rigid

CAMERAS = rig(4)


def mask(*boxes, size=(120, 160)):
    """A mask of boxes: left, top, right, bottom."""
    out = np.zeros(size, np.uint8)
    for left, top, right, bottom in boxes:
        cv2.rectangle(out, (left, top), (right, bottom), 1, -1)
    return out > 0


def measured(*boxes):
    return measure_silhouette(mask(*boxes), lambda px: px)


def test_an_upright_person_has_crown_feet_and_a_hull():
    found = measured((50, 20, 69, 99), (55, 10, 64, 20))
    assert found.flaw is None
    np.testing.assert_allclose(found.upright_px, [[59.5, 10], [59.5, 99]], atol=0.6)
    assert {(50, 99), (69, 99), (55, 10), (64, 10)} <= {tuple(p) for p in found.hull_px}
    assert (55, 20) not in {tuple(p) for p in found.hull_px}


@pytest.mark.parametrize(
    ("boxes", "flaw", "has_hull"),
    [
        ((), Flaw.NOBODY, False),
        (((50, 20, 51, 21),), Flaw.NOBODY, False),
        (((50, 20, 69, 119),), Flaw.CUT, False),
        (((0, 20, 19, 99),), Flaw.CUT, False),
        (((20, 20, 39, 99), (80, 20, 99, 90)), Flaw.SEVERAL, False),
        (((50, 60, 89, 99),), Flaw.BENT, True),
    ],
)
def test_a_silhouette_that_does_not_count_says_why(boxes, flaw, has_hull):
    found = measured(*boxes)
    assert found.flaw == flaw
    assert bool(len(found.hull_px)) == has_hull
    assert np.isnan(found.upright_px).all()


def test_raised_hands_are_no_crown():
    found = measured((50, 20, 69, 105), (55, 10, 64, 20), (44, 4, 49, 60), (70, 4, 75, 60))
    np.testing.assert_allclose(found.upright_px, [[59.5, 10], [59.5, 105]], atol=0.6)


def test_parts_of_one_person_are_one_silhouette():
    assert measured((50, 20, 69, 70), (52, 74, 60, 99)).flaw is None


def test_frontier_points_agree_between_true_cameras_alone():
    rows, _ = outlined(CAMERAS, 3)
    hulls = [[s.hull_px for s in row] for row in rows]
    focal = CAMERAS[0].K[0, 0]
    angles = plane_angles(hulls, CAMERAS, (0, 1))
    assert len(angles) == 6
    assert focal * np.nanmax(angles) < 0.3
    off = rigid.transform(rigid.so3_exp(np.radians([0.0, 0.0, 3.0])), None)
    wrong = [CAMERAS[0], replace(CAMERAS[1], T_world_camera=CAMERAS[1].T_world_camera @ off), *CAMERAS[2:]]
    assert focal * np.nanmax(plane_angles(hulls, wrong, (0, 1))) > 2
    seen, outward = frontier_points(hulls, CAMERAS)
    assert seen.px.shape == (3, 4, 12, 2)
    # Points of a pair are seen by these two alone, above and below.
    assert seen.is_seen[0, :, 0].tolist() == [True, True, False, False]
    assert np.all(seen.is_seen.sum(axis=1) <= 2)
    # The upper one is the first; both directions lead out of the silhouette.
    assert np.all(seen.px[:, 0, 1, 1] - seen.px[:, 0, 0, 1] > 50)
    assert np.all(outward[:, 0, 0, 1] < -0.5)
    assert np.all(outward[:, 0, 1, 1] > 0.5)


def test_each_camera_finds_the_vertical_and_its_height():
    rows, points = outlined(CAMERAS, 24, noise_px=0.3)
    px = np.array([[s.upright_px for s in row] for row in rows])
    height = np.median(points[:, -1, 2]) + 0.08
    for camera, true in zip(cameras_over_floor(px, CAMERAS), CAMERAS, strict=True):
        up, true_up = camera.T_world_camera[2, :3], true.T_world_camera[2, :3]
        assert np.degrees(np.arccos(up @ true_up)) < 3
        assert camera.center_world[2] * height == pytest.approx(true.center_world[2], rel=0.1)
        assert np.ptp(on_floor(camera, px[:, CAMERAS.index(true), 1]) * height, axis=0).max() == pytest.approx(
            2, rel=0.15
        )
