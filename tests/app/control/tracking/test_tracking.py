"""Tracking runs through the controller: what is shown and stored, pausing, looking around, undo."""

import gc
import threading
import time
import weakref
from dataclasses import replace

import numpy as np
import pytest
from fake_tracker import STEP_M
from gestures import FRONT, PAGE, drag, drag_on, wait_for
from run_poses import Estimate, doubted

from app.state.run_choices import RunChoices
from tracker.errors import SessionError, TrackerError
from tracker.pipeline import track_session
from tracker.session.store.annotation_store import AnnotationStore


def end_the_step_soon(tracker):
    """To stop a run waits for the current step."""
    threading.Timer(0.2, tracker.let_go, (1,)).start()


def x_of(controller):
    return controller.state.poses[0][0]


def test_a_run_goes_out_from_a_frame_in_both_directions_and_keeps_its_pose(placed, tracker, session):
    start, last, ended = x_of(placed), placed.session.n_frames - 1, []
    placed.tracking.start_outward(2, (0,), None, ended.append)
    assert placed.state.track.total == last
    tracker.go_on(placed, 2, at=1)  # the start and the frame before it
    assert (placed.state.track.first, placed.state.track.last) == (2, 0)
    assert placed.state.poses[0][0] == pytest.approx(start + STEP_M)
    end_the_step_soon(tracker)
    placed.tracking.pause()
    placed.tracking.resume()
    tracker.let_go(last + 2)
    wait_for(lambda: ended)
    assert ended == [True]
    assert tracker.seen == [2, 1, 0, *range(2, last + 1)]
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        assert tracker.last[3].poses[0][0] == pytest.approx(start + STEP_M)  # the second leg begins at the start, too
        assert store.pose("person", 2).values[0] == start
        assert len(store.frames("person")) == last + 1
        assert {row.frame for row in store.frames("person") if row.source == "manual"} == {2}
        placed.history.undo()
        assert [row.frame for row in store.frames("person")] == [2]


def test_a_camera_that_seems_off_is_a_notice_at_the_end_of_a_run(placed, tracker, monkeypatch):
    monkeypatch.setattr(track_session, "contradiction", lambda recording: "camera LEFT is turned")
    tracker.track(placed, until=4, frames=2)
    measures = "press Check the cameras in the inspector's Calibration to measure it."
    assert placed.state.track.notice == f"Camera LEFT is turned; {measures}"
    assert not placed.state.track.failed


@pytest.mark.slow
def test_a_run_shows_and_stores_what_it_finds_as_one_entry(placed, tracker, session):
    start = x_of(placed)
    placed.tracking.start(backward=False, until=9)
    assert placed.state.track.running
    assert (placed.state.track.first, placed.state.track.last, placed.state.track.total) == (3, 9, 7)
    tracker.go_on(placed, 2, at=4)
    shown = placed.state.people[0]
    assert placed.state.frame == 4
    assert (shown.source, shown.status, shown.remark) == ("tracked", "doubtful", "left arm relocated")
    assert shown.part_costs_px == (0.5,) * 9 + (None,)
    costs = placed.state.cost_px, placed.state.view_costs_px
    assert costs[0] == pytest.approx(np.mean(costs[1]))  # of the pose, not those that the tracker had
    assert x_of(placed) == pytest.approx(start + 2 * STEP_M)
    tracker.go_on(placed, 5)
    assert placed.state.track.message == "done: 7 frames, 1 doubtful, 1 lost"
    assert placed.state.frame == 9
    assert placed.state.undo == "track forward from frame 3"
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        assert [(row.frame, row.source, row.status) for row in store.frames("person")] == [
            (2, "manual", ""), (3, "tracked", "good"), (4, "tracked", "doubtful"), (5, "tracked", "good"),
            (6, "tracked", "good"), (7, "tracked", "lost"), (8, "tracked", "good"), (9, "tracked", "good"),
        ]  # fmt: skip
        record = store.pose("person", 4)
        assert (record.cost_px, record.view_costs_px) == costs
        assert (record.part_costs_px, record.remark) == (shown.part_costs_px, shown.remark)
        assert record.settings["method"]
        assert record.limbs_lost == pytest.approx((0.25, 0.0001), abs=1e-6)
        assert placed.stored_poses.timeline()[3]["limbs_lost"] == ()  # a good pose
    assert placed.stored_poses.timeline()[4] == {
        "source": "tracked", "cost_px": round(costs[0], 3), "keyframe": False, "status": "doubtful",
        "remark": shown.remark, "reviewed": False, "ambiguous": False, "limbs_lost": (0.25, 0.0),
    }  # fmt: skip
    placed.history.undo()
    assert set(placed.stored_poses.timeline()) == {2}
    assert placed.state.redo == "track forward from frame 3"
    assert placed.state.track.message == "taken back: track forward from frame 3, Redo brings it back"
    placed.history.redo()
    assert placed.state.track.message == "brought back: track forward from frame 3"


def test_backward_runs_to_the_first_frame(placed, tracker):
    tracker.track(placed, until=None, frames=2, backward=True)
    assert tracker.seen == [1, 0]
    assert placed.state.frame == 0
    assert placed.state.undo == "track backward from frame 1"


def test_a_draft_is_tracked_itself(placed, tracker):
    placed.navigation.seek(5)
    assert placed.state.people[0].source is None
    tracker.track(placed, until=6, frames=2)
    assert tracker.seen == [5, 6]


@pytest.mark.slow
def test_keyframes_are_taken_as_they_are(placed, tracker):
    drag_on(placed, 4, "torso", (0.0, 9.0))
    keyframe = placed.state.poses[0]
    placed.navigation.seek(2)
    placed.tracking.start(backward=False, until=5)
    np.testing.assert_array_equal(tracker_fixed(placed, tracker)[4][0], keyframe)
    tracker.go_on(placed, 3, at=4)  # the shown keyframe is tracked, too: between both, people are tracked both ways
    assert placed.state.people[0].source == "manual"
    np.testing.assert_array_equal(placed.state.poses[0], keyframe)
    tracker.go_on(placed, 1)
    cells = placed.stored_poses.timeline()
    assert cells[4]["keyframe"]
    assert (cells[4]["source"], cells[5]["source"]) == ("manual", "tracked")


def tracker_fixed(controller, tracker):
    wait_for(lambda: tracker.run)
    return tracker.run.subjects.keyframes


@pytest.mark.slow
def test_a_run_takes_the_chosen_stride_and_cameras(placed, tracker):
    names = placed.session.camera_names
    alone = placed.state.settings
    placed.tracking.choose(RunChoices(stride=3, cameras=(names[1], names[3])))
    tracker.track(placed, until=9, frames=1, at=5)
    assert None not in placed.state.view_costs_px  # the cost of a pose is that in all cameras
    tracker.go_on(placed, 1)
    assert tracker.seen == [5, 8]
    observer = tracker.run.observer
    assert [c.camera.name for c in observer.cameras] == [names[1], names[3]]
    whole = placed.frames.observer.evidence(5)
    for own, same in zip(observer.evidence(5), (whole[1], whole[3]), strict=True):
        np.testing.assert_array_equal(own.points_px, same.points_px)
    assert set(placed.stored_poses.timeline()) == {2, 5, 8}
    assert (tracker.settings.trust_m, tracker.settings.trust_rad) == (3 * alone.trust_m, 3 * alone.trust_rad)


def test_a_run_over_keyframes_alone_is_no_entry(placed, tracker):
    drag_on(placed, 3, "torso", (0.0, 9.0))
    placed.navigation.seek(2)
    tracker.track(placed, until=3, frames=1)
    assert placed.state.undo == "drag torso, frame 3"


@pytest.mark.slow
def test_pause_and_go_on_are_one_entry(placed, tracker, session):
    tracker.track(placed, until=8, frames=2, at=4)
    end_the_step_soon(tracker)
    placed.tracking.pause()
    assert not placed.state.track.running
    assert placed.state.track.at == 5
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        assert [row.frame for row in store.frames("person")] == [2, 3, 4, 5]
    placed.navigation.seek(3)
    placed.tracking.resume()
    tracker.go_on(placed, 3)
    assert tracker.seen == [3, 4, 5, 6, 7, 8]
    assert placed.state.frame == 8
    placed.history.undo()
    assert set(placed.stored_poses.timeline()) == {2}


@pytest.mark.slow
def test_stop_ends_a_run_and_keeps_what_it_found(placed, tracker):
    tracker.track(placed, until=None, frames=3, at=5)
    end_the_step_soon(tracker)
    placed.activities.stop()
    assert placed.state.track.first is None
    assert placed.state.track.message.startswith("stopped: ")
    assert {2, 3, 4, 5} <= set(placed.stored_poses.timeline())
    seen = list(tracker.seen)
    placed.tracking.resume()
    tracker.let_go(1)
    time.sleep(0.1)
    assert tracker.seen == seen


def test_looking_around_does_not_stop_a_run(placed, tracker, monkeypatch):
    monkeypatch.setattr("app.control.tracking.tracking._SAVE_S", 1e9)
    tracker.track(placed, until=None, frames=3, at=5)
    placed.navigation.seek(4)  # tracked, and not written of its own accord
    assert not placed.state.follow
    assert placed.state.people[0].status == "doubtful"
    tracker.go_on(placed, 2, at=7)
    assert placed.state.frame == 4
    assert placed.state.track.running
    placed.tracking.follow(True)
    assert placed.state.frame == 7
    assert placed.state.people[0].source == "tracked"
    tracker.go_on(placed, 1, at=8)
    assert placed.state.frame == 8


def test_seeking_while_nothing_runs_leaves_following_as_it_is(placed):
    placed.navigation.seek(9)
    assert placed.state.follow


@pytest.mark.slow
@pytest.mark.parametrize("edit", ["drag", "set", "search", "undo"])
def test_edits_stop_a_run(placed, tracker, edit):
    tracker.track(placed, until=None, frames=3, at=5)
    end_the_step_soon(tracker)
    {
        "drag": lambda: drag(placed, "left_knee", (3.0, 3.0)),
        "set": lambda: placed.pose_edits.set_dof(0, 8, 0.3),
        "search": placed.search.step,
        "undo": placed.history.undo,
    }[edit]()
    assert placed.state.track.first is None
    assert placed.state.frame == 5  # where the hand was
    if edit == "undo":
        assert set(placed.stored_poses.timeline()) == {2}
    else:
        assert {2, 3, 4, 5} <= set(placed.stored_poses.timeline())
    seen = list(tracker.seen)
    tracker.let_go(5)
    time.sleep(0.1)
    assert tracker.seen == seen


@pytest.mark.slow
def test_undo_goes_to_the_nearest_frame_of_the_run(placed, tracker):
    tracker.track(placed, until=6, frames=4)
    for here, there in ((30, 6), (4, 4), (0, 3)):
        placed.navigation.seek(here)
        placed.history.undo()
        assert placed.state.frame == there
        placed.history.redo()


@pytest.mark.slow
def test_a_hand_takes_hold_of_the_frame_that_it_saw(placed, tracker):
    tracker.track(placed, until=None, frames=4, at=6)
    end_the_step_soon(tracker)
    placed.dragging.begin(PAGE, FRONT, 0, "torso", (320.0, 240.0), frame=4)
    assert placed.state.frame == 4
    assert placed.state.people[0].status == "doubtful"
    placed.dragging.move(PAGE, (330.0, 240.0), 1)
    placed.dragging.end(PAGE)
    assert placed.state.undo == "drag torso, frame 4"


@pytest.mark.slow
def test_a_run_writes_no_more_often_than_it_should(placed, tracker, monkeypatch):
    written = []
    for name in ("commit", "amend"):
        real = getattr(AnnotationStore, name)
        monkeypatch.setattr(AnnotationStore, name, lambda *a, real=real, **k: written.append(1) or real(*a, **k))
    began = time.monotonic()
    tracker.track(placed, until=None, frames=47)
    assert len(placed.stored_poses.timeline()) == 48
    assert len(written) <= 2 + (time.monotonic() - began) / 0.5


def test_an_impossible_run_has_a_sentence(tracker, controller):
    with pytest.raises(TrackerError, match="pose the body"):
        controller.tracking.start(backward=False, until=None)
    drag(controller, "torso", (4.0, 0.0))
    with pytest.raises(TrackerError, match="frames to track before frame 0"):
        controller.tracking.start(backward=True, until=None)


def test_a_tracker_that_fails_says_so_and_loses_nothing(placed, tracker):
    tracker.fails_at = 6
    tracker.track(placed, until=None, frames=4)
    assert placed.state.track.message == "stopped, because the tracker failed: no light: 3 frames, 1 doubtful"
    assert placed.state.track.failed
    assert set(placed.stored_poses.timeline()) == {2, 3, 4, 5}


@pytest.mark.slow
def test_an_edit_refused_by_a_full_disk_is_written_later(placed, tracker, monkeypatch):
    real = AnnotationStore.commit

    def full(*_, **__):
        raise SessionError("the disk is full; make room")

    monkeypatch.setattr(AnnotationStore, "commit", full)
    monkeypatch.setattr("app.control.tracking.tracking._SAVE_S", 0.0)
    tracker.track(placed, until=6, frames=2, at=4)
    assert placed.state.save_error == "the disk is full; make room"
    monkeypatch.setattr(AnnotationStore, "commit", real)
    tracker.go_on(placed, 2)
    assert placed.state.save_error is None
    assert set(placed.stored_poses.timeline()) == {2, 3, 4, 5, 6}


@pytest.mark.slow
def test_a_run_survives_a_restart(placed, tracker, opened):
    tracker.track(placed, until=6, frames=4)
    controller = opened()
    controller.navigation.seek(4)
    assert (controller.state.people[0].status, controller.state.people[0].remark) == ("doubtful", "left arm relocated")
    controller.history.undo()
    assert set(controller.stored_poses.timeline()) == {2}


@pytest.fixture
def estimate(tracker, monkeypatch):
    """Runs end with the estimate of all frames together, which finds everybody a step aside."""
    tracker.whole_runs, found = True, Estimate(STEP_M, doubted(7))
    monkeypatch.setattr(track_session, "estimate_run", found)
    return found


@pytest.mark.slow
def test_the_estimate_of_all_frames_takes_the_place_of_what_was_tracked(placed, tracker, estimate):
    """The frame that is looked at shows its estimated pose, and one undo takes back all of the run."""
    seen = []
    placed.subscribe(lambda state: seen.append(state.track))
    tracker.track(placed, until=9, frames=7, at=9)
    forward = dict(tracker.last)
    tracker.go_on(placed, 7)
    assert tracker.seen == [*range(3, 10), *range(9, 2, -1)]
    stages = [(t.stage, t.done, t.total) for t in seen if t.stage != "tracking"]
    assert sorted(set(stages), key=stages.index) == [
        *(("back", i, 7) for i in range(1, 8)), *(("solve", i, 7) for i in range(1, 8))
    ]  # fmt: skip
    (run,) = estimate.asked
    assert [p.source for p in run.proposals[5, 0]] == ["backward"]
    np.testing.assert_array_equal(run.proposals[5, 0][0].pose, tracker.last[5].poses[0])
    assert placed.state.track.message == "done: 7 frames, 1 doubtful"
    aside = STEP_M * (np.arange(22) == 1)
    assert (placed.state.frame, placed.state.people[0].source) == (9, "tracked")
    np.testing.assert_array_equal(placed.state.poses[0], forward[9].poses[0] + aside)
    placed.navigation.seek(7)
    shown = placed.state.people[0]
    assert (shown.source, shown.status, shown.remark) == (
        "tracked",
        "doubtful",
        "left arm uncertain: elsewhere on 50% of the likely paths",
    )
    np.testing.assert_array_equal(placed.state.poses[0], forward[7].poses[0] + aside)
    placed.history.undo()
    assert set(placed.stored_poses.timeline()) == {2}


@pytest.mark.slow
def test_the_estimate_of_all_frames_can_be_switched_off(placed, tracker, estimate):
    placed.search.set_settings(replace(placed.state.settings, whole_run=False))
    tracker.track(placed, until=9, frames=7)
    assert (estimate.asked, tracker.seen) == ([], [*range(3, 10)])
    assert placed.state.track.message == "done: 7 frames, 1 doubtful, 1 lost"


@pytest.mark.slow
@pytest.mark.parametrize("is_stopped", [True, False])
def test_a_run_that_is_over_leaves_nothing_to_the_collector_of_cycles(placed, tracker, is_stopped):
    """Runs that were broken off each kept ten megabytes for minutes."""
    gc.collect()
    gc.disable()
    try:
        placed.tracking.start(backward=False, until=4)
        run = weakref.ref(placed.tracking._run.session)
        tracker.go_on(placed, 1, at=3)
        if is_stopped:
            end_the_step_soon(tracker)
            placed.tracking.stop()
        tracker.let_go(5)
        wait_for(lambda: placed.state.track.message and run() is None)
    finally:
        gc.enable()
