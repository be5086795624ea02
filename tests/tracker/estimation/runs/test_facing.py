"""Which way a person faces in a run, on a simulated recording whose poses are known."""

import numpy as np
import pytest
from filmed_run import FilmedRun, estimated, moving

from tracker.body.model import PosedBody
from tracker.estimation.fitting.limb_exchange import turned_round
from tracker.estimation.runs.run_estimate import Facing

N = 4
NEAR_M = 0.05
"""Error of a point that contours show; some are hidden on all frames."""


def test_nearly_all_frames_tell():
    assert Facing.of([10.0]) == Facing.of([200.0] * 30 + [-5.0]) == (False, True)
    assert Facing.of([2.0]) == Facing.of([200.0] * 4 + [-5.0]) == (False, False)
    assert Facing.of([-90.0, -7.0, 200.0]) == (True, False)


@pytest.fixture(scope="module")
def film(gavrila):
    return FilmedRun(gavrila, moving(gavrila, N))


@pytest.fixture(scope="module")
def turned(film):
    return np.array([turned_round(PosedBody(film.model, pose)) for pose in film.true[0]])


@pytest.mark.slow
@pytest.mark.parametrize("is_turned", [False, True])
def test_a_run_without_a_keyframe_faces_the_way_of_the_contours(film, turned, is_turned):
    found = estimated(film.asked(turned if is_turned else film.true[0]))
    assert film.errors_m(found).max() < NEAR_M
    assert {pose.is_facing_sure for pose in found.values()} == {not is_turned}


@pytest.mark.slow
def test_a_keyframe_says_which_way_a_person_faces(film, turned):
    found = estimated(film.asked(turned, keyframes={1: turned[1]}))
    np.testing.assert_array_equal(found[1].pose, turned[1])
    assert all(pose.is_facing_sure for pose in found.values())
