"""How the corners of a calibration by a board are counted in each camera."""

from types import SimpleNamespace

import numpy as np
import pytest

from tracker.calibration.boards.board_problem import SeenCorners
from tracker.calibration.boards.footage_calibration import FilmedCalibration

PX = np.array([[0, 0], [9, 0], [9, 19], [0, 19], [5, 0], [14, 0], [14, 19], [5, 19], [3, 3]], float)
SEEN = SeenCorners(np.array([0] * 8 + [1]), np.array([0] * 4 + [3] * 5), np.arange(9), PX)


def calibrated(errors_px):
    fit = SimpleNamespace(errors_px=np.array(errors_px), sigmas_px=np.array([0.5, 1.0]))
    found = SimpleNamespace(rig=SimpleNamespace(fit=fit, frames=np.array([3])))
    cameras = tuple(SimpleNamespace(size=size) for size in ((50, 20), (10, 10)))
    return FilmedCalibration(cameras, found, SimpleNamespace(seen=SEEN))


def test_views_that_overlap_are_covered_once():
    found = calibrated([[0.0, 0.0]] * 5)
    assert [found.covered_share(i) for i in range(2)] == pytest.approx([15 / 50, 1 / 100])


def test_gross_errors_are_those_of_four_standard_deviations_on_adjusted_frames():
    found = calibrated([[1.9, 0.0], [2.1, 0.0], [np.nan, 0.0], [0.0, 0.0], [0.0, -2.1]])
    assert np.flatnonzero(found.is_gross).tolist() == [5, 6]
