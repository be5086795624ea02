"""Posing without a drag, on the controller: numbers, nudges, mirror, copies, resets; history and locks."""

import numpy as np
import pytest
from gestures import FRONT, drag, pixel_of

from tracker.errors import TrackerError

LEFT_WRIST = "left_wrist"


def world_of(controller, point):
    model = controller.models[0]
    return model.points_world(controller.state.poses[0])[model.point_names.index(point)]


@pytest.mark.slow
@pytest.mark.parametrize(("right_m", "up_m"), [(0.02, 0.0), (0.0, 0.01), (-0.01, -0.02)])
def test_a_nudge_moves_a_joint_parallel_to_the_image(right_m, up_m, controller):
    drag(controller, LEFT_WRIST, (25.0, -25.0))
    before = world_of(controller, LEFT_WRIST)
    controller.pose_edits.nudge(0, LEFT_WRIST, FRONT, right_m, up_m)
    camera = controller.session.cameras[FRONT].camera
    moved = camera.T_world_camera[:3, :3].T @ (world_of(controller, LEFT_WRIST) - before)
    np.testing.assert_allclose(moved, [right_m, -up_m, 0.0], atol=0.002)


def test_without_a_joint_the_body_moves(controller):
    before = controller.models[0].points_world(controller.state.poses[0])
    controller.pose_edits.nudge(0, None, FRONT, 0.05, 0.0)
    moved = controller.models[0].points_world(controller.state.poses[0]) - before
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), 0.05, atol=1e-6)


def test_nudges_in_quick_succession_are_one_entry(monkeypatch, controller):
    for _ in range(5):
        controller.pose_edits.nudge(0, LEFT_WRIST, FRONT, 0.01, 0.0)
    assert controller.state.undo == "nudge left wrist, frame 0"
    controller.history.undo()
    assert controller.state.undo is None
    for _ in range(2):
        controller.pose_edits.nudge(0, LEFT_WRIST, FRONT, 0.01, 0.0)
        monkeypatch.setattr("app.control.posing.pose_edits._SAME_GESTURE_S", 0.0)
    controller.history.undo()
    assert controller.state.undo == "nudge left wrist, frame 0"  # another second, another entry


def test_a_degree_of_freedom_turns_by_steps_to_its_limit(controller):
    model = controller.models[0]
    dof = model.dof_names.index("left_elbow.extension")
    controller.pose_edits.turn(0, [dof], 0.1)
    controller.pose_edits.turn(0, [dof], 0.1)
    assert controller.state.poses[0][dof] == pytest.approx(0.2)
    controller.pose_edits.turn(0, [dof], 10.0)
    assert controller.state.poses[0][dof] == pytest.approx(model.limits[dof, 1])
    assert controller.state.undo == "nudge left elbow extension, frame 0"


def test_a_drag_of_curves_counts_from_its_start_and_is_one_entry(monkeypatch, controller):
    monkeypatch.setattr("app.control.posing.pose_edits._SAME_GESTURE_S", 0.0)
    model = controller.models[0]
    dofs = [model.dof_names.index(name) for name in ("left_elbow.extension", "torso.twist")]
    for by in (0.1, 10.0, 0.3):  # beyond the limit and back
        controller.pose_edits.turn(0, dofs, by, 4, drag=7)
    np.testing.assert_allclose(controller.state.poses[0][dofs], model.neutral()[dofs] + 0.3)
    assert controller.stored_poses.timeline()[4]["keyframe"]
    assert controller.state.undo == "drag 2 curves, frame 4"
    controller.pose_edits.turn(0, dofs[:1], 0.2, 4, drag=8)
    assert controller.state.undo == "drag left elbow extension, frame 4"
    controller.pose_edits.cancel_drag(dofs[:1], 8)
    controller.pose_edits.cancel_drag(dofs, 7)  # saved by now
    np.testing.assert_allclose(controller.state.poses[0][dofs], model.neutral()[dofs] + 0.3)
    controller.history.undo()
    assert controller.state.undo is None


def test_the_hand_means_the_frame_that_it_saw(controller):
    controller.pose_edits.turn(0, [3], 0.1, frame=4)
    assert controller.state.frame == 4
    assert controller.state.undo == "nudge torso abduction, frame 4"


def test_mirror_and_back(controller):
    drag(controller, LEFT_WRIST, (25.0, -25.0))
    before = controller.models[0].points_world(controller.state.poses[0])
    controller.pose_edits.mirror(0)
    assert controller.state.undo == "mirror, frame 0"
    assert np.abs(controller.models[0].points_world(controller.state.poses[0]) - before).max() > 0.1
    controller.pose_edits.mirror(0)
    np.testing.assert_allclose(controller.models[0].points_world(controller.state.poses[0]), before, atol=1e-9)
    controller.history.undo()
    controller.history.undo()
    assert controller.state.undo == "drag left wrist, frame 0"


def test_a_pose_is_copied_and_locks_hold(controller):
    drag(controller, LEFT_WRIST, (25.0, -25.0))
    model, source = controller.models[0], controller.state.poses[0]
    controller.navigation.seek(5)
    controller.pose_edits.reset(0, None)
    locked = [i for i, name in enumerate(model.dof_names) if name.startswith("left_elbow")]
    controller.dof_locks.set(0, locked, True)
    before = controller.state.poses[0]
    controller.pose_edits.copy_from(0, 0)
    free = np.setdiff1d(np.arange(model.n_dofs), locked)
    np.testing.assert_array_equal(controller.state.poses[0][free], source[free])
    np.testing.assert_array_equal(controller.state.poses[0][locked], before[locked])
    assert controller.state.undo == "copy frame 0, frame 5"


def test_there_must_be_a_pose_to_copy(controller):
    with pytest.raises(TrackerError, match="on frame 3 to copy, found none"):
        controller.pose_edits.copy_from(0, 3)
    assert controller.state.people[0].source is None


def test_a_limb_is_reset_alone(controller):
    model = controller.models[0]
    drag(controller, LEFT_WRIST, (25.0, -25.0))
    drag(controller, "left_ankle", (15.0, -15.0))
    before = controller.state.poses[0]
    controller.pose_edits.reset(0, "left_elbow")
    arm = np.array([name.startswith(("left_shoulder", "left_elbow", "left_collar")) for name in model.dof_names])
    np.testing.assert_array_equal(controller.state.poses[0][arm], model.neutral()[arm])
    np.testing.assert_array_equal(controller.state.poses[0][~arm], before[~arm])
    assert controller.state.undo == "reset left arm, frame 0"


def test_nudging_what_is_locked_says_so(controller):
    model = controller.models[0]
    controller.dof_locks.set(0, range(model.n_dofs), True)
    with pytest.raises(TrackerError, match="locked"):
        controller.pose_edits.nudge(0, LEFT_WRIST, FRONT, 0.01, 0.0)
    with pytest.raises(TrackerError, match="left elbow extension is locked"):
        controller.pose_edits.turn(0, [model.dof_names.index("left_elbow.extension")], 0.1)


def test_numbers_can_be_typed_where_the_joint_is_seen(controller):
    x = controller.models[0].dof_names.index("torso.x")
    before = pixel_of(controller, "torso")
    controller.pose_edits.set_dof(0, x, controller.state.poses[0][x] + 0.1)
    assert np.linalg.norm(pixel_of(controller, "torso") - before) > 3
    assert controller.state.undo == "set torso x, frame 0"
