"""Height and poses from known joints: recovered from a body of other lengths, refused where no body has them."""

from dataclasses import replace

import numpy as np
import pytest

from tracker.errors import TrackerError
from tracker.estimation.acquisition.from_joints import height_from_joints, place_joints, pose_at_joints
from tracker.evaluation.metrics import joints_of_poses
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import load_model

MODEL = load_model("gavrila34", 1.75)
N_FRAMES = 9


@pytest.fixture
def joints():
    """Joints of a child of the model's proportions, in poses of any kind."""
    child, rng = MODEL.with_height(1.27), np.random.default_rng(3)
    poses = {k: child.clip(rng.normal(0, 0.3, child.n_dofs)) for k in range(N_FRAMES)}
    return joints_of_poses(child, poses, 30.0)


def test_the_height_is_found(joints):
    assert height_from_joints(MODEL, joints) == pytest.approx(1.27, rel=0.02)
    # It does not matter how tall the body was before.
    assert height_from_joints(MODEL.with_height(0.9), joints) == pytest.approx(height_from_joints(MODEL, joints))


def test_one_bad_frame_does_not_matter(joints):
    expected = height_from_joints(MODEL, joints)
    joints.points[4] *= 3
    joints.points[5, 2:5] = np.nan
    assert height_from_joints(MODEL, joints) == pytest.approx(expected, rel=0.01)


@pytest.mark.slow
def test_a_bad_frame_is_left_out(joints):
    joints.points[4, :6] += (0.5, 0, 0)
    joints.points[5, 3:] = np.nan
    child = MODEL.with_height(1.27)
    found = pose_at_joints(child, joints, range(N_FRAMES))
    assert sorted(found.bodies) == sorted(found.placed) == [0, 1, 2, 3, 6, 7, 8]
    for k, (body,) in found.bodies.items():
        points = body.points_world[found.placed[k].points]
        np.testing.assert_allclose(points, found.placed[k].targets_world, atol=0.02)


def test_lengths_that_no_body_has_are_refused(joints):
    knee = joints.names.index("left_knee"), joints.names.index("right_knee")
    joints.points[:, knee] *= 4
    with pytest.raises(TrackerError, match="times as long as"):
        height_from_joints(MODEL, joints)


def test_missing_joints_are_named(joints):
    without = [i for i, n in enumerate(joints.names) if n != "left_knee"]
    fewer = replace(joints, names=tuple(joints.names[i] for i in without), points=joints.points[:, without])
    with pytest.raises(TrackerError, match="left_knee"):
        height_from_joints(MODEL, fewer)


def test_only_known_limb_joints_are_placed(joints):
    row = dict(zip(joints.names, joints.points[0], strict=True)) | {"left_wrist": np.full(3, np.nan)}
    placed = place_joints(MODEL, row, 0.02)
    names = {MODEL.point_names[i] for i in placed.points}
    assert names == set(LIMB_JOINTS) - {"left_wrist"}
    assert set(placed.weights) == {50.0}
