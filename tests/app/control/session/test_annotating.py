"""The plan of annotation in an open session: verdicts change no pose, and the state follows what is stored."""

import numpy as np
import pytest
from gestures import drag, wait_for

from tracker.annotation.frame_choice import FrameChoice
from tracker.annotation.plan import add_tasks, decide
from tracker.errors import TrackerError


def states(controller):
    return [(t.row.frame, t.state, t.comment) for t in controller.state.annotation.tasks]


def move(controller):
    """Move an arm by hand, which makes a keyframe."""
    drag(controller, "left_wrist", (20, -10))


def planned(controller, frames="0,5,9"):
    controller.annotating.plan(FrameChoice(frames=frames), None, [], each=False)
    return controller.annotating


@pytest.mark.slow
def test_a_plan_goes_from_draft_to_verified_and_a_verdict_changes_no_pose(controller):
    annotating = planned(controller)
    assert states(controller) == [(0, "draft", ""), (5, "draft", ""), (9, "draft", "")]
    move(controller)
    wait_for(lambda: states(controller)[0] == (0, "annotated", ""))
    pose, undo = controller.state.people[0].values.copy(), controller.state.undo
    annotating.reject(0, 0, " left elbow ")
    assert states(controller)[0] == (0, "rejected", "left elbow")
    annotating.verify(0, 0)
    assert states(controller)[0] == (0, "verified", "")
    np.testing.assert_array_equal(controller.state.people[0].values, pose)
    assert controller.state.undo == undo  # a keyframe has its mark
    move(controller)
    wait_for(lambda: states(controller)[0] == (0, "annotated", ""))
    annotating.withdraw(0, 5)
    assert [frame for frame, *_ in states(controller)] == [0, 9]


def test_a_verified_pose_that_is_no_keyframe_is_reviewed_and_undo_takes_the_mark_back(controller):
    move(controller)
    controller.ranges.mark(0, 0, "none")
    annotating = planned(controller)
    pose = controller.state.people[0].values.copy()
    annotating.verify(0, 0)
    assert controller.stored_poses.timeline()[0]["reviewed"]
    assert states(controller)[0][1] == "verified"
    np.testing.assert_array_equal(controller.state.people[0].values, pose)
    assert controller.state.undo == "Verify, frame 0"
    controller.history.undo()
    assert not controller.stored_poses.timeline()[0]["reviewed"]


def test_impossible_plans_and_decisions_are_refused(controller):
    annotating = planned(controller)
    with pytest.raises(TrackerError, match="all of them are planned already"):
        planned(controller)
    with pytest.raises(TrackerError, match="such as 0,40,100:110 within 0:50, found '77'"):
        planned(controller, "77")
    with pytest.raises(TrackerError, match="expected the reason of the rejection"):
        annotating.reject(0, 0, " ")
    with pytest.raises(TrackerError, match="expected a task of person in frame 3"):
        annotating.verify(0, 3)
    with pytest.raises(TrackerError, match="expected a pose of person in frame 5 to verify"):
        annotating.verify(0, 5)
    with pytest.raises(TrackerError, match="expected one of the"):
        annotating.comment(0, 0, 99, "x")


def test_comments_and_speeds_are_in_the_state(controller):
    annotating = planned(controller)
    move(controller)
    annotating.comment(0, 0, 0, "hidden")
    annotating.verify(0, 0)
    (comment,) = controller.state.annotation.comments
    assert (comment.row.text, comment.resolved) == ("hidden", False)
    annotating.resolve(comment.row.uid, True)
    assert controller.state.annotation.comments[0].resolved
    wait_for(lambda: [s.verified for s in controller.state.annotation.speeds if s.verified] == [1])


def test_the_plan_is_there_after_a_restart(opened):
    planned(opened())
    controller = opened()
    wait_for(lambda: len(controller.state.annotation.tasks) == 3)


@pytest.mark.slow
def test_the_next_click_needs_poses_and_then_follows_the_error(controller):
    controller.proposing.start()
    wait_for(lambda: controller.state.annotation.proposed.number == 1)
    proposed = controller.state.annotation.proposed
    assert (proposed.running, proposed.found) == (False, None)
    assert proposed.message.startswith("Expected poses to improve, found none")
    move(controller)
    controller.proposing.start()
    wait_for(lambda: controller.state.annotation.proposed.number == 2)
    proposed = controller.state.annotation.proposed
    assert (proposed.click, proposed.message, proposed.after_mm) == (None, "", None)  # a keyframe: nothing pays
    assert proposed.found.error_mm > 0
    move(controller)
    wait_for(lambda: controller.state.annotation.proposed.after_mm is not None)


def test_decisions_of_others_are_seen_with_the_next_change(controller):
    planned(controller)
    move(controller)
    store = controller.session_state.saver.store
    add_tasks(store, [("person", 2, "ben")], "lead")
    decide(store, ("person", 0), "rejected", "hip", author="rita")
    move(controller)
    wait_for(lambda: (2, "draft", "") in states(controller))
