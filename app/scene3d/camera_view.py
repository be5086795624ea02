"""Look through a camera in the 3-D view: from its calibrated pose, its undistorted image behind the bodies.

Each open page has a canvas of its own size, and so its own field of view and image.
"""

from dataclasses import dataclass

import numpy as np
import viser

from app.control.controller import Controller
from app.drawing.centred_image import centred, field_of_view
from app.drawing.joint_handles import head_circles, without_faces
from app.runtime.jobs import LatestWinsWorker
from app.state.state import State
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, Image
from tracker.geometry.cameras import Camera, viewed_point

_MOVED_M = 1e-3
_MOVED_RAD = 1e-3
"""A turn or a move of the view beyond these leaves the camera."""
_LEAST_PX = 16
"""A smaller canvas counts as invisible."""
_JPEG_QUALITY = 88


@dataclass(frozen=True)
class _FreeView:
    """The view of a page before it looked through a camera."""

    position: Array
    look_at: Array
    up: Array
    fov: float


@dataclass(frozen=True, eq=False)
class _Report:
    """A page's report of its view. Reports are distinct even where they are equal."""

    client: int
    position: Array
    wxyz: Array


@dataclass
class _PageView:
    """The view of one page."""

    client: viser.ClientHandle
    camera: int | None = None
    """The camera that it was moved to."""
    arrived: bool = False
    """Whether it has reported its arrival. Reports from the way there are ignored."""
    shown: tuple[object, ...] = ()
    """Camera, frame and canvas size of the image behind the bodies."""
    before: _FreeView | None = None
    """The view before; kept after a return to it."""
    left: int | None = None
    """The camera that it returned from."""
    turned_away: bool = False
    """Whether its user turned it away from the camera, and so continues from there."""

    def is_back(self, report: _Report) -> bool:
        """Return whether a report is from the view before: a slow page may send it after it was moved on."""
        return self.before is not None and bool(np.linalg.norm(report.position - self.before.position) < _MOVED_M)


class CameraView:
    """Keeps the view of every page at the camera of the state."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Follow the controller's state and the pages' canvases."""
        self._controller = controller
        self._views: dict[int, _PageView] = {}
        # One thread for states and reports, so that neither overtakes the other.
        self._latest: LatestWinsWorker[State | _Report] = LatestWinsWorker(self._take, "camera view")
        paused = ("drag", "is_pin_held", "pages_pausing_3d")
        blurred = ("pages_blurring_faces", "people")
        controller.subscribe(self._latest.offer, "snapped", "frame", "calibration", "footage", *paused, *blurred)
        server.on_client_connect(self._connected)
        server.on_client_disconnect(self._disconnected)

    @property
    def _cameras(self) -> list[Camera]:
        return [c.camera.pinhole for c in self._controller.session.cameras]

    async def _connected(self, client: viser.ClientHandle) -> None:
        self._views[client.client_id] = _PageView(client)

        async def moved(_: viser.CameraHandle) -> None:
            seen = client.camera  # as the page reported it
            # Each report has a key of its own. If only the newest counted, a view that is turned right after its
            # arrival would never arrive, and never leave the camera.
            report = _Report(client.client_id, seen.position, seen.wxyz)
            self._latest.offer(report, report)

        client.camera.on_update(moved)
        await moved(client.camera)

    async def _disconnected(self, client: viser.ClientHandle) -> None:
        self._views.pop(client.client_id, None)

    def _take(self, update: State | _Report) -> None:
        if isinstance(update, _Report):
            view = self._views.get(update.client)
            if view is not None:
                self._moved(view, update)
                self._update(view)
            return
        for view in list(self._views.values()):
            self._update(view)

    def _moved(self, view: _PageView, report: _Report) -> None:
        """Note that a view arrived at its camera, or left it."""
        if view.camera is None:
            return
        if _is_at(report.position, report.wxyz, self._cameras[view.camera]):
            view.arrived = True
        elif view.arrived and not view.is_back(report) and self._controller.state.snapped == view.camera:
            view.turned_away = True
            self._controller.view_3d.look_through_camera(None)

    def _update(self, view: _PageView) -> None:
        """Move a view to the camera of the state."""
        state = self._controller.state
        if state.snapped is None:
            self._release(view)
            return
        seen = view.client.camera
        size = (seen.image_width, seen.image_height)
        heads = (
            head_circles(self._controller.session, state.drawn, [state.snapped]) if state.pages_blurring_faces else []
        )
        wanted = (state.snapped, state.frame, size, state.calibration.n_changes, *heads)
        if wanted == view.shown or min(size) < _LEAST_PX or state.is_3d_paused:
            return
        camera = self._cameras[state.snapped]
        # A slow page may still report the camera that it is returning from.
        if view.camera is None and not (
            view.left is not None and _is_at(seen.position, seen.wxyz, self._cameras[view.left])
        ):
            view.before = _FreeView(seen.position, seen.look_at, seen.up_direction, seen.fov)
        image = without_faces(self._image(state.frame, state.snapped), heads, state.snapped)
        with view.client.atomic():
            if view.camera != state.snapped:
                view.arrived = _is_at(seen.position, seen.wxyz, camera)
                self._move_to(seen, camera)
            seen.fov = field_of_view(camera, size[0] / size[1])
            view.client.scene.set_background_image(
                centred(image, camera, size), format="jpeg", jpeg_quality=_JPEG_QUALITY
            )
        view.camera, view.turned_away, view.shown = state.snapped, False, wanted

    def _move_to(self, seen: viser.CameraHandle, camera: Camera) -> None:
        T = camera.T_world_camera
        seen.position = T[:3, 3]
        seen.wxyz = rigid.quaternion_from_matrix(T[:3, :3])
        # Turning the view from here orbits about what the cameras look at.
        depth = max(0.5, float(camera.depths(viewed_point(self._cameras))))
        seen.look_at = T[:3, 3] + depth * T[:3, 2]

    def _release(self, view: _PageView) -> None:
        if view.camera is None:
            return
        seen, before = view.client.camera, view.before
        with view.client.atomic():
            view.client.scene.set_background_image(None)
            if before is not None and not view.turned_away:
                seen.position, seen.look_at, seen.up_direction = before.position, before.look_at, before.up
                seen.fov = before.fov
                view.left = view.camera
            else:
                view.left = None
        view.camera, view.shown, view.arrived = None, (), False

    def _image(self, frame: int, camera: int) -> Image:
        image = self._controller.frames.images(frame)[camera]
        if image is not None:
            return image
        width, height = self._cameras[camera].size
        return np.full((height, width, 3), 24, np.uint8)  # a damaged frame; the pane says so


def _is_at(position: Array, wxyz: Array, camera: Camera) -> bool:
    T = camera.T_world_camera
    turn = rigid.so3_log(rigid.matrix_from_quaternion(wxyz).T @ T[:3, :3])
    return bool(np.linalg.norm(position - T[:3, 3]) < _MOVED_M and np.linalg.norm(turn) < _MOVED_RAD)
