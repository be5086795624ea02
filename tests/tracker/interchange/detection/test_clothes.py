"""Colors of clothes are those between shoulders and hips, and between hips and knees."""

import cv2
import numpy as np

from tracker.interchange.detection.people_in_views import clothes_colors

TORSO = np.array([[60.0, 40.0], [40.0, 40.0], [57.0, 80.0], [43.0, 80.0]])
KNEES = np.array([[57.0, 120.0], [43.0, 120.0]])
RED, BLUE = (200, 30, 40), (20, 40, 180)


def dressed():
    picture = np.full((160, 100, 3), 128, np.uint8)
    picture[36:80, 38:63], picture[80:124, 38:63] = RED, BLUE
    return picture


def lab(color):
    return cv2.cvtColor(np.array([[color]], np.uint8), cv2.COLOR_RGB2LAB)[0, 0]


def test_trunk_and_thighs_have_their_colors():
    np.testing.assert_array_equal(clothes_colors(dressed(), TORSO, KNEES), [*lab(RED), *lab(BLUE)])


def test_some_points_beside_the_person_change_nothing():
    shifted = np.array([12.0, 0.0])
    np.testing.assert_array_equal(clothes_colors(dressed(), TORSO + shifted / 3, KNEES), [*lab(RED), *lab(BLUE)])


def test_unseen_parts_have_no_color():
    found = clothes_colors(dressed()[:90], TORSO, KNEES)
    np.testing.assert_array_equal(found[:3], lab(RED))
    assert np.isnan(found[3:]).all()
    assert np.isnan(clothes_colors(dressed(), np.full((4, 2), np.nan), KNEES)).all()
