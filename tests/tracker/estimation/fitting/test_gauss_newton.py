from dataclasses import replace

import numpy as np
import pytest
from bodies import ARM, with_center
from finite_differences import normal, slopes
from gaussian_prior import GaussianPrior
from hypothesis import given, settings
from hypothesis import strategies as st
from staging import at, posed, shaken, solid

from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.fitting.gauss_newton import (
    PointTargets,
    PosePrior,
    covariance,
    fit_to_points,
    normal_equations,
    solve,
)
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid

GAVRILA = load_model("gavrila22")
ROTATIONS = ~ARM.dof_is_length


def points_of(model, values, names=LIMB_JOINTS):
    places = model.named_points_world(values)
    return {n: places[n] for n in names}


def target(model, name, *place, weight=1.0):
    return PointTargets(np.array([model.point_names.index(name)]), np.array([place]), np.array([weight]))


def hand(values):
    return ARM.points_world(values)[ARM.point_names.index("hand")]


def off(model, values, targets):
    """Distance of each named point from its target, metres."""
    return np.array([np.linalg.norm(p - targets[n]) for n, p in points_of(model, values, targets).items()])


def block_of(kind, model, values, rng):
    if kind == "prior":
        return PosePrior(shaken(model, values, rng, 0.02, 0.2), rng.uniform(0.5, 3.0, model.n_dofs))
    if kind == "correlated prior":
        root = rng.normal(0, 1 / model.n_dofs, (model.n_dofs, model.n_dofs))
        return GaussianPrior(shaken(model, values, rng, 0.02, 0.2), root @ root.T)
    points = rng.integers(0, len(model.point_names), 9)
    targets = model.points_world(values)[points] + rng.normal(0, 0.1, (9, 3))
    return PointTargets(points, targets, rng.uniform(0.5, 3.0, 9))


@pytest.mark.parametrize("model", [GAVRILA, load_model("gavrila34"), ARM], ids=lambda m: m.name)
@pytest.mark.parametrize("kind", ["points", "prior", "correlated prior"])
@pytest.mark.parametrize("seed", range(3))
def test_blocks_against_finite_differences(kind, model, seed):
    """Balls: a prior's derivative is exact at its own pose, and off by half the angle between them, here 1%."""
    rng = np.random.default_rng(seed)
    values = shaken(model, model.neutral(), rng, 0.3, 0.5)
    body, block = PosedBody(model, values), block_of(kind, model, values, rng)
    gradient = slopes(lambda b: normal(block, b).cost, body, 1e-5)
    atol = 0.02 if model is ARM and kind != "points" else 1e-7
    np.testing.assert_allclose(normal(block, body).gradient, gradient, atol=atol)
    # Where nothing is left over, Gauss-Newton's second derivative is the second derivative.
    if isinstance(block, PointTargets):
        block = PointTargets(block.points, model.points_world(values)[block.points], block.weights)
    else:
        block = replace(block, pose=values)
    hessian = slopes(lambda b: normal(block, b).gradient, body, 1e-5)
    np.testing.assert_allclose(normal(block, body).hessian, hessian, atol=1e-6)


def test_normal_equations_of_rows_by_hand():
    found = normal_equations(np.array([1.0, 2.0]), np.array([[1.0, 0.0], [3.0, -1.0]]))
    assert found.cost == 2.5
    assert found.gradient.tolist() == [7.0, -2.0]
    assert found.hessian.tolist() == [[10.0, -3.0], [-3.0, 1.0]]


def test_without_iterations_a_pose_is_only_looked_at():
    wild = GAVRILA.retract(GAVRILA.neutral(), np.full(GAVRILA.n_dofs, -0.4))  # knees beyond their limits
    block = target(GAVRILA, "left_wrist", 0.3, 0.2, 0.1, weight=2.0)
    fit = solve(GAVRILA, wild, [block], max_iterations=0)
    here = GAVRILA.clip(wild)
    np.testing.assert_array_equal(fit.pose, here)
    normal = block.linearize(GAVRILA, here, GAVRILA.kinematics(here))
    assert (fit.cost, fit.iterations) == (normal.cost, 0)
    np.testing.assert_array_equal(fit.hessian, normal.hessian)


def test_covariance_by_hand():
    """Two blocks know where a ball is, to 1/2 and 1/3 m; its rotation is unobserved."""
    ball = solid((0.1, 0.1, 0.1))
    place, start = target(ball, "root", 1, 2, 3, weight=2.0), at(ball, 0, 0, 0).values
    prior = PosePrior(start, np.array([3.0, 0, 0, 0, 0, 0]))
    found = covariance(ball, solve(ball, start, [place, prior]))
    # What is not known at all has a variance of 1, which is as good as a block of weight 1.
    np.testing.assert_allclose(np.diag(found), [1 / 14, 1 / 5, 1 / 5, 1, 1, 1], rtol=1e-6)
    np.testing.assert_allclose(found, np.diag(np.diag(found)), atol=1e-9)


def test_covariance_against_noisy_targets():
    """Poses fitted to joints that are off by 5 mm at random scatter as the covariance says.

    200 fits tell a standard deviation to 5% (one sigma) and the mean squared Mahalanobis distance to 0.5 of 22.
    """
    rng = np.random.default_rng(11)
    truth, sigma = posed(GAVRILA, 0), 0.005
    points = np.arange(len(GAVRILA.point_names))
    places = GAVRILA.points_world(truth)

    def fitted(noise):
        block = PointTargets(points, places + noise, np.full(len(points), 1 / sigma))
        return solve(GAVRILA, truth, [block])

    expected = covariance(GAVRILA, fitted(0.0))
    off = [GAVRILA.difference(fitted(rng.normal(0, sigma, places.shape)).pose, truth) for _ in range(200)]
    np.testing.assert_allclose(np.std(off, axis=0), np.sqrt(np.diag(expected)), rtol=0.2)
    distances = np.einsum("ni,ij,nj->n", off, np.linalg.inv(expected), off)
    assert distances.mean() == pytest.approx(GAVRILA.n_dofs, abs=2)


def test_weighted_mean_by_hand():
    # One point drawn to x = 0 with weight 1 and to x = 1 with weight 2: 1 (x - 0) + 4 (x - 1) = 0.
    blocks = [target(ARM, "shoulder", 0, 0, 0), target(ARM, "shoulder", 1, 0, 0, weight=2.0)]
    fit = solve(ARM, ARM.neutral(), blocks, active_dofs=ARM.dof_is_length)
    np.testing.assert_allclose(fit.pose[:3], [0.8, 0, 0], atol=1e-6)
    assert fit.cost == pytest.approx(0.5 * (0.8**2 + 4 * 0.2**2))


def test_prior_against_a_target_by_hand():
    # Weight 3 to stay at 0, weight 1 to go to 1: 9 x + (x - 1) = 0.
    blocks = [PosePrior(ARM.neutral(), np.full(ARM.n_dofs, 3.0)), target(ARM, "shoulder", 0, 1, 0)]
    fit = solve(ARM, ARM.neutral(), blocks)
    np.testing.assert_allclose(fit.pose[:3], [0, 0.1, 0], atol=1e-6)
    assert fit.cost == pytest.approx(0.5 * (9 * 0.1**2 + 0.9**2))


def test_a_prior_is_exchanged_as_if_it_had_been_there(gavrila):
    rng = np.random.default_rng(0)
    pose, mean, other = (posed(gavrila, seed) for seed in range(3))
    weights, block = rng.uniform(1, 5, gavrila.n_dofs), target(gavrila, "left_wrist", 0.3, 0.2, 1.1)
    old, new = PosePrior(mean, weights), PosePrior(other, 2 * weights)
    found = solve(gavrila, pose, [block, old], max_iterations=0).with_prior(gavrila, old, new)
    expected = solve(gavrila, pose, [block, new], max_iterations=0)
    np.testing.assert_allclose(found.cost, expected.cost)
    np.testing.assert_allclose(found.hessian, expected.hessian, atol=1e-9)
    np.testing.assert_array_equal(found.pose, expected.pose)


def test_two_bone_arm_by_the_law_of_cosines():
    # Bones of 0.3 and 0.4 m, the hand 0.5 m away: a right angle at the elbow.
    fit = solve(ARM, ARM.neutral(), [target(ARM, "hand", 0.3, 0, -0.4)], active_dofs=ROTATIONS)
    np.testing.assert_allclose(hand(fit.pose), [0.3, 0, -0.4], atol=1e-6)
    assert fit.pose[ARM.dof_value[-1]] == pytest.approx(np.pi / 2, abs=1e-5)


def test_out_of_reach_the_arm_is_stretched_towards_the_target():
    fit = solve(ARM, ARM.neutral(), [target(ARM, "hand", 2.0, 0, -2.0)], active_dofs=ROTATIONS, max_iterations=200)
    np.testing.assert_allclose(hand(fit.pose), 0.7 * np.array([1, 0, -1]) / np.sqrt(2), atol=1e-3)


def test_free_leaves_the_rest_alone():
    free = np.array(ARM.dof_names) == "elbow.bend"
    fit = solve(ARM, ARM.neutral(), [target(ARM, "hand", 0.4, 0, -0.3)], active_dofs=free)
    np.testing.assert_array_equal(np.delete(fit.pose, ARM.dof_value[-1]), np.delete(ARM.neutral(), -1))
    assert fit.pose[-1] == pytest.approx(np.pi / 2, abs=1e-5)


def test_limits_hold_and_the_rest_does_what_it_can():
    # The elbow bends forward alone; drawn back it stays straight, and the shoulder turns back in its stead.
    back = target(ARM, "hand", -0.4, 0, -0.3)
    elbow_only = solve(ARM, ARM.neutral(), [back], active_dofs=np.array(ARM.dof_names) == "elbow.bend")
    assert elbow_only.pose[-1] == 0
    whole = solve(ARM, ARM.neutral(), [target(ARM, "hand", -0.7, 0, 0)], active_dofs=ROTATIONS, max_iterations=200)
    np.testing.assert_allclose(hand(whole.pose), [-0.7, 0, 0], atol=1e-3)
    # A ball within its cone of 100 degrees: the hand cannot be raised overhead.
    above = solve(ARM, whole.pose, [target(ARM, "hand", -0.1, 0, 0.7)], active_dofs=ROTATIONS, max_iterations=200)
    upper = ARM.kinematics(above.pose).Ts_world_part[0, :3, 2]
    assert np.degrees(np.arccos(upper[2])) <= 100 + 1e-6
    np.testing.assert_allclose(ARM.clip(above.pose), above.pose, atol=1e-9)


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000))
def test_ball_joint_recovers_a_rotation_from_points(seed):
    rng = np.random.default_rng(seed)
    swing = rng.normal(size=3) * (1, 1, 0)
    swing *= rng.uniform(0, np.radians(90)) / max(np.linalg.norm(swing), 1e-9)
    values = ARM.neutral()
    turn = rigid.quaternion_exp(np.array([0, 0, rng.uniform(-1, 1)]))
    values[3:7] = rigid.quaternion_multiply(rigid.quaternion_exp(swing), turn)
    values[-1] = rng.uniform(0.3, 2.5)  # bent: the twist shows
    blocks = [target(ARM, n, *p) for n, p in zip(ARM.point_names, ARM.points_world(values), strict=True)]
    fit = solve(ARM, ARM.neutral(), blocks, max_iterations=200)
    np.testing.assert_allclose(ARM.points_world(fit.pose), ARM.points_world(values), atol=1e-4)


def test_the_cost_never_rises():
    rng = np.random.default_rng(7)
    start = GAVRILA.neutral()
    targets = points_of(GAVRILA, shaken(GAVRILA, start, rng, 0.6, 0.3))
    blocks = [target(GAVRILA, n, *p) for n, p in targets.items()]
    costs = [solve(GAVRILA, start, blocks, max_iterations=n).cost for n in (1, 2, 3, 5, 10, 50)]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] < 1e-8


class Rough:
    """A prior with a cost that is rough near its minimum, like that of image residuals; it counts its calls."""

    def __init__(self, near, roughness):
        self.prior, self.roughness, self.asked = PosePrior(near, np.full(GAVRILA.n_dofs, 10.0)), roughness, 0

    def linearize(self, model, values, kinematics):
        self.asked += 1
        found = self.prior.linearize(model, values, kinematics)
        return found._replace(cost=found.cost + self.roughness * np.random.default_rng(self.asked).random())


@pytest.mark.parametrize("seed", range(5))
def test_a_small_gain_ends_the_descent(seed):
    """Near a rough minimum steps are refused repeatedly, each shorter than the last; a smallest decrease ends this."""
    near, rng = posed(GAVRILA, seed), np.random.default_rng(seed)
    start = shaken(GAVRILA, near, rng, 0.3, 0.1)
    patient, content = Rough(near, 0.05), Rough(near, 0.05)
    ends = [
        solve(GAVRILA, start, [patient], tolerance=1e-3),
        solve(GAVRILA, start, [content], tolerance=1e-3, gain=0.1),
    ]
    assert content.asked < patient.asked
    assert content.asked <= 5
    for end in ends:
        assert end.cost < 0.1
    # What no step promises to gain is not tried at all.
    idle = Rough(near, 0.0)
    stay = solve(GAVRILA, start, [idle], gain=1e6)
    assert (idle.asked, stay.iterations) == (1, 1)
    np.testing.assert_array_equal(stay.pose, GAVRILA.clip(start))


@pytest.mark.parametrize("seed", [*range(3), *(pytest.param(k, marks=pytest.mark.slow) for k in range(3, 12))])
def test_fit_to_points_recovers_poses_from_their_own_joints(seed):
    """Anywhere, facing any way, limbs at random within their limits; the limb joints alone are known."""
    rng = np.random.default_rng(seed)
    low, high = np.clip(GAVRILA.limits, -np.pi, np.pi).T
    values = shaken(GAVRILA, GAVRILA.neutral(), rng, 0.5, 1.0)
    limbs = GAVRILA.dof_joint > 0
    values[limbs] = rng.uniform(0.8 * low + 0.2 * high, 0.2 * low + 0.8 * high)[limbs]
    values[5] = rng.uniform(-np.pi, np.pi)
    targets = points_of(GAVRILA, values)
    fit = fit_to_points(GAVRILA, targets)
    # The weak pull to the start (1e-3 per rad) holds the joints back by a hair.
    assert off(GAVRILA, fit.pose, targets).max() < 0.001
    # What the joints show is the same: where every part's axis points.
    axes = [GAVRILA.kinematics(v).Ts_world_part[:, :3, 2] for v in (values, fit.pose)]
    assert np.degrees(np.arccos(np.clip(np.sum(axes[0] * axes[1], axis=1), -1, 1))).max() < 1


@pytest.mark.slow
def test_other_sizes_are_fitted_as_well_as_they_can():
    values = GAVRILA.neutral()
    targets = points_of(GAVRILA, values)
    shorter = GAVRILA.with_height(1.6)
    fit = fit_to_points(shorter, targets)
    assert shorter.height_m == 1.6
    assert 0.01 < off(shorter, fit.pose, targets).mean() < 0.05


@pytest.mark.slow
def test_a_longer_trunk_is_not_bent_to_be_shorter():
    """Shoulders 4 cm below those of this body: buckling the trunk would bring it nearer, but is unnatural."""
    model = load_model("gavrila34")
    targets = points_of(model, model.neutral())
    for name in targets:
        if name.endswith(("shoulder", "elbow", "wrist")):
            targets[name][2] -= 0.04
    found = fit_to_points(model, targets).pose
    trunk = [i for i, name in enumerate(model.value_names) if name.startswith(("spine.", "waist."))]
    assert np.degrees(np.abs(found[trunk])).max() < 10  # 45 without
    assert off(model, found, targets).mean() < 0.02


def test_near_is_where_the_fit_begins():
    values = shaken(GAVRILA, GAVRILA.neutral(), np.random.default_rng(2), 0.3, 0.5)
    # A straight arm's twist does not show in its joints: it stays as it was.
    names = np.array(GAVRILA.value_names)
    values[names == "left_elbow.extension"] = 0
    near = values.copy()
    near[names == "left_shoulder.twist"] = 0.7
    fit = fit_to_points(GAVRILA, points_of(GAVRILA, values), near)
    assert fit.pose[names == "left_shoulder.twist"][0] == pytest.approx(0.7, abs=1e-3)


def test_unknown_and_missing_points_are_passed_over():
    targets = points_of(GAVRILA, shaken(GAVRILA, GAVRILA.neutral(), np.random.default_rng(4), 0.3, 0.5))
    fit = fit_to_points(GAVRILA, targets | {"left_wrist": np.full(3, np.nan), "tail": np.zeros(3)})
    del targets["left_wrist"]
    assert off(GAVRILA, fit.pose, targets).max() < 1e-3


@pytest.mark.parametrize("known", [[], ["left_hip", "right_hip", "left_knee"]])
def test_too_few_points(known):
    targets = points_of(GAVRILA, GAVRILA.neutral(), known) | {"left_wrist": np.full(3, np.nan), "tail": np.zeros(3)}
    found = ", ".join(sorted(known)) or "none"
    with pytest.raises(TrackerError, match=rf"at least 4.*found {len(known)} \({found}\).*left_ankle"):
        fit_to_points(GAVRILA, targets)


@pytest.mark.slow
def test_fit_to_joint_centers_puts_them_on_the_targets():
    """A reference states anatomical joint centres, not pivots."""
    model = GAVRILA
    for side, y in (("left", 0.02), ("right", -0.02)):
        model = with_center(model, f"{side}_hip", (0.0, y, -0.03))
    pose = model.clip(model.retract(model.neutral(), np.random.default_rng(4).normal(0, 0.2, model.n_dofs)))
    targets = dict(zip(model.point_names, model.joint_centers_world(pose), strict=True))
    fit = fit_to_points(model, targets, centers=True)
    np.testing.assert_allclose(model.joint_centers_world(fit.pose), list(targets.values()), atol=1e-4)
    off = fit_to_points(model, targets)
    assert np.linalg.norm(model.joint_centers_world(off.pose) - list(targets.values()), axis=1).max() > 0.005
