"""Corners in drawn pictures, against where the board was drawn."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from drawn_boards import arc, carried, drawn

from tracker.calibration.boards.board_description import Board
from tracker.calibration.boards.corner_detection import CornerDetector
from tracker.geometry import rigid

CHARUCO = Board("charuco", 4, 5, 0.1)
CHECKERS = Board("checkerboard", 7, 6, 0.09)
CAMERA = arc()[1]


def assert_at_corners(found, board, T, least):
    expected = CAMERA.project(rigid.apply(T, board.corners))[found.ids]
    assert len(found.ids) >= least
    assert np.all(np.diff(found.ids) > 0)
    assert np.sqrt(np.mean(np.sum((found.px - expected) ** 2, axis=1))) < 0.2


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("legacy", [False, True])
def test_corners_are_found_below_a_pixel(inverted, legacy):
    board = replace(CHARUCO, inverted=inverted, legacy=legacy, rows=4, columns=5)
    T = carried(board, 1, seed=2)[0]
    corners = CornerDetector(board).detect(drawn(board, CAMERA, T))
    assert_at_corners(corners, board, T, 12)
    assert not corners.from_behind


def test_a_picture_in_colour_is_the_same():
    T = carried(CHARUCO, 1)[0]
    image = drawn(CHARUCO, CAMERA, T)
    detector = CornerDetector(CHARUCO)
    one, other = detector.detect(image), detector.detect(np.repeat(image[:, :, None], 3, axis=2))
    np.testing.assert_allclose(one.px, other.px, atol=0.01)


def test_a_covered_board_has_its_other_corners():
    T = carried(CHARUCO, 1)[0]
    image = drawn(CHARUCO, CAMERA, T)
    hand = CAMERA.project(rigid.apply(T, CHARUCO.corners[:3])).mean(axis=0)
    cv2.circle(image, tuple(int(v) for v in hand), 15, 90, -1)
    assert_at_corners(CornerDetector(CHARUCO).detect(image), CHARUCO, T, 6)


def test_the_back_of_a_transparent_board_has_the_same_corners():
    T = carried(CHARUCO, 1)[0]
    away = T @ rigid.transform(rigid.so3_exp(np.array([0.0, np.pi, 0.0])))
    image = drawn(CHARUCO, CAMERA, away, from_behind=True)
    found = CornerDetector(CHARUCO).detect(image)
    assert found.from_behind
    assert_at_corners(found, CHARUCO, away, 12)


@pytest.mark.parametrize("seed", range(6))
def test_a_checkerboard_has_one_orientation(seed):
    """Whichever way it is turned, the first corner is that of the board's first row and column."""
    T = carried(CHECKERS, 1, seed)[0]
    assert_at_corners(CornerDetector(CHECKERS).detect(drawn(CHECKERS, CAMERA, T)), CHECKERS, T, 30)


def test_an_empty_picture_has_no_corners():
    for board in (CHARUCO, CHECKERS):
        corners = CornerDetector(board).detect(np.full((480, 640), 120, np.uint8))
        assert len(corners.ids) == len(corners.px) == 0
