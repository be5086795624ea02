"""The way of a pose between frames: through the poses, with a slope that fits, straight on beyond them."""

import numpy as np
import pytest

from tracker.body.motion.pose_path import PosePath
from tracker.formats.model_toml import load_model

FPS = 20.0


@pytest.fixture(scope="module")
def model():
    return load_model("gavrila22", 1.7)


def swinging(model, k, hz=1.0):
    """The pose of somebody who swings in all angles, k frames from the start."""
    return model.retract(model.neutral(), np.full(model.n_dofs, 0.1) * np.sin(2 * np.pi * hz * k / FPS))


def around(model, frames=range(-6, 7)):
    return PosePath.around(model, {10 + k: swinging(model, k) for k in frames}, 10, FPS)


def test_it_leads_through_the_poses(model):
    path = around(model)
    for k in (-3, -1, 0, 1, 2):
        np.testing.assert_allclose(
            path.step(k / FPS), model.difference(swinging(model, k), swinging(model, 0)), atol=1e-9
        )


def test_between_frames_it_is_closer_to_a_swing_than_a_straight_line(model):
    path = around(model)
    for late in (-1.5, 0.4, 2.5):
        true = model.difference(swinging(model, late), swinging(model, 0))
        straight = late * path.velocity(0.0) / FPS
        off, straight_off = (np.abs(step - true).max() for step in (path.step(late / FPS), straight))
        assert off < 0.2 * straight_off


def test_its_velocity_is_its_slope(model):
    path, h = around(model), 1e-6
    for t in (-0.12, 0.0, 0.03, 0.08, 1.0):
        slope = (path.step(t + h) - path.step(t - h)) / (2 * h)
        np.testing.assert_allclose(path.velocity(t), slope, atol=1e-6)


def test_beyond_known_poses_it_goes_straight_on(model):
    for frames, sign in ((range(-2, 2), 1), (range(-1, 3), -1)):
        path = around(model, frames)
        one, two, three = (path.step(sign * k / FPS) for k in (3, 4, 5))
        np.testing.assert_allclose(two - one, three - two, atol=1e-9)


def test_a_gap_ends_it(model):
    path = around(model, [0, 1, 3, 4])
    np.testing.assert_allclose(path.step(3 / FPS), 3 * path.step(1 / FPS), atol=1e-9)


def test_a_steady_one_moves_by_its_velocity(model):
    velocity = np.arange(model.n_dofs, dtype=float)
    path = PosePath.steady(velocity, FPS)
    np.testing.assert_allclose(path.step(0.3), 0.3 * velocity)
    np.testing.assert_allclose(path.velocity(-0.2), velocity)
