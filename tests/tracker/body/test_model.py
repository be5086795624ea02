import numpy as np
import pytest
from bodies import MODELS, set_deg, with_center
from hypothesis import given
from hypothesis import strategies as st

from tracker.body.limbs import limbs
from tracker.body.model import parts_of
from tracker.formats.model_toml import load_model
from tracker.geometry import rigid

each_model = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)
seeds = st.integers(0, 10_000)


def random_values(model, seed, spread=1.0):
    step = np.random.default_rng(seed).normal(0, spread, model.n_dofs)
    return model.retract(model.neutral(), step)


def slow_kinematics(model, values):
    """Part poses by matrices and a walk down the tree, straight from the definition."""
    Ts, at = [], 0
    for joint, parent in zip(model.joints, model.parents, strict=True):
        T = np.eye(4) if parent < 0 else Ts[parent]
        T = T @ rigid.transform(t=np.array(joint.position) * model.height_m)
        if joint.free:
            T = rigid.transform(t=values[at : at + 3]) @ T
            at += 3
        if joint.kind == "ball":
            T = T @ rigid.transform(rigid.matrix_from_quaternion(values[at : at + 4]))
            at += 4
        for axis in joint.axes:
            T = T @ rigid.transform(rigid.so3_exp(np.array(axis.direction) * values[at]))
            at += 1
        Ts.append(T)
    assert at == len(values)
    return np.array(Ts)


@each_model
def test_kinematics_against_the_definition(model):
    for seed in range(20):
        values = random_values(model, seed)
        np.testing.assert_allclose(model.kinematics(values).Ts_world_part, slow_kinematics(model, values), atol=1e-12)


@pytest.mark.slow
@each_model
@pytest.mark.parametrize("seed", range(5))
def test_point_jacobian_against_finite_differences(model, seed):
    values = random_values(model, seed)
    rng = np.random.default_rng(seed)
    parts = rng.integers(0, len(model.parts), 40)
    points_part = rng.normal(0, 0.3, (40, 3))

    def world(v):
        T = model.kinematics(v).Ts_world_part[parts]
        return np.einsum("nij,nj->ni", T[:, :3, :3], points_part) + T[:, :3, 3]

    J = model.point_jacobian(model.kinematics(values), parts, world(values))
    assert J.shape == (40, 3, model.n_dofs)
    h = 1e-6
    for i, unit in enumerate(np.eye(model.n_dofs)):
        numeric = (world(model.retract(values, h * unit)) - world(model.retract(values, -h * unit))) / (2 * h)
        np.testing.assert_allclose(J[:, :, i], numeric, atol=1e-8, err_msg=model.dof_names[i])


@pytest.mark.slow
@each_model
@given(seed=seeds)
def test_difference_undoes_retract(model, seed):
    values = random_values(model, seed)
    step = np.random.default_rng(seed + 1).uniform(-1.5, 1.5, model.n_dofs)  # balls: under half a turn
    moved = model.retract(values, step)
    np.testing.assert_allclose(model.difference(moved, values), step, atol=1e-9)
    np.testing.assert_array_equal(model.retract(values, np.zeros(model.n_dofs)), values)
    np.testing.assert_allclose(model.difference(values, values), 0, atol=1e-12)


@pytest.mark.slow
@each_model
@given(seed=seeds)
def test_clip_puts_within_limits_once_and_for_all(model, seed):
    wild = random_values(model, seed, 3.0)
    tame = model.clip(wild)
    np.testing.assert_allclose(model.clip(tame), tame, atol=1e-9)
    for i, name in enumerate(model.dof_names):
        if not name.endswith((".rx", ".ry", ".rz")):
            low, high = model.limits[i]
            assert low <= tame[model.dof_value[i]] <= high, name
    calm = model.clip(0.9 * model.neutral() + 0.1 * model.neutral())
    np.testing.assert_allclose(calm, model.neutral(), atol=1e-12)


@pytest.mark.slow
@given(seed=seeds)
def test_clipped_ball_is_within_cone_and_twist(seed):
    model = MODELS["balls"]
    values = model.clip(random_values(model, seed, 3.0))
    Ts = model.kinematics(values).Ts_world_part
    R = Ts[0, :3, :3].T @ Ts[1, :3, :3]  # arm in the trunk's frame
    assert np.arccos(np.clip(R[2, 2], -1, 1)) <= np.radians(100) + 1e-6
    # What is left when the shortest swing that tilts z there is taken back is a turn about z.
    axis = np.cross([0, 0, 1], R[:, 2])
    angle = np.arctan2(np.linalg.norm(axis), R[2, 2])
    swing = rigid.so3_exp(axis / max(np.linalg.norm(axis), 1e-12) * angle)
    twist = rigid.so3_log(swing.T @ R)
    np.testing.assert_allclose(twist[:2], 0, atol=1e-6)
    assert abs(twist[2]) <= np.radians(60) + 1e-6


def test_ball_within_its_limits_is_left_alone():
    model = MODELS["balls"]
    for seed in range(20):
        values = random_values(model, seed, 0.3)
        values[model.value_names.index("elbow.bend")] = 0.5
        values[model.value_names.index("elbow.roll")] = -0.5
        np.testing.assert_allclose(
            model.kinematics(model.clip(values)).Ts_world_part, model.kinematics(values).Ts_world_part, atol=1e-9
        )


@each_model
def test_moves_says_which_parts_a_degree_of_freedom_moves(model):
    values = random_values(model, 3)
    before = model.kinematics(values).Ts_world_part
    for i, unit in enumerate(np.eye(model.n_dofs)):
        after = model.kinematics(model.retract(values, 0.1 * unit)).Ts_world_part
        moved = np.abs(after - before).max(axis=(1, 2)) > 1e-9
        np.testing.assert_array_equal(moved, model.moves[i], err_msg=model.dof_names[i])


@each_model
def test_height_scales_the_body(model):
    values = model.neutral()
    double = model.with_height(2 * model.height_m)
    np.testing.assert_allclose(double.points_world(values), 2 * model.points_world(values), atol=1e-12)
    np.testing.assert_allclose(double.centers_part, 2 * model.centers_part)
    assert double.shapes[0].half_axes == tuple(2 * a for a in model.shapes[0].half_axes)


def at(model, values, name):
    return model.points_world(values)[model.point_names.index(name)]


def test_gavrila_has_the_papers_degrees_of_freedom():
    model = MODELS["gavrila22"]
    assert model.n_dofs == len(model.value_names) == 22
    assert [len(g.dofs) for g in model.search_groups] == [5, 9, 8]
    assert sorted(d for g in model.search_groups for d in g.dofs) == sorted(model.dof_names)


def test_gavrila_stands_with_hanging_arms():
    model = MODELS["gavrila22"].with_height(2.0)
    stand = model.neutral()
    np.testing.assert_allclose(at(model, stand, "left_wrist"), [0, 0.2, 0.296 - 0.324 - 0.309], atol=1e-12)
    np.testing.assert_allclose(at(model, stand, "right_ankle"), [0, -0.1, -0.296 - 0.485 - 0.5054], atol=1e-12)


@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
def test_gavrila_joints_turn_the_way_their_names_say(side, sign):
    model = MODELS["gavrila22"].with_height(1.0)
    shoulder, hip = np.array([0, sign * 0.1, 0.148]), np.array([0, sign * 0.05, -0.148])
    arm, leg = 0.162 + 0.1545, 0.2425 + 0.2527
    # Abduction lifts sideways, elevation forward (x), and a bent elbow or knee brings hand forward or foot back.
    for degrees, point, expected in [
        ({"shoulder__abduction": 90}, "wrist", np.add(shoulder, (0, sign * arm, 0))),
        ({"shoulder__elevation": 90}, "wrist", np.add(shoulder, (arm, 0, 0))),
        ({"elbow__extension": 90}, "wrist", np.add(shoulder, (0.1545, 0, -0.162))),
        ({"hip__abduction": 90 * 8 / 9}, "ankle", None),
        ({"hip__elevation": 90}, "ankle", np.add(hip, (leg, 0, 0))),
        ({"knee__extension": 90}, "ankle", np.add(hip, (-0.2527, 0, -0.2425))),
        # The arm hangs, its elbow bent forward: twist turns the hand towards the body's middle or away from it.
        ({"shoulder__twist": 90, "elbow__extension": 90}, "wrist", np.add(shoulder, (0, sign * 0.1545, -0.162))),
    ]:
        values = set_deg(model, **{f"{side}_{k}": v for k, v in degrees.items()})
        found = at(model, values, f"{side}_{point}")
        if expected is None:  # 80 degrees is as far as the hip goes
            expected = np.add(hip, (0, sign * leg * np.sin(np.radians(80)), -leg * np.cos(np.radians(80))))
        np.testing.assert_allclose(found, expected, atol=1e-12, err_msg=str(degrees))


def test_gavrila34_has_a_trunk_that_bends():
    model, plain = MODELS["gavrila34"], MODELS["gavrila22"]
    assert model.n_dofs == len(model.value_names) == 34
    assert sorted(d for g in model.search_groups for d in g.dofs) == sorted(model.dof_names)
    # Standing straight it is the same person: the points that both have are in the same places.
    places = plain.named_points_world(plain.neutral())
    shared = [n for n in model.point_names if n in places]
    assert len(shared) >= 14
    for name in shared:
        np.testing.assert_allclose(at(model, model.neutral(), name), places[name], atol=1e-9, err_msg=name)


@pytest.mark.parametrize(
    ("joint", "degrees", "moving", "way"),
    [
        # x is forward, y to the left, z up; the legs hang on the pelvis below the waist, which hangs below the spine.
        ("spine__elevation", 20, "left_ankle", (-1, 0, 0)),
        ("spine__abduction", 20, "left_ankle", (0, 1, 0)),
        ("spine__twist", 20, "left_hip", (-1, 0, 0)),
        ("waist__elevation", 20, "left_ankle", (-1, 0, 0)),
        ("waist__abduction", 20, "left_ankle", (0, 1, 0)),
        ("waist__twist", 20, "left_hip", (-1, 0, 0)),
        ("neck__elevation", 20, "head", (1, 0, 0)),
        ("neck__abduction", 20, "head", (0, -1, 0)),
        ("left_collarbone__elevation", 20, "left_shoulder", (0, 0, 1)),
        ("right_collarbone__elevation", 20, "right_shoulder", (0, 0, 1)),
        ("left_collarbone__protraction", 20, "left_shoulder", (1, 0, 0)),
        ("right_collarbone__protraction", 20, "right_shoulder", (1, 0, 0)),
    ],
)
def test_gavrila34_joints_turn_the_way_their_names_say(joint, degrees, moving, way):
    model = MODELS["gavrila34"]
    moved = at(model, set_deg(model, **{joint: degrees}), moving) - at(model, model.neutral(), moving)
    assert moved @ way > 0.8 * np.linalg.norm(moved) > 0.01
    # Arms and head are above the spine's joint, and stay where they are when the trunk bends.
    if joint.startswith(("spine", "waist")):
        np.testing.assert_array_equal(
            at(model, set_deg(model, **{joint: degrees}), "left_wrist"), at(model, model.neutral(), "left_wrist")
        )


def test_gavrila38_is_gavrila34_with_feet():
    model, plain = MODELS["gavrila38"], MODELS["gavrila34"]
    assert model.n_dofs == 38
    assert set(model.dof_names) - set(plain.dof_names) == {
        f"{side}_ankle.{name}" for side in ("left", "right") for name in ("flexion", "inversion")
    }
    assert sorted(d for g in model.search_groups for d in g.dofs) == sorted(model.dof_names)
    assert [x.name for x in limbs(model)] == ["head", "left_forearm", "right_forearm", "left_foot", "right_foot"]
    assert [len(x.parts) for x in limbs(model)] == [1, 3, 3, 3, 3]
    values = np.random.default_rng(0).normal(0, 0.3, plain.n_dofs)
    posed = model.neutral()
    posed[[model.dof_names.index(n) for n in plain.dof_names]] = values
    for name in plain.point_names:
        np.testing.assert_allclose(at(model, posed, name), at(plain, values, name), atol=1e-9, err_msg=name)


@pytest.mark.parametrize(("side", "inwards"), [("left", -1.0), ("right", 1.0)])
def test_gavrila38_feet_turn_the_way_their_names_say(side, inwards):
    model = MODELS["gavrila38"]
    foot = model.part_index[f"{side}_foot"]

    def turned(**angles):
        values = set_deg(model, **{f"{side}_ankle__{name}": angle for name, angle in angles.items()})
        R = model.kinematics(values).Ts_world_part[foot, :3, :3]
        return at(model, values, f"{side}_toe") - at(model, values, f"{side}_ankle"), -R[:, 2]

    toe, sole = turned()
    assert toe[0] > 0.1 * model.height_m
    raised, _ = turned(flexion=20)  # dorsiflexion
    assert raised[2] - toe[2] > 0.03 * model.height_m
    adducted, inverted = turned(inversion=25)  # the sole looks inwards, and the toes point inwards
    assert (inverted - sole)[1] * inwards > 0.2
    assert (adducted - toe)[1] * inwards > 0.02 * model.height_m


@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
@pytest.mark.parametrize("flexion", [-40, 0, 60, 90, 130])
def test_gavrila34_abducts_a_leg_alike_however_far_it_is_lifted(side, sign, flexion):
    """Abduction is the angle of the thigh with the plane of symmetry, and twist leaves the thigh where it is."""
    model = MODELS["gavrila34"].with_height(1.0)

    def knee(**angles):
        values = set_deg(model, **{f"{side}_hip__{name}": angle for name, angle in angles.items()})
        return at(model, values, f"{side}_knee") - at(model, values, f"{side}_hip")

    level = 0.2425 * np.array([np.sin(np.radians(flexion)), 0, -np.cos(np.radians(flexion))])
    for abduction in (-35, 0, 40, 75):
        a = np.radians(abduction)
        expected = np.cos(a) * level + (0, sign * 0.2425 * np.sin(a), 0)
        np.testing.assert_allclose(knee(flexion=flexion, abduction=abduction, twist=50), expected, atol=1e-12)


def test_only_the_papers_hips_lose_a_degree_of_freedom_when_a_leg_is_lifted():
    turns = {}
    for name, lift in (("gavrila22", "elevation"), ("gavrila34", "flexion")):
        model = MODELS[name]
        axes = model.kinematics(set_deg(model, **{f"left_hip__{lift}": 90})).axes_world
        turns[name] = np.linalg.svd(axes[[n.startswith("left_hip.") for n in model.dof_names]])[1]
    np.testing.assert_allclose(turns["gavrila22"], [np.sqrt(2), 1, 0], atol=1e-9)
    np.testing.assert_allclose(turns["gavrila34"], 1, atol=1e-9)


def test_gavrila34_bends_its_trunk_farther_forwards_than_backwards():
    model = MODELS["gavrila34"].with_height(1.0)
    ends = [np.degrees(model.limits[model.dof_names.index(f"{joint}.elevation")]) for joint in ("spine", "waist")]
    for way, angles in zip((1, -1), np.transpose(ends), strict=True):
        values = set_deg(model, spine__elevation=angles[0], waist__elevation=angles[1])
        T_pelvis_world = np.linalg.inv(model.kinematics(values).Ts_world_part[model.part_index["pelvis"]])
        ahead = (T_pelvis_world @ [*at(model, values, "neck"), 1.0])[0]
        assert way * ahead > 0.05  # x is forward as the pelvis sees it
        assert abs(angles.sum()) == pytest.approx(85 if way > 0 else 50)


def test_spreads_are_known_of_what_bends_little():
    model = MODELS["gavrila34"]
    known = {n.split(".")[0] for n, s in zip(model.dof_names, model.spreads, strict=True) if np.isfinite(s)}
    assert known == {"spine", "waist", "neck", "left_collarbone", "right_collarbone"}
    assert (model.spreads > 0).all()
    trunk = [model.spreads[model.dof_names.index(f"{joint}.twist")] for joint in ("spine", "waist")]
    assert np.linalg.norm(trunk) == pytest.approx(np.radians(25), rel=0.02)  # as much as a neck
    assert np.isinf(MODELS["gavrila22"].spreads).all()
    balls = MODELS["balls"]
    assert balls.spreads.shape == (balls.n_dofs,)
    assert np.isinf(balls.spreads).all()


def test_parts_of_several_bodies_follow_one_another(gavrila):
    models = [gavrila, load_model("gavrila34"), gavrila]
    whose = np.repeat(range(3), [len(m.parts) for m in models])
    for person in range(3):
        np.testing.assert_array_equal(np.arange(len(whose))[parts_of(models, person)], np.flatnonzero(whose == person))


@each_model
def test_a_point_is_its_own_joint_center_by_default(model):
    values = random_values(model, 3)
    np.testing.assert_array_equal(model.joint_centers_world(values), model.points_world(values))


def test_a_joint_center_moves_with_the_part_above_the_joint():
    """The hip's centre lies in the pelvis: no angle of the hip moves it; that of a wrist lies in the forearm."""
    model = with_center(with_center(MODELS["gavrila34"], "left_hip", (0.01, 0.02, -0.03)), "left_wrist", (0, 0.01, 0))
    values = random_values(model, 1, 0.3)
    away = (model.joint_centers_world(values) - model.points_world(values)) / model.height_m
    T = model.kinematics(values).Ts_world_part[:, :3, :3]
    for name, part, offset in (
        ("left_hip", "pelvis", (0.01, 0.02, -0.03)),
        ("left_wrist", "left_forearm", (0, 0.01, 0)),
    ):
        found = away[model.point_names.index(name)]
        np.testing.assert_allclose(T[model.part_index[part]].T @ found, offset, atol=1e-12)
    assert np.count_nonzero(np.linalg.norm(away, axis=1) > 1e-9) == 2
    bent = set_deg(model, left_hip__flexion=60)
    hip = model.point_names.index("left_hip")
    np.testing.assert_allclose(
        model.joint_centers_world(bent)[hip], model.joint_centers_world(set_deg(model))[hip], atol=1e-12
    )
