"""The status of a pose by the run, and the rows that are stored of an estimate."""

import numpy as np
import pytest
from run_poses import MOVED, run_pose

from tracker.body.limbs import Search, limb_display_name, limbs
from tracker.body.model import PosedBody
from tracker.estimation.fitting.hypothesis import Hypothesis
from tracker.formats.model_toml import load_model
from tracker.pipeline.tracked_changes import assessed_by_run, assessed_keyframe, estimated_row
from tracker.session.store.records import PoseRecord

FACING = "contours do not tell which way the person faces"


def record(model, remark=""):
    return PoseRecord(model.neutral(), ("tracked",) * len(model.neutral()), 7, status="lost", remark=remark)


def at_limb(model, value, name="left_forearm", rest=0.0):
    return np.array([value if x.name == name else rest for x in limbs(model)])


def assessed(model, remark="", **known):
    return assessed_by_run(model, record(model, remark), run_pose(model, model.neutral(), **known))


@pytest.mark.parametrize(
    ("apart_m", "status", "remark"),
    [
        (0.0, "good", ""),
        (0.03, "good", ""),
        (0.08, "doubtful", "left arm uncertain"),
        (0.2, "lost", "left arm uncertain"),
    ],
)
def test_status_by_the_covariance_of_the_solve(gavrila, apart_m, status, remark):
    errors = np.zeros((len(gavrila.point_names), 3, 3))
    errors[gavrila.point_names.index("left_wrist")] = np.diag([apart_m**2, 0, 0])
    assessment = assessed(gavrila, errors_m2=errors)
    assert (assessment.status, assessment.remark) == (status, remark)
    shared = assessed(gavrila).errors[0]
    assert np.trace(shared) > 0  # of what all views share
    np.testing.assert_allclose(assessment.errors, errors + shared)


@pytest.mark.parametrize(("mass", "status"), [(0.02, "good"), (0.3, "doubtful"), (0.9, "lost")])
def test_status_by_the_mass_of_paths(gavrila, mass, status):
    assessment = assessed(gavrila, elsewhere=at_limb(gavrila, mass))
    reason = f"left arm uncertain: elsewhere on {100 * mass:.0f}% of the likely paths"
    assert (assessment.status, assessment.remark) == (status, "" if status == "good" else reason)
    off = at_limb(gavrila, True)
    assert max(assessment.limbs_lost) == assessment.limbs_lost[int(off.argmax())]


@pytest.mark.parametrize(
    ("nats", "is_searched", "status"),
    [
        (2.0, False, "good"),
        (8.0, False, "doubtful"),
        (8.0, True, "good"),
        (11.0, True, "doubtful"),
        (20.0, False, "lost"),
    ],
)
def test_status_by_the_colors_of_the_run(gavrila, nats, is_searched, status):
    """They count less against limbs that were searched."""
    assessment = assessed(
        gavrila, by_colors=at_limb(gavrila, nats, rest=-20.0), is_searched=is_searched,
        against=("left hand elsewhere in A",) * len(limbs(gavrila)),
    )  # fmt: skip
    assert assessment.status == status
    assert assessment.remark == ("" if status == "good" else "left arm uncertain: left hand elsewhere in A")


def test_a_limb_that_fewer_than_two_views_show_is_doubtful(gavrila):
    assessment = assessed(gavrila, is_shown=at_limb(gavrila, False, rest=True))
    assert (assessment.status, assessment.remark) == ("doubtful", "left arm uncertain: fewer than two views show it")
    lost = assessed(gavrila, is_shown=at_limb(gavrila, False, rest=True), elsewhere=at_limb(gavrila, 0.9))
    assert lost.status == "lost"


def test_all_limbs_are_doubtful_where_the_way_that_a_person_faces_is_not_sure(gavrila):
    assessment = assessed(gavrila, is_facing_sure=False)
    assert assessment.status == "doubtful"
    assert assessment.remark == f"{limb_display_name(limbs(gavrila)[0].name)} uncertain: {FACING}"
    assert min(assessment.limbs_lost) > 0.1


def test_the_head_is_not_searched():
    """A limb of one part is not, wherever others are."""
    model = load_model("gavrila34")
    found = [
        assessed(model, by_colors=at_limb(model, 8.0, "head", -20.0), is_searched=is_searched).limbs_lost
        for is_searched in (False, True)
    ]
    assert found[0][0] == found[1][0] == max(found[0])


def test_the_worst_of_all_counts_and_the_reason_is_of_the_limb_that_it_speaks_against(gavrila):
    by_colors = np.maximum(*(at_limb(gavrila, 9.0, name, -20.0) for name in ("left_forearm", "right_calf")))
    assessment = assessed(
        gavrila, elsewhere=at_limb(gavrila, 0.97), by_colors=by_colors,
        against=("colours",) * len(limbs(gavrila)),
    )  # fmt: skip
    assert (assessment.status, assessment.remark) == (
        "lost",
        "left arm uncertain: elsewhere on 97% of the likely paths",
    )
    assert (
        sorted(assessment.limbs_lost)[-2] == assessment.limbs_lost[[x.name for x in limbs(gavrila)].index("right_calf")]
    )


def test_other_poses_take_the_place_of_earlier_remarks_and_notes_stay(gavrila):
    other = gavrila.neutral()
    other[gavrila.value_names.index("left_shoulder.elevation")] += 1.0
    remark = "right leg may be elsewhere, left leg uncertain, tracked back from frame 9"
    assert assessed(gavrila, remark).remark == "tracked back from frame 9"
    others = (Hypothesis(PosedBody(gavrila, other), cost=0.5),)
    assessment = assessed(gavrila, remark, others=others, elsewhere=at_limb(gavrila, 0.4))
    assert (assessment.status, assessment.remark) == (
        "doubtful",
        "tracked back from frame 9, left arm may be elsewhere",
    )


def test_the_row_of_an_estimate_has_its_pose_and_costs_and_the_history_of_the_pose_before(gavrila):
    searches = Search("limbs", ("right_calf",), 4.0, None, False), Search("path", ("left_calf",), 3.0, 1.0, True)
    before = PoseRecord(
        gavrila.neutral(), ("searched",) * len(gavrila.neutral()), 3, cost_px=9.0, settings={"method": "voxels"},
        view_costs_px=(9.0,), part_costs_px=(9.0,), trace=searches, status="lost",
    )  # fmt: skip
    costs = np.ones(len(gavrila.parts))
    costs[2] = np.nan
    found = run_pose(gavrila, gavrila.neutral() + 0.1, entry=MOVED, part_costs_px=costs, view_costs_px=(0.5, np.nan))
    row = estimated_row(gavrila, before, found, 7, {"method": "chamfer"})
    np.testing.assert_array_equal(row.values, found.pose)
    assert (row.model_revision, row.sources, row.settings, row.status) == (7, before.sources, before.settings, "good")
    assert (row.cost_px, row.view_costs_px, row.part_costs_px[1:3]) == (1.5, (0.5, None), (1.0, None))
    assert row.trace == (searches[0], MOVED)  # of this run
    assert estimated_row(gavrila, before, found._replace(entry=None), 7, {}).trace == (searches[0],)
    alone = estimated_row(gavrila, None, found, 7, {"method": "chamfer"})
    assert (set(alone.sources), alone.settings, alone.trace) == ({"tracked"}, {"method": "chamfer"}, (MOVED,))


def test_a_keyframe_gets_an_assessment_of_its_own_pose(gavrila):
    keyframe = gavrila.neutral() + 0.1
    change = assessed_keyframe(
        gavrila, "ann", 4, keyframe, run_pose(gavrila, gavrila.neutral(), elsewhere=at_limb(gavrila, 0.9))
    )
    assert (change.person, change.frame, change.status) == ("ann", 4, "lost")
    assert change.remark == "left arm uncertain: elsewhere on 90% of the likely paths"
    np.testing.assert_array_equal(change.values, keyframe)
    assert change.errors.shape == (len(gavrila.point_names), 3, 3)
