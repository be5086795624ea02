"""The major axis of a silhouette: arms beside the trunk are removed round by round (GD96 Fig. 5)."""

import cv2
import numpy as np
import pytest
from staging import camera_at

from tracker.estimation.initialization.generators.body_axis import major_axis

CAMERA = camera_at("c", (4.0, 0.0, 0.0))


def silhouette(arm=True, turn_deg=0.0):
    """A trunk with legs, and an arm that points to one side."""
    mask = np.zeros((480, 640), np.uint8)
    cv2.rectangle(mask, (290, 120), (350, 420), 255, -1)
    if arm:
        cv2.rectangle(mask, (350, 150), (520, 180), 255, -1)
    T = cv2.getRotationMatrix2D((320, 270), turn_deg, 1.0)
    return cv2.warpAffine(mask, T, (640, 480)) > 127


def angle_deg(line, turn_deg):
    along = np.diff(line, axis=0)[0]
    truth = np.array([np.sin(np.radians(turn_deg)), np.cos(np.radians(turn_deg))])
    return float(np.degrees(np.arccos(min(1.0, abs(along @ truth) / np.linalg.norm(along)))))


@pytest.mark.parametrize("turn_deg", [0.0, 25.0, -40.0])
def test_an_arm_at_the_side_is_removed(turn_deg):
    axis = major_axis(silhouette(turn_deg=turn_deg), CAMERA)
    first, last = (angle_deg(line, turn_deg) for line in (axis.lines_px[0], axis.lines_px[-1]))
    assert len(axis.lines_px) > 2
    assert first > 8
    assert last < 1.5
    assert axis.elongation > 0.7


def test_a_strip_of_even_width_loses_nothing():
    axis = major_axis(silhouette(arm=False), CAMERA)
    assert len(axis.lines_px) == 1
    np.testing.assert_allclose(np.ptp(axis.lines_px[-1][:, 1]), 300, atol=2)


def test_the_plane_holds_the_axis_and_the_camera():
    axis = major_axis(silhouette(turn_deg=25.0), CAMERA)
    rays = CAMERA.rays(axis.lines_px[-1])
    np.testing.assert_allclose(rays @ axis.normal_world, 0, atol=1e-12)


def test_specks_have_no_axis():
    mask = np.zeros((480, 640), bool)
    mask[10, 10:30] = True
    assert major_axis(mask, CAMERA) is None
