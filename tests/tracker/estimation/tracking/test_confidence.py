import itertools

import numpy as np
import pytest
from bodies import BALLS
from hypothesis import given
from hypothesis import strategies as st
from staging import SUIT, cameras_around, dressed, own_evidence, posed

from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.estimation.appearance.part_colors import Colors
from tracker.estimation.fitting.contour_residuals import ContourResiduals, PartCosts
from tracker.estimation.fitting.gauss_newton import PosePrior, solve
from tracker.estimation.tracking.confidence import (
    STATUS_MODEL,
    LimbFeatures,
    PoseQuality,
    _Contours,
    classify,
    probabilities,
    quality,
    reason,
    views_of_limbs,
    worst,
)  # fmt: skip
from tracker.formats.model_toml import PRESETS, load_model, parse_model


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
    model = load_model("gavrila34")
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
    LimbFeatures, name=st.just("arm"), at_limits=st.floats(0, 1), free_spread_px=st.floats(0.1, 80),
    second_forward=st.floats(0, 1), end_color=st.floats(-3, 3), end_explained=st.floats(0, 1.5), innovation=st.floats(0,
    0.3),
)  # fmt: skip
CLEAR = LimbFeatures("leg", 0.0, 1.2, 0.06, 1.0, 0.5, 0.01)
ASTRAY = (0.25, 6.0, 0.4, -1.0, 0.1, 0.2)
"""Contours far from edges, that explain little, with the wrong colour, far from the prediction."""


@pytest.mark.slow
@given(before=figures, worse=st.tuples(*[st.floats(0, 3)] * 6), trunk=st.floats(0, 0.1))
def test_worse_figures_never_clear_a_limb(before, worse, trunk):
    signs = (1, 1, 1, -1, -1, 1)
    after = LimbFeatures("arm", *(b + s * w for b, s, w in zip(before[1:], signs, worse, strict=True)))
    better = PoseQuality(0.05, 3, 0.05, (before, CLEAR))
    worst_of = PoseQuality(0.05, 3, 0.05 + trunk, (after, CLEAR))
    assert (worst_of.log_odds >= better.log_odds).all()
    assert set(better.limbs_to_search) <= set(worst_of.limbs_to_search)
    order = ("good", "doubtful", "lost")
    assert order.index(classify(worst_of)) >= order.index(classify(better))


def test_a_limb_is_doubtful_where_it_may_be_off_and_lost_where_it_may_be_lost():
    seen = set()
    for spread_px in np.geomspace(1.0, 80.0, 40):
        found = PoseQuality(0.05, 3, 0.05, (CLEAR, CLEAR._replace(free_spread_px=spread_px)))
        off, lost = (probabilities(found.log_odds + c - STATUS_MODEL.lost).max() for c in STATUS_MODEL[1:])
        assert classify(found) == ("lost" if lost > 0.25 else "doubtful" if off > 0.05 else "good")
        seen.add(classify(found))
    assert seen == {"good", "doubtful", "lost"}


def test_plain_data():
    undressed, vague = LimbFeatures("x", *ASTRAY), CLEAR._replace(name="y", free_spread_px=40.0)
    assert classify(PoseQuality(0.05, 3, 0.05, (CLEAR, CLEAR))) == "good"
    for limb in (undressed, vague):
        found = PoseQuality(0.15, 3, 0.05, (CLEAR, CLEAR, limb))
        assert found.limbs_to_search == found.missing_limbs == (limb.name,)
        assert classify(found) == "lost"
        assert not found.is_body_lost
    assert PoseQuality(0.15, 3, 0.05, (CLEAR, undressed, vague)).is_body_lost  # most of it
    assert classify(PoseQuality(1.0, 3, 0.05, (CLEAR, CLEAR))) == "lost"  # no edge anywhere near
    assert classify(PoseQuality(0.0, 0, 0.05, ())) == "lost"  # nothing sees the body


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (PoseQuality(0.05, 3, 0.05, (CLEAR, CLEAR)), ""),
        (PoseQuality(0.15, 3, 0.05, (CLEAR, LimbFeatures("left_forearm", *ASTRAY))), "left arm uncertain"),
        (PoseQuality(0.15, 3, 0.05, (LimbFeatures("right_calf", *ASTRAY), CLEAR)), "right leg uncertain"),
        (PoseQuality(1.0, 3, 0.05, (CLEAR, CLEAR)), "no edges near the body"),
        (PoseQuality(0.0, 0, 0.05, ()), "no view shows the body"),
    ],
)
def test_contradictions_of_a_pose(found, words):
    assert reason(found) == words


def judged(model, truth, values, colors=False):
    """PoseQuality of a pose before the evidence of another one."""
    bodies = [PosedBody(model, truth)]
    views = dressed(bodies, cameras_around(), SUIT) if colors else own_evidence(bodies, cameras_around())
    match = ContourResiduals(views, [PosedBody(model, values)])
    fit = solve(model, values, [match, PosePrior(values, np.full(model.n_dofs, 5.0))], max_iterations=0)
    thetas = np.array([v.theta_px for v in views])
    body = PosedBody(model, values)
    score = None
    if colors:
        known = Colors(views, bodies).learn()
        score = Colors(views, [body]).score(values, known)
    return quality(body, fit, match.part_costs(values), views, thetas, values, score)


@pytest.mark.parametrize("colors", [False, True])
def test_quality_of_a_pose_and_of_a_lost_arm(gavrila, colors):
    truth = posed(gavrila, 1)
    off = np.array(truth)
    off[gavrila.dof_names.index("left_shoulder.abduction")] += 1.0
    right, wrong = judged(gavrila, truth, truth, colors), judged(gavrila, truth, off, colors)
    assert right.views == wrong.views == 3
    assert right.forward < 0.05 < wrong.forward
    arm = [x.name for x in wrong.limbs].index("left_forearm")
    assert wrong.log_odds[arm] > right.log_odds[arm]
    assert wrong.limbs[arm].second_forward > right.limbs[arm].second_forward + 0.05
    assert wrong.limbs[arm].end_explained < right.limbs[arm].end_explained - 0.3
    assert 0.5 < right.limbs[arm].end_explained < 1.5
    assert right.trunk_forward < 0.05
    assert all(x.innovation == 0 for x in (*right.limbs, *wrong.limbs))  # as predicted
    assert all(0 < x.free_spread_px < 10 for x in right.limbs)
    if colors:
        assert wrong.log_odds.argmax() == arm
        assert wrong.limbs[arm].end_color < right.limbs[arm].end_color - 0.5
    else:  # they say nothing
        assert all(x.end_color == np.inf for x in right.limbs)


def test_the_colours_of_a_head_say_nothing():
    """Hair and face differ."""
    model = load_model("gavrila34")
    judgement = judged(model, posed(model, 1), posed(model, 1), colors=True)
    assert [x.name for x in judgement.limbs if np.isinf(x.end_color)] == ["head"]


def test_contours_view_by_view():
    """Two parts in four views; the last hardly shows them, and their first part is long."""
    length = np.array([[40.0, 10.0], [40.0, 10.0], [40.0, 10.0], [2.0, 1.0]])
    far = length * np.array([[0.1], [0.4], [0.2], [1.0]])
    costs = PartCosts(length, np.zeros((4, 2)), length / 5)
    contours, both = _Contours(costs, far, np.array([50.0, 15.0])), np.array([0, 1])
    assert contours.second_forward(both, 0.7) == pytest.approx(0.2)
    assert contours._replace(beside_px=np.array([500.0, 50.0])).second_forward(both, 0.7) == 0.7
    one = contours._replace(costs=costs._replace(length_px=length * [[0], [1], [0], [0]]))
    assert one.second_forward(both, 0.7) == pytest.approx(0.4)
    assert contours.explained(both) == pytest.approx(0.2)


def test_views_show_the_limbs_of_which_they_show_enough(gavrila):
    body, cameras = PosedBody(gavrila, posed(gavrila, 1)), cameras_around()
    views, n = own_evidence([body], cameras), len(gavrila.parts)
    arm, leg = limbs(gavrila)[0], limbs(gavrila)[-1]
    length_px = np.full((len(views), n), 100.0)
    length_px[0, arm.parts[0]] = 0.0  # the forearm is seen
    length_px[1, arm.parts] = 10.0
    length_px[2, leg.parts] = 0.0
    shown = views_of_limbs(body, PartCosts(length_px, np.zeros_like(length_px), length_px), views)
    assert shown[:, 0].tolist() == [True, False, True]
    assert shown[:, -1].tolist() == [True, True, False]
    assert shown[:, 1:-1].all()


def test_quality_where_nothing_is_seen(gavrila):
    truth = posed(gavrila, 1)
    judgement = judged(gavrila, truth, gavrila.retract(truth, np.pad([0.0, 0.0, 30.0], (0, gavrila.n_dofs - 3))))
    assert judgement.views == 0
    assert classify(judgement) == "lost"
