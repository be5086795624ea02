"""Keyframes that their neighbours or views contradict, on motions and costs whose faults are known."""

import numpy as np
import pytest

from tracker.body.motion.keyframe_doubts import neighbour_gaps, raised_views

FPS = 30.0
WRIST = 1


@pytest.fixture
def walk():
    """A trunk that walks at 1.5 m/s, and a wrist that swings 0.3 m to and fro once a second, with a tracker's noise."""
    rng, t = np.random.default_rng(3), np.arange(40) / FPS
    trunk = np.stack([1.5 * t, 0 * t, 0 * t + 1], axis=1)
    wrist = trunk + np.stack([0.3 * np.sin(2 * np.pi * t), 0 * t + 0.3, 0 * t], axis=1)
    places = np.stack([trunk, wrist], axis=1)
    return dict(enumerate(places + 0.004 * rng.standard_normal(places.shape)))


def test_right_keyframes_are_not_doubted(walk):
    assert neighbour_gaps(walk, walk.keys(), FPS) == {}


@pytest.mark.parametrize("off_m", [0.15, 0.3])
def test_a_wrong_keyframe_is_named_with_point_and_distance(walk, off_m):
    walk[20][WRIST] += (0, off_m, 0)
    ((frame, gap),) = neighbour_gaps(walk, {5, 20, 30}, FPS).items()
    assert (frame, gap.point) == (20, WRIST)
    assert gap.distance_m == pytest.approx(off_m, abs=0.02)


def test_a_jump_between_the_neighbours_is_not_blamed_on_the_keyframe(walk):
    for frame in range(20, 40):
        walk[frame] += (0, 0.4, 0)
    assert neighbour_gaps(walk, {20}, FPS) == {}


def test_a_keyframe_alone_or_at_an_end_has_no_neighbours_to_contradict_it(walk):
    walk[0] += (0, 0.5, 0)
    walk[39] += (0, 0.5, 0)
    assert neighbour_gaps(walk, {0, 39}, FPS) == {}
    assert neighbour_gaps({20: walk[20]}, {20}, FPS) == {}


def test_views_with_twice_the_usual_cost_are_named_most_raised_first():
    usual = [
        (2.0, 1.0, None, 0.2),
        (2.2, 1.1, 3.0, 0.3),
        (1.8, 0.9, None, 0.2),
        (2.0, 1.0, 3.0, 0.3),
        (2.1, 1.0, 3.0, 0.2),
    ]
    views = raised_views((4.5, 3.0, 9.0, 0.7), usual)
    assert [(v.camera, v.cost_px, v.usual_px) for v in views] == [(1, 3.0, 1.0), (0, 4.5, 2.0)]  # too few of camera 2
    assert raised_views((3.9, 1.9, None, 0.2), usual) == ()
    assert raised_views((9.0, 9.0), usual[:4]) == ()
