"""Constant offsets of joints, acceleration errors and errors of frames."""

import numpy as np
import pytest
from bodies import with_center

from tracker.evaluation.metrics import Motion, PoseDoubt, evaluate_joints, joints_of_poses
from tracker.evaluation.stored_evaluation import evaluate_offsets
from tracker.formats.model_toml import load_model

MODEL = load_model("gavrila34", 1.7)
FPS = 50.0


def poses(n=20):
    rng = np.random.default_rng(2)
    ends = rng.normal(0, 0.5, (2, MODEL.n_dofs))
    return {k: MODEL.clip(MODEL.retract(MODEL.neutral(), ends[0] + k / n * (ends[1] - ends[0]))) for k in range(n)}


def evaluated(true_model, align="none", n=20):
    motion = Motion(MODEL, poses(n))
    tables = joints_of_poses(MODEL, motion.poses, FPS), joints_of_poses(true_model, motion.poses, FPS)
    result = evaluate_joints(*tables, range(n), align)
    return evaluate_offsets(result, motion, tables, range(n), align)


def test_an_offset_in_the_body_is_found_and_taken_away():
    """The anatomical hip lies beside the pivot, in the pelvis: the world difference turns with the body."""
    evaluation = evaluated(with_center(MODEL, "left_hip", (0.02, 0.0, -0.01)))
    assert evaluation.per_joint_mm["left_hip"] == pytest.approx(1700 * np.hypot(0.02, 0.01))
    assert evaluation.offsets_mm["left_hip"] == pytest.approx((-34.0, 0.0, 17.0), abs=1e-6)
    assert evaluation.per_joint_without_offsets_mm["left_hip"] == pytest.approx(0, abs=1e-6)
    assert evaluation.mpjpe_mm == pytest.approx(1700 * np.hypot(0.02, 0.01) / 12)
    assert evaluation.mpjpe_without_offsets_mm == pytest.approx(0, abs=1e-6)


def test_offsets_after_an_alignment_are_those_of_the_aligned_poses():
    evaluation = evaluated(with_center(MODEL, "left_wrist", (0.0, 0.03, 0.0)), "rigid-all")
    assert evaluation.mpjpe_without_offsets_mm < 0.5 * evaluation.mpjpe_mm


def test_an_error_that_moves_is_no_offset():
    motion = Motion(MODEL, poses())
    estimate, truth = (joints_of_poses(MODEL, motion.poses, FPS) for _ in range(2))
    wrist = truth.names.index("left_wrist")
    truth.points[:, wrist, 0] += 0.04 * (-1.0) ** np.arange(20)
    result = evaluate_joints(estimate, truth, range(20))
    offsets = evaluate_offsets(result, motion, (estimate, truth), range(20))
    assert offsets.per_joint_without_offsets_mm["left_wrist"] > 35
    # Second difference of 4 cm to and fro: 4 * 4 cm.
    assert offsets.acceleration_error_m_s2 == pytest.approx(0.16 * FPS**2 / 12)


def test_the_acceleration_error_follows_the_stride():
    estimate, truth = (joints_of_poses(MODEL, poses(), FPS) for _ in range(2))
    truth.points[:, truth.names.index("left_wrist"), 0] += 0.5 * 3.0 * (np.arange(20) / FPS) ** 2  # 3 m/s^2
    for step in (1, 2, 5):
        evaluation = evaluate_joints(estimate, truth, range(0, 20, step))
        assert evaluation.fps == FPS / step
        assert evaluation.acceleration_error_m_s2 == pytest.approx(3.0 / 12)
    assert evaluate_joints(estimate, truth, range(2)).acceleration_error_m_s2 is None


def test_each_frame_has_its_worst_joint():
    estimate, truth = (joints_of_poses(MODEL, poses(4), FPS) for _ in range(2))
    truth.points[1, truth.names.index("right_knee"), 2] += 0.06
    truth.points[2, :] = np.nan
    assessed = {
        0: PoseDoubt("keyframe"),
        1: PoseDoubt("lost", 0.9, "left leg uncertain"),
        2: PoseDoubt("", 0.2, "", 31.5),
    }
    found = evaluate_joints(estimate, truth, range(4), assessed=assessed).per_frame
    assert [f.frame for f in found] == [0, 1, 2, 3]
    assert [f.status for f in found] == ["keyframe", "lost", None, None]
    assert (found[1].worst_joint, found[1].worst_mm) == ("right_knee", pytest.approx(60))
    assert found[1].mean_mm == pytest.approx(5)
    assert found[2][2:5] == (None, None, None)
    assert [f[5:] for f in found[:3]] == [(None, "", None), (0.9, "left leg uncertain", None), (0.2, "", 31.5)]
