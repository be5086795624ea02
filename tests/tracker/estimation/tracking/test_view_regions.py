import numpy as np
import pytest
from staging import at, camera_at, solid

from tracker.estimation.tracking.view_regions import confirmed_regions, regions

BALL = solid((0.1, 0.1, 0.1))
CAMERAS = [camera_at("front", (4.0, 0.0, 0.0)), camera_at("near", (0.3, 0.0, 0.0))]
"""The second is so near that the whole image is looked at."""


def test_a_region_holds_a_body_and_what_the_prediction_may_be_off():
    (front, near) = regions(CAMERAS, [at(BALL, 0, 0, 0)])
    middle = CAMERAS[0].project(np.zeros((1, 3)))[0]
    margin = 0.25 * CAMERAS[0].K[0, 0] / 4.0
    assert near is None
    assert np.all(np.abs(np.array(front[:2]) - (middle - margin)) <= 8)
    assert np.all(np.abs(np.array(front[2:]) - (middle + margin)) <= 8)


@pytest.mark.parametrize(("moved_m", "holds"), [(0.0, True), (0.03, True), (0.2, False), (-0.2, False)])
def test_a_region_looked_at_ahead_is_left_where_somebody_comes_near_its_border(moved_m, holds):
    ahead = regions(CAMERAS, [at(BALL, 0, 0, 0)])
    bodies = [at(BALL, 0, moved_m, 0)]
    found = confirmed_regions(ahead, CAMERAS, bodies)
    assert found == (ahead if holds else regions(CAMERAS, bodies))
    # Either way there is more room about the body than its flesh takes.
    margin = 0.15 * CAMERAS[0].K[0, 0] / 4.0
    px = CAMERAS[0].project(np.array([[0, moved_m, 0]]))[0]
    assert np.all(np.array(found[0][:2]) < px - margin)
    assert np.all(np.array(found[0][2:]) > px + margin)


def test_the_whole_image_holds_every_region_and_none_holds_it():
    far, near = [at(BALL, 0, 0, 0)], [at(BALL, 3.8, 0, 0)]
    assert regions(CAMERAS, near)[0] is None
    assert confirmed_regions([None, None], CAMERAS, far) == [None, None]
    assert confirmed_regions(regions(CAMERAS, far), CAMERAS, near)[0] is None
