"""Steps between poses of which some have the other set of angles of a joint."""

import numpy as np
import pytest
from bodies import MODELS

from tracker.body.motion.interpolation import interpolate_pose
from tracker.body.motion.pose_steps import PredictSettings, nearest_equivalent, predict, shortest_step
from tracker.formats.model_toml import load_model

BODY = load_model("gavrila38")
SHOULDER = [BODY.dof_names.index(f"right_shoulder.{name}") for name in ("abduction", "elevation", "twist")]
LOWERED, RAISED = np.radians([10, 20, -85]), np.radians([20, 40, -80])


def posed(angles, body=BODY):
    pose = body.neutral()
    pose[SHOULDER] = angles
    return pose


def other(angles):
    """The other set of angles of the same shoulder."""
    return np.array([angles[0] + np.pi, np.pi - angles[1], angles[2] + np.pi])


def same_place(model, a, b):
    np.testing.assert_allclose(model.points_world(a), model.points_world(b), atol=1e-9)


def test_both_sets_of_angles_are_one_pose():
    same_place(BODY, posed(LOWERED), posed(other(LOWERED)))
    np.testing.assert_allclose(shortest_step(BODY, posed(other(LOWERED)), posed(LOWERED)), 0, atol=1e-12)


def test_a_step_leads_to_the_other_set_of_angles():
    start = posed(LOWERED)
    step = shortest_step(BODY, posed(other(RAISED)), start)
    np.testing.assert_allclose(step[SHOULDER], RAISED - LOWERED, atol=1e-12)
    same_place(BODY, BODY.retract(start, step), posed(RAISED))


@pytest.mark.parametrize("name", MODELS)
def test_a_step_leads_to_the_pose(name):
    model, rng = MODELS[name], np.random.default_rng(0)
    low, high = np.maximum(model.limits, -3).T[0], np.minimum(model.limits, 3).T[1]
    for _ in range(20):
        a, b = (model.retract(model.neutral(), rng.uniform(low, high)) for _ in range(2))
        same_place(model, model.retract(a, shortest_step(model, b, a)), b)


def test_only_angles_that_may_wind_are_unwrapped():
    winds = np.isinf(BODY.limits).all(axis=1) & ~BODY.dof_is_length
    assert 0 < winds.sum() < 6
    start, limited = BODY.neutral(), BODY.dof_names.index("left_elbow.extension")
    to = start.copy()
    to[winds], to[limited] = start[winds] + 4.0, start[limited] + 4.0
    for a, b, way in ((start, to, 1), (to, start, -1)):
        step = shortest_step(BODY, b, a)
        np.testing.assert_allclose(step[winds], way * (4.0 - 2 * np.pi))
        assert step[limited] == pytest.approx(way * 4.0)


def test_the_nearest_numbers_within_the_limits():
    near = nearest_equivalent(BODY, posed(other(RAISED)), posed(LOWERED))
    np.testing.assert_allclose(near[SHOULDER], RAISED, atol=1e-12)
    # The other set of a hanging arm that is turned outward is beyond the limit of the twist.
    outward = posed(np.radians([10, 20, 85]))
    far = nearest_equivalent(BODY, outward, posed(other(np.radians([10, 20, 85]))))
    np.testing.assert_array_equal(far, outward)
    locked = np.ones(BODY.n_dofs, dtype=bool)
    locked[SHOULDER[1]] = False
    np.testing.assert_array_equal(
        nearest_equivalent(BODY, posed(other(RAISED)), posed(LOWERED), locked), posed(other(RAISED))
    )


def test_an_arm_between_two_sets_of_angles_stays_in_its_place():
    between = interpolate_pose(BODY, posed(LOWERED), posed(other(LOWERED)), np.linspace(0, 1, 5))
    for pose in between:
        same_place(BODY, pose, posed(LOWERED))


def test_a_flip_is_not_predicted_as_a_turn():
    predicted = predict(BODY, [posed(other(LOWERED)), posed(LOWERED), posed(LOWERED)], PredictSettings(1, 3))
    same_place(BODY, predicted, posed(LOWERED))
