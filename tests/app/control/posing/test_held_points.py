"""Points that a drag placed are held, until they are released; what does not reach the pointer is said."""

import numpy as np
import pytest
from gestures import FRONT, PAGE, drag, grab, pixel_of

from app.drawing import joint_handles
from app.state.people import HeldPoint
from tracker.errors import TrackerError

RIGHT = 1


def world_of(controller, point):
    return controller.models[0].points_world(controller.state.poses[0])[controller.models[0].point_names.index(point)]


@pytest.mark.slow
def test_a_drag_holds_the_point_it_placed_on_its_frame_until_it_is_released(controller):
    drag(controller, "left_wrist", (25.0, -25.0))
    drag(controller, "left_wrist", (5.0, 5.0), RIGHT)
    assert controller.state.held == {HeldPoint(0, 0, "left_wrist", camera) for camera in (FRONT, RIGHT)}
    before = world_of(controller, "left_wrist")
    drag(controller, "torso", (3.0, 0.0))
    assert np.linalg.norm(world_of(controller, "left_wrist") - before) < 0.01
    held = {h.point for h in joint_handles.handles(controller.session, controller.state, [FRONT]) if h.held}
    assert held == {"left_wrist", "torso"}
    controller.navigation.seek(1)
    assert controller.state.held_points(0) == frozenset()
    controller.held_points.set(0, "left_wrist", False, frame=0)
    assert controller.state.held_points(0) == {"torso"}
    before = world_of(controller, "left_wrist")
    drag(controller, "torso", (8.0, 0.0))
    assert np.linalg.norm(world_of(controller, "left_wrist") - before) > 0.02
    controller.held_points.set(0, None, False)
    assert controller.state.held == frozenset()


def test_a_drag_that_is_undone_holds_nothing_and_holds_again_when_it_is_redone(controller):
    for by in (9.0, 4.0):  # the second one holds what the first holds already
        drag(controller, "left_wrist", (by, 0.0))
    controller.held_points.set(0, "left_knee", True)  # no entry of the history
    knee, wrist = HeldPoint(0, 0, "left_knee", None), HeldPoint(0, 0, "left_wrist", FRONT)
    for move, held in (("undo", {knee, wrist}), ("undo", {knee}), ("redo", {knee, wrist}), ("redo", {knee, wrist})):
        getattr(controller.history, move)()
        assert controller.state.held == held
    controller.history.go_to(None)
    assert controller.state.held == {knee}
    handles = joint_handles.handles(controller.session, controller.state, [FRONT])
    assert {h.point for h in handles if h.held} <= {"left_knee"}


def test_still_points_and_spines_are_not_held(controller):
    controller.dragging.begin(PAGE, FRONT, 0, "left_wrist", tuple(pixel_of(controller, "left_wrist")))
    controller.dragging.end(PAGE)
    assert controller.state.held == frozenset()
    controller.held_points.set(0, "left_knee", True)
    assert controller.state.held == {HeldPoint(0, 0, "left_knee", None)}
    with pytest.raises(TrackerError, match="a point that can be held"):
        controller.held_points.set(0, "neck", True)


def test_a_point_out_of_reach_says_by_how_much(controller):
    start = grab(controller, "left_wrist")
    controller.dragging.move(PAGE, tuple(start + np.array([15.0, -15.0])), 1)
    assert joint_handles.out_of_reach(controller.session, controller.state) is None
    controller.dragging.move(PAGE, tuple(start + np.array([200.0, 0.0])), 2)
    short = joint_handles.out_of_reach(controller.session, controller.state)
    assert (short.u, short.v) == pytest.approx(tuple(start + np.array([200.0, 0.0])))
    assert (short.point_u, short.point_v) == pytest.approx(tuple(pixel_of(controller, "left_wrist")), abs=0.01)
    camera = controller.session.cameras[FRONT].camera.pinhole
    far_m = 200 * float(camera.depths(world_of(controller, "left_wrist"))) / camera.K[0, 0]
    assert 0.2 * far_m < short.distance_m < far_m
    controller.dragging.end(PAGE)
    assert joint_handles.out_of_reach(controller.session, controller.state) is None
