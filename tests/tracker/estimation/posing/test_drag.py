from dataclasses import replace

import numpy as np
import pytest
from staging import camera_at, cameras_around, shaken

from tracker.body.model import PosedBody
from tracker.estimation.fitting.gauss_newton import solve
from tracker.estimation.posing import reaching
from tracker.estimation.posing.drag import bend, drag, push, turn
from tracker.estimation.posing.grab import grab, grab_part, minor_points, regrab
from tracker.estimation.posing.picking import part_hulls
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid
from tracker.geometry.cameras import NEAR_PLANE_M

SIDE = camera_at("side", (3.0, 2.5, 1.0))


def place(model, values, point):
    return model.points_world(values)[model.point_names.index(point)]


@pytest.fixture(scope="module")
def pose(gavrila):
    """Arms half raised and limbs bent: room to move in every direction."""
    values = gavrila.neutral()
    for name, angle in {
        "left_shoulder.abduction": 0.8, "right_shoulder.abduction": 0.8, "left_shoulder.elevation": 0.3,
        "left_elbow.extension": 0.9, "right_elbow.extension": 0.9, "left_hip.elevation": 0.5,
        "left_knee.extension": 0.9, "right_knee.extension": 0.8, "right_hip.elevation": 0.3,
    }.items():  # fmt: skip
        values[gavrila.value_names.index(name)] = angle
    return values


@pytest.mark.slow
@pytest.mark.parametrize("point", ["left_wrist", "right_wrist", "left_elbow", "left_ankle", "right_ankle", "left_knee"])
@pytest.mark.parametrize("seed", range(4))
def test_a_dragged_joint_stays_under_the_pointer(gavrila, pose, point, seed):
    """The pointer goes where the chain can follow: to the image of the point in another pose of the limb."""
    rng = np.random.default_rng(seed)
    hold = np.array([2.0, -1.0])  # the handle was not hit in its middle
    start = SIDE.project(place(gavrila, pose, point)) + hold
    hand = grab(gavrila, pose, SIDE, point, start)
    other = gavrila.clip(gavrila.retract(pose, np.where(hand.active_dofs, rng.normal(0, 0.25, gavrila.n_dofs), 0)))
    goal = SIDE.project(place(gavrila, other, point)) + hold
    values = pose
    for part in (0.25, 0.5, 0.75, 1.0):
        values = drag(hand, start + part * (goal - start), values)
        np.testing.assert_allclose(gavrila.clip(values), values, atol=1e-9)
    assert np.linalg.norm(goal - start) > 2
    assert np.linalg.norm(SIDE.project(place(gavrila, values, point)) + hold - goal) < 1


@pytest.mark.parametrize("way", [(6, 0), (-6, 3), (-3, -5), (10, -10)])
@pytest.mark.parametrize("point", ["left_wrist", "right_wrist", "left_ankle", "right_ankle"])
def test_two_bones_keep_the_depth(gavrila, pose, point, way):
    start = SIDE.project(place(gavrila, pose, point))
    hand = grab(gavrila, pose, SIDE, point, start)
    end = place(gavrila, drag(hand, start + way, pose), point)
    assert SIDE.depths(end) == pytest.approx(hand.depth_m, abs=0.01)
    assert np.linalg.norm(SIDE.project(end) - start - way) < 0.5


def test_the_pointer_is_followed_if_one_bone_decides_the_depth(gavrila, pose):
    # The elbow moves on a sphere around the shoulder: at its old depth it would stay 4 px behind.
    start = SIDE.project(place(gavrila, pose, "left_elbow"))
    hand = grab(gavrila, pose, SIDE, "left_elbow", start)
    end = place(gavrila, drag(hand, start + np.array([-3, -5]), pose), "left_elbow")
    assert np.linalg.norm(SIDE.project(end) - start - (-3, -5)) < 0.5
    assert abs(SIDE.depths(end) - hand.depth_m) > 0.03


def test_a_straight_limb_bends(gavrila):
    camera = camera_at("side", (0.0, 4.0, 0.0))
    values = gavrila.neutral()
    start = camera.project(place(gavrila, values, "left_ankle"))
    hand = grab(gavrila, values, camera, "left_ankle", start)
    bent = drag(hand, start - np.array([0, 25]), values)
    assert np.linalg.norm(camera.project(place(gavrila, bent, "left_ankle")) - start + (0, 25)) < 1
    assert bent[gavrila.value_names.index("left_knee.extension")] > 0.5


@pytest.mark.parametrize(
    ("point", "moves"),
    [
        ("left_wrist", {"left_shoulder", "left_elbow"}),
        ("left_elbow", {"left_shoulder"}),
        ("right_ankle", {"right_hip", "right_knee"}),
        ("right_knee", {"right_hip"}),
        ("head", {"torso"}),
        ("left_shoulder", {"torso"}),
        ("torso", {"torso"}),
    ],
)
def test_only_the_chain_moves(gavrila, pose, point, moves):
    start = SIDE.project(place(gavrila, pose, point))
    values = drag(grab(gavrila, pose, SIDE, point, start), start + np.array([9, -7]), pose)
    changed = np.abs(gavrila.difference(values, pose)) > 1e-9
    assert {n.split(".")[0] for n, c in zip(gavrila.dof_names, changed, strict=True) if c} == moves
    if point in ("head", "left_shoulder"):  # the body turns about its root, which stays
        np.testing.assert_array_equal(place(gavrila, values, "torso"), place(gavrila, pose, "torso"))


@pytest.mark.parametrize("camera", cameras_around(3))
def test_the_torso_moves_the_body_parallel_to_the_image(gavrila, pose, camera):
    start = camera.project(place(gavrila, pose, "torso")) + np.array([4, 4])
    hand = grab(gavrila, pose, camera, "torso", start)
    values = drag(hand, start + np.array([80, -50]), pose)
    shift = place(gavrila, values, "torso") - place(gavrila, pose, "torso")
    moved = gavrila.points_world(values) - gavrila.points_world(pose)
    np.testing.assert_allclose(moved, np.broadcast_to(shift, moved.shape))
    assert camera.depths(place(gavrila, values, "torso")) == pytest.approx(
        float(camera.depths(place(gavrila, pose, "torso"))), abs=1e-9
    )
    np.testing.assert_allclose(camera.project(place(gavrila, values, "torso")), start + np.array([76, -54]), atol=1e-6)


@pytest.mark.parametrize("point", ["left_wrist", "right_ankle", "head", "torso"])
def test_the_way_back_restores_the_pose(gavrila, pose, point):
    start = SIDE.project(place(gavrila, pose, point))
    hand = grab(gavrila, pose, SIDE, point, start)
    values = pose
    for way in [(10, 0), (15, 10), (5, 20), (-5, 5), (0, 0)]:
        values = drag(hand, start + way, values)
    # Within a tenth of a degree and a millimetre, which is not visible.
    assert np.abs(gavrila.difference(values, pose)).max() < 0.002


def test_without_moving_nothing_moves(gavrila, pose):
    start = SIDE.project(place(gavrila, pose, "left_wrist")) + np.array([3, 3])
    values = drag(grab(gavrila, pose, SIDE, "left_wrist", start), start, pose)
    np.testing.assert_allclose(values, pose, atol=1e-6)


def test_limits_hold_however_far_the_pointer_goes(gavrila, pose):
    rng = np.random.default_rng(0)
    for point in ("left_wrist", "right_elbow", "left_ankle", "head"):
        start = SIDE.project(place(gavrila, pose, point))
        values = drag(grab(gavrila, pose, SIDE, point, start), start + rng.uniform(-400, 400, 2), pose)
        np.testing.assert_allclose(gavrila.clip(values), values, atol=1e-9)
        assert np.all(np.isfinite(values))


def test_out_of_reach_the_limb_points_at_the_pointer(gavrila, pose):
    camera = camera_at("ahead", (4.0, 0.0, 0.3), (0.0, 0.0, 0.3))
    start = camera.project(place(gavrila, pose, "left_wrist"))
    shoulder = place(gavrila, pose, "left_shoulder")
    hand = grab(gavrila, pose, camera, "left_wrist", start)
    goal_px = camera.project(shoulder) + np.array([300, 0])
    values = pose
    for _ in range(5):  # the pointer rests there for a few moves
        values = drag(hand, goal_px, values)
    goal = camera.back_project(goal_px, hand.depth_m)
    arm = place(gavrila, values, "left_wrist") - shoulder
    reach = np.linalg.norm(arm)
    assert reach > 0.98 * (0.162 + 0.1545) * gavrila.height_m
    assert np.degrees(np.arccos(arm @ (goal - shoulder) / reach / np.linalg.norm(goal - shoulder))) < 5


def test_a_limb_that_is_stretched_to_what_is_out_of_reach_is_not_tried_bent(gavrila, pose, monkeypatch):
    camera = camera_at("ahead", (4.0, 0.0, 0.3), (0.0, 0.0, 0.3))
    start = camera.project(place(gavrila, pose, "left_wrist"))
    hand = grab(gavrila, pose, camera, "left_wrist", start)
    way = camera.project(place(gavrila, pose, "left_shoulder")) + np.array([300, 0]) - start
    values = pose
    for share in np.linspace(0, 1, 20)[1:]:
        values = drag(hand, start + share * way, values)
    solved = []
    monkeypatch.setattr(reaching, "solve", lambda *args, **how: solved.append(0) or solve(*args, **how))
    quick = drag(hand, start + way + (5, 5), values)
    assert len(solved) == 1
    monkeypatch.setattr(reaching, "_is_stretched", lambda *_: False)
    tried = drag(hand, start + way + (5, 5), values)
    assert len(solved) > 3
    wrists = [place(gavrila, v, "left_wrist") for v in (quick, tried)]
    np.testing.assert_allclose(*wrists, atol=0.001)


def test_a_limb_that_has_followed_is_not_tried_bent(gavrila, pose, monkeypatch):
    start = SIDE.project(place(gavrila, pose, "left_wrist"))
    hand, way = grab(gavrila, pose, SIDE, "left_wrist", start), np.array([25, -40])
    solved = []
    monkeypatch.setattr(reaching, "solve", lambda *args, **how: solved.append(0) or solve(*args, **how))
    values = drag(hand, start + way, pose)
    end = place(gavrila, values, "left_wrist")
    assert len(solved) == 1
    assert np.linalg.norm(SIDE.project(end) - start - way) < 0.5
    assert 0.002 < abs(SIDE.depths(end) - hand.depth_m) < 0.02  # as far as the pull of the rest holds it back
    monkeypatch.setattr(reaching, "_REACHED", reaching._REACHED._replace(depth_m=0.002))
    np.testing.assert_allclose(drag(hand, start + way, pose), values, atol=0.01)
    assert len(solved) == 4


@pytest.mark.parametrize("seed", range(5))
def test_from_any_pose_the_joint_follows_or_a_limit_holds_it(gavrila, seed):
    rng = np.random.default_rng(seed)
    values = shaken(gavrila, gavrila.neutral(), rng, 0.6, 0.3)
    for point in ("left_wrist", "right_wrist", "left_ankle", "right_ankle"):
        camera = cameras_around()[seed % 3]
        start = camera.project(place(gavrila, values, point))
        way = rng.uniform(-15, 15, 2)
        moved = drag(grab(gavrila, values, camera, point, start), start + way, values)
        end = camera.project(place(gavrila, moved, point))
        assert np.linalg.norm(end - start - way) < np.linalg.norm(way)  # nearer than it was


LIMBS = [
    (side, *joints)
    for side in ("left", "right")
    for joints in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle"))
]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gavrila22", "gavrila22_cones", "gavrila34", "knossow54"])
@pytest.mark.parametrize("seed", range(6))
def test_no_drag_of_a_limb_moves_another(name, seed):
    """Any pose, size, view, pointer and kind of drag, with the arms and legs of the other joints where they were."""
    rng = np.random.default_rng(seed)
    model = load_model(name, rng.uniform(1.5, 1.95))
    values = shaken(model, model.neutral(), rng, 0.8, 0.4)
    for side, *joints in LIMBS:
        own = {f"{side}_{joint}" for joint in joints[1:]}
        carried = own | {f"{side}_knuckles", f"{side}_toe"}
        others = [n for n in model.point_names if n not in carried]
        for point in own:
            camera = cameras_around()[rng.integers(3)]
            start = camera.project(place(model, values, point))
            grabbed = grab(model, values, camera, point, start)
            for change in (drag, push, turn):
                moved = change(grabbed, start + rng.uniform(-120, 120, 2), values)
                for other in others:
                    assert np.linalg.norm(place(model, moved, other) - place(model, values, other)) < 0.02, (
                        point,
                        other,
                    )


def test_points_that_a_hand_hardly_needs(gavrila):
    assert minor_points(gavrila) == ("neck",)  # rigid there
    bending = load_model("gavrila34")
    assert sorted(minor_points(bending)) == ["left_collarbone", "neck", "right_collarbone", "spine", "waist"]
    with_hands = minor_points(load_model("knossow54"))  # wrists and ankles are stiff too, but place their limbs
    assert sorted(with_hands) == ["left_collarbone", "neck", "right_collarbone", "spine", "upper_neck", "waist"]


@pytest.mark.parametrize(("point", "bent"), [("left_hip", "waist"), ("right_shoulder", "right_collarbone")])
def test_a_shoulder_or_hip_bends_the_trunk_only_with_the_modifier(point, bent):
    model = load_model("gavrila34")
    own = model.dof_joint == [j.name for j in model.joints].index(bent)
    start = SIDE.project(place(model, model.neutral(), point))
    hand = grab(model, model.neutral(), SIDE, point, start)
    assert bent in minor_points(model)
    assert not np.any(drag(hand, start + np.array([12.0, -4.0]), model.neutral())[own])
    bent_pose = bend(hand, start + np.array([12.0, -4.0]), model.neutral())
    assert np.abs(bent_pose[own]).max() > 0.01
    assert np.linalg.norm(SIDE.project(place(model, bent_pose, point)) - start - (12.0, -4.0)) < 0.5


def test_a_head_nods_where_the_neck_bends_and_else_turns_the_body(gavrila):
    for model, stays in ((load_model("gavrila34"), True), (gavrila, False)):
        values = model.neutral()
        px = SIDE.project(place(model, values, "head"))
        target = px + np.array([12.0, 3.0])
        nodded = drag(grab(model, values, SIDE, "head", px), target, values)
        np.testing.assert_allclose(SIDE.project(place(model, nodded, "head")), target, atol=0.5)
        moved = place(model, nodded, "left_ankle") - place(model, values, "left_ankle")
        assert (np.linalg.norm(moved) < 1e-9) == stays


def held_place(hand, values):
    return SIDE.project(hand.point_world(values))


@pytest.mark.parametrize("part", ["left_forearm", "left_upper_arm", "right_thigh", "right_calf"])
def test_a_part_follows_by_the_place_that_was_touched(gavrila, pose, part):
    index = gavrila.part_index[part]
    outline = next(o for o in part_hulls([PosedBody(gavrila, pose)], [SIDE])[0] if o.part == index)
    start = outline.polygon_px.mean(axis=0) + 2.0
    hand = grab_part(gavrila, pose, SIDE, index, start)
    np.testing.assert_allclose(held_place(hand, pose), start, atol=0.1)
    for way in (np.array([4.0, -3.0]), np.array([-3.0, -2.0])):
        values = drag(hand, start + way, pose)
        assert np.linalg.norm(held_place(hand, values) - start - way) < 1
        np.testing.assert_array_equal(values[:3], pose[:3])


def test_the_torso_is_taken_by_its_surface_to_move_the_body(gavrila, pose):
    start = SIDE.project(place(gavrila, pose, "torso")) + 3.0
    hand = grab_part(gavrila, pose, SIDE, 0, start)
    values = drag(hand, start + np.array([20, -10]), pose)
    np.testing.assert_allclose(held_place(hand, values), start + np.array([20, -10]), atol=0.01)
    np.testing.assert_array_equal(values[3:], pose[3:])


def test_turning_the_body_about_the_line_of_sight(gavrila, pose):
    center = SIDE.project(place(gavrila, pose, "torso"))
    start = center + np.array([0.0, -40.0])
    hand = replace(grab(gavrila, pose, SIDE, "torso", start), offset_px=np.zeros(2))
    values = turn(hand, center + np.array([40.0, 0.0]), pose)  # a quarter clockwise, as the view shows it
    np.testing.assert_allclose(values[:3], pose[:3], atol=1e-9)
    before, after = (gavrila.kinematics(v).Ts_world_part[0, :3, :3] for v in (pose, values))
    sight = SIDE.T_world_camera[:3, :3].T @ (place(gavrila, pose, "torso") - SIDE.center_world)
    turned = rigid.so3_log(SIDE.T_world_camera[:3, :3].T @ after @ before.T @ SIDE.T_world_camera[:3, :3])
    np.testing.assert_allclose(turned, np.pi / 2 * sight / np.linalg.norm(sight), atol=1e-3)


def test_on_the_joint_itself_a_turn_goes_as_a_knob(gavrila, pose):
    start = SIDE.project(place(gavrila, pose, "torso"))
    hand = grab(gavrila, pose, SIDE, "torso", start)
    turned = turn(hand, start + np.array([30, 0]), pose)
    before, after = (gavrila.kinematics(v).Ts_world_part[0, :3, :3] for v in (pose, turned))
    angle = np.linalg.norm(rigid.so3_log(after @ before.T))
    assert angle == pytest.approx(30 * hand.depth_m / SIDE.K[0, 0] / 0.3, rel=1e-3)


@pytest.mark.parametrize(("point", "pivot"), [("left_elbow", "left_shoulder"), ("left_knee", "left_hip")])
def test_a_limb_turns_about_its_joint_as_the_view_shows_it(gavrila, pose, point, pivot):
    start = SIDE.project(place(gavrila, pose, point))
    center = SIDE.project(place(gavrila, pose, pivot))
    hand = grab(gavrila, pose, SIDE, point, start)
    c, s = np.cos(0.3), np.sin(0.3)
    for way in (np.array([[c, -s], [s, c]]), np.array([[c, s], [-s, c]])):
        goal = center + way @ (start - center)
        values = turn(hand, goal, pose)
        end = SIDE.project(place(gavrila, values, point)) - center
        wanted = goal - center
        assert np.degrees(np.arccos(end @ wanted / np.linalg.norm(end) / np.linalg.norm(wanted))) < 3
        own = gavrila.dof_joint == [j.name for j in gavrila.joints].index(pivot)
        np.testing.assert_array_equal(values[~own], pose[~own])


@pytest.mark.parametrize("point", ["left_wrist", "right_ankle"])
def test_a_push_moves_a_point_in_depth_and_leaves_it_in_the_view(gavrila, pose, point):
    start = SIDE.project(place(gavrila, pose, point))
    hand = grab(gavrila, pose, SIDE, point, start)
    for up in (4.0, -4.0):
        end = place(gavrila, push(hand, start - (0.0, up), pose), point)
        wanted = 2 * up * hand.depth_m / SIDE.K[1, 1]
        assert SIDE.depths(end) - hand.depth_m == pytest.approx(wanted, abs=0.35 * abs(wanted))
        assert np.linalg.norm(SIDE.project(end) - start) < 1


def test_the_body_is_pushed_along_the_line_of_sight(gavrila, pose):
    start = SIDE.project(place(gavrila, pose, "torso"))
    hand = grab(gavrila, pose, SIDE, "torso", start)
    values = push(hand, start - np.array([0.0, 20.0]), pose)
    np.testing.assert_allclose(SIDE.project(place(gavrila, values, "torso")), start, atol=1e-6)
    assert SIDE.depths(place(gavrila, values, "torso")) == pytest.approx(hand.depth_m * (1 + 40 / SIDE.K[1, 1]))
    near = push(hand, start + np.array([0.0, 1e5]), pose)
    assert SIDE.depths(place(gavrila, near, "torso")) == pytest.approx(NEAR_PLANE_M)


def test_after_a_turn_the_hand_goes_on_where_it_is(gavrila, pose):
    start = SIDE.project(place(gavrila, pose, "left_wrist"))
    hand = grab(gavrila, pose, SIDE, "left_wrist", start)
    turned = turn(hand, start + np.array([0, -12]), pose)
    again = regrab(hand, turned, start + np.array([0, -12]))
    np.testing.assert_allclose(drag(again, start + np.array([0, -12]), turned), turned, atol=5e-3)
