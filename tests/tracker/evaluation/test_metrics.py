from dataclasses import replace

import numpy as np
import pytest
from bodies import set_deg

from tracker.errors import FormatError
from tracker.evaluation.metrics import Motion, best_rigid, evaluate_joints, evaluate_poses, joints_of_poses
from tracker.formats.joint_maps import JOINTS, LIMB_JOINTS
from tracker.formats.model_toml import load_model
from tracker.formats.trc import MarkerTable, remap_axes
from tracker.geometry import rigid


def table(points, frames=None, names=JOINTS, rate=30.0):
    points = np.asarray(points, dtype=np.float64)
    frames = np.arange(len(points)) if frames is None else np.asarray(frames)
    return MarkerTable(tuple(names), frames, frames / rate, points, rate)


@pytest.fixture
def truth():
    """Four frames of 14 joints that move."""
    return np.random.default_rng(0).normal(0, 0.5, (4, len(JOINTS), 3))


def test_no_error(truth):
    e = evaluate_joints(table(truth), table(truth), range(4))
    assert (e.frames, e.missing_frames, e.missing_reference_values, e.lost_frames) == (4, 0, 0, 0)
    assert (e.mpjpe_mm, e.median_mm, e.p95_mm) == (0, 0, 0)
    assert e.pa_mpjpe_mm == pytest.approx(0, abs=1e-9)


def test_figures_worked_out_by_hand(truth):
    estimate = truth.copy()
    estimate[0, JOINTS.index("left_wrist")] += (0.03, 0.0, 0.04)  # 50 mm
    estimate[1, JOINTS.index("right_knee"), 1] += 0.2  # 200 mm: lost
    estimate[:, JOINTS.index("head"), 2] -= 0.5  # no limb joint: counts by itself alone
    e = evaluate_joints(table(estimate), table(truth), range(4))
    assert e.mpjpe_mm == pytest.approx((50 + 200) / 48)
    assert e.median_mm == pytest.approx(0)
    assert e.lost_frames == 1
    assert e.per_joint_mm["left_wrist"] == pytest.approx(50 / 4)
    assert e.per_joint_mm["right_knee"] == pytest.approx(200 / 4)
    assert e.per_joint_mm["head"] == pytest.approx(500)
    assert e.per_joint_mm["neck"] == 0


def test_percentile(truth):
    estimate = truth.copy()
    # 48 distances of 0, 1, ... 47 mm: the 95th percentile lies at 0.95 * 47 = 44.65.
    estimate[:, :12, 0] += np.arange(48).reshape(4, 12) / 1000
    e = evaluate_joints(table(estimate), table(truth), range(4))
    assert e.p95_mm == pytest.approx(44.65)
    assert e.median_mm == pytest.approx(23.5)


def test_missing_frames_and_values(truth):
    reference = truth.copy()
    reference[1, JOINTS.index("left_hip")] = np.nan
    reference[2, JOINTS.index("head")] = np.nan
    estimate = truth + np.array([0.0, 0.01, 0.0])
    e = evaluate_joints(table(estimate[[0, 1, 3]], [0, 1, 3]), table(reference), range(1, 4))
    assert (e.frames, e.missing_frames, e.missing_reference_values, e.lost_frames) == (3, 1, 1, 1)
    assert e.mpjpe_mm == pytest.approx(10)


def test_joints_that_only_one_side_has(truth):
    some = [JOINTS.index(j) for j in ("left_hip", "left_knee", "neck")]
    e = evaluate_joints(table(truth + 0.01), table(truth[:, some], names=("left_hip", "left_knee", "neck")), range(4))
    assert sorted(e.per_joint_mm) == ["left_hip", "left_knee", "neck"]
    assert e.mpjpe_mm == pytest.approx(np.sqrt(3) * 10)
    assert e.pa_mpjpe_mm is None  # two limb joints fix no rotation


def test_pa_takes_out_each_frames_own_motion(truth):
    rng = np.random.default_rng(1)
    moved = np.array([p @ rigid.so3_exp(rng.normal(size=3)).T + rng.normal(size=3) for p in truth])
    e = evaluate_joints(table(moved), table(truth), range(4))
    assert e.mpjpe_mm > 100
    assert e.pa_mpjpe_mm == pytest.approx(0, abs=1e-9)
    # One motion for all does not help there.
    assert evaluate_joints(table(moved), table(truth), range(4), "rigid-all").mpjpe_mm > 100


def test_pa_does_not_scale_or_mirror(truth):
    assert evaluate_joints(table(truth * 1.1), table(truth), range(4)).pa_mpjpe_mm > 10
    assert evaluate_joints(table(truth * (-1, 1, 1)), table(truth), range(4)).pa_mpjpe_mm > 100


def test_rigid_all_takes_out_one_motion(truth):
    T = rigid.transform(rigid.so3_exp(np.array([0.3, -0.2, 1.0])), np.array([1.0, 2.0, 3.0]))
    estimate = rigid.apply(T, truth)
    estimate[0, JOINTS.index("head")] += 0.1
    e = evaluate_joints(table(estimate), table(truth), range(4), "rigid-all")
    assert e.mpjpe_mm == pytest.approx(0, abs=1e-9)
    assert e.per_joint_mm["head"] == pytest.approx(np.sqrt(3) * 100 / 4)


def test_nothing_in_common(truth):
    with pytest.raises(FormatError, match="in common"):
        evaluate_joints(table(truth), table(truth, [10, 11, 12, 13]), range(4))


def test_best_rigid_of_a_quarter_turn():
    source = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    target = source @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]).T + (1, 2, 3)
    T = best_rigid(source, target)
    np.testing.assert_allclose(T, [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]], atol=1e-12)


def test_axes():
    # A file whose y points up, x forward, z to the right.
    points = remap_axes(table([[[1.0, 2.0, 3.0]]], names=["a"]), "x,-z,y").points
    assert points[0, 0].tolist() == [1, -3, 2]


@pytest.mark.parametrize("axes", ["x,y", "x,y,y", "x,y,w", "x,,z", "x,y,z,x", ""])
def test_malformed_axes(axes):
    with pytest.raises(FormatError, match="three different axes"):
        remap_axes(table([[[1.0, 2.0, 3.0]]], names=["a"]), axes)


def test_axes_that_mirror():
    with pytest.raises(FormatError, match="mirror"):
        remap_axes(table([[[1.0, 2.0, 3.0]]], names=["a"]), "x,z,y")


@pytest.fixture
def model():
    return load_model("gavrila22")


def compared(model, estimated, true, frames=(0,), true_model=None):
    """Evaluation of poses by frame."""
    joints = table(np.zeros((1, len(JOINTS), 3)))
    known = evaluate_joints(joints, joints, [0])
    return evaluate_poses(known, Motion(model, estimated), Motion(true_model or model, true), frames)


def test_twist_counts_only_where_it_shows(model):
    n_parts = len(model.parts)
    for bend, expected in ((0, 0.0), (19, None), (21, None), (90, None)):
        true = set_deg(model, left_elbow__extension=bend)
        estimate = set_deg(model, left_elbow__extension=bend, left_shoulder__twist=30)
        comparison = compared(model, {0: estimate}, {0: true})
        # The forearm's axis swings around the upper arm's by the twist: 2 asin(sin(bend) sin(15)).
        swing = np.degrees(2 * np.arcsin(np.sin(np.radians(bend)) * np.sin(np.radians(15))))
        wanted = (swing if bend < 20 else 60.0) / n_parts
        assert comparison.axis_error_deg == pytest.approx(wanted if expected is None else expected, abs=1e-9)
        assert comparison.long_axis_error_deg == pytest.approx(swing / n_parts, abs=1e-9)
        assert comparison.angle_error_deg["left_shoulder.twist"] == pytest.approx(30)
        assert comparison.angle_error_deg["left_elbow.extension"] == pytest.approx(0)
        assert "torso.x" not in comparison.angle_error_deg


def test_body_turn_counts_whole_for_trunk_and_head(model):
    # Turning about the vertical leaves all limbs' hanging axes as they are.
    comparison = compared(model, {0: set_deg(model, torso__twist=40)}, {0: model.neutral()})
    assert comparison.axis_error_deg == pytest.approx(2 * 40 / len(model.parts))
    assert comparison.per_part_axis_deg["torso"] == pytest.approx(40)
    assert comparison.per_part_axis_deg["left_calf"] == pytest.approx(0)


def test_the_worst_frame(model):
    raised = {3: model.neutral(), 4: set_deg(model, left_hip__elevation=30), 5: set_deg(model, left_hip__elevation=10)}
    comparison = compared(model, raised, dict.fromkeys((3, 4, 5), model.neutral()), range(9))
    n = len(model.parts)
    assert comparison.axis_error_deg == pytest.approx(2 * 40 / n / 3)
    assert (comparison.worst_axis_error_deg, comparison.worst_axis_frame) == (pytest.approx(2 * 30 / n), 4)


def test_angles_go_the_shorter_way_round(model):
    comparison = compared(model, {0: set_deg(model, torso__twist=179)}, {0: set_deg(model, torso__twist=-179)})
    assert comparison.angle_error_deg["torso.twist"] == pytest.approx(2)


def test_body_size_does_not_matter_to_angles(model):
    other = load_model("gavrila22", 1.5)
    comparison = compared(other, {3: set_deg(other, left_hip__elevation=10)}, {3: model.neutral()}, range(9), model)
    assert comparison.axis_error_deg == pytest.approx(2 * 10 / len(model.parts))  # thigh and calf
    assert comparison.angle_error_deg["left_hip.elevation"] == pytest.approx(10)


def test_bodies_of_other_parts_are_compared_by_the_names_of_parts(model):
    bending = load_model("gavrila34", 1.6)
    estimate = set_deg(bending, waist__elevation=20, left_elbow__extension=70)
    comparison = compared(bending, {0: estimate}, {0: set_deg(model, left_elbow__extension=60)}, true_model=model)
    assert sorted(comparison.per_part_axis_deg) == sorted(model.part_index)  # no pelvis, no collars
    # Below the waist all is turned by 20 degrees; the trunk of the one is the chest of the other.
    expected = dict.fromkeys(("left_thigh", "left_calf", "right_thigh", "right_calf"), 20.0) | {"left_forearm": 10.0}
    assert comparison.per_part_axis_deg == pytest.approx({n: expected.get(n, 0.0) for n in model.part_index}, abs=1e-9)
    assert comparison.angle_error_deg is None


def test_no_frame_in_common(model):
    with pytest.raises(FormatError, match="no frame in common"):
        compared(model, {0: model.neutral()}, {1: model.neutral()}, range(3))


def test_no_part_in_common(model):
    parts = tuple(replace(p, name=f"{p.name}_x") for p in model.parts)
    joints = tuple(replace(j, child=f"{j.child}_x", parent=f"{j.parent}_x" if j.parent else "") for j in model.joints)
    other = replace(model, name="other", parts=parts, joints=joints, landmarks=())
    with pytest.raises(FormatError, match="'gavrila22' and 'other' have no part of the same name"):
        compared(model, {0: model.neutral()}, {0: model.neutral()}, true_model=other)


def test_joints_of_poses(model):
    poses = {7: model.neutral(), 2: set_deg(model, left_elbow__extension=90)}
    joints = joints_of_poses(model, poses, 30.0)
    assert joints.names == JOINTS
    assert joints.frames.tolist() == [2, 7]
    wrist = joints.points[:, LIMB_JOINTS.index("left_wrist")]
    np.testing.assert_allclose(wrist[1], model.points_world(poses[7])[model.point_names.index("left_wrist")])
    assert wrist[0, 2] > wrist[1, 2]
    assert evaluate_joints(joints, joints, [2, 7]).mpjpe_mm == 0
