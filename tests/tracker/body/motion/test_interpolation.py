"""Poses between poses, against rotations worked out by another library and against a body's limits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from tracker.body.motion.interpolation import interpolate_pose
from tracker.formats.model_toml import load_model

SHARES = np.linspace(0.0, 1.0, 9)


@pytest.fixture(scope="module", params=["gavrila22", "gavrila34"])
def model(request):
    return load_model(request.param)


def random_pose(model, rng, spread=0.6):
    values = model.neutral()
    values[model.dof_value] += spread * rng.standard_normal(model.n_dofs)
    return model.clip(values)


def root_rotation(model, values):
    return model.kinematics(values).Ts_world_part[0][:3, :3]


def test_the_ends_are_the_poses_themselves(model):
    rng = np.random.default_rng(3)
    for spread in np.linspace(0.6, 2.0, 20):
        start, end = random_pose(model, rng, spread), random_pose(model, rng, spread)
        path = interpolate_pose(model, start, end, SHARES)
        np.testing.assert_allclose(model.points_world(path[0]), model.points_world(start), atol=1e-9)
        np.testing.assert_allclose(model.points_world(path[-1]), model.points_world(end), atol=1e-9)


def test_limbs_go_straight_and_stay_within_limits(model):
    rng = np.random.default_rng(4)
    start, end = random_pose(model, rng), random_pose(model, rng)
    path = interpolate_pose(model, start, end, SHARES)
    limbs = model.dof_value[model.dof_joint > 0]
    straight = start[limbs] + SHARES[:, None] * (end - start)[limbs]
    np.testing.assert_allclose(path[:, limbs], straight, atol=1e-12)
    far = interpolate_pose(model, random_pose(model, rng, 2.0), random_pose(model, rng, 2.0), SHARES)
    for poses in (path, far):
        np.testing.assert_array_equal(poses, model.clip(poses))


def test_the_root_turns_about_one_axis_at_one_speed(model):
    rng = np.random.default_rng(5)
    for _ in range(20):
        start, end = random_pose(model, rng, 1.5), random_pose(model, rng, 1.5)
        ends = Rotation.from_matrix([root_rotation(model, start), root_rotation(model, end)])
        truth = Slerp([0.0, 1.0], ends)(SHARES).as_matrix()
        found = np.array([root_rotation(model, v) for v in interpolate_pose(model, start, end, SHARES)])
        np.testing.assert_allclose(found, truth, atol=1e-6)


def test_the_root_moves_along_a_straight_line(model):
    start, end = model.neutral(), model.neutral()
    at = [list(model.value_names).index(f"{model.joints[0].name}.{n}") for n in "xyz"]
    end[at] = (1.0, -2.0, 0.5)
    np.testing.assert_allclose(interpolate_pose(model, start, end, SHARES)[:, at], SHARES[:, None] * end[at])


def test_a_turn_over_the_seam_goes_the_short_way(model):
    twist = model.value_names.index(f"{model.joints[0].name}.twist")
    start, end = model.neutral(), model.neutral()
    start[twist], end[twist] = np.radians(170.0), np.radians(-170.0)
    degrees = np.degrees(interpolate_pose(model, start, end, SHARES)[:, twist])
    np.testing.assert_allclose(degrees, np.linspace(170.0, 190.0, 9), atol=1e-6)  # and no jump on the way
    back = np.degrees(interpolate_pose(model, end, start, SHARES)[:, twist])
    np.testing.assert_allclose(back, np.linspace(-170.0, -190.0, 9), atol=1e-6)


def test_a_wound_up_pose_goes_on_from_where_it_is(model):
    twist = model.value_names.index(f"{model.joints[0].name}.twist")
    start, end = model.neutral(), model.neutral()
    start[twist], end[twist] = np.radians(725.0), np.radians(15.0)
    np.testing.assert_allclose(
        np.degrees(interpolate_pose(model, start, end, SHARES)[:, twist]), np.linspace(725, 735, 9), atol=1e-6
    )


def test_balls_turn_the_short_way_whatever_the_sign_of_the_quaternion(model):
    shoulder = next(i for i, j in enumerate(model.joints) if j.name == "left_shoulder")
    joints = list(model.joints)
    joints[shoulder] = replace(joints[shoulder], kind="ball", axes=(), cone=np.pi, twist=np.pi)
    body = replace(model, joints=tuple(joints))
    at = [body.value_names.index(f"left_shoulder.{q}") for q in ("qw", "qx", "qy", "qz")]
    turn = Rotation.from_rotvec([0.4, -1.1, 0.3])
    start, end = body.neutral(), body.neutral()
    end[at] = -np.roll(turn.as_quat(), 1)  # the same rotation
    found = Rotation.from_quat(np.roll(interpolate_pose(body, start, end, SHARES)[:, at], -1, axis=1))
    np.testing.assert_allclose(found.as_rotvec(), SHARES[:, None] * turn.as_rotvec(), atol=1e-9)


def test_nothing_asked_for_is_nothing_given(model):
    assert interpolate_pose(model, model.neutral(), model.neutral(), np.zeros(0)).shape == (0, len(model.value_names))
