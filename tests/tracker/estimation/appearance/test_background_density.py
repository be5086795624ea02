"""The background of a view: usual colours, shadows, outliers where they occur, exposure."""

import numpy as np
import pytest
from staging import camera_at

from tracker.estimation.appearance.background_density import learn_background
from tracker.estimation.appearance.part_drawing import CellView

SHAPE, N = (48, 64), 20
CAMERA = camera_at("front", (4.0, 0.0, 0.0), size=(64, 48))
WALL = np.array([120, 90, 60])
ONE = np.ones(3, np.float32)


@pytest.fixture(scope="module")
def frames():
    """A wall with noise. A person stands in the middle most of the time; leaves move at the left."""
    rng = np.random.default_rng(0)
    views, occupied = [], []
    for k in range(N):
        image = WALL + rng.normal(0, 2, (*SHAPE, 3))
        if k % 4 == 0:
            image[8:40, :12] = rng.uniform(0, 255, 3)
        hidden = np.zeros(SHAPE, bool)
        if k > 8:
            image[10:40, 30:40], hidden[8:42, 28:42] = (200, 200, 220), True
        views.append(CellView(CAMERA, (0, 0), image.round().astype(np.uint8)))
        occupied.append(hidden)
    return views, occupied


def densities(known, color, gain=ONE):
    colors = np.tile(np.asarray(color, np.uint8), (*SHAPE, 1))
    return known.log_density(CellView(CAMERA, (0, 0), colors), gain)


def test_a_background_is_learnt_behind_people(frames):
    known = learn_background(*frames, SHAPE, None)
    np.testing.assert_allclose(known.mean[20, 35], WALL, atol=2)
    wall, person, shade = (densities(known, c) for c in (WALL, (200, 200, 220), (0.7 * WALL).round()))
    assert wall[20, 35] > shade[20, 35] > person[20, 35] + 3
    assert wall[20, 35] > person[20, 35] + 8


def test_outliers_are_likely_where_they_were_seen(frames):
    known = learn_background(*frames, SHAPE, None)
    odd = densities(known, (10, 200, 10))
    assert odd[24, 4] > odd[24, 50] + 1


def test_exposure_is_taken_out(frames):
    views, occupied = frames
    known = learn_background(views, occupied, SHAPE, None)
    bright = views[0]._replace(colors=np.clip(views[0].colors * 1.3, 0, 255).round().astype(np.uint8))
    gain = known.gain(bright, ~occupied[0])
    np.testing.assert_allclose(gain, 1.3, atol=0.03)
    assert known.log_density(bright, gain)[20, 50] > known.log_density(bright, ONE)[20, 50] + 5


def test_the_empty_scene_serves_where_people_always_stand(frames):
    views, _ = frames
    always = [np.ones(SHAPE, bool)] * N
    empty = np.tile(WALL.astype(np.uint8), (*SHAPE, 1))
    seen, unknown = (learn_background(views, always, SHAPE, e) for e in (empty, None))
    assert densities(seen, WALL)[20, 35] > densities(seen, (200, 200, 220))[20, 35] + 5
    assert densities(unknown, WALL)[20, 35] == pytest.approx(densities(unknown, (200, 200, 220))[20, 35], abs=1e-6)


def test_a_view_without_images_takes_all_colours_alike():
    known = learn_background([], [], SHAPE, None)
    assert np.ptp([densities(known, c)[20, 35] for c in (WALL, (200, 200, 220))]) < 1e-6
