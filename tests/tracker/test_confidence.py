import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from staging import cameras_around, own_evidence, posed
from test_body import BALLS

from tracker.body import Body
from tracker.confidence import LimbFigures, Quality, judge, limbs, quality, worst
from tracker.fit import StayNear, solve
from tracker.formats.model_toml import PRESETS, load_model, parse_model
from tracker.refine import ContourMatch


def names_of(model, parts):
    return [model.parts[p].name for p in parts]


def test_limbs_of_the_papers_body(gavrila):
    found = {x.name: x for x in limbs(gavrila)}
    assert set(found) == {f"{s}_{n}" for s in ("left", "right") for n in ("forearm", "calf")}
    assert names_of(gavrila, found["left_forearm"].parts) == ["left_upper_arm", "left_forearm"]
    assert names_of(gavrila, found["right_calf"].parts) == ["right_thigh", "right_calf"]
    dofs = np.array(gavrila.dof_names)[found["left_forearm"].dofs]
    assert sorted(d.split(".")[0] for d in dofs) == ["left_elbow"] + ["left_shoulder"] * 3


def test_limbs_of_a_trunk_that_bends():
    model = load_model("gavrila31")
    found = {x.name: x for x in limbs(model)}
    assert names_of(model, found["left_forearm"].parts) == ["left_collar", "left_upper_arm", "left_forearm"]
    assert names_of(model, found["left_calf"].parts) == ["left_thigh", "left_calf"]  # two legs hang on the pelvis
    assert names_of(model, found["head"].parts) == ["head"]
    assert found["head"].dofs.sum() == 2


@pytest.mark.parametrize("name", PRESETS)
def test_limbs_share_nothing_and_leave_the_trunk_alone(name):
    model = load_model(name)
    found = limbs(model)
    for a, b in itertools.combinations(found, 2):
        assert not set(a.parts) & set(b.parts)
        assert not np.any(a.dofs & b.dofs)
    root = model.dof_joint == 0
    for limb in found:
        assert 0 not in limb.parts
        assert not np.any(limb.dofs & root)
        # Whatever its degrees of freedom move is of the limb.
        assert set(np.flatnonzero(model.moves[limb.dofs].any(axis=0))) <= set(limb.parts)
        assert list(limb.parts) == sorted(limb.parts)  # from the trunk outwards


def test_limbs_of_a_body_with_balls():
    balls = parse_model(BALLS, "balls")
    (arm,) = limbs(balls)
    assert names_of(balls, arm.parts) == ["arm", "forearm", "hand"]
    assert arm.dofs.sum() == 5  # a ball and two axes; the hand is stuck on


def test_worst():
    for several in itertools.product(("good", "doubtful", "lost"), repeat=3):
        expected = "lost" if "lost" in several else "doubtful" if "doubtful" in several else "good"
        assert worst(several) == expected
    assert worst([]) == "good"


figures = st.builds(
    LimbFigures,
    name=st.just("arm"),
    forward=st.floats(0, 1),
    shown=st.floats(0, 1.2),
    color=st.floats(-3, 3),
    drop=st.floats(-3, 6),
)


@given(before=figures, worse=st.tuples(*[st.floats(0, 3)] * 4))
def test_worse_figures_never_clear_a_limb(before, worse):
    after = LimbFigures(
        "arm", before.forward + worse[0], before.shown - worse[1], before.color - worse[2], before.drop + worse[3]
    )
    assert after.suspicious >= before.suspicious
    quality_before, quality_after = (
        Quality(f.forward, 1.0, 0.01, 0.01, 3, 0.0, (f, LimbFigures("leg", 0.0, 1.0, 1.0, 0.0)))
        for f in (before, after)
    )
    order = ("good", "doubtful", "lost")
    assert order.index(judge(quality_after)) >= order.index(judge(quality_before))


def test_what_is_plain():
    good, bad = LimbFigures("left_forearm", 0.05, 0.9, 1.0, 0.0), LimbFigures("left_calf", 1.0, 0.9, 1.0, 0.0)
    hidden, undressed = LimbFigures("x", 0.0, 0.0, 1.0, 0.0), LimbFigures("y", 0.05, 0.9, -2.0, 4.0)
    assert judge(Quality(0.05, 1.0, 0.01, 0.01, 3, 0.0, (good,))) == "good"
    for limb in (bad, hidden, undressed):
        found = Quality(0.1, 1.0, 0.01, 0.01, 3, 0.0, (good, limb))
        assert found.suspects == (limb.name,)
        assert judge(found) == "doubtful"
    assert judge(Quality(1.0, 0.0, 1.0, 0.5, 3, 0.0, (bad, hidden))) == "lost"
    assert judge(Quality(0.0, 0.0, 1.0, 0.0, 0, 0.0, ())) == "lost"  # nothing sees the body
    # What no part explains speaks against every limb.
    assert Quality(0.05, 1.0, 0.01, 0.01, 3, 0.2, (good, bad)).suspects == ("left_forearm", "left_calf")


def judged(model, truth, values):
    """Quality of a pose before the evidence of another one."""
    views = own_evidence([Body(model, truth)], cameras_around())
    match = ContourMatch(views, [Body(model, values)])
    fit = solve(model, values, [match, StayNear(values, np.full(model.n_dofs, 5.0))], max_iterations=0)
    thetas = np.array([v.theta_px for v in views])
    shown = np.full((3, len(model.parts)), 80.0)
    return quality(model, fit, truth, match.part_costs(values), thetas, shown, np.zeros(3), None)


def test_quality_of_a_pose_and_of_a_lost_arm(gavrila):
    truth = posed(gavrila, 1)
    off = np.array(truth)
    off[gavrila.dof_names.index("left_shoulder.abduction")] += 1.0
    right, wrong = judged(gavrila, truth, truth), judged(gavrila, truth, off)
    assert right.views == wrong.views == 3
    assert right.forward < 0.05 < wrong.forward
    assert right.explained > wrong.explained
    assert right.step_m == 0
    end = gavrila.point_names.index("left_wrist")
    moved = np.linalg.norm(gavrila.points_world(off) - gavrila.points_world(truth), axis=1)
    assert wrong.step_m == pytest.approx(moved[end])
    arm = [x.name for x in wrong.limbs].index("left_forearm")
    forward = [x.forward for x in wrong.limbs]
    assert forward[arm] == max(forward) > 0.45 > 2 * sorted(forward)[-2]
    assert "left_forearm" in wrong.suspects
    assert all(x.drop == 0 and x.color == np.inf for x in right.limbs)  # without colours they say nothing
    assert 0 < right.spread_m < wrong.spread_m


def test_quality_where_nothing_is_seen(gavrila):
    truth = posed(gavrila, 1)
    found = judged(gavrila, truth, gavrila.retract(truth, np.pad([0.0, 0.0, 30.0], (0, gavrila.n_dofs - 3))))
    assert found.views == 0
    assert judge(found) == "lost"
    assert np.isfinite([found.forward, found.explained, found.spread_m, found.step_m]).all()
