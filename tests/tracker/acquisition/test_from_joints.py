"""Body sizes from joints: recovered from a body of other lengths, and refused where they cannot be a body's."""

from dataclasses import replace

import numpy as np
import pytest

from tracker.acquisition.from_joints import fit_sizes
from tracker.errors import TrackerError
from tracker.evaluation.metrics import joints_of_poses
from tracker.formats.model_toml import load_model

LONGER = {"elbow": 1.1, "wrist": 0.93, "knee": 1.07, "ankle": 0.95}


@pytest.fixture
def other():
    """A body of other lengths than the preset's: limbs, shoulder width and trunk."""
    model = load_model("gavrila22", 1.8)

    def scaled(item):
        x, y, z = item.position
        factor = next((f for name, f in LONGER.items() if item.name.endswith(name)), 1.0)
        if item.name.endswith("_shoulder"):
            return replace(item, position=(x, 1.08 * y, 1.06 * z))
        return replace(item, position=(x, y, (1.06 if item.name.endswith("_hip") else factor) * z))

    return replace(model, joints=tuple(map(scaled, model.joints)), landmarks=tuple(map(scaled, model.landmarks)))


@pytest.fixture
def joints(other):
    rng = np.random.default_rng(3)
    poses = {k: other.clip(rng.normal(0, 0.4, other.n_dofs)) for k in range(9)}  # lengths do not depend on the pose
    return joints_of_poses(other, poses, 30.0)


def lengths(model):
    p = dict(zip(model.point_names, model.points_world(model.neutral()), strict=True))
    pairs = [
        ("left_shoulder", "left_elbow"), ("right_elbow", "right_wrist"), ("left_hip", "left_knee"),
        ("right_knee", "right_ankle"), ("left_shoulder", "right_shoulder"), ("left_hip", "right_hip"),
        ("left_shoulder", "left_hip"),
    ]  # fmt: skip
    return [float(np.linalg.norm(p[a] - p[b])) for a, b in pairs]


def test_lengths_are_recovered(other, joints):
    found = fit_sizes(load_model("gavrila22", 1.7), joints)
    np.testing.assert_allclose(lengths(found), lengths(other), rtol=1e-6)


def test_one_bad_frame_does_not_matter(other, joints):
    joints.points[4] *= 3
    joints.points[5, 2:5] = np.nan
    found = fit_sizes(load_model("gavrila22", 1.7), joints)
    np.testing.assert_allclose(lengths(found), lengths(other), rtol=1e-6)


def test_shapes_stretch_along_their_segments(joints):
    model = load_model("gavrila22", 1.7)
    found = fit_sizes(model, joints)
    before, after = model.parts[2], found.parts[2]
    ratio = lengths(found)[0] / lengths(model)[0]
    assert after.name == "left_upper_arm"
    assert after.half_axes[:2] == before.half_axes[:2]
    assert after.half_axes[2] == pytest.approx(before.half_axes[2] * ratio)
    assert after.center[2] == pytest.approx(before.center[2] * ratio)


def test_lengths_that_no_body_has_are_refused(joints):
    with pytest.raises(TrackerError, match="times as long as the model's"):
        fit_sizes(load_model("gavrila22", 1.7), replace(joints, points=joints.points * 10))


def test_missing_joints_are_named(joints):
    without = [i for i, n in enumerate(joints.names) if n != "left_knee"]
    fewer = replace(joints, names=tuple(joints.names[i] for i in without), points=joints.points[:, without])
    with pytest.raises(TrackerError, match="left_knee"):
        fit_sizes(load_model("gavrila22", 1.7), fewer)
