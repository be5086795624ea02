"""Epipolar lines of a pixel, and the distance of another one, of cameras with distorted lenses."""

import numpy as np
import pytest
from bodies import MODELS
from stored_motions import distorted_cameras

from app.drawing.epipolar_check import epipolar_check
from tracker.body.model import PosedBody

CAMERAS = distorted_cameras()
BODY = PosedBody(MODELS["gavrila22"], MODELS["gavrila22"].neutral())


@pytest.fixture
def wrist():
    return BODY.points_world[BODY.model.point_names.index("left_wrist")]


def px(camera, place):
    return CAMERAS[camera].pinhole.project(place)


def test_a_place_lies_on_its_lines_and_beside_them_at_its_distance(wrist):
    check = epipolar_check(CAMERAS, [(0, px(0, wrist))], [BODY])
    assert [line.camera for line in check.lines] == [1, 2]
    assert check.distance is None
    for line in check.lines:
        start, end = np.array([[line.x0, line.y0], [line.x1, line.y1]])
        across = np.array([start[1] - end[1], end[0] - start[0]]) / np.linalg.norm(end - start)
        assert abs((px(line.camera, wrist) - start) @ across) < 0.05
        beside = px(line.camera, wrist) + 4.0 * across
        distance = epipolar_check(CAMERAS, [(0, px(0, wrist)), (line.camera, beside)], [BODY]).distance
        assert (distance.camera, distance.px) == (line.camera, pytest.approx(4.0, abs=0.05))
        view = CAMERAS[line.camera].pinhole
        assert distance.mm == pytest.approx(4000 * view.depths(wrist) / view.K[0, 0], rel=0.05)


def test_millimetres_are_of_a_body_only(wrist):
    points = [(0, px(0, wrist)), (1, px(1, wrist))]
    assert epipolar_check(CAMERAS, points, [BODY]).distance.mm == pytest.approx(0, abs=0.5)
    assert epipolar_check(CAMERAS, points, []).distance.mm is None
    away = wrist + 0.5 * np.array([1.0, 0, 0])
    assert epipolar_check(CAMERAS, [(0, px(0, away)), (1, px(1, away))], [BODY]).distance.mm is None


def test_without_a_point_or_a_line_there_is_nothing(wrist):
    assert epipolar_check(CAMERAS, [], [BODY]) == epipolar_check(CAMERAS[:1], [(0, px(0, wrist))], [BODY])
    same = epipolar_check(CAMERAS, [(0, px(0, wrist)), (0, px(0, wrist))], [BODY])
    assert same.distance is None
