"""Why a pose is in doubt: the part and the view that contradict it."""

import numpy as np
import pytest
from gestures import drag, wait_for
from run_with_doubt import DOUBTED, WRONG_FRAME, store_run

from app.control.tracking import reasons
from tracker.errors import TrackerError

pytestmark = pytest.mark.slow  # learns from fifty frames

PAGE = 7


@pytest.fixture
def doubted(session, opened):
    """The program at the frame on which an arm is wrong."""
    store_run(session)
    controller = opened()
    controller.navigation.seek(WRONG_FRAME)
    yield controller
    controller.reasons.watch(PAGE, False)


def explained(controller, timeout_s=120):
    controller.reasons.watch(PAGE, True)
    wait_for(lambda: controller.state.reason is not None and not controller.state.reasons.running, timeout_s)
    assert controller.state.reason.alternatives is not None
    return controller.state.reason


def test_the_wrong_arm_is_named_and_a_true_pose_is_not_contradicted(doubted):
    found, model = explained(doubted), doubted.models[0]
    names = [p.name for p in model.parts]
    assert names[found.contradiction.part] in (DOUBTED, "left_upper_arm")
    view = doubted.session.camera_names[found.contradiction.view]
    assert found.contradiction.sentence.endswith(f" in {view}")
    arm, leg = names.index(DOUBTED), names.index("left_calf")
    assert np.nanmax(found.table.below[:, arm]) > 10 > 3 > np.nanmax(found.table.below[:, leg])
    excess = found.table.outside - found.table.usual_outside
    assert np.nanmax(excess[:, arm]) > 0.5 > 0.2 > np.nanmax(excess[:, leg])
    assert np.nanmax(found.table.contour_px[:, arm]) > 2 * np.nanmax(found.table.contour_px[:, leg])
    doubted.navigation.seek(WRONG_FRAME - 5)
    wait_for(lambda: doubted.state.reason is not None, 30)
    assert doubted.state.reason.contradiction is None


def test_the_run_is_learnt_once_and_again_when_its_poses_change(doubted, monkeypatch):
    learnt = []
    learn = reasons.learn_usual_evidence
    monkeypatch.setattr(reasons, "learn_usual_evidence", lambda *words: learnt.append(0) or learn(*words))
    explained(doubted)
    drag(doubted, "left_wrist", (4.0, 0.0))
    wait_for(lambda: doubted.state.reason is not None, 30)
    assert len(learnt) == 1
    doubted.ranges.mark(0, 0, "keyframe")
    doubted.ranges.mark(49, 49, "keyframe")
    doubted.ranges.interpolate(0, 49)
    wait_for(lambda: not doubted.state.ranges.running, 60)
    doubted.navigation.seek(40)
    wait_for(lambda: doubted.state.reason is not None and doubted.state.reason.frame == 40, 60)
    assert len(learnt) == 2


def test_other_cameras_do_not_say_what_is_usual():
    """The same poses and people, but corrected cameras."""
    poses, observer = {0: (np.zeros(3),)}, object()
    learnt = reasons._Learnt(None, (0,), poses, observer)
    assert learnt.holds((0,), poses, observer)
    assert not learnt.holds((0,), poses, object())


def test_a_numbered_alternative_is_taken_assessed_and_undone_at_once(doubted):
    wrong = doubted.state.poses[0]
    explained(doubted)
    best = doubted.state.reason.alternatives[0]
    assert best.nats < -6
    assert best.limbs == ("left arm",)
    with pytest.raises(TrackerError, match="expected an alternative 9 of the shown pose"):
        doubted.alternatives.take_alternative(0, WRONG_FRAME, 8)
    doubted.alternatives.take_alternative(0, WRONG_FRAME, 0)
    assert doubted.state.checked == {(0, WRONG_FRAME)}
    wait_for(lambda: not doubted.state.checked, 120)
    np.testing.assert_array_equal(doubted.state.poses[0], best.values)
    assert (doubted.state.people[0].status, doubted.state.people[0].source) == ("good", "manual")
    assert doubted.state.people[0].errors is not None
    wait_for(lambda: doubted.state.reason is not None, 60)
    assert doubted.state.reason.contradiction is None
    doubted.history.undo()
    np.testing.assert_array_equal(doubted.state.poses[0], wrong)
    assert doubted.state.people[0].status == "lost"


@pytest.mark.parametrize("joints", [("left_shoulder",), ("left_shoulder", "left_elbow")])
def test_locked_joints_stay_in_alternatives(doubted, joints):
    model, wrong = doubted.models[0], doubted.state.poses[0]
    locked = [i for i, name in enumerate(model.dof_names) if name.partition(".")[0] in joints]
    doubted.dof_locks.set(0, locked, True)
    found, values = explained(doubted), model.dof_value[locked]
    assert all(np.array_equal(o.values[values], wrong[values]) for o in found.alternatives)


def test_a_pose_that_is_edited_meanwhile_keeps_its_edit(doubted):
    doubted.alternatives.take_alternative(0, WRONG_FRAME)
    drag(doubted, "left_wrist", (9.0, 0.0))
    edited = doubted.state.poses[0]
    wait_for(lambda: not doubted.state.checked, 120)
    np.testing.assert_array_equal(doubted.state.poses[0], edited)
    assert doubted.state.people[0].status == ""


def test_it_can_be_stopped_and_asked_again(doubted):
    doubted.reasons.watch(PAGE, True)
    wait_for(lambda: doubted.state.reasons.share > 0.05, 60)
    doubted.reasons.stop()
    wait_for(lambda: not doubted.state.reasons.running)
    assert (doubted.state.reason, doubted.state.reasons.message) == (None, "Stopped.")
    assert explained(doubted) is not None


def test_a_drag_goes_first(doubted):
    doubted.reasons.watch(PAGE, True)
    wait_for(lambda: doubted.state.reasons.share > 0.05, 60)
    doubted.dragging.begin(1, 0, 0, "left_wrist", (100.0, 100.0), WRONG_FRAME)
    wait_for(lambda: doubted.state.is_dragging)
    share = doubted.state.reasons.share
    for k in range(30):
        doubted.dragging.move(1, (100.0 + k, 100.0), k)
    assert doubted.state.reasons.share <= share + 2 / 50  # at most the frame that was being read
    doubted.dragging.cancel(1)
    wait_for(lambda: doubted.state.reason is not None, 120)


def test_without_a_run_a_sentence_says_what_to_do(controller):
    controller.reasons.watch(PAGE, True)
    wait_for(lambda: controller.state.reasons.message != "")
    assert controller.state.reasons.message.startswith("Expected a pose of person on frame 0, found none")
    drag(controller, "torso", (4.0, 0.0))
    wait_for(lambda: "found 1; track the recording first" in controller.state.reasons.message, 30)
    controller.reasons.watch(PAGE, False)
