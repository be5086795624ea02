"""The figure of ten parts, from bodies of sessions and back."""

from dataclasses import replace

import numpy as np
import pytest
from moving_figure import joint_points

from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.voxel.body_pose import pose_of, state_of
from tracker.estimation.voxel.figure import chain_centers, figure_of, part_rotations, torso_center
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import PRESETS, load_model


@pytest.mark.parametrize("name", PRESETS)
def test_joints_of_the_figure_are_those_of_the_body(name):
    model = load_model(name, 1.7)
    of, body = figure_of(model), PosedBody(model, model.neutral())
    R = part_rotations(body, of)
    centers = chain_centers(of.figure, of.sizes, R, torso_center(body, of, R[0]))
    own = body.named_points_world
    for point, position in joint_points(of.figure, of.sizes, R, centers).items():
        np.testing.assert_allclose(position, own[point], atol=2e-3, err_msg=point)
    assert sorted(np.concatenate(of.members)) == list(range(len(model.parts)))


def test_joints_of_the_papers_body_are_functions_of_its_sizes():
    figure = figure_of(load_model("mikic10", 1.8)).figure
    expected = [[0, 0, 1], [0, 1, 0.891], [0, -1, 0.891], [0, 0.5, -1], [0, -0.5, -1], *[[0, 0, -1]] * 4]
    np.testing.assert_allclose(figure.parent_shares[1:], expected, atol=1e-3)
    np.testing.assert_allclose(figure.own_shares[1:], [[0, 0, -1], *[[0, 0, 1]] * 8], atol=1e-9)


@pytest.mark.parametrize("name", PRESETS)
def test_a_pose_comes_back(name):
    model, rng = load_model(name, 1.75), np.random.default_rng(3)
    step = np.where(np.isfinite(model.spreads), 0.0, 0.35 * rng.normal(size=model.n_dofs))
    pose = model.clip(model.retract(model.neutral(), step))
    state = state_of(model, [pose], 0.1, VoxelSettings())
    state = state.with_covariance(1e-4 * np.eye(state.layout.n))
    found = pose_of(model, state, model.neutral())
    names = [model.point_names.index(n) for n in LIMB_JOINTS]
    errors = np.linalg.norm(model.points_world(found.values)[names] - model.points_world(pose)[names], axis=1)
    assert errors.max() < 0.05
    assert np.linalg.eigvalsh(found.covariance).min() > 0


def test_shoulders_are_where_collarbones_have_them():
    model = load_model("gavrila38", 1.75)
    step = np.zeros(model.n_dofs)
    step[list(model.dof_names).index("left_collarbone.elevation")] = -0.25
    pose = model.retract(model.neutral(), step)
    state, own = state_of(model, [pose], 0.1, VoxelSettings()), PosedBody(model, pose).named_points_world
    found = joint_points(state.figure, state.sizes, state.rotations, state.centers)
    for name in ("left_shoulder", "left_elbow", "left_wrist", "right_shoulder"):
        np.testing.assert_allclose(found[name], own[name], atol=5e-3, err_msg=name)


def test_velocities_follow_from_two_poses():
    model = load_model("gavrila34", 1.75)
    before = model.neutral()
    step = np.zeros(model.n_dofs)
    step[0], step[list(model.dof_names).index("left_shoulder.elevation")] = 0.03, 0.2
    state = state_of(model, [before, model.retract(before, step)], 0.1, VoxelSettings())
    np.testing.assert_allclose(state.velocity, [0.3, 0, 0], atol=1e-9)
    assert np.linalg.norm(state.turn_rates[2]) == pytest.approx(2.0, abs=0.05)
    assert np.linalg.norm(state.turn_rates[3]) == pytest.approx(0.0, abs=1e-6)


def test_a_body_without_the_joints_of_ten_parts():
    model = load_model("mikic10", 1.75)
    joints = tuple(replace(j, name="odd") if j.name == "left_knee" else j for j in model.joints)
    with pytest.raises(TrackerError, match="without left_knee"):
        figure_of(replace(model, joints=joints))
