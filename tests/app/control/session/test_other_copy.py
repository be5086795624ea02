"""Another copy of the session: where it differs, its poses drawn, and decisions between both that undo takes back."""

import shutil

import numpy as np
import pytest
from gestures import drag, drag_on, wait_for

from app.drawing.ghosts import copy_lines
from app.state.page_view import View
from tracker.errors import TrackerError
from tracker.evaluation.agreement.copies import mean_pose
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import TAKEN_FROM, PoseChange, PoseRecord

VIEW = View(frozenset(("contours",)), (1, 0, 0, 1))
RAISED_RAD = 0.4


@pytest.fixture
def both(session, tmp_path, controller):
    """A controller with keyframes on frames 0 and 1, and the folder of ben's copy, where an arm on frame 1 differs."""
    for frame in (0, 1):
        drag_on(controller, frame, "torso", (4.0, 0.0))
    ben = shutil.copytree(session, tmp_path / "ben")
    with AnnotationStore(ben / "annotations.sqlite") as store:
        store.commit("by ben", [PoseChange("person", frame, moved(store, controller, frame)) for frame in (1, 2)])
    return controller, ben


def moved(store, controller, frame):
    """The pose of frame 1 with a raised arm, for another frame."""
    values = store.pose("person", 1).values.copy()
    values[controller.models[0].value_names.index("left_shoulder.elevation")] += RAISED_RAD
    return PoseRecord(values, ("manual",) * len(values), 1, keyframe=True)


def compared(both):
    controller, ben = both
    controller.other_copies.open(ben)
    return controller, controller.state.other_copy


def test_frames_that_both_annotated_are_compared_by_their_farthest_joint(both):
    _, copy = compared(both)
    assert (copy.name, copy.own_name, copy.notes) == ("ben", "session", ())
    ((same, other),) = copy.differences  # frame 2 is ben's alone
    assert (same.frame, other.frame) == (0, 1)
    assert same.distance_m == pytest.approx(0.0, abs=1e-9)
    assert other.joint in ("left_wrist", "left_elbow")
    assert 0.05 < other.distance_m < 0.5


def test_the_poses_of_both_are_read_once(both, monkeypatch):
    controller, ben = both
    saver, read = controller.session_state.saver, []
    real = saver.record
    monkeypatch.setattr(saver, "record", lambda person, frame: read.append(frame) or real(person, frame))
    controller.other_copies.open(ben)
    assert sorted(read) == [0, 1]


def test_the_other_pose_is_drawn_where_the_copy_has_one(both):
    controller, copy = compared(both)
    assert {p.camera for p in copy_lines(controller.session, controller.state, VIEW)} == {0, 3}
    controller.navigation.seek(5)
    assert copy_lines(controller.session, controller.state, VIEW) == []
    controller.other_copies.leave()
    controller.navigation.seek(1)
    assert copy_lines(controller.session, controller.state, VIEW) == []
    assert copy.poses[0].keys() == {0, 1, 2}


@pytest.mark.parametrize("decision", ["take", pytest.param("mean", marks=pytest.mark.slow), "keep"])
def test_a_decision_is_one_step_and_undone_as_one(both, decision):
    controller, copy = compared(both)
    own, other = controller.state.poses[0], copy.poses[0][1].values
    controller.navigation.seek(5)
    controller.other_copies.decide(0, 1, decision)
    wanted = {"take": other, "keep": own, "mean": mean_pose(controller.models[0], [own, other])}[decision]
    np.testing.assert_allclose(controller.state.poses[0], wanted, atol=1e-12)
    assert controller.state.frame == 1
    record = controller.session_state.saver.record(0, 1)
    assert record.keyframe
    assert record.settings.get(TAKEN_FROM) == {"take": "ben", "mean": "the mean of session and ben"}.get(decision)
    wait_for(lambda: (0, 1) in controller.state.other_copy.decided and not controller.state.checked)
    if decision == "take":
        wait_for(lambda: controller.state.other_copy.differences[0][1].distance_m < 1e-9)
        (back, *_) = controller.session_state.saver.alternatives(0, 1)
        np.testing.assert_array_equal(back.values, own)
    controller.history.undo()
    np.testing.assert_array_equal(controller.state.poses[0], own)


def test_a_pose_that_changes_afterwards_is_compared_again_and_no_longer_decided(both):
    controller, _ = compared(both)
    controller.other_copies.decide(0, 1, "keep")
    before = controller.state.other_copy.differences[0][1].distance_m
    drag(controller, "left_wrist", (25.0, -15.0))
    wait_for(lambda: (0, 1) not in controller.state.other_copy.decided)
    assert controller.state.other_copy.differences[0][1].distance_m != before


def test_a_frame_without_own_pose_can_only_take_theirs(both):
    controller, _ = compared(both)
    for decision in ("keep", "mean"):
        with pytest.raises(TrackerError, match="expected a pose of person on frame 2 in this session, found none"):
            controller.other_copies.decide(0, 2, decision)
    with pytest.raises(TrackerError, match="expected a pose of person on frame 5 in ben, found none"):
        controller.other_copies.decide(0, 5, "take")
    controller.other_copies.decide(0, 2, "take")
    assert controller.state.people[0].source == "manual"


def test_another_recording_is_refused_and_the_session_itself(both, session):
    controller, ben = both
    with pytest.raises(TrackerError, match="expected another copy to compare with, found none"):
        controller.other_copies.decide(0, 1, "take")
    with pytest.raises(TrackerError, match="expected different session folders"):
        controller.other_copies.open(session)
    toml = ben / "session.toml"
    toml.write_text(toml.read_text("utf-8").replace("n_frames = 50", "n_frames = 40"), "utf-8")
    with pytest.raises(TrackerError, match="expected copies of one session, found frames 50"):
        controller.other_copies.open(ben)
    assert controller.state.other_copy is None
