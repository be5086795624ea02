"""Annotators with known bias and noise: bias, limits and consensus come back; and consensus poses."""

import numpy as np
import pytest
from bodies import MODELS
from stored_motions import random_poses

from tracker.errors import SessionError
from tracker.evaluation.agreement.comparison import compare
from tracker.evaluation.agreement.copies import Copies, Subject, annotator_names, mean_points, mean_pose, pose_steps
from tracker.formats.joint_maps import LIMB_JOINTS

N, BIAS_M, NOISE_M = 30, 0.008, 0.002
JOINTS = LIMB_JOINTS
ELBOW, WRIST = JOINTS.index("left_elbow"), JOINTS.index("right_wrist")


def copies_of(points):
    """Copies without angles of points, (n, k, m, 3); joints beyond the limbs' go by numbers."""
    n, k, m = points.shape[:3]
    names, subjects = tuple("abcd"[:k]), tuple(Subject("ann", 5 * i) for i in range(n))
    joints = JOINTS if m == len(JOINTS) else tuple(map(str, range(m)))
    return Copies(names, subjects, joints, points, (), np.zeros((n, 0)), np.zeros((n, k, 0)), 25.0)


def white_noise(rng, n, k):
    """Noise of k annotators at a joint, (n, k, 3), whose sample has mean 0 and covariance 1: no luck is involved."""
    raw = rng.normal(size=(n, 3 * k))
    raw -= raw.mean(axis=0)
    return (raw @ np.linalg.inv(np.linalg.cholesky(np.cov(raw.T))).T).reshape(n, k, 3)


@pytest.fixture(params=[1, 2, 3])
def annotated(request):
    """True joints in motion, and two annotators: the second has its elbow 8 mm off, and both have noise."""
    rng = np.random.default_rng(request.param)
    truth = np.cumsum(rng.normal(size=(N, len(JOINTS), 3)), axis=0) * 0.05
    u = np.array([2.0, -1.0, 2.0]) / 3
    points = truth[:, None] + NOISE_M * np.stack([white_noise(rng, N, 2) for _ in JOINTS], axis=2)
    points[:, 1, ELBOW] += BIAS_M * u
    return truth, points, u


def test_known_bias_and_limits_come_back(annotated):
    _, points, u = annotated
    found = compare(copies_of(points)).joints
    elbow, half = found["left_elbow"], 1.959964 * NOISE_M * np.sqrt(2)
    assert np.allclose(elbow.bias_m, BIAS_M * u, atol=1e-9)
    assert elbow.along[:3] == pytest.approx((BIAS_M, BIAS_M - half, BIAS_M + half), abs=1e-8)
    assert [axis.upper - axis.bias for axis in elbow.by_axis] == pytest.approx([half] * 3, abs=1e-8)
    assert elbow.typical_error_m == pytest.approx(NOISE_M)
    assert elbow.typical_error_by_axis_m == pytest.approx([NOISE_M] * 3)
    assert np.allclose(found["right_wrist"].bias_m, 0, atol=1e-9)
    assert (elbow.pair, elbow.n) == (("a", "b"), N)


def test_the_consensus_has_less_error_than_either(annotated):
    truth, points, _ = annotated
    error = np.linalg.norm(mean_points(points) - truth, axis=-1).mean()
    assert all(error < np.linalg.norm(points[:, i] - truth, axis=-1).mean() for i in range(2))
    found = compare(copies_of(points)).annotators
    assert found["a"].joint_distance_m["left_elbow"] == pytest.approx(BIAS_M / 2, rel=0.2)
    assert np.allclose(found["a"].bias_m["left_elbow"], -found["b"].bias_m["left_elbow"])


def test_of_several_annotators_the_pair_with_the_largest_bias_is_named(annotated):
    _, points, u = annotated
    third = points[:, :1].copy()
    third[:, 0, ELBOW] -= 0.004 * u
    found = compare(copies_of(np.concatenate([points, third], axis=1))).joints["left_elbow"]
    assert found.pair == ("b", "c")
    assert found.along.bias == pytest.approx(0.012)
    assert set(compare(copies_of(points)).annotators) == {"a", "b"}


def reaching(copies):
    """Parts of the joints whose interval of the bias reaches 0: along its line, and along one axis."""
    joints = compare(copies).joints.values()
    along = [joint.along.bias_interval[0] <= 0 for joint in joints]
    axis = [joint.by_axis[0].bias_interval[0] <= 0 <= joint.by_axis[0].bias_interval[1] for joint in joints]
    return np.mean(along), np.mean(axis)


@pytest.mark.slow
@pytest.mark.parametrize("k", [2, 3, 4])
@pytest.mark.parametrize("n", [N, 6])
def test_copies_without_bias_show_none(k, n):
    """Of 400 comparisons of copies without a systematic difference, at most one in twenty shows a bias, or so."""
    noise = NOISE_M * np.random.default_rng(k).normal(size=(n, k, 400, 3)) * (1.0, 2.0, 0.5)
    along, axis = reaching(copies_of(noise))
    assert along >= 0.93
    assert axis >= 0.93


@pytest.mark.parametrize("k", [2, 3, 4])
def test_copies_with_a_bias_show_it(k):
    points = NOISE_M * np.random.default_rng(k).normal(size=(N, k, 20, 3))
    points[:, -1] += BIAS_M * np.array([2.0, -1.0, 2.0]) / 3
    assert reaching(copies_of(points))[0] == 0


def test_three_poses_say_nothing_of_a_line_in_space():
    points = np.random.default_rng(0).normal(size=(3, 2, 1, 3))
    (found,) = compare(copies_of(points)).joints.values()
    assert np.isnan([found.along.bias_interval, found.along.lower_interval]).all()
    assert np.isfinite([found.along.lower, *found.by_axis[0].bias_interval]).all()


def test_bodies_without_a_common_joint_have_no_worst_one():
    points = np.random.default_rng(0).normal(size=(3, 2, 2, 3))
    points[0, 0, 0] = points[0, 1, 1] = np.nan
    comparison = compare(copies_of(points))
    assert [d.subject.frame for d in comparison.worst if d.subject.frame == 0] == []
    assert len(comparison.worst) == 2
    alone = compare(copies_of(points[:1]))
    assert (alone.worst, alone.joints) == ((), {})
    assert np.isnan(alone.annotators["a"].mean_distance_m)
    assert compare(copies_of(points[:, :, :0])).joints == {}


def test_worst_poses_come_first(annotated):
    _, points, _ = annotated
    points[7, 1, WRIST] += 0.05
    points[20, 0, ELBOW, 2] += 0.1
    worst = compare(copies_of(points)).worst
    assert [(d.subject.frame, d.joint) for d in worst[:2]] == [(100, "left_elbow"), (35, "right_wrist")]
    assert [d.distance_m for d in worst] == sorted((d.distance_m for d in worst), reverse=True)
    assert len(worst) == N


def test_a_joint_that_a_body_lacks_counts_where_both_have_it(annotated):
    _, points, _ = annotated
    points[:10, 1, WRIST] = np.nan
    found = compare(copies_of(points)).joints
    assert (found["left_elbow"].n, found["right_wrist"].n) == (N, N - 10)


@pytest.mark.parametrize("name", ["gavrila22", "knossow54", "mikic10"])
def test_the_mean_pose_is_the_middle(name):
    model = MODELS[name]
    middle = random_poses(model, 2, seed=4)[1]
    step = 0.2 * np.random.default_rng(2).normal(size=model.n_dofs)
    mean = mean_pose(model, [model.retract(middle, step), model.retract(middle, -step)])
    assert np.allclose(model.points_world(mean), model.points_world(middle), atol=1e-7)


@pytest.mark.parametrize("name", ["gavrila22", "mikic10"])
def test_the_steps_from_the_mean_pose_cancel(name):
    model = MODELS[name]
    poses = [random_poses(model, 2, seed=k)[1] for k in range(3)]
    assert np.allclose(pose_steps(model, poses, mean_pose(model, poses)).sum(axis=0), 0, atol=1e-8)


def test_the_mean_of_angles_goes_the_shorter_way_round():
    model = MODELS["gavrila22"]
    i = next(i for i in range(model.n_dofs) if not model.dof_is_length[i])
    a, b = model.neutral(), model.neutral()
    a[model.dof_value[i]], b[model.dof_value[i]] = np.radians(175), np.radians(-175)
    assert np.cos(mean_pose(model, [a, b])[model.dof_value[i]]) == pytest.approx(-1)


def test_names_are_the_shortest_ends_that_differ(tmp_path):
    assert annotator_names([tmp_path / "x" / "ann", tmp_path / "x" / "ben"]) == ("ann", "ben")
    assert annotator_names([tmp_path / "ann" / "walk", tmp_path / "ben" / "walk"]) == ("ann/walk", "ben/walk")
    with pytest.raises(SessionError, match="twice"):
        annotator_names([tmp_path, tmp_path])
