"""The audit of stored poses: what is compared, what stays, and what takes their place."""

import shutil
from dataclasses import asdict, replace
from types import SimpleNamespace

import numpy as np
import pytest
from run_poses import MOVED, Estimate
from run_with_doubt import WRONG_FRAME, store_run
from stored_motions import put_poses

from tracker.body.model import PosedBody
from tracker.compute.progress import mapped, result_of
from tracker.errors import Remedy, TrackerError
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.fitting.hypothesis import Hypothesis
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.formats.model_toml import format_model
from tracker.pipeline import audit
from tracker.pipeline.audit import AuditPlan, PoseAudit
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import Alternative, AssessmentChange, MarkChange, PoseChange

FRAMES = range(17, 24)
OBSERVER = SimpleNamespace(cameras=(None, None))
PLAN = AuditPlan(FRAMES, (0,), TrackSettings())
LOST = {"elsewhere": np.array([0.9, 0.0, 0.0, 0.0])}


@pytest.fixture
def session(tmp_path, sample_folder):
    """With a run that is stored, and a keyframe on frame 19."""
    return store_run(shutil.copytree(sample_folder, tmp_path / "session"))


@pytest.fixture
def store(session):
    store = AnnotationStore(session.annotations_path)
    store.commit("keyframe", [MarkChange("person", 19, True, False)], author="eve")
    yield store
    store.close()


@pytest.fixture
def estimate(session, store, monkeypatch):
    """All poses move; the left arm is elsewhere on frames 19 and 20, where another pose is about as good."""
    model = session.people[0].model
    pose = store.pose("person", WRONG_FRAME).values.copy()
    pose[model.value_names.index("left_shoulder.elevation")] -= 1.5
    other = Hypothesis(PosedBody(model, pose), "limbs", 0.5)
    held_estimate = Estimate(0.1, {19: LOST, WRONG_FRAME: {**LOST, "entry": MOVED, "others": (other,)}})
    monkeypatch.setattr(audit, "estimate_run", held_estimate)
    return held_estimate


def audited(session, store, plan=PLAN):
    return {change.frame: change for change in result_of(PoseAudit(session, store, OBSERVER, plan).steps())}


def test_poses_are_assessed_and_stay(session, store, estimate):
    before = store.poses("person", FRAMES)
    outcome = audited(session, store)
    (asked,) = estimate.asked
    assert (asked.stays, dict(asked.subjects.keyframes), sorted(asked.poses)) == (True, {}, [*FRAMES])
    for k in FRAMES:
        np.testing.assert_array_equal(asked.poses[k][0], before[k].values)
    sources = {k: [p.source for p in asked.proposals[k, 0]] for k in FRAMES}
    assert sources == {k: ["alternative"] * (k == WRONG_FRAME) for k in FRAMES}
    np.testing.assert_array_equal(
        asked.proposals[WRONG_FRAME, 0][0].pose, store.alternatives("person", WRONG_FRAME)[0].values
    )
    assert sorted(outcome) == [*FRAMES]
    for k in set(FRAMES) - {19}:
        pose = outcome[k].pose
        assert pose.status == ("lost" if k == WRONG_FRAME else "good")
        assert pose.errors is not None
        kept = replace(
            pose, status=before[k].status, errors=None, limbs_lost=before[k].limbs_lost, remark=before[k].remark
        )
        np.testing.assert_array_equal(kept.values, before[k].values)
        assert (kept.trace, kept.sources, kept.settings) == (before[k].trace, before[k].sources, before[k].settings)
        assert (kept.cost_px, before[k].cost_px) == (1.5, 1.0 + (k == WRONG_FRAME))  # by an earlier version
    (other,) = outcome[WRONG_FRAME].alternatives
    assert other.model_revision == before[WRONG_FRAME].model_revision
    assert not outcome[18].alternatives
    assert outcome[WRONG_FRAME].pose.remark == "left arm may be elsewhere"


def test_a_keyframe_is_compared_as_others_are_and_only_its_assessment_is_stored(session, store, estimate):
    before, change = store.pose("person", 19), audited(session, store)[19]
    assert isinstance(change, AssessmentChange)
    assert (change.status, change.remark) == ("lost", "left arm uncertain: elsewhere on 90% of the likely paths")
    store.commit("audit", [change], by_program=True)
    after = store.pose("person", 19)
    assert (after.status, after.keyframe, after.author, after.cost_px) == ("lost", True, before.author, 1.5)
    np.testing.assert_array_equal(after.values, before.values)


def test_the_estimate_takes_the_place_of_poses_but_not_of_keyframes(session, store, estimate):
    before = store.poses("person", FRAMES)
    outcome = audited(session, store, replace(PLAN, replaces=True))
    (asked,) = estimate.asked
    assert not asked.stays
    assert {k: list(own) for k, own in asked.subjects.keyframes.items()} == {19: [0]}
    assert isinstance(outcome[19], AssessmentChange)
    for k in set(FRAMES) - {19}:
        pose = outcome[k].pose
        assert pose.values[1] == pytest.approx(before[k].values[1] + 0.1)
        assert (pose.cost_px, pose.sources) == (1.5, before[k].sources)
    assert outcome[WRONG_FRAME].pose.trace == (*before[WRONG_FRAME].trace, MOVED)


def test_a_pose_that_is_estimated_again_was_reviewed_or_interpolated_no_more(session, store, estimate):
    """Nobody has seen it, and the pictures speak for it."""
    own = store.pose("person", 18)
    between = replace(own, sources=("interpolated",) * len(own.values), settings={"method": "interpolate"})
    store.commit("put", [PoseChange("person", 18, between), MarkChange("person", 17, False, True)])
    outcome = audited(session, store, replace(PLAN, replaces=True))
    assert not outcome[17].pose.reviewed
    assert set(outcome[18].pose.sources) == {"tracked"}
    assert outcome[18].pose.settings == {"method": "chamfer", **asdict(PLAN.settings)}
    assert audited(session, store)[17].pose.reviewed


def test_poses_of_an_earlier_body_are_compared_in_the_present_one(session, store, estimate):
    """Poses that stay keep their body; the estimate belongs to the present one. A keyframe keeps its joints."""
    (person,) = session.people
    before, former = store.poses("person", FRAMES), person.model
    longer = former.with_height(1.1 * former.height_m)
    resized = replace(session, people=(replace(person, model=longer),))
    outcome = audited(resized, store, replace(PLAN, replaces=True))
    (asked,) = estimate.asked
    held = retarget_pose(before[19].values, former, longer)
    assert not np.allclose(held, before[19].values)
    np.testing.assert_allclose(asked.subjects.keyframes[19][0], held)
    np.testing.assert_array_equal(outcome[19].values, before[19].values)
    revisions = {store.model_revision(outcome[k].pose.model_revision).toml for k in set(FRAMES) - {19}}
    assert revisions == {format_model(longer)}
    stay = audited(resized, store)
    for k in set(FRAMES) - {19}:
        assert stay[k].pose.model_revision == before[k].model_revision
        np.testing.assert_array_equal(stay[k].pose.values, before[k].values)


def test_locked_dofs_stay_and_other_people_are_held(session, store, estimate):
    """They are taken where they are stored, in their neutral pose on other frames."""
    (person,) = session.people
    beside = replace(person, name="beside")
    held = person.model.neutral() + 0.2
    put_poses(store, beside, {18: held}, keyframe=True)
    store.set_setting("locked", {"person": ["torso.x"]})
    outcome = audited(replace(session, people=(beside, person)), store, replace(PLAN, people=(1,)))
    (asked,) = estimate.asked
    assert {c.person for c in outcome.values()} == {"person"}
    assert (asked.subjects.tracked, list(asked.subjects.keyframes)) == ((1,), [18])
    np.testing.assert_array_equal(asked.subjects.keyframes[18][0], held)
    np.testing.assert_array_equal(asked.poses[18][0], held)
    np.testing.assert_array_equal(asked.poses[17][0], person.model.neutral())
    active = asked.subjects.active_dofs[1]
    assert np.flatnonzero(~active).tolist() == [person.model.dof_names.index("torso.x")]


def test_frames_that_follow_one_another_are_compared_together(session, store, estimate):
    """A frame alone shows no motion; progress goes on from each to the next."""
    store.commit("clear", [PoseChange("person", k, None) for k in (19, 21)])
    shown = []
    plan = replace(PLAN, frames=range(17, 26))
    rows = result_of(mapped(PoseAudit(session, store, OBSERVER, plan).steps(), shown.append))
    assert [sorted(run.poses) for run in estimate.asked] == [[17, 18], [22, 23, 24, 25]]
    assert [c.frame for c in rows] == [17, 18, 22, 23, 24, 25]
    assert shown == pytest.approx([k / 6 for k in range(1, 7)])


def test_a_keyframe_between_the_frames_of_a_stride_belongs_to_them(session, store, estimate):
    audited(session, store, replace(PLAN, frames=(14, 16, 18, 19, 20, 22, 26, 28, 30)))
    assert [sorted(run.poses) for run in estimate.asked] == [[14, 16, 18, 19, 20, 22], [26, 28, 30]]


def test_alternatives_of_another_body_are_left_out(session, store, estimate):
    other = Alternative(np.zeros(3), store.add_model_revision("person", "another body"))
    pose = store.pose("person", 18)
    store.commit("put", [PoseChange("person", 18, pose, (other,))])
    audited(session, store)
    assert estimate.asked[0].proposals[18, 0] == []


def test_too_little_is_refused(session, store, estimate):
    with pytest.raises(TrackerError, match="expected two cameras or more to compare poses, found one"):
        PoseAudit(session, store, SimpleNamespace(cameras=(None,)), PLAN)
    store.commit("clear", [PoseChange("person", k, None) for k in range(18, 24)])
    with pytest.raises(TrackerError, match="two frames in a row on which all these people have a pose") as caught:
        audited(session, store)
    assert caught.value.remedy == Remedy("place_body")
    assert estimate.asked == []
