"""The 3-D view seen through a camera: at its calibrated pose, with its undistorted image behind the bodies.

Every page that is open has a canvas of its own size, so each is told its own field of view and gets its own image.
"""

from dataclasses import dataclass

import numpy as np
import viser

from app.control.controller import Controller
from app.drawing.centred_image import centred, field_of_view
from app.runtime.jobs import LatestWinsWorker
from app.state.state import State
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, Image
from tracker.geometry.cameras import Camera, viewed_point

_MOVED_M = 1e-3
_MOVED_RAD = 1e-3
"""Whoever turns or moves the view by more than this leaves the camera."""
_LEAST_PX = 16
"""A canvas smaller than this is not seen."""
_JPEG_QUALITY = 88


@dataclass(frozen=True)
class _Free:
    """Where the view was before it was snapped."""

    position: Array
    look_at: Array
    up: Array
    fov: float


@dataclass(frozen=True, eq=False)
class _Report:
    """Where a page says that its view is; each is one of its own, wherever the view is."""

    client: int
    position: Array
    wxyz: Array


@dataclass
class _Eye:
    """The view of one page."""

    client: viser.ClientHandle
    camera: int | None = None
    """The camera it was sent to."""
    arrived: bool = False
    """Whether it has said that it is there: what it says of earlier places on the way counts for nothing."""
    shown: tuple[object, ...] = ()
    """Camera, frame and canvas of the image behind the bodies."""
    before: _Free | None = None
    """Where it was before, kept when it has been sent back there."""
    left: int | None = None
    """The camera that it was sent back from."""
    turned_away: bool = False
    """Whether it left the camera by its user's hand, who wants to go on from there."""

    def is_back(self, report: _Report) -> bool:
        """Whether it says that it is where it came from: a slow page says so late, when it has been sent on again."""
        return self.before is not None and bool(np.linalg.norm(report.position - self.before.position) < _MOVED_M)


class SnapView:
    """Keeps the view of every page at the camera that the state says."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Follow the controller's state and the pages' canvases."""
        self._controller = controller
        self._cameras = [c.camera for c in controller.session.cameras]
        self._eyes: dict[int, _Eye] = {}
        # One thread for states and for what pages report, so that neither overtakes the other.
        self._latest: LatestWinsWorker[State | _Report] = LatestWinsWorker(self._take, "snap")
        controller.subscribe(self._latest.offer)
        server.on_client_connect(self._connected)
        server.on_client_disconnect(self._disconnected)

    async def _connected(self, client: viser.ClientHandle) -> None:
        self._eyes[client.client_id] = _Eye(client)

        async def moved(_: viser.CameraHandle) -> None:
            seen = client.camera  # what is read here the page has said: nothing of ours is in between
            # Each under a key of its own, for each counts: if only the newest did, one who arrives and turns at once
            # would never have arrived, and never get away from the camera.
            report = _Report(client.client_id, seen.position, seen.wxyz)
            self._latest.offer(report, report)

        client.camera.on_update(moved)
        await moved(client.camera)

    async def _disconnected(self, client: viser.ClientHandle) -> None:
        self._eyes.pop(client.client_id, None)

    def _take(self, told: State | _Report) -> None:
        if isinstance(told, _Report):
            eye = self._eyes.get(told.client)
            if eye is not None:
                self._moved(eye, told)
                self._look(eye)
            return
        for eye in list(self._eyes.values()):
            self._look(eye)

    def _moved(self, eye: _Eye, report: _Report) -> None:
        """See whether a view has arrived at its camera, or has left it."""
        if eye.camera is None:
            return
        if _is_at(report.position, report.wxyz, self._cameras[eye.camera]):
            eye.arrived = True
        elif eye.arrived and not eye.is_back(report) and self._controller.state.snapped == eye.camera:
            eye.turned_away = True
            self._controller.view_3d.snap(None)

    def _look(self, eye: _Eye) -> None:
        """Bring a view to where the state says."""
        state = self._controller.state
        if state.snapped is None:
            self._release(eye)
            return
        seen = eye.client.camera
        size = (seen.image_width, seen.image_height)
        wanted = (state.snapped, state.frame, size)
        if wanted == eye.shown or min(size) < _LEAST_PX or state.is_3d_paused:
            return
        camera = self._cameras[state.snapped]
        # A slow page may still say that it is at the camera from which it has been sent back: it is on its way then.
        if eye.camera is None and not (
            eye.left is not None and _is_at(seen.position, seen.wxyz, self._cameras[eye.left])
        ):
            eye.before = _Free(seen.position, seen.look_at, seen.up_direction, seen.fov)
        image = self._image(state.frame, state.snapped)
        with eye.client.atomic():
            if eye.camera != state.snapped:
                eye.arrived = _is_at(seen.position, seen.wxyz, camera)
                self._send_to(seen, camera)
            seen.fov = field_of_view(camera, size[0] / size[1])
            eye.client.scene.set_background_image(
                centred(image, camera.pinhole, size), format="jpeg", jpeg_quality=_JPEG_QUALITY
            )
        eye.camera, eye.turned_away, eye.shown = state.snapped, False, wanted

    def _send_to(self, seen: viser.CameraHandle, camera: Camera) -> None:
        T = camera.T_world_camera
        seen.position = T[:3, 3]
        seen.wxyz = rigid.quaternion_from_matrix(T[:3, :3])
        # Whoever turns the view from here turns it about what the cameras look at.
        depth = max(0.5, float(camera.depths(viewed_point(self._cameras))))
        seen.look_at = T[:3, 3] + depth * T[:3, 2]

    def _release(self, eye: _Eye) -> None:
        if eye.camera is None:
            return
        seen, before = eye.client.camera, eye.before
        with eye.client.atomic():
            eye.client.scene.set_background_image(None)
            if before is not None and not eye.turned_away:
                seen.position, seen.look_at, seen.up_direction = before.position, before.look_at, before.up
                seen.fov = before.fov
                eye.left = eye.camera
            else:
                eye.left = None
        eye.camera, eye.shown, eye.arrived = None, (), False

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
