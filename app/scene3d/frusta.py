"""Draw the cameras in the 3-D view: frusta with small images of the shown frame. A click looks through the camera."""

import time
from typing import Any

import numpy as np
import viser

from app.control.controller import Controller
from app.drawing.centred_image import aspect_around, centred, field_of_view
from app.drawing.joint_handles import HeadCircle, head_circles, without_faces
from app.runtime.jobs import LatestWinsWorker
from app.state.calibration import CalibrationState, CorrectedFrame
from app.state.state import State
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera

_SCALE_M = 0.25
_COLOR = (120, 130, 140)
_CORRECTED_COLOR = (230, 130, 30)
"""Of a camera as a preview corrects it: it stands out from the others and from both backgrounds."""
_CORRECTED_SCALE_M = 0.5
"""A frustum of the same size would lie on that of the present camera, which is turned by a degree or less."""
_WIDTH_PX = 192
_JPEG_QUALITY = 75
_REST_S = 0.35
"""Time from the change of frame to its images, so that the panes go first."""


class Frusta:
    """The frusta of all cameras of a session."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Add the frusta and follow the controller's state."""
        self._server, self._controller = server, controller
        self._cameras = [c.camera.pinhole for c in controller.session.cameras]
        self._n_changes = controller.state.calibration.n_changes
        self._corrected: list[viser.CameraFrustumHandle] = []
        self._previewed: CorrectedFrame | None = None
        self._shown: tuple[int, tuple[HeadCircle, ...]] | None = None  # the frame of the images, heads that are blurred
        self._handles = [self._add(index) for index in range(len(self._cameras))]
        self._labels = [server.scene.add_label(f"/cameras/{c.name}/name", c.name) for c in self._cameras]
        latest = LatestWinsWorker(self._show_images, "frusta")
        controller.subscribe(
            latest.offer, "frame", "view_3d", "calibration", "footage", "drag", "track", "search", "people",
            "pages_blurring_faces",
        )  # fmt: skip
        latest.offer(controller.state)

    def show(self, state: State) -> None:
        """Show or hide the cameras. Looking through a camera hides them, because they would cover its image."""
        self._show_calibration(state.calibration)
        is_shown = state.view_3d.cameras and state.snapped is None
        for handle, label in zip(self._handles, self._labels, strict=True):
            if handle.visible != is_shown:
                handle.visible = label.visible = is_shown

    def _show_calibration(self, found: CalibrationState) -> None:
        """Move the frusta to other cameras, and show the corrected ones of a preview beside them."""
        if found.n_changes != self._n_changes:
            self._n_changes = found.n_changes
            self._cameras = [c.camera.pinhole for c in self._controller.session.cameras]
            for handle, camera in zip(self._handles, self._cameras, strict=True):
                handle.fov = field_of_view(camera, aspect_around(camera))
                handle.wxyz = rigid.quaternion_from_matrix(camera.T_world_camera[:3, :3])
                handle.position = camera.T_world_camera[:3, 3]
        preview = found.preview if found.is_previewed else None
        if preview is not self._previewed:
            self._previewed = preview
            for handle in self._corrected:
                handle.remove()
            changed = () if preview is None else zip(self._cameras, preview.cameras, strict=True)
            self._corrected = [
                self._frustum(f"/corrected/{after.name}", after, _CORRECTED_COLOR, _CORRECTED_SCALE_M)
                for before, after in changed
                if not np.array_equal(before.T_world_camera, after.T_world_camera)
                or not np.array_equal(before.K, after.K)
            ]

    def _frustum(
        self, name: str, camera: Camera, color: tuple[int, int, int], scale_m: float = _SCALE_M
    ) -> viser.CameraFrustumHandle:
        aspect = aspect_around(camera)
        return self._server.scene.add_camera_frustum(
            name,
            fov=field_of_view(camera, aspect),
            aspect=aspect,
            scale=scale_m,
            thickness=1.5,
            thickness_units="screen",
            color=color,
            format="jpeg",
            jpeg_quality=_JPEG_QUALITY,
            wxyz=rigid.quaternion_from_matrix(camera.T_world_camera[:3, :3]),
            position=camera.T_world_camera[:3, 3],
            cast_shadow=False,
            receive_shadow=False,
        )

    def _add(self, index: int) -> viser.CameraFrustumHandle:
        handle = self._frustum(f"/cameras/{self._cameras[index].name}", self._cameras[index], _COLOR)

        @handle.on_click
        def _(_: Any) -> None:
            self._controller.view_3d.look_through_camera(index)

        return handle

    def _show_images(self, state: State) -> None:
        """Put the images of a frame into the frusta after it has been shown for a moment."""
        indices = range(len(self._cameras))
        heads = head_circles(self._controller.session, state.drawn, indices) if state.pages_blurring_faces else []
        wanted = (state.frame, tuple(heads)) if state.view_3d.images and state.view_3d.cameras else None
        if wanted == self._shown:
            return
        if wanted is not None:
            time.sleep(_REST_S)
            now = self._controller.state
            # A browser that renders in software has no time for them during a tracking run.
            if now.frame != state.frame or now.drag is not None or now.is_3d_throttled:
                return  # the next state asks again
        self._shown = wanted
        images = [None] * len(indices) if wanted is None else self._controller.frames.images(state.frame)
        small = []
        for index, (camera, image) in enumerate(zip(self._cameras, images, strict=True)):
            size = (_WIDTH_PX, round(_WIDTH_PX / aspect_around(camera)))
            small.append(None if image is None else centred(without_faces(image, heads, index), camera, size))
        with self._server.atomic():
            for handle, picture in zip(self._handles, small, strict=True):
                handle.image = picture
