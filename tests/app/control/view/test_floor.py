"""Setting the floor from three points clicked in the views: against planes that are known, kept, gone back to."""

import numpy as np
import pytest

from app.control.view import floor as floor_editing
from app.drawing.floor_lines import floor_lines
from app.messages.client import EditFloor, MarkFloor
from app.messages.encoding import state as state_message
from app.messages.parsing import MessageError
from app.page.commands import dispatch
from app.page.feeds.inspector import view_3d
from tracker.body.motion.floor_from_feet import FeetFloor
from tracker.errors import TrackerError
from tracker.geometry import rigid
from tracker.geometry.ground_plane import UP_ROTATIONS, GroundPlane, nearest_axis, up_rotation
from tracker.session.session import load_session

TILT = rigid.so3_exp(np.array([0.05, -0.03, 0.0]))
HEIGHT_M = 0.12
CORNERS = np.array([[-0.8, -0.6, 0.0], [0.9, -0.5, 0.0], [0.1, 0.8, 0.0]])
"""Points of a floor that lies 12 cm above the calibration's and is tilted by 3.3 degrees."""


def corners():
    return (CORNERS + np.array([0, 0, HEIGHT_M])) @ TILT.T


def do(controller, action, **fields):
    message = MarkFloor("mark", **fields) if action == "mark" else EditFloor(action)
    dispatch(controller, 1, message)


def click(controller, place, cameras=(0, 1), noise_px=0.0, rng=None):
    for camera in cameras:
        u, v = controller.session.cameras[camera].camera.pinhole.project(place)
        du, dv = (0, 0) if rng is None else rng.normal(0, noise_px, 2)
        do(controller, "mark", camera=camera, u=u + du, v=v + dv)


def click_all(controller, places, **options):
    do(controller, "begin")
    for i, place in enumerate(places):
        if i:
            do(controller, "next")
        click(controller, place, **options)


def test_three_points_in_two_views_give_the_plane(controller):
    click_all(controller, corners())
    plane = controller.state.floor.picking.plane
    assert plane.normal == pytest.approx(TILT[:, 2], abs=1e-6)
    assert plane.offset_m == pytest.approx(HEIGHT_M, abs=1e-6)
    assert controller.state.floor.plane is None, "nothing has been applied yet"


@pytest.mark.slow
def test_clicks_two_pixels_off_tilt_it_little_and_more_views_make_it_surer(opened):
    controller, errors = opened(), {}
    for cameras in ((0, 1), (0, 1, 2, 3)):
        rng, found = np.random.default_rng(4), []
        for _ in range(20):
            click_all(controller, corners(), cameras=cameras, noise_px=2.0, rng=rng)
            cosine = controller.state.floor.picking.plane.normal @ TILT[:, 2]
            found.append(np.degrees(np.arccos(min(1.0, cosine))))
        errors[len(cameras)] = np.mean(found)
    assert errors[4] < errors[2] < 1.5
    assert controller.state.floor.picking.picks[0].error_px > 0.5


@pytest.mark.slow
def test_applied_it_is_kept_turns_who_stands_and_can_be_gone_back_from(opened, session):
    controller = opened()
    before = (session / "session.toml").read_text()
    click_all(controller, corners())
    do(controller, "apply")
    floor = controller.state.floor
    assert floor.picking is None
    assert floor.up == "z"
    controller = opened()
    assert controller.state.floor.plane.normal == pytest.approx(floor.plane.normal)
    assert controller.state.floor.plane.offset_m == pytest.approx(HEIGHT_M, abs=1e-6)
    model = controller.models[0]
    points = model.points_world(controller.state.poses[0])
    upright = model.points_world(model.neutral()) @ up_rotation("z", floor.plane).T
    assert points - points[0] == pytest.approx(upright - upright[0], abs=0.01)
    do(controller, "revert")
    assert (session / "session.toml").read_text() == before
    assert opened().state.floor.plane is None
    do(opened(), "revert")
    assert load_session(session).floor.offset_m == pytest.approx(HEIGHT_M, abs=1e-6)


def test_it_is_set_from_the_feet_and_says_so(monkeypatch, controller):
    with pytest.raises(TrackerError, match="expected poses whose feet show the floor, found none"):
        do(controller, "from_feet")
    floor = FeetFloor(GroundPlane(TILT[:, 2], HEIGHT_M), 0.004, 0.31, 12)
    monkeypatch.setattr(floor_editing, "floor_from_feet", lambda people: floor)
    do(controller, "from_feet")
    assert load_session(controller.session.folder).floor.offset_m == pytest.approx(HEIGHT_M, abs=1e-6)
    told = view_3d(controller, controller.state).floor
    assert told.origin == "feet at 12 places, within 4 mm, tilt known to 0.3°"
    assert told.tilt_deg == pytest.approx(3.34, abs=0.01)
    do(controller, "revert")
    assert controller.state.floor.plane is None


def test_taking_back_goes_through_all_marks(controller):
    click_all(controller, corners()[:2])
    for expected in ((2, 1), (2, 0), (1, 1), (1, 0), (1, 0)):
        do(controller, "take_back")
        told = state_message(controller.session, controller.state).floor
        assert (told.point, told.views) == expected


def test_a_second_click_in_a_view_takes_the_place_of_the_first(controller):
    do(controller, "begin")
    do(controller, "mark", camera=0, u=3.0, v=4.0)
    click(controller, corners()[0])
    assert len(controller.state.floor.picking.picks[0].marks) == 2
    assert controller.state.floor.picking.picks[0].point_world == pytest.approx(corners()[0], abs=1e-6)


def test_an_impossible_request_has_a_sentence(controller):
    do(controller, "begin")
    do(controller, "mark", camera=0, u=3.0, v=4.0)
    with pytest.raises(TrackerError, match="second view"):
        do(controller, "next")
    with pytest.raises(TrackerError, match="three points"):
        do(controller, "apply")
    with pytest.raises(TrackerError, match="no former floor"):
        do(controller, "revert")
    with pytest.raises(MessageError, match="an index below 4 as 'camera'"):
        do(controller, "mark", camera=99, u=1.0, v=1.0)
    do(controller, "cancel")
    do(controller, "mark", camera=0, u=3.0, v=4.0)
    do(controller, "apply")
    assert controller.state.floor.plane is None


def test_three_points_on_a_line_are_no_floor(controller):
    click_all(controller, [[-0.8, 0, 0], [0.1, 0.01, 0], [0.9, 0, 0]])
    told = state_message(controller.session, controller.state).floor
    assert not told.ready
    assert "line" in told.why
    with pytest.raises(TrackerError, match="line"):
        do(controller, "apply")


def test_the_views_show_lines_of_sight_and_the_plane(controller):
    session = controller.session
    do(controller, "begin")
    click(controller, corners()[0], cameras=(0,))
    lines = {p.camera: p.segments_px for p in floor_lines(session, controller.state) if p.kind == "floor_sight"}
    assert sorted(lines) == [1, 2, 3]
    for camera, (x0, y0, x1, y1) in ((c, s[0]) for c, s in lines.items()):
        u, v = session.cameras[camera].camera.pinhole.project(corners()[0])
        across = (x1 - x0) * (v - y0) - (y1 - y0) * (u - x0)
        assert abs(across) / np.hypot(x1 - x0, y1 - y0) < 0.01
    click_all(controller, corners())
    seen = [p for p in floor_lines(session, controller.state) if p.kind == "floor" and len(p.segments_px) > 100]
    assert {p.camera for p in seen} == {0, 1, 2, 3}
    view = session.cameras[0].camera.pinhole
    start = seen[0].segments_px[:, :2].astype(float)
    rays = view.rays(start)
    depths = (HEIGHT_M - view.center_world @ TILT[:, 2]) / (rays @ TILT[:, 2])
    assert np.all(np.linalg.norm(view.center_world + depths[:, None] * rays - corners().mean(axis=0), axis=1) < 3.5)


@pytest.mark.parametrize("up", list(UP_ROTATIONS))
def test_the_least_turn_lets_up_point_up(up, opened):
    normal = rigid.so3_exp(np.array([0.1, -0.2, 0.15])) @ UP_ROTATIONS[up][:, 2]
    R = up_rotation(up, GroundPlane(normal, 0.0))
    assert R[:, 2] == pytest.approx(normal)
    assert pytest.approx(np.eye(3)) == R @ R.T
    assert nearest_axis(normal) == up
    turned = up_rotation(up, GroundPlane(-UP_ROTATIONS[up][:, 2], 0.0))
    assert turned[:, 2] == pytest.approx(-UP_ROTATIONS[up][:, 2])
    assert np.linalg.det(turned) == pytest.approx(1.0)
