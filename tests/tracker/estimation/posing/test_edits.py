from dataclasses import replace

import numpy as np
import pytest
from staging import shaken

from tracker.body.parts import Axis
from tracker.estimation.posing.edits import copy_dofs, copy_joint_angles, joint_of, limb_of, mirror_pose
from tracker.estimation.posing.orient import orient
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid

M = np.diag([1.0, -1.0, 1.0])


def with_balls(model):
    """The same body with ball joints for shoulders, hips and root."""
    joints = tuple(
        replace(j, kind="ball", axes=()) if j.free or j.name.endswith(("shoulder", "hip")) else j for j in model.joints
    )
    return replace(model, joints=joints, search_groups=())


def with_odd_axes(model):
    """The same body with a right shoulder that turns about other axes, in another order, with the same range."""
    axes = {
        "left_shoulder": tuple(
            replace(a, limits=(-2.8, 2.8)) for j in model.joints if j.name == "left_shoulder" for a in j.axes
        ),
        "right_shoulder": tuple(
            Axis(n, d, (-2.8, 2.8)) for n, d in (("z", (0, 0, 1)), ("x", (1, 0, 0)), ("y", (0, 1, 0)))
        ),
    }
    joints = tuple(replace(j, axes=axes.get(j.name, j.axes)) for j in model.joints)
    return replace(model, joints=joints, search_groups=())


MODELS = {
    "gavrila22": lambda: load_model("gavrila22"),
    "gavrila34": lambda: load_model("gavrila34"),
    "balls": lambda: with_balls(load_model("gavrila34")),
    "odd axes": lambda: with_odd_axes(load_model("gavrila34")),
}


@pytest.fixture(params=MODELS)
def model(request):
    return MODELS[request.param]()


def any_pose(model, seed):
    """A pose in the middle of a movement, anywhere, with any rotation."""
    return shaken(model, model.neutral(), np.random.default_rng(seed), 0.5, 1.0)


@pytest.mark.parametrize("seed", range(4))
def test_joints_are_mirror_images_in_the_frame_of_the_root(model, seed):
    values = any_pose(model, seed)
    result = mirror_pose(model, values)
    T = model.kinematics(values).Ts_world_part[0]
    np.testing.assert_allclose(model.kinematics(result).Ts_world_part[0], T, atol=1e-12)
    before, after = (rigid.apply(rigid.inverse(T), model.points_world(v)) for v in (values, result))
    for i, name in enumerate(model.point_names):
        swapped = name.replace("left_", "?").replace("right_", "left_").replace("?", "right_")
        np.testing.assert_allclose(after[i], M @ before[model.point_names.index(swapped)], atol=1e-5, err_msg=name)
    assert np.abs(after - before).max() > 0.05


@pytest.mark.parametrize("seed", range(4))
def test_mirrored_twice_is_the_same_pose(model, seed):
    values = any_pose(model, seed)
    twice = mirror_pose(model, mirror_pose(model, values))
    np.testing.assert_allclose(model.points_world(twice), model.points_world(values), atol=1e-5)
    np.testing.assert_allclose(np.abs(model.difference(twice, values)).max(), 0, atol=1e-4)


def test_taken_poses_are_exact_and_the_rest_untouched(model):
    a, b = any_pose(model, 1), any_pose(model, 2)
    dofs = np.isin(model.dof_joint, [0, len(model.joints) // 2])
    result = copy_dofs(model, a, b, dofs)
    np.testing.assert_array_equal(np.abs(model.difference(result, a))[~dofs], 0)
    np.testing.assert_allclose(np.abs(model.difference(result, b))[dofs], 0, atol=1e-12)


def test_joints_that_turn_in_another_order_are_bent_alike_all_the_same():
    """The hips of the two bodies have other angles for one rotation; all common joints are copied."""
    paper, ours = load_model("gavrila22"), load_model("gavrila34")
    theirs = posed_legs(paper)
    bent = copy_joint_angles(ours, ours.neutral(), paper, theirs, np.ones(ours.n_dofs, dtype=bool))
    for name in ("left_thigh", "left_calf", "right_thigh", "right_forearm"):
        R = [b.kinematics(v).Ts_world_part[b.part_index[name], :3, :3] for b, v in ((paper, theirs), (ours, bent))]
        np.testing.assert_allclose(*R, atol=1e-5, err_msg=name)
    # Going back they are the angles that they were, and what is locked stays.
    np.testing.assert_allclose(
        copy_joint_angles(paper, paper.neutral(), ours, bent, np.ones(paper.n_dofs, dtype=bool)), theirs, atol=1e-5
    )
    free = np.array([not n.startswith("left_hip.") for n in ours.dof_names])
    held = copy_joint_angles(ours, ours.neutral(), paper, theirs, free)
    np.testing.assert_array_equal(held[~free], ours.neutral()[~free])


def posed_legs(model):
    """Legs lifted sideways and forward, an arm away from the trunk; the root stays."""
    values = model.neutral()
    for name, degrees in {
        "left_hip.abduction": 35, "left_hip.elevation": 60, "left_hip.twist": -20, "left_knee.extension": 50,
        "right_hip.abduction": 10, "right_hip.elevation": -20, "right_hip.twist": 30, "right_shoulder.abduction": 70,
        "right_elbow.extension": 40,
    }.items():  # fmt: skip
        values[model.value_names.index(name)] = np.radians(degrees)
    return values


def test_points_mean_the_joint_and_limb_that_people_expect(gavrila):
    def limb(point):
        name, dofs = limb_of(gavrila, point)
        return name, sorted({gavrila.joints[j].name for j in gavrila.dof_joint[dofs]})

    assert limb("left_wrist") == limb("left_shoulder") == ("left_forearm", ["left_elbow", "left_shoulder"])
    assert limb(None)[0] == limb("torso")[0] == limb("head")[0] == "body"
    assert "torso" not in limb(None)[1]
    assert gavrila.joints[joint_of(gavrila, "left_wrist")].name == "left_elbow"
    assert gavrila.joints[joint_of(gavrila, "head")].name == "torso"  # a neck that does not bend


def test_a_joint_of_the_trunk_is_reset_alone():
    model = load_model("gavrila34")
    name, dofs = limb_of(model, "waist")
    assert name == "waist"
    assert {model.joints[j].name for j in model.dof_joint[dofs]} == {"waist"}


@pytest.mark.parametrize("name", ["torso", "left_shoulder", "right_hip"])
def test_a_part_takes_an_orientation_that_its_joint_allows(model, name):
    start, other = any_pose(model, 5), any_pose(model, 6)
    part = [j.name for j in model.joints].index(name)
    goal = copy_dofs(model, start, other, (model.dof_joint == part) & ~model.dof_is_length)
    wanted = model.kinematics(goal).Ts_world_part[part, :3, :3]
    result = orient(model, start, part, wanted)
    np.testing.assert_allclose(model.kinematics(result).Ts_world_part[part, :3, :3], wanted, atol=1e-5)
    np.testing.assert_allclose(model.difference(result, start)[model.dof_joint != part], 0, atol=1e-12)


def test_a_hinge_turns_as_near_as_it_can(gavrila):
    start = any_pose(gavrila, 7)
    elbow = gavrila.dof_names.index("left_elbow.extension")
    part = int(gavrila.dof_joint[elbow])
    start[elbow] = 0.8
    wanted = gavrila.kinematics(start).Ts_world_part[part, :3, :3] @ rigid.so3_exp(np.array([0.4, -0.3, 0.2]))
    angles = np.linspace(*gavrila.limits[elbow], 2000)

    def apart(angle):
        values = start.copy()
        values[elbow] = angle
        return np.linalg.norm(gavrila.kinematics(values).Ts_world_part[part, :3, :3] - wanted)

    best = angles[np.argmin([apart(a) for a in angles])]
    assert orient(gavrila, start, part, wanted)[elbow] == pytest.approx(best, abs=2e-3)
