"""The height of a person is measured on the frames around a start, as the median of a few."""

from types import SimpleNamespace

import numpy as np
import pytest

from tracker.errors import TrackerError
from tracker.estimation.initialization import standing_heights
from tracker.estimation.initialization.standing_heights import StandingHeights


def scene(x_m, height_m=None):
    """A figure at a place; who bends has no height."""
    return SimpleNamespace(figure=SimpleNamespace(points_world=np.array([[x_m, 0.0, 1.0]])), height_m=height_m)


@pytest.fixture
def around(monkeypatch):
    """Measures a person at x = 0 who bends on frame 20 of 60, with the figures that a function returns elsewhere."""
    monkeypatch.setattr(standing_heights, "upright_height", lambda scene: scene.height_m)

    def measure(scenes, n_people=1, own=None):
        asked = []

        def figures(frame, person):
            asked.append(frame)
            return scenes(frame)

        heights = StandingHeights(figures, 60, n_people)
        found = heights.around(scene(0.0, own), 20, 0)
        assert heights.around(scene(0.0, own), 20, 0) == found
        assert len(asked) == len(set(asked))  # each frame is measured once
        return found, asked

    return measure


def test_frames_around_are_measured_the_nearest_first(around):
    by_frame = {24: 1.50, 18: 1.60, 30: 1.55}
    found, asked = around(lambda k: [scene(0.0, by_frame.get(k))])
    assert found == 1.55
    assert asked == [24, 18, 30]


def test_the_height_on_the_frame_counts(around):
    assert around(lambda k: [scene(0.0, {24: 1.60, 18: 1.70}.get(k))], own=1.65)[0] == 1.65


def test_few_frames_are_tried(around):
    found, asked = around(lambda k: [scene(0.0)])
    assert found is None
    assert len(asked) == 8


def test_the_person_is_followed(around):
    def two(frame):
        away = 0.05 * (frame - 20)
        return [scene(3.0 - away, 1.80), scene(away, {24: 1.55, 18: 1.56, 30: 1.57}.get(frame, 9.9))]

    assert around(two, n_people=2)[0] == 1.56


def test_people_who_look_alike_are_not_measured(around):
    assert around(lambda k: [scene(0.0, 1.80)], n_people=2)[0] is None
    assert around(lambda k: [scene(0.6, 1.80)])[0] is None


def test_frames_without_figures_are_left_out(around):
    def nobody(frame):
        raise TrackerError("expected somebody, found none")

    assert around(nobody, own=1.70)[0] == 1.70
    assert around(nobody)[0] is None
