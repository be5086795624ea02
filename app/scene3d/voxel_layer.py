"""Draw the voxels of the shown frame in the 3-D view, in the colours of their parts (MTHC01 Fig. 7)."""

from collections.abc import Sequence

import numpy as np
import viser
from numpy.typing import NDArray

from app.control.controller import Controller
from app.drawing.overlay_colors import rgb
from app.remedies import page_text
from app.runtime.jobs import LatestWinsWorker
from app.state.identity import ObjectIdentity
from app.state.state import State
from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.estimation.voxel.body_pose import state_of
from tracker.estimation.voxel.figure import N_PARTS, figure_of
from tracker.estimation.voxel.labels import LabelRule, label_voxels
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.evidence.silhouettes import SilhouetteFinder
from tracker.evidence.voxels.shadows import recover_from_shadows
from tracker.evidence.voxels.visual_hull import carve_people
from tracker.footage.camera_source import CameraSource
from tracker.geometry.arrays import Array
from tracker.geometry.ground_plane import floor_plane

_VOXEL_M = 0.03
"""Edge of the voxels, metres."""
_FREE_RGB = (150, 150, 150)
"""Colour of voxels that belong to no part."""
_REST_S = 0.1
"""Time between updates, so that panes go first."""


class VoxelLayer:
    """The voxels of the shown frame. They are carved and labelled in a thread of their own."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Find no silhouettes before the layer is switched on."""
        self._server, self._controller = server, controller
        self._finder: tuple[Sequence[CameraSource], SilhouetteFinder] | None = None  # with the cameras that it is of
        self._drawn: tuple[object, ...] = ()
        self._latest = LatestWinsWorker(self._show, "voxels", _REST_S)
        self._was_on = False

    def show(self, state: State) -> None:
        """Draw the voxels of a state, if they are switched on, in their own thread."""
        if state.view_3d.voxels or self._was_on:
            self._latest.offer(state)
        self._was_on = state.view_3d.voxels

    def _show(self, state: State) -> None:
        if not state.view_3d.voxels or state.drag is not None or state.is_3d_throttled:
            if not state.view_3d.voxels and self._drawn:
                self._drawn = ()
                self._draw(np.zeros((0, 3)), np.zeros((0, 3), np.uint8), "")
            return
        wanted = (state.frame, state.calibration.n_changes, *map(ObjectIdentity, state.poses), state.models)
        if wanted == self._drawn:
            return
        self._drawn = wanted
        try:
            points = self._carved(state.frame)
        except TrackerError as error:  # of an empty scene, a camera that has moved, unreadable footage
            self._draw(np.zeros((0, 3)), np.zeros((0, 3), np.uint8), f"No voxels: {page_text(error)}")
            return
        self._draw(points, part_colors(points, state.models, state.poses), "")

    def _carved(self, frame: int) -> Array:
        """Return the surface voxels of all people on a frame, (N, 3), metres."""
        session = self._controller.session
        if self._finder is None or self._finder[0] is not session.cameras:
            recording = self._controller.frames.observer.recording
            if self._finder is not None:
                self._finder[1].close()
            self._finder = session.cameras, SilhouetteFinder(session.cameras, recording)
        silhouettes, floor = self._finder[1].silhouettes(frame), floor_plane(session.up, session.floor)
        hull = carve_people(recover_from_shadows(silhouettes, floor, _VOXEL_M), _VOXEL_M)
        return np.concatenate([f.points_world[f.is_surface] for f in hull.figures])

    def _draw(self, points: Array, colors: NDArray[np.uint8], note: str) -> None:
        with self._server.atomic():
            self._server.scene.add_point_cloud(
                "/voxels/points", points.astype(np.float32), colors, point_size=_VOXEL_M, precision="float32"
            )
            self._server.scene.add_label("/voxels/note", note, visible=bool(note))


def part_colors(points: Array, models: Sequence[BodyModel], poses: Sequence[Array | None]) -> NDArray[np.uint8]:
    """Return the colour of each voxel, (N, 3): that of the part that it belongs to, grey where none is near.

    Args:
        points: centres of voxels, (N, 3), metres.
        models: the body of each person.
        poses: of each person, (n_values,); None for a person without a pose on the frame.
    """
    settings, states, colors = VoxelSettings(), [], [_FREE_RGB]
    for model, pose in zip(models, poses, strict=True):
        try:
            members = figure_of(model).members
        except TrackerError:  # a body without the joints of ten parts colours nothing
            continue
        if pose is not None:
            states.append(state_of(model, [pose], 1.0, settings))
            colors += [rgb(model.parts[members[k][0]].color) for k in range(N_PARTS)]
    out = np.array(colors, dtype=np.uint8)
    if not states:
        return np.broadcast_to(out[0], points.shape).copy()
    rule = LabelRule(np.inf if settings.gate is None else settings.gate)
    return out[label_voxels(points, states, _VOXEL_M, rule).labels + 1]
