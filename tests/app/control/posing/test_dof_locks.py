"""Locks: what they hold still, and that they outlast the program."""

import numpy as np
import pytest
from gestures import FRONT, PAGE, drag, pixel_of, wait_for

from tracker.errors import TrackerError


def dofs_of(controller, *joints):
    names = controller.models[0].dof_names
    return [i for i, name in enumerate(names) if name.partition(".")[0] in joints]


def test_a_drag_moves_what_is_not_locked(controller):
    locked = dofs_of(controller, "left_shoulder")
    controller.pose_edits.set_dof(0, dofs_of(controller, "left_elbow")[0], 1.0)
    controller.dof_locks.set(0, locked, True)
    before = controller.state.poses[0]
    drag(controller, "left_wrist", (0.0, -15.0))
    after = controller.state.poses[0]
    np.testing.assert_array_equal(after[locked], before[locked])
    assert not np.array_equal(after, before)


def test_a_point_whose_limb_is_locked_is_refused(controller):
    controller.dof_locks.set(0, dofs_of(controller, "left_shoulder", "left_elbow"), True)
    before = controller.state.poses[0]
    with pytest.raises(TrackerError, match="left_wrist with all of that locked"):
        controller.dragging.begin(PAGE, FRONT, 0, "left_wrist", tuple(pixel_of(controller, "left_wrist")))
    controller.dragging.move(PAGE, (10.0, 10.0), 1)
    controller.dragging.end(PAGE)
    np.testing.assert_array_equal(controller.state.poses[0], before)
    controller.dof_locks.set(0, dofs_of(controller, "left_shoulder"), False)
    drag(controller, "left_wrist", (5.0, 0.0))
    assert controller.state.undo == "drag left wrist, frame 0"


def test_a_locked_body_stays_where_it_is(controller):
    depth = controller.models[0].dof_names.index("torso.x")
    controller.dof_locks.set(0, [depth], True)
    before = controller.state.poses[0]
    drag(controller, "torso", (40.0, 0.0))
    assert controller.state.poses[0][depth] == before[depth]
    assert not np.array_equal(controller.state.poses[0], before)


def test_a_locked_number_is_not_set(controller):
    (dof,) = dofs_of(controller, "left_elbow")
    controller.dof_locks.set(0, [dof], True)
    with pytest.raises(TrackerError, match="left elbow extension is locked"):
        controller.pose_edits.set_dof(0, dof, 0.4)
    assert controller.state.undo is None


def test_a_search_leaves_locked_degrees_of_freedom_alone(controller):
    drag(controller, "torso", (4.0, 0.0))
    locked = dofs_of(controller, "torso", "neck", "left_shoulder")
    controller.dof_locks.set(0, locked, True)
    before = controller.state.poses[0]
    controller.search.run()
    assert controller.replay.runs()[-1].stages[0].name.startswith("arms")
    wait_for(lambda: controller.state.search.evaluations > 200 or controller.state.search.message)
    controller.activities.stop()
    after = controller.state.poses[0]
    np.testing.assert_array_equal(after[locked], before[locked])
    assert not np.array_equal(after, before)


@pytest.mark.slow
def test_a_tracking_run_is_told_what_is_locked(placed, tracker):
    locked = dofs_of(placed, "left_shoulder")
    placed.dof_locks.set(0, locked, True)
    tracker.track(placed, until=4, frames=2)
    (free,) = tracker.run.subjects.active_dofs
    assert set(np.flatnonzero(~free)) == set(locked)


def test_with_all_locked_a_search_says_so(controller):
    controller.dof_locks.set(0, range(controller.models[0].n_dofs), True)
    with pytest.raises(TrackerError, match="found all of them locked"):
        controller.search.run()
    assert controller.state.search.kind is None


@pytest.mark.slow
def test_locks_survive_a_restart_and_are_no_entry_of_the_history(opened):
    controller = opened()
    locked = frozenset(dofs_of(controller, "right_knee", "torso"))
    controller.dof_locks.set(0, locked, True)
    assert controller.state.undo is None
    controller = opened()
    assert controller.state.locked == (locked,)
    controller.dof_locks.set(0, locked, False)
    assert opened().state.locked == (frozenset(),)
