"""`quadrille audit`: statuses, errors and reasons of stored poses; its JSON, and what it refuses."""

import csv
import json

import numpy as np
import pytest
from command_line import SAMPLE, assert_refused, output_of, stored
from run_poses import Estimate, doubted

from tracker.pipeline import audit
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import Alternative, MarkChange, PinChange, PoseChange

FRAMES, APART, STEP_M = range(20, 26), 23, 0.02


@pytest.fixture
def estimate(monkeypatch):
    """The likeliest poses are a step aside, and on one frame the left arm is elsewhere on half of the paths."""
    held_estimate = Estimate(STEP_M, doubted(APART))
    monkeypatch.setattr(audit, "estimate_run", held_estimate)
    return held_estimate


@pytest.fixture
def posed(run, session):
    """The sample with known poses on some frames, none of them a keyframe."""
    for frame in FRAMES:
        assert run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", str(frame), "--json")[0] == 0
    with AnnotationStore(session / "annotations.sqlite") as store:
        store.commit("no keyframes", [MarkChange("person", frame, False, False) for frame in FRAMES])
    return session


@pytest.mark.slow
def test_poses_are_assessed_but_stay(run, posed, estimate):
    before = stored(posed)
    out = output_of(run("audit", posed, "--json"))
    found, after = json.loads(out)["person"], stored(posed)
    assert [[*asked.poses] for asked in estimate.asked] == [[*FRAMES]]
    (doubt,) = found["doubts"]
    assert (doubt["frame"], doubt["reason"]) == (APART, "left arm uncertain: elsewhere on 50% of the likely paths")
    assert doubt["probability_off"] > 0.05
    assert after[APART].status == doubt["status"] != "good"
    assert after[APART].errors.shape[1:] == (3, 3)
    assert {after[k].status for k in FRAMES if k != APART} == {"good"}
    for k in FRAMES:
        np.testing.assert_array_equal(after[k].values, before[k].values)


@pytest.mark.slow
def test_a_keyframe_is_assessed_and_stays(run, posed, estimate):
    with AnnotationStore(posed / "annotations.sqlite") as store:
        store.commit("keyframes", [MarkChange("person", k, True, True) for k in (APART, 24)], author="eve")
        store.commit("pin", [PinChange("person", APART, "left_wrist", "FRONT", (10.0, 20.0))])
    before = stored(posed)
    out = output_of(run("audit", posed, "--json"))
    (doubt,) = json.loads(out)["person"]["doubts"]
    assert (doubt["frame"], doubt["reason"]) == (APART, "left arm uncertain: elsewhere on 50% of the likely paths")
    after = stored(posed)
    assert [(after[k].keyframe, after[k].status) for k in (APART, 24)] == [(True, doubt["status"]), (True, "good")]
    assert after[APART].errors.shape[1:] == (3, 3)
    np.testing.assert_array_equal(after[APART].values, before[APART].values)
    for name in ("sources", "settings", "author", "time", "reviewed"):
        assert getattr(after[APART], name) == getattr(before[APART], name), name
    out = output_of(run("evaluate", posed, "--reference", SAMPLE / "truth.trc", "--json"))
    (told,) = [f for f in json.loads(out)["per_frame"] if f["frame"] == APART]
    assert (told["status"], told["reason"]) == ("keyframe", doubt["reason"])
    assert told["probability_off"] == pytest.approx(doubt["probability_off"], abs=0.01)
    table = posed / "poses.csv"
    assert run("export", posed, "--format", "csv", "--out", table)[0] == 0
    (row,) = [r for r in csv.DictReader(table.open()) if r["frame"] == str(APART)]
    assert (row["status"], row["keyframe"]) == (doubt["status"], "true")
    assert float(next(value for name, value in row.items() if "left_wrist" in name and "error" in name)) > 0
    with AnnotationStore(posed / "annotations.sqlite") as store:
        assert len(store.pins("person", APART)) == 1
        store.undo()
        assert (store.pose("person", APART).status, store.pose("person", APART).errors) == ("", None)


@pytest.mark.slow
def test_alternatives_are_proposed_and_only_those_that_may_be_stay(run, posed, estimate):
    with AnnotationStore(posed / "annotations.sqlite") as store:
        pose = store.pose("person", 21)
        other = Alternative(pose.values + 0.1, pose.model_revision, 2.0)
        store.commit("alternative", [PoseChange("person", 21, pose, (other,))])
    assert run("audit", posed, "--json")[0] == 0
    (asked,) = estimate.asked
    ((proposed, source),) = asked.proposals[21, 0]
    np.testing.assert_array_equal(proposed, other.values)
    assert source == "alternative"
    with AnnotationStore(posed / "annotations.sqlite") as store:
        assert store.alternatives("person", 21) == ()


@pytest.mark.slow
def test_the_likeliest_poses_take_the_place_of_the_stored_ones_if_that_is_asked(run, posed, estimate):
    before = stored(posed)
    out = output_of(run("audit", posed, "--replace", "--frames", "22:25"))
    assert "person: 2 good, 1 doubtful" in out
    after = stored(posed)
    for k in (22, APART, 24):
        values = before[k].values
        np.testing.assert_array_equal(after[k].values, values + STEP_M * (np.arange(len(values)) == 1))
    assert after[20].errors is None
    assert [[*asked.poses] for asked in estimate.asked] == [[22, 23, 24]]


def test_poses_are_needed(run, session):
    assert_refused(run("audit", session), ["two frames in a row", "found none"])
