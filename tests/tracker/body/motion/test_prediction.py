from dataclasses import replace

import numpy as np
import pytest
from bodies import BALLS
from hypothesis import given
from hypothesis import strategies as st

from tracker.body.motion.pose_steps import PredictSettings, predict
from tracker.errors import TrackerError
from tracker.formats.model_toml import load_model, parse_model
from tracker.geometry import rigid

GAVRILA = load_model("gavrila22")
BALL_MODEL = parse_model(BALLS, "balls")
FREE = np.isinf(GAVRILA.limits).all(axis=1)


def unbounded(order, window=3):
    return PredictSettings(order, window, bound_rad=np.inf, bound_m=np.inf)


def motion(order, n, seed):
    """Poses of a polynomial motion around one well within the limits, (n + 1, n_values); the last is to be foretold."""
    rng = np.random.default_rng(seed)
    low, high = np.clip(GAVRILA.limits, -1.0, 1.0).T
    middle = rng.uniform(0.6 * low + 0.4 * high, 0.4 * low + 0.6 * high)
    rates = rng.uniform(-0.004, 0.004, (order + 1, GAVRILA.n_dofs))
    times = np.arange(n + 1.0)
    return middle + np.vander(times, order + 1) @ rates


@pytest.mark.slow
@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("window", [3, 4, 7])
@given(seed=st.integers(0, 10_000))
def test_motion_of_the_order_is_foretold_exactly(order, window, seed):
    poses = motion(order, 8, seed)
    predicted = predict(GAVRILA, list(poses[:-1]), unbounded(order, window))
    np.testing.assert_allclose(predicted, poses[-1], atol=1e-9)


def test_only_the_window_counts():
    poses = motion(1, 8, 3)
    poses[:5] += np.random.default_rng(0).normal(0, 0.1, poses[:5].shape)
    np.testing.assert_allclose(predict(GAVRILA, list(poses[:-1]), unbounded(1, 3)), poses[-1], atol=1e-9)
    assert np.abs(predict(GAVRILA, list(poses[:-1]), unbounded(1, 4)) - poses[-1]).max() > 0.01


def test_a_window_longer_than_the_order_needs_averages_noise():
    poses = np.tile(GAVRILA.neutral(), (3, 1))
    poses[:, 0] = [0.0, 0.03, 0.0]
    # The steps from the last pose are 0, 0.03, 0 at the times -2, -1, 0: no slope, the mean 0.01.
    assert predict(GAVRILA, list(poses), unbounded(1))[0] == pytest.approx(0.01)


@pytest.mark.parametrize("order", [1, 2])
def test_fewer_poses_than_the_order_needs_lower_it(order):
    poses = motion(1, 4, 1)
    np.testing.assert_allclose(predict(GAVRILA, [poses[0]], unbounded(order)), poses[0], atol=1e-12)
    np.testing.assert_allclose(predict(GAVRILA, list(poses[:2]), unbounded(order)), poses[2], atol=1e-12)
    # A window does the same.
    np.testing.assert_allclose(predict(GAVRILA, list(poses[:-1]), unbounded(order, 1)), poses[-2], atol=1e-12)


def test_a_window_that_must_be_full_predicts_no_motion_before():
    poses, settings = list(motion(2, 5, 1)), replace(unbounded(2, 5), full_window=True)
    np.testing.assert_allclose(predict(GAVRILA, poses[:4], settings), poses[3], atol=1e-12)
    np.testing.assert_allclose(predict(GAVRILA, poses[:5], settings), poses[5], atol=1e-9)


@pytest.mark.parametrize("order", [1, 2])
def test_each_degree_of_freedom_is_bounded_by_itself(order):
    settings = PredictSettings(order, 3, bound_rad=0.2, bound_m=0.05)
    last = GAVRILA.neutral()
    last[GAVRILA.dof_names.index("left_knee.extension")] = 1.2
    step = np.zeros(GAVRILA.n_dofs)
    names = ("torso.x", "torso.y", "left_shoulder.abduction", "left_knee.extension", "torso.twist")
    for name, change in zip(names, (0.3, -0.02, 0.5, -0.6, 0.01), strict=True):
        step[GAVRILA.dof_names.index(name)] = change
    past = [last - 2 * step, last - step, last]  # wild steps, beside limits even: the past is taken as it is
    expected = np.clip(step, *np.where(GAVRILA.dof_is_length, [[-0.05], [0.05]], [[-0.2], [0.2]]))
    np.testing.assert_allclose(predict(GAVRILA, past, settings) - last, expected, atol=1e-12)


def test_limits_hold():
    knee = GAVRILA.dof_names.index("left_knee.extension")
    poses = np.tile(GAVRILA.neutral(), (3, 1))
    poses[:, knee] = [0.4, 0.25, 0.1]
    assert predict(GAVRILA, list(poses), unbounded(1))[knee] == GAVRILA.limits[knee, 0]
    poses[:, knee] = GAVRILA.limits[knee, 1] + np.array([-0.2, -0.1, 0.5])  # given beyond the limit, as by hand
    for order in (0, 1, 2):
        assert predict(GAVRILA, list(poses), unbounded(order))[knee] == GAVRILA.limits[knee, 1]


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("order", [1, 2])
def test_a_turn_through_half_a_circle_goes_on(order, way):
    """Angles are stored within half a turn: the past crosses from one end of the range to the other."""
    twist = GAVRILA.dof_names.index("torso.twist")
    assert FREE[twist]
    poses = np.tile(GAVRILA.neutral(), (4, 1))
    poses[:, twist] = way * np.radians([165, 175, -175, -165])
    predicted = predict(GAVRILA, list(poses[:3]), PredictSettings(order, 3))
    assert np.remainder(predicted[twist] - poses[3, twist] + np.pi, 2 * np.pi) - np.pi == pytest.approx(0, abs=1e-9)
    np.testing.assert_allclose(np.delete(predicted, twist), np.delete(poses[3], twist), atol=1e-12)


@pytest.mark.parametrize("order", [1, 2])
def test_a_ball_turns_on(order):
    """Constant speed about a fixed axis, aslant to all; the root through more than a whole turn."""
    turn = 0.35 * np.array([2.0, -3.0, 6.0]) / 7
    root = slice(3, 7)
    poses = [BALL_MODEL.neutral()]
    for _ in range(20):
        poses.append(poses[-1].copy())
        poses[-1][root] = rigid.quaternion_multiply(poses[-2][root], rigid.quaternion_exp(turn))
    for k in range(3, 20):
        predicted = predict(BALL_MODEL, poses[:k], unbounded(order))
        step = BALL_MODEL.difference(predicted, poses[k])
        np.testing.assert_allclose(step, 0, atol=1e-9, err_msg=str(k))
        assert np.linalg.norm(predicted[root]) == pytest.approx(1)


def test_a_ball_is_bounded_and_held_in_its_cone():
    shoulder = slice(7, 11)
    poses = np.tile(BALL_MODEL.neutral(), (3, 1))
    for pose, angle in zip(poses, np.radians([50, 70, 90]), strict=True):
        pose[shoulder] = rigid.quaternion_exp(np.array([angle, 0, 0]))
    tilt = [2 * np.degrees(np.arccos(predict(BALL_MODEL, list(poses), s)[7])) for s in (unbounded(1), unbounded(2))]
    np.testing.assert_allclose(tilt, 100, atol=1e-6)  # its cone, not 110
    bounded = predict(BALL_MODEL, list(poses), PredictSettings(1, 3, bound_rad=np.radians(4)))
    assert 2 * np.degrees(np.arccos(bounded[7])) == pytest.approx(94)


def test_the_past_is_left_alone():
    poses = [p.copy() for p in motion(2, 4, 5)]
    before = [p.copy() for p in poses]
    for order in (0, 1, 2):
        predict(GAVRILA, poses, PredictSettings(order))
    np.testing.assert_array_equal(poses, before)


@pytest.mark.parametrize(("order", "window"), [(-1, 3), (3, 5), (1, 0)])
def test_settings_that_predict_nothing(order, window):
    with pytest.raises(
        TrackerError, match=f"order 0 to 2 over at least 1 past pose, found order {order} over {window}"
    ):
        PredictSettings(order, window)
