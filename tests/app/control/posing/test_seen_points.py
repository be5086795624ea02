"""The places where a user puts points in the views are stored with the pose, and are undone with it."""

import numpy as np
import pytest
from gestures import PAGE, drag, pixel_of

from tracker.session.store.records import SEEN


def seen(controller):
    return controller.session_state.saver.record(0, controller.state.frame).settings.get(SEEN, {})


def test_the_end_of_a_drag_is_kept_even_out_of_reach(controller):
    start, far = np.array(pixel_of(controller, "left_wrist", 0)), np.array([300.0, -200.0])
    drag(controller, "left_wrist", tuple(far))
    (point, views), *more = seen(controller).items()
    camera = controller.session.cameras[0].camera
    assert (point, more, list(views)) == ("left_wrist", [], [camera.name])
    wanted = camera.distort_points(start + far)
    assert views[camera.name] == pytest.approx(wanted, abs=0.5)
    assert np.abs(np.array(pixel_of(controller, "left_wrist", 0)) - start - far).max() > 20  # out of reach


def test_each_point_and_view_has_its_last_place(controller):
    for point, step in (("left_wrist", (6.0, -9.0)), ("right_knee", (5.0, 8.0)), ("left_wrist", (-7.0, 4.0))):
        drag(controller, point, step)
    found = seen(controller)
    assert set(found) == {"left_wrist", "right_knee"}
    controller.history.undo()
    assert seen(controller) != found
    controller.history.undo()
    assert set(seen(controller)) == {"left_wrist"}


def test_turning_or_pushing_places_nothing(controller):
    drag(controller, "left_wrist", (6.0, -9.0))
    before = seen(controller)
    at = np.array(pixel_of(controller, "right_wrist", 0))
    controller.dragging.begin(PAGE, 0, 0, "right_wrist", tuple(at))
    controller.dragging.move(PAGE, tuple(at + 20.0), 1, "push", is_last=True)
    controller.dragging.end(PAGE)
    assert seen(controller) == before


def test_an_edit_that_is_no_drag_drops_what_it_moves(controller):
    for point in ("left_wrist", "right_knee"):
        drag(controller, point, (6.0, -9.0))
    model = controller.session.people[0].model
    elbow = next(i for i, name in enumerate(model.dof_names) if name.startswith("left_elbow"))
    controller.pose_edits.set_dof(0, elbow, float(controller.state.poses[0][elbow]) + 0.4)
    assert set(seen(controller)) == {"right_knee"}
    controller.history.undo()
    assert set(seen(controller)) == {"left_wrist", "right_knee"}


def test_fits_know_where_points_were_put(controller):
    put = np.add(pixel_of(controller, "left_wrist", 0), (30.0, -20.0))
    drag(controller, "left_wrist", (30.0, -20.0))
    constraints = controller.session_state.fit_constraints(0)
    assert [(at.point, at.camera) for at in constraints.seen] == [("left_wrist", 0)]
    np.testing.assert_allclose(constraints.seen[0].position_px, put, atol=0.5)
