"""Draw the state in viser's 3-D scene: bodies, predicted poses, trails, floor, cameras."""

from functools import partial

import numpy as np
import viser

from app.control.controller import Controller
from app.drawing.predicted_pose import prediction
from app.drawing.trails import Trails
from app.runtime.jobs import LatestWinsWorker
from app.scene3d.camera_view import CameraView
from app.scene3d.character_layer import CharacterLayer
from app.scene3d.frusta import Frusta
from app.scene3d.meshes import PeopleMeshes
from app.scene3d.throttle import Throttle
from app.scene3d.voxel_layer import VoxelLayer
from app.state.floor_picking import FloorState
from app.state.identity import ObjectIdentity
from app.state.state import State
from app.state.view_3d import View3d
from tracker.body.model import BodyModel
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera, viewed_point
from tracker.geometry.ground_plane import up_rotation
from tracker.session.session import Session

_REST_S = 0.08
"""Time between updates. Drawing the scene costs the browser more than the panes, which go first."""
_CELL_RGB, _SECTION_RGB = (112, 116, 122), (140, 145, 152)
"""Colours of the floor's lines, legible on black, on white and on an image."""
_PREDICTED_RGB = (150, 158, 172)
_PREDICTED_OPACITY = 0.35


class SceneView:
    """The 3-D view of a session."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Build the scene and follow the controller's state."""
        self._server, self._controller, self._session = server, controller, controller.session
        self._throttle = Throttle(controller)
        self._drawn_poses: tuple[object, ...] = ()
        self._drawn_prediction: tuple[object, ...] = ()
        self._drawn_trails: tuple[object, ...] = ()
        self._trails_version = controller.state.timeline_version
        self._appearance: tuple[View3d, frozenset[int], frozenset[int]] | None = None
        self._drawn_floor: tuple[object, ...] = ()
        self._grid = _add_surroundings(server, self._session)
        self._people = self._new_people(controller.state)
        self._models: tuple[BodyModel, ...] = controller.state.models
        self._predicted: PeopleMeshes | None = None
        self._present = controller.state.present
        self._trails = self._new_trails()
        self._frusta = Frusta(server, controller)
        self._characters, self._voxels = CharacterLayer(server, controller), VoxelLayer(server, controller)
        latest = LatestWinsWorker(self._show, "scene", _REST_S)
        controller.subscribe(latest.offer)
        latest.offer(controller.state)
        CameraView(server, controller)

    def _show(self, state: State) -> None:
        due = self._throttle.due(state)
        if due is None:
            return
        state = due.drawn
        with self._server.atomic():
            self._frusta.show(state)
            self._show_bodies(state)
            self._show_appearance(state)
            self._show_floor(state.floor)
            poses = tuple(map(ObjectIdentity, state.poses))
            if poses != self._drawn_poses:
                self._drawn_poses = poses
                self._people.pose(state.poses)
            self._show_prediction(state)
            self._show_trails(state)
            self._characters.show(due)
        self._voxels.show(due)

    def _show_bodies(self, state: State) -> None:
        """Rebuild the meshes when the sizes of a body change."""
        if state.models != self._models:
            self._models = state.models
            self._people.remove()
            self._people = self._new_people(state)
            self._drawn_poses, self._appearance = (), None
        if state.present != self._present:
            self._present = state.present
            if self._predicted is not None:
                self._predicted.remove()
                self._predicted = None
            self._drawn_prediction = ()
            self._trails, self._drawn_trails = self._new_trails(), ()

    def _new_people(self, state: State) -> PeopleMeshes:
        """Add the meshes of all people. A click selects the person, and the joint that moves the part."""
        parts = PeopleMeshes(self._server, "/people", self._controller.session_of(state).people)
        for person, handles in enumerate(parts.handles):
            points = self._controller.models[person].point_names
            for part, handle in enumerate(handles):
                handle.on_click(partial(self._clicked, person, points[part]))
        return parts

    def _clicked(self, person: int, point: str, _: object) -> None:
        self._controller.navigation.select(person, point)

    def _new_trails(self) -> list[Trails]:
        people = self._controller.session.people
        return [
            Trails(p.model, partial(self._controller.stored_poses.in_present_body, i)) for i, p in enumerate(people)
        ]

    def _show_appearance(self, state: State) -> None:
        others = frozenset(range(len(state.people))) - {state.person}
        appearance = (state.view_3d, state.people_not_drawn, others if state.visibility.solo else frozenset())
        if appearance == self._appearance:
            return
        self._appearance = appearance
        self._people.set_appearance(*appearance)
        self._grid.visible = state.view_3d.floor

    def _show_floor(self, floor: FloorState) -> None:
        """Move the grid to the floor, or to the plane that is previewed."""
        picking = floor.picking
        plane = floor.plane if picking is None or picking.plane is None else picking.plane
        floor_drawn = (floor.up, plane)
        if floor_drawn == self._drawn_floor:
            return
        R = up_rotation(floor.up, plane)
        self._drawn_floor = floor_drawn
        self._grid.wxyz = rigid.quaternion_from_matrix(R)
        self._grid.position = np.zeros(3) if plane is None else plane.origin_world
        if picking is None:  # a preview does not turn the view
            self._server.scene.set_up_direction(R[:, 2])

    def _show_prediction(self, state: State) -> None:
        backward = state.track.running and (state.track.last or 0) < (state.track.first or 0)
        hidden = state.visibility.hidden
        wanted = (state.view_3d.ghost, state.frame, state.timeline_version, state.settings.predict, backward, hidden)
        if wanted == self._drawn_prediction or (not state.view_3d.ghost and self._predicted is None):
            return
        self._drawn_prediction = wanted
        if not state.view_3d.ghost:
            self._controller.view_3d.note_prediction("")
            assert self._predicted is not None
            self._predicted.show_only(frozenset())
            return
        frame, settings = state.frame, state.settings.predict
        found = [
            prediction(p.model, partial(self._controller.stored_poses.in_present_body, i), frame, settings, backward)
            for i, p in enumerate(self._controller.session.people)
        ]
        several = len(found) > 1
        notes = [f"{p.name}: {f.why}" if several else f.why for p, f in zip(self._session.people, found, strict=True)]
        self._controller.view_3d.note_prediction("; ".join(notes))
        if self._predicted is None:
            people = self._controller.session.people
            self._predicted = PeopleMeshes(self._server, "/prediction", people, _PREDICTED_RGB, _PREDICTED_OPACITY)
        self._predicted.pose([f.values for f in found])
        self._predicted.show_only(frozenset(i for i, f in enumerate(found) if f.values is not None) - hidden)

    def _show_trails(self, state: State) -> None:
        view, version = state.view_3d, state.timeline_version
        hidden = state.visibility.hidden
        wanted = (view.trail_points, view.trail_frames, state.frame, version, hidden)
        if wanted == self._drawn_trails or (not view.trail_points and not self._drawn_trails):
            return
        self._drawn_trails = wanted
        if version != self._trails_version:
            changed = self._controller.stored_poses.timeline(self._trails_version)
            self._trails_version = version
            for trails in self._trails:
                trails.forget(changed)
        for index, (person, trails) in enumerate(zip(self._session.people, self._trails, strict=True)):
            shown = frozenset() if index in hidden else view.trail_points
            points, colors = trails.segments(state.frame, view.trail_frames, shown, self._session.n_frames)
            self._server.scene.add_line_segments(
                f"/trails/{person.name}", points, colors, thickness=2.5, thickness_units="screen"
            )


def _add_surroundings(server: viser.ViserServer, session: Session) -> viser.GridHandle:
    up = up_rotation(session.up, session.floor)[:, 2]
    server.scene.set_up_direction(up)
    _place_viewpoint(server, [c.camera for c in session.cameras], up)
    return server.scene.add_grid(
        "/floor",
        width=8.0,
        height=8.0,
        cell_size=0.5,
        section_size=1.0,
        cell_color=_CELL_RGB,
        section_color=_SECTION_RGB,
        shadow_opacity=0.0,  # shadows would double the work of a browser that renders in software
    )


def _place_viewpoint(server: viser.ViserServer, cameras: list[Camera], up: Array) -> None:
    """Look at the middle of what the cameras see, from beside and above the first camera."""
    middle = viewed_point(cameras)
    to_first = rigid.so3_exp(up * np.radians(25)) @ (cameras[0].center_world - middle)
    server.initial_camera.look_at = tuple(middle)
    server.initial_camera.position = tuple(middle + 0.9 * to_first)
    server.initial_camera.up = tuple(up)
