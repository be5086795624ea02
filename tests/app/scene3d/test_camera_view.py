"""The view through a camera without a browser: what a slow page reports late."""

import asyncio
import contextlib
import threading
from types import SimpleNamespace

import numpy as np
import pytest
from gestures import wait_for

from app.scene3d.camera_view import CameraView
from tracker.geometry import rigid

START = (np.array([3.0, 3.0, 2.0]), np.array([1.0, 0.0, 0.0, 0.0]))


class Page:
    """Stands for a page with viser's 3-D view; it reports only when it is told to."""

    client_id = 1

    def __init__(self):
        position, wxyz = START
        self.camera = SimpleNamespace(
            position=position, wxyz=wxyz, look_at=np.zeros(3), up_direction=np.array([0.0, 0, 1]), fov=1.0,
            image_width=400, image_height=300, on_update=self._keep,
        )  # fmt: skip
        self.background = None
        self.shown, self.may_go_on = threading.Event(), threading.Event()
        self.may_go_on.set()
        self.scene = SimpleNamespace(set_background_image=self._show)

    def _keep(self, callback):
        self._moved = callback

    def _show(self, image, **_):
        self.background = image
        self.shown.set()
        self.may_go_on.wait(20)

    def atomic(self):
        return contextlib.nullcontext()

    def reports(self, position, wxyz):
        """Say that the view is somewhere: viser then takes that for where it is."""
        self.camera.position, self.camera.wxyz = position, wxyz
        asyncio.run(self._moved(None))


@pytest.fixture
def page(controller):
    page, connect = Page(), []
    server = SimpleNamespace(on_client_connect=connect.append, on_client_disconnect=lambda _: None)
    CameraView(server, controller)
    asyncio.run(connect[0](page))
    return page


def pose_of(controller, camera):
    T = controller.session.cameras[camera].camera.T_world_camera
    return T[:3, 3], rigid.quaternion_from_matrix(T[:3, :3])


def snap(controller, page, camera):
    controller.view_3d.look_through_camera(camera)
    wait_for(lambda: (page.background is None) == (camera is None))


def settled(controller, page, place):
    """Report a place and wait until it was taken in: a view at rest hears of every report."""
    page.reports(*place)
    asyncio.run(asyncio.sleep(0.1))
    return controller.state.snapped


def test_a_turn_leaves_the_camera(controller, page):
    snap(controller, page, 0)
    position, wxyz = pose_of(controller, 0)
    assert settled(controller, page, (position, wxyz)) == 0
    page.reports(position + 0.1, wxyz)
    wait_for(lambda: controller.state.snapped is None)
    wait_for(lambda: page.background is None)


def test_a_turn_right_after_arriving_leaves_it_too(controller, page):
    page.may_go_on.clear()
    controller.view_3d.look_through_camera(0)
    assert page.shown.wait(20)
    # Both are said while the view is still at work.
    position, wxyz = pose_of(controller, 0)
    page.reports(position, wxyz)
    page.reports(position + 0.1, wxyz)
    page.may_go_on.set()
    wait_for(lambda: controller.state.snapped is None, 5)


def test_late_reports_of_a_slow_page_are_no_turn(controller, page):
    snap(controller, page, 0)
    assert settled(controller, page, pose_of(controller, 0)) == 0
    snap(controller, page, None)
    snap(controller, page, 0)
    # The first comes from before it was let go, the second from in between.
    assert settled(controller, page, pose_of(controller, 0)) == 0
    assert settled(controller, page, START) == 0
    assert page.background is not None


def test_reports_before_a_second_snap_are_no_turn(controller, page):
    snap(controller, page, 0)
    assert settled(controller, page, pose_of(controller, 0)) == 0
    snap(controller, page, None)
    assert settled(controller, page, pose_of(controller, 0)) is None  # it has not heard yet that it was let go
    snap(controller, page, 0)
    assert settled(controller, page, START) == 0
    snap(controller, page, None)
    np.testing.assert_array_equal(page.camera.position, START[0])
