"""Points that were placed stay where they are while others are dragged, and views agree about a point."""

import numpy as np
import pytest
from staging import camera_at, cameras_around, posed, shaken

from tracker.estimation.posing.drag import bend, drag, push, turn
from tracker.estimation.posing.grab import Constraints, grab, heading_points, holdable_points
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid

FRONT, SIDE = camera_at("front", (4.0, 0.5, 0.6)), camera_at("side", (0.5, 4.0, 0.6))
BOTH = (FRONT, SIDE)
ENDS = ("left_wrist", "right_wrist", "left_ankle", "right_ankle")


@pytest.fixture(scope="module", params=["gavrila22", "gavrila34"])
def model(request):
    return load_model(request.param)


def place(model, values, point):
    return model.points_world(values)[model.point_names.index(point)]


def away(model, values, before, *points):
    """How far points are from where they were, metres."""
    return [np.linalg.norm(place(model, values, p) - place(model, before, p)) for p in points]


def dragged(model, values, camera, point, by_px, held=None, change=drag, steps=4):
    start = camera.project(place(model, values, point))
    hand = grab(model, values, camera, point, start, Constraints(None, held or {}))
    for share in np.linspace(0, 1, steps + 1)[1:]:
        values = change(hand, start + share * np.asarray(by_px), values)
    return values


def upright(model, values):
    return np.degrees(np.arccos(model.kinematics(values).Ts_world_part[0, 2, 2]))


@pytest.mark.parametrize("point", ["torso", "left_shoulder"])
def test_hands_and_feet_that_were_placed_stay_while_the_body_moves(model, point):
    values = posed(model, 0)
    for side in ("left", "right"):
        for joint, angle in (("knee", 0.8), ("elbow", 1.0)):
            values[model.value_names.index(f"{side}_{joint}.extension")] = angle
    free = dragged(model, values, FRONT, point, (5, 3))
    held = dragged(model, values, FRONT, point, (5, 3), dict.fromkeys(ENDS, BOTH))
    np.testing.assert_allclose(place(model, held, "head"), place(model, free, "head"), atol=1e-9)
    assert min(away(model, free, values, *ENDS)) > 0.015
    assert max(away(model, held, values, *ENDS)) < 0.005


@pytest.mark.parametrize(("middle", "end"), [("left_elbow", "left_wrist"), ("right_knee", "right_ankle")])
def test_a_placed_end_stays_while_the_middle_turns_about_it_and_the_other_way_round(model, middle, end):
    values = posed(model, 1)
    base = place(model, values, middle.replace("elbow", "shoulder").replace("knee", "hip"))
    axis = place(model, values, end) - base
    # The middle joint goes round the line from shoulder to wrist: the wrist need not move.
    round_it = rigid.so3_exp(0.3 * axis / np.linalg.norm(axis)) @ (place(model, values, middle) - base) + base
    by_px = FRONT.project(round_it) - FRONT.project(place(model, values, middle))
    moved = dragged(model, values, FRONT, middle, by_px, {end: BOTH})
    assert away(model, moved, values, end)[0] < 0.01
    assert away(model, dragged(model, values, FRONT, middle, by_px), values, end)[0] > 0.03
    # The end goes round the middle: the middle need not move.
    about = rigid.so3_exp(np.array([0.0, 0.2, 0.0])) @ (place(model, values, end) - place(model, values, middle))
    by_px = FRONT.project(place(model, values, middle) + about) - FRONT.project(place(model, values, end))
    assert away(model, dragged(model, values, FRONT, end, by_px, {middle: BOTH}), values, middle)[0] < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gavrila22", "gavrila34"])
@pytest.mark.parametrize("seed", range(3))
def test_no_drag_of_a_limb_moves_another_whatever_is_held(name, seed):
    rng = np.random.default_rng(seed)
    body = load_model(name, rng.uniform(1.5, 1.95))
    values = shaken(body, body.neutral(), rng, 0.8, 0.4)
    cameras = cameras_around()
    held = {p: [cameras[i] for i in rng.permutation(3)[:2]] for p in holdable_points(body) if rng.random() < 0.6}
    for point in [p for p in holdable_points(body) if p.endswith(("elbow", "wrist", "knee", "ankle"))]:
        side, _, joint = point.partition("_")
        own = {f"{side}_{j}" for j in (("elbow", "wrist") if joint in ("elbow", "wrist") else ("knee", "ankle"))}
        change = (drag, push, turn)[rng.integers(3)]
        moved = dragged(body, values, cameras[rng.integers(3)], point, rng.uniform(-120, 120, 2), held, change, 1)
        others = [n for n in body.point_names if n not in own]
        assert max(away(body, moved, values, *others)) < 0.02, point


@pytest.mark.parametrize("point", ["torso", "left_wrist", "right_knee"])
def test_a_second_view_keeps_where_the_first_one_placed_a_point(model, point):
    """Two views at 45 degrees: without the first, the second drag would take the point off its line of sight."""
    first, second = FRONT, camera_at("oblique", (2.8, 2.8, 0.6))
    values = posed(model, 2)
    before = place(model, values, point)
    goal = before + np.array([0.12, -0.1, 0.03])
    if point != "torso":  # a place that the limb reaches
        other = shaken(model, values, np.random.default_rng(8), 0.25, 0.0)
        limb = np.isin(
            model.dof_joint, [i for i, j in enumerate(model.joints) if j.name.startswith(point.split("_")[0])]
        )
        goal = place(model, np.where(limb & model.limb_dofs, other, values), point)
    once = dragged(model, values, first, point, first.project(goal) - first.project(before))

    def second_px(view, held):
        by_px = second.project(goal) - second.project(place(model, once, point))
        twice = dragged(model, once, second, point, by_px, held)
        return np.linalg.norm(view.project(place(model, twice, point)) - view.project(goal))

    assert second_px(second, {point: [first]}) < 3
    assert second_px(first, {point: [first]}) < 4
    if point != "right_knee":  # its sphere about the hip leaves little open
        assert second_px(first, {point: [first]}) < 0.5 * second_px(first, {})


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_an_ankle_drag_bends_the_knee_forwards(model, seed):
    rng = np.random.default_rng(seed)
    values = model.neutral()
    values[5] = rng.uniform(0, 2 * np.pi)
    moved = dragged(model, values, cameras_around()[seed % 3], "left_ankle", (rng.uniform(-10, 10), -20.0))
    hip, knee, ankle = (place(model, moved, f"left_{j}") for j in ("hip", "knee", "ankle"))
    leg = (ankle - hip) / np.linalg.norm(ankle - hip)
    bow = (knee - hip) - ((knee - hip) @ leg) * leg
    x, y = (model.kinematics(values).Ts_world_part[0, :3, i] for i in (0, 1))
    assert bow @ x > 0.1
    assert abs(bow @ y) < 0.03


def walking(model, rng):
    """A person who stands or walks, in any direction, one leg straight in every second pose."""
    values = model.neutral()
    values[5] = rng.uniform(0, 2 * np.pi)
    for side in ("left", "right"):
        degrees = {
            "hip.flexion": rng.uniform(-20, 35), "hip.elevation": rng.uniform(-20, 35),
            "hip.abduction": rng.uniform(0, 12), "knee.extension": rng.choice([0, rng.uniform(0, 60)]),
        }  # fmt: skip
        for name, angle in degrees.items():
            if f"{side}_{name}" in model.dof_names:
                values[model.dof_value[model.dof_names.index(f"{side}_{name}")]] = np.radians(angle)
    return model.clip(values)


@pytest.mark.slow
def test_short_drags_of_an_ankle_do_not_fold_the_leg(model):
    """A leg that an ankle's drag stretches is another matter: its knee comes to the line from hip to ankle."""
    rng, moved_m, missed_m = np.random.default_rng(11), [], []
    knee = model.value_names.index("left_knee.extension")
    while len(moved_m) < 60:
        values, camera, angle = walking(model, rng), cameras_around()[rng.integers(3)], rng.uniform(0, 2 * np.pi)
        by_px = 25 * np.array([np.cos(angle), np.sin(angle)])
        moved = dragged(model, values, camera, "left_ankle", by_px, steps=2)
        if moved[knee] > values[knee] + 0.03:
            moved_m += away(model, moved, values, "left_knee")
            start = camera.project(place(model, values, "left_ankle"))
            missed_m.append(grab(model, values, camera, "left_ankle", start).miss_m(start + by_px, moved))
    assert np.mean(np.array(moved_m) > 0.25) < 0.06
    assert np.median(moved_m) > 0.05  # knees still bend
    assert np.median(missed_m) < 0.01


def test_an_elbow_that_is_raised_from_a_hanging_arm_arrives(model):
    values = model.neutral()
    shoulder = place(model, values, "left_shoulder")
    reach = np.linalg.norm(place(model, values, "left_elbow") - shoulder)
    goal = shoulder + reach * np.array([0.0, np.sqrt(0.5), np.sqrt(0.5)])
    by_px = FRONT.project(goal) - FRONT.project(place(model, values, "left_elbow"))
    moved = dragged(model, values, FRONT, "left_elbow", by_px)
    assert np.linalg.norm(place(model, moved, "left_elbow") - goal) < 0.06


@pytest.mark.slow
@pytest.mark.parametrize("point", ["left_shoulder", "right_shoulder", "left_hip"])
@pytest.mark.parametrize("way", [(40, -30), (-60, 80), (5, 200)])
def test_a_shoulder_or_hip_turns_the_body_about_the_vertical_and_never_tilts_it(model, point, way):
    values = posed(model, 3)
    values[3:5] = 0
    moved = dragged(model, values, FRONT, point, way)
    assert point in heading_points(model)
    assert upright(model, moved) < 1e-3
    np.testing.assert_allclose(place(model, moved, "torso"), place(model, values, "torso"), atol=1e-9)
    tilted = dragged(model, values, FRONT, point, way, change=turn)
    assert upright(model, tilted) > 3


def test_a_shoulder_drawn_to_the_other_side_turns_the_body_round(model):
    """In steps, as a hand goes; from the outline inwards it comes towards the camera."""
    values = model.neutral()  # faces FRONT
    left, right = (FRONT.project(place(model, values, f"{side}_shoulder")) for side in ("left", "right"))
    half = dragged(model, values, FRONT, "left_shoulder", (right - left) / 2, steps=8)
    assert FRONT.depths(place(model, half, "left_shoulder")) < FRONT.depths(place(model, half, "torso")) - 0.1
    whole = dragged(model, values, FRONT, "left_shoulder", right - left, steps=12)
    assert np.linalg.norm(FRONT.project(place(model, whole, "left_shoulder")) - right) < 4
    facing = model.kinematics(whole).Ts_world_part[0, :3, 0]
    assert facing @ (FRONT.center_world - place(model, whole, "torso")) < 0


@pytest.mark.parametrize("point", ["left_wrist", "right_ankle"])
def test_with_the_modifier_the_trunk_bends_and_the_other_limbs_stay(point):
    body = load_model("gavrila34")
    values = posed(body, 4)
    straight = dragged(body, values, SIDE, point, (45, -45))
    bent = dragged(body, values, SIDE, point, (45, -45), change=bend)
    stiff = np.isfinite(body.spreads) & (body.dof_joint != 0)
    assert not np.any(straight[stiff] - values[stiff])
    assert np.abs(bent[stiff] - values[stiff]).max() > 0.005
    others = [end for end in ENDS if end != point]
    assert max(away(body, bent, values, *others)) < 0.02


def test_the_shortfall_of_a_point_is_its_distance_from_the_line_of_sight(model):
    values = posed(model, 5)
    start = FRONT.project(place(model, values, "left_wrist"))
    hand = grab(model, values, FRONT, "left_wrist", start)
    near, far = start + np.array([3.0, 2.0]), start + np.array([400.0, 0.0])
    assert hand.miss_m(near, drag(hand, near, values)) < 0.002
    end = drag(hand, far, values)
    ray = hand.target_world(far) - FRONT.center_world
    off = np.cross(ray / np.linalg.norm(ray), place(model, end, "left_wrist") - FRONT.center_world)
    assert hand.miss_m(far, end) == pytest.approx(np.linalg.norm(off), abs=1e-9)
    assert hand.miss_m(far, end) > 0.5
