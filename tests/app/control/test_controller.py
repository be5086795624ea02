"""The controller without a screen: gestures, searches, undo, and what is on disk after each."""

import threading
import time

import numpy as np
import pytest
from gestures import PAGE, drag, grab, pixel_of, wait_for

from tracker.errors import SessionError
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.search.best_first import SearchSettings
from tracker.session.store.annotation_store import AnnotationStore


def test_a_fresh_session_shows_a_draft_that_is_not_stored(controller):
    assert controller.state.people[0].source is None
    assert controller.state.undo is None
    assert controller.stored_poses.timeline() == {}


def test_a_drag_is_one_entry_and_ends_at_the_pointer(controller):
    target = pixel_of(controller, "left_wrist") + np.array([25.0, -15.0])
    drag(controller, "left_wrist", (25.0, -15.0))
    np.testing.assert_allclose(pixel_of(controller, "left_wrist"), target, atol=1.0)
    assert controller.state.undo == "drag left wrist, frame 0"
    assert controller.state.people[0].source == "manual"
    assert controller.stored_poses.timeline()[0]["keyframe"]
    controller.history.undo()
    assert controller.state.undo is None
    assert controller.state.people[0].source is None


def test_the_cost_follows_a_drag(controller):
    before = controller.state.cost_px
    drag(controller, "torso", (120.0, 0.0))
    assert controller.state.cost_px > before
    assert len(controller.state.view_costs_px) == 4


def test_a_hand_that_holds_still_sees_what_the_pose_costs(controller):
    before = controller.state.cost_px
    start = grab(controller, "torso")
    for seq, way in enumerate((10.0, 60.0, 120.0)):
        controller.dragging.move(PAGE, (start[0] + way, start[1]), seq)
    shown = controller.state.poses
    wait_for(lambda: controller.state.cost_px != before)
    wait_for(lambda: controller.state.cost_px == controller.session_state.costs(shown).cost_px)
    assert controller.state.drag is not None
    controller.dragging.cancel(PAGE)
    assert controller.state.cost_px == before


def test_the_cost_of_what_has_been_let_go_is_not_touched(controller):
    drag(controller, "torso", (120.0, 0.0))
    controller.session_state.set(cost_px=1.4)  # as a tracker knows it
    time.sleep(0.1)
    assert controller.state.cost_px == 1.4


def test_a_cancelled_drag_leaves_nothing(controller):
    values = controller.state.poses[0]
    start = grab(controller, "torso")
    controller.dragging.move(PAGE, tuple(start + 40), 1)
    assert not np.array_equal(controller.state.poses[0], values)
    controller.dragging.cancel(PAGE)
    np.testing.assert_array_equal(controller.state.poses[0], values)
    assert controller.state.undo is None


def test_a_long_drag_is_on_disk_before_it_ends(opened, session, monkeypatch):
    monkeypatch.setattr("app.control.posing.dragging._CHECKPOINT_S", 0.0)
    controller = opened()
    start = grab(controller, "torso")
    controller.dragging.move(PAGE, tuple(start + 40), 1)
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as other:
        np.testing.assert_array_equal(other.pose("person", 0).values, controller.state.poses[0])
    controller.dragging.move(PAGE, tuple(start + 60), 2)
    controller.dragging.cancel(PAGE)
    assert controller.state.undo is None
    assert controller.state.people[0].source is None


def test_another_page_cannot_move_what_this_one_holds(controller):
    start = grab(controller, "torso")
    values = controller.state.poses[0]
    controller.dragging.move(PAGE + 1, tuple(start + 40), 1)
    controller.dragging.end(PAGE + 1)
    np.testing.assert_array_equal(controller.state.poses[0], values)
    assert controller.state.drag is not None


def test_restart_shows_the_same_pose_and_history(opened):
    controller = opened()
    drag(controller, "torso", (10.0, 5.0))
    drag(controller, "right_knee", (8.0, -6.0))
    drag(controller, "left_elbow", (8.0, -6.0))
    controller.history.undo()
    before = controller.state
    controller = opened()
    np.testing.assert_array_equal(controller.state.poses[0], before.poses[0])
    assert (controller.state.undo, controller.state.redo) == (before.undo, before.redo)
    assert controller.state.redo == "drag left elbow, frame 0"
    controller.history.redo()
    assert controller.state.redo is None


def test_undo_goes_to_the_frame_it_is_about(controller):
    drag(controller, "torso", (10.0, 5.0))
    controller.navigation.seek(7)
    assert controller.state.people[0].source is None  # a draft: the pose of the nearest frame
    controller.history.undo()
    assert controller.state.frame == 0
    assert controller.stored_poses.timeline(1)[0] is None


def test_a_slider_is_one_entry_however_often_it_moves(controller):
    model = controller.models[0]
    dof = model.dof_names.index("left_shoulder.abduction")
    for value in (0.1, 0.2, 9.0):
        controller.pose_edits.set_dof(0, dof, value)
    assert controller.state.poses[0][dof] == pytest.approx(model.limits[dof, 1])  # within its limit
    assert controller.state.undo == "set left shoulder abduction, frame 0"
    controller.history.undo()
    assert controller.state.undo is None


def test_values_nobody_touched_keep_their_source(session, controller):
    drag(controller, "torso", (10.0, 0.0))
    controller.search.step()
    wait_for(lambda: controller.state.search.evaluations and not controller.state.search.running)
    drag(controller, "left_wrist", (10.0, 0.0))
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        sources = store.pose("person", 0).sources
    names = controller.models[0].value_names
    assert sources[names.index("left_elbow.extension")] == "manual"
    assert set(sources[:5]) <= {"manual", "searched"}


def test_stepping_a_search(controller):
    seen = []
    controller.subscribe(lambda state: seen.append(state.search))
    controller.search.step()
    wait_for(lambda: controller.state.search.evaluations > 1 and not controller.state.search.running)
    first = controller.state.search
    assert first.kind == "search"
    assert first.stage == "torso and head"
    controller.search.step()
    wait_for(lambda: controller.state.search.evaluations > first.evaluations)
    assert any(job.candidate is not None for job in seen)
    assert controller.state.undo == "search, frame 0"


def test_a_search_to_its_end_lowers_the_cost_and_is_one_entry(controller):
    before = controller.state.cost_px
    controller.search.set_settings(TrackSettings(search=SearchSettings(passes=(1.0,), max_expansions=4)))
    controller.search.run()
    wait_for(lambda: controller.state.search.message)
    assert controller.state.search.message.startswith("done")
    assert controller.state.cost_px < before
    assert controller.state.undo == "search, frame 0"
    assert controller.state.people[0].source == "searched"
    controller.history.undo()
    assert controller.state.undo is None


def test_a_stopped_search_keeps_the_best_so_far_on_disk(session, controller):
    controller.search.run()
    wait_for(lambda: controller.state.search.evaluations > 30)
    controller.activities.stop()
    assert not controller.state.search.running
    assert controller.state.search.kind == "search"  # it stands, and can go on
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        np.testing.assert_array_equal(store.pose("person", 0).values, controller.state.poses[0])
    evaluations = controller.state.search.evaluations
    controller.search.step()
    wait_for(lambda: controller.state.search.evaluations > evaluations)


@pytest.mark.slow
@pytest.mark.parametrize("interruption", ["seek", "drag", "undo", "set"])
def test_whatever_a_hand_does_stops_a_running_search(interruption, controller):
    drag(controller, "torso", (4.0, 4.0))
    controller.search.run()
    wait_for(lambda: controller.state.search.evaluations > 15)
    {
        "seek": lambda: controller.navigation.seek(3),
        "drag": lambda: drag(controller, "left_knee", (3.0, 3.0)),
        "undo": controller.history.undo,
        "set": lambda: controller.pose_edits.set_dof(0, 8, 0.3),
    }[interruption]()
    assert not controller.state.search.running
    values = controller.state.poses[0]
    time.sleep(0.2)
    assert controller.state.poses[0] is values  # no late step


def test_seeking_out_of_range_stays_within(controller):
    controller.navigation.seek(10_000)
    assert controller.state.frame == controller.session.n_frames - 1
    controller.navigation.seek(-5)
    assert controller.state.frame == 0


def test_nothing_is_lost_when_the_disk_is_full(monkeypatch, controller):
    real = AnnotationStore.commit

    def full(*_, **__):
        raise SessionError("the disk is full; make room")

    monkeypatch.setattr(AnnotationStore, "commit", full)
    drag(controller, "torso", (10.0, 0.0))
    values = controller.state.poses[0]
    assert controller.state.save_error == "the disk is full; make room"
    monkeypatch.setattr(AnnotationStore, "commit", real)
    drag(controller, "left_wrist", (5.0, 0.0))  # the next save holds what the failed one did not
    assert controller.state.save_error is None
    controller.navigation.seek(1)
    controller.navigation.seek(0)
    assert controller.state.poses[0][0] == values[0]


def test_many_hands_at_once_leave_one_consistent_state(controller):

    def nudge(dof):
        for value in np.linspace(0.0, 0.4, 8):
            controller.pose_edits.set_dof(0, dof, float(value))

    threads = [threading.Thread(target=nudge, args=(d,)) for d in (6, 7, 10)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    np.testing.assert_allclose(controller.state.poses[0][[6, 7, 10]], 0.4)
