"""Searches as they are watched: to the end of a stage, paced, replayed, compared, run again, taken over."""

import gc
import time
import weakref

import numpy as np
import pytest
from gestures import drag, wait_for

from tracker.errors import TrackerError
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.search.best_first import SearchSettings

QUICK = TrackSettings(search=SearchSettings(passes=(1.0,), max_expansions=3))


def searched(controller, settings=QUICK):
    """Search the shown frame to its end; gives the run."""
    controller.search.set_settings(settings)
    controller.search.run()
    wait_for(lambda: controller.state.search.message)
    with controller.lock:  # its last words and its saving are under one lock
        return controller.replay.runs()[-1]


def test_a_stage_ends_where_the_next_begins_and_goes_on_from_there(controller):
    controller.search.set_settings(QUICK)
    ends = []
    for stage in range(2):
        controller.search.run_stage()
        run = controller.replay.runs()[-1]
        wait_for(lambda r=run, s=stage: r.counts[s].done and not controller.state.search.running)
        ends.append(run.evaluations)
        assert [count.done for count in run.counts] == [i <= stage for i in range(3)]
        assert run.counts[stage + 1].expansions == 0
    assert controller.state.search.kind == "search"  # it stands
    assert ends == [sum(c.evaluations for c in run.counts[: i + 1]) for i in range(2)]
    assert run.start_px - run.best_px == pytest.approx(sum(c.gain_px for c in run.counts))
    assert len(controller.replay.runs()) == 1


def test_the_speed_is_kept_and_a_change_takes_effect_at_once(controller):
    controller.search.set_settings(QUICK)
    controller.search.set_speed(0.05)  # one expansion in 20 s
    controller.search.run()
    wait_for(lambda: controller.replay.runs() and controller.replay.runs()[-1].steps)
    time.sleep(0.3)
    assert len(controller.replay.runs()[-1].steps) == 1
    controller.search.set_speed(None)
    wait_for(lambda: controller.state.search.message, 15.0)
    with pytest.raises(TrackerError, match="expected a speed above 0"):
        controller.search.set_speed(0.0)


def test_a_replay_shows_every_step_and_changes_nothing(controller):
    run = searched(controller)
    true, undo, version = controller.state.people, controller.state.undo, controller.state.timeline_version
    for step in (-1, 0, len(run.steps) // 2, len(run.steps) - 1):
        controller.replay.show(run.number, step)
        drawn, kept = controller.state.drawn, run.steps[max(0, step)]
        expected = run.start[0] if step < 0 else kept.best
        np.testing.assert_allclose(drawn.poses[0], expected, atol=1e-6)
        assert (drawn.search.candidate is None) == (step < 0)
        assert controller.state.people is true
    np.testing.assert_allclose(drawn.poses[0], controller.state.poses[0], atol=1e-6)
    controller.replay.show(run.number, 10**6)  # beyond the last is the last
    assert controller.state.search_view.replay.step == len(run.steps) - 1
    controller.replay.leave()
    assert controller.state.drawn is controller.state
    assert (controller.state.undo, controller.state.timeline_version) == (undo, version)


@pytest.mark.slow
@pytest.mark.parametrize("what", ["drag", "seek", "step", "undo"])
def test_whatever_happens_to_the_frame_ends_the_replay(what, controller):
    run = searched(controller)
    controller.replay.show(run.number, 0)
    {
        "drag": lambda: drag(controller, "left_knee", (3.0, 3.0)),
        "seek": lambda: controller.navigation.seek(3),
        "step": controller.search.step,
        "undo": controller.history.undo,
    }[what]()
    assert controller.state.search_view.replay is None


def test_a_run_is_compared_with_one_by_other_settings_and_taken_back(controller):
    first = searched(controller)
    controller.search.set_settings(TrackSettings(theta_px=8.0, search=QUICK.search))
    controller.search.run_again()
    second = controller.replay.runs()[-1]
    wait_for(lambda: second.over)
    assert second.number != first.number
    np.testing.assert_array_equal(second.start[0], first.start[0])
    assert not np.array_equal(second.best[0], first.best[0])
    np.testing.assert_array_equal(controller.state.poses[0], second.best[0])
    controller.replay.compare(first.number)
    np.testing.assert_array_equal(controller.state.search_view.compared[0], first.best[0])
    controller.replay.take(first.number, None)
    np.testing.assert_array_equal(controller.state.poses[0], first.best[0])
    assert controller.state.undo == f"take run {first.number}, frame 0"
    controller.history.undo()
    np.testing.assert_array_equal(controller.state.poses[0], second.best[0])
    controller.navigation.seek(1)
    assert controller.state.search_view.compared is None
    with pytest.raises(TrackerError, match="expected a recorded run of frame 1"):
        controller.replay.show(first.number, 0)
    controller.navigation.seek(0)
    assert [r.number for r in controller.replay.runs()] == [first.number, second.number]


def test_a_candidate_is_previewed_and_taken(controller):
    run = searched(controller)
    costs = [c.px for c in run.candidates]
    assert costs == sorted(costs)
    assert len(costs) > 2
    assert costs[0] == pytest.approx(run.best_px)
    before = controller.state.people
    controller.replay.preview(run.number, 1)
    assert controller.state.search_view.preview.poses is run.candidates[1].poses
    controller.replay.preview(run.number, 99)
    assert controller.state.search_view.preview is None
    assert controller.state.people is before
    controller.replay.take(run.number, 1)
    np.testing.assert_array_equal(controller.state.poses[0], run.candidates[1].poses[0])
    with pytest.raises(TrackerError, match="found number 100"):
        controller.replay.take(run.number, 99)


def test_locked_dofs_stay_in_a_second_run_and_in_taken_poses(controller):
    model = controller.models[0]
    dof = model.dof_names.index("left_shoulder.abduction")
    run = searched(controller)
    controller.pose_edits.set_dof(0, dof, 0.7)
    controller.dof_locks.set(0, [dof], True)
    controller.replay.take(run.number, None)
    assert controller.state.poses[0][dof] == pytest.approx(0.7)
    assert controller.state.poses[0][0] == run.best[0][0]
    controller.search.run_again(run.number)
    again = controller.replay.runs()[-1]
    wait_for(lambda: again.over)
    assert again.best[0][dof] == pytest.approx(0.7)
    assert all("left_shoulder.abduction" not in s.group.dofs for s in again.stages)


def test_stop_ends_a_paused_search(controller):
    controller.search.set_settings(QUICK)
    controller.search.step()
    wait_for(lambda: controller.state.search.evaluations and not controller.state.search.running)
    shown = controller.state.people
    controller.activities.stop()
    assert controller.state.search.kind is None
    assert controller.state.search.message.startswith("stopped: ")
    assert controller.state.people is shown
    assert controller.replay.runs()[-1].over
    controller.activities.stop()  # nothing is left to stop
    controller.search.step()
    wait_for(lambda: len(controller.replay.runs()) == 2)


@pytest.mark.slow
@pytest.mark.parametrize("what", ["discarded", "moved", "sizes"])
def test_a_comparison_ends_with_its_run(what, controller):
    run = searched(controller)
    controller.replay.compare(run.number)
    controller.replay.preview(run.number, 0)
    if what == "discarded":
        for _ in range(6):
            controller.search.forget()
            controller.search.step()
            wait_for(lambda: not controller.search.running)
        assert run.number not in [r.number for r in controller.replay.runs()]
    elif what == "moved":
        drag(controller, "left_knee", (3.0, 3.0))
        controller.replay.preview(run.number, 0)
        controller.navigation.seek(3)
        controller.replay.compare(None)
        drag(controller, "left_knee", (3.0, 3.0))
        controller.navigation.seek(0)
        controller.replay.compare(run.number)
        controller.history.undo()  # of the drag on frame 3, which is shown
        assert controller.state.frame == 3
    else:
        controller.body_sizes.set_height(0, 1.7)
        controller.body_sizes.apply(0, refit=False)
    view = controller.state.search_view
    assert (view.compared_run, view.compared, view.preview) == (None, None, None)


def source_of(controller):
    """The source of the pose, which the timeline and the state must agree on, also when the frame is shown again."""
    shown = controller.state.people[0].source
    assert controller.stored_poses.timeline(0)[0]["source"] == shown
    controller.navigation.seek(1)
    controller.navigation.seek(0)
    assert controller.state.people[0].source == shown
    return shown


@pytest.mark.slow
def test_the_shown_source_is_the_stored_one(controller):
    drag(controller, "torso", (4.0, 0.0))
    controller.search.set_settings(QUICK)
    controller.dof_locks.set(0, [0], True)  # this value stays as it was placed
    controller.search.run()
    wait_for(lambda: controller.state.search.message)
    with controller.lock:
        assert source_of(controller) == "manual"  # the most manual one of the values
    controller.dof_locks.set(0, [0], False)
    searched(controller)
    assert source_of(controller) == "searched"
    drag(controller, "left_wrist", (5.0, 5.0))
    assert source_of(controller) == "manual"
    controller.pinning.fit(0)
    assert source_of(controller) == "fitted"


def test_contours_are_fitted_chain_by_chain(controller):
    """The root comes first; every chain is a stage of the replay, and the run is one entry of the history."""
    controller.search.fit_contours(by_chains=True)
    wait_for(lambda: controller.state.search.message)
    with controller.lock:
        run = controller.replay.runs()[-1]
    stages = [run.stages[s.stage].name for s in run.steps]
    assert stages[0] == "root"
    assert stages[-1] == "whole body"
    assert set(stages) == {s.name for s in run.stages}
    assert run.is_contour_fit
    controller.replay.show(run.number, 1)
    assert controller.state.search_view.replay.stage == stages[1]


def test_contours_are_fitted_iteration_by_iteration(controller):
    """Each iteration lowers the distance of the contours, and is replayed with the contours at the start beside it."""
    controller.search.fit_contours()
    wait_for(lambda: controller.state.search.message)
    with controller.lock:
        run = controller.replay.runs()[-1]
    assert run.is_contour_fit
    px = [step.best_px for step in run.steps]
    assert len(px) >= 2
    assert px == sorted(px, reverse=True)
    assert px[-1] < px[0]
    assert [step.evaluations for step in run.steps] == list(range(len(px)))  # the number of iterations
    controller.replay.show(run.number, 1)
    shown = controller.state.search_view.replay
    assert shown.fitted_from is run.start
    assert shown.candidate_px == px[1]
    controller.replay.leave()
    searched(controller)
    controller.replay.show(controller.replay.runs()[-1].number, 0)
    assert controller.state.search_view.replay.fitted_from is None


@pytest.mark.slow
def test_a_search_that_is_forgotten_leaves_nothing_to_the_collector_of_cycles(controller):
    controller.search.set_settings(QUICK)
    gc.collect()
    gc.disable()
    try:
        controller.search.step()
        wait_for(
            lambda: controller.replay.runs() and controller.replay.runs()[-1].steps and not controller.search.running
        )
        job = weakref.ref(controller.search._job)
        controller.navigation.seek(3)
        wait_for(lambda: job() is None)
    finally:
        gc.enable()
