"""State to viser's 3-D scene: bodies, the ghost of the prediction, trails, floor, cameras."""

from collections.abc import Sequence
from functools import partial

import numpy as np
import viser

from app.control.controller import Controller
from app.drawing.predicted_pose import prediction
from app.drawing.trails import Trails
from app.runtime.jobs import LatestWinsWorker
from app.scene3d.camera_view import SnapView
from app.scene3d.frusta import Frusta
from app.scene3d.pace import Pace
from app.scene3d.view_panel import ViewPanel
from app.state.floor_picking import FloorState
from app.state.state import State
from app.state.view_3d import View3d
from tracker.body.model import BodyModel, PosedBody
from tracker.contours.occluding_contours import part_poses
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera, viewed_point
from tracker.geometry.ground_plane import up_rotation
from tracker.session.session import Session

_REST_S = 0.08
"""Time between updates: drawing the scene costs the browser more than drawing the panes, which go first."""
_CELL_RGB, _SECTION_RGB = (112, 116, 122), (140, 145, 152)
"""Lines of the floor, legible before black, white and an image."""
_GHOST_RGB = (150, 158, 172)
_GHOST_OPACITY = 0.35
_DIMMED = 0.2
"""Opacity of people who are dimmed, as a share of the others'."""


class Scene:
    """The 3-D view of a session."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Build the scene and follow the controller's state."""
        self._server, self._controller, self._session = server, controller, controller.session
        self._pace = Pace(controller)
        self._posed: tuple[object, ...] = ()
        self._expected: tuple[object, ...] = ()
        self._trailed: tuple[object, ...] = ()
        self._trails_version = controller.state.timeline_version
        self._look: tuple[View3d, frozenset[int], frozenset[int]] | None = None
        self._laid: tuple[object, ...] = ()
        self._panel = ViewPanel(server, controller)
        self._grid = _add_surroundings(server, self._session)
        self._parts = self._new_people(controller.state)
        self._shape: tuple[BodyModel, ...] = controller.state.models
        self._ghost: _Parts | None = None
        self._present = controller.state.present
        self._trails = self._new_trails()
        self._frusta = Frusta(server, controller)
        latest = LatestWinsWorker(self._show, "scene", _REST_S)
        controller.subscribe(latest.offer)
        latest.offer(controller.state)
        SnapView(server, controller)

    def _show(self, state: State) -> None:
        due = self._pace.due(state)
        if due is None:
            return
        state = due.drawn
        with self._server.atomic():
            self._frusta.show(state)
            self._show_bodies(state)
            self._show_look(state)
            self._show_floor(state.floor)
            poses = tuple(id(p) for p in state.poses)
            if poses != self._posed:
                self._posed = poses
                self._parts.pose(state.poses)
            self._show_ghost(state)
            self._show_trails(state)

    def _show_bodies(self, state: State) -> None:
        """Make the meshes anew where somebody is shown in a body of other sizes than before."""
        if state.models != self._shape:
            self._shape = state.models
            self._parts.remove()
            self._parts = self._new_people(state)
            self._posed, self._look = (), None
        if state.present != self._present:
            self._present = state.present
            if self._ghost is not None:
                self._ghost.remove()
                self._ghost = None
            self._expected = ()
            self._trails, self._trailed = self._new_trails(), ()

    def _new_people(self, state: State) -> "_Parts":
        """The meshes of everybody; a click on one works on that person, and on the joint that moves the part."""
        parts = _Parts(self._server, "/people", self._controller.session_of(state))
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

    def _show_look(self, state: State) -> None:
        others = frozenset(range(len(state.people))) - {state.person}
        look = (state.view_3d, state.visibility.hidden, others if state.visibility.solo else frozenset())
        if look == self._look:
            return
        self._look = look
        self._parts.look(*look)
        self._grid.visible = state.view_3d.floor

    def _show_floor(self, floor: FloorState) -> None:
        """Lay the grid on the floor, or on the plane that is previewed."""
        picking = floor.picking
        plane = floor.plane if picking is None or picking.plane is None else picking.plane
        laid = (floor.up, plane)
        if laid == self._laid:
            return
        R = up_rotation(floor.up, plane)
        self._laid = laid
        self._grid.wxyz = rigid.quaternion_from_matrix(R)
        self._grid.position = np.zeros(3) if plane is None else plane.origin_world
        if picking is None:  # a preview turns nobody's view
            self._server.scene.set_up_direction(R[:, 2])

    def _show_ghost(self, state: State) -> None:
        backward = state.track.running and (state.track.last or 0) < (state.track.first or 0)
        hidden = state.visibility.hidden
        wanted = (state.view_3d.ghost, state.frame, state.timeline_version, state.settings.predict, backward, hidden)
        if wanted == self._expected or (not state.view_3d.ghost and self._ghost is None):
            return
        self._expected = wanted
        if not state.view_3d.ghost:
            self._panel.say_of_ghost("")
            assert self._ghost is not None
            self._ghost.hide()
            return
        frame, settings = state.frame, state.settings.predict
        found = [
            prediction(p.model, partial(self._controller.stored_poses.in_present_body, i), frame, settings, backward)
            for i, p in enumerate(self._controller.session.people)
        ]
        several = len(found) > 1
        told = [f"{p.name}: {f.why}" if several else f.why for p, f in zip(self._session.people, found, strict=True)]
        self._panel.say_of_ghost("; ".join(told))
        if self._ghost is None:
            self._ghost = _Parts(self._server, "/prediction", self._controller.session, _GHOST_RGB, _GHOST_OPACITY)
        self._ghost.pose([f.values for f in found])
        for index, (handles, expected) in enumerate(zip(self._ghost.handles, found, strict=True)):
            _set_visible(handles, expected.values is not None and index not in hidden)

    def _show_trails(self, state: State) -> None:
        view, version = state.view_3d, state.timeline_version
        hidden = state.visibility.hidden
        wanted = (view.trail_points, view.trail_frames, state.frame, version, hidden)
        if wanted == self._trailed or (not view.trail_points and not self._trailed):
            return
        self._trailed = wanted
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


class _Parts:
    """The parts of everybody as meshes."""

    def __init__(
        self,
        server: viser.ViserServer,
        root: str,
        session: Session,
        color: tuple[int, int, int] | None = None,
        opacity: float | None = None,
    ) -> None:
        """Add the meshes below a node of the scene.

        Args:
            server: whose scene.
            root: name of the node.
            session: with the people.
            color: of all of them; by part by default.
            opacity: of all of them; opaque by default.
        """
        self._people = session.people
        self.handles = [
            [
                server.scene.add_mesh_simple(
                    f"{root}/{person.name}/{part.name}",
                    shape.triangles().vertices + center,
                    shape.triangles().faces,
                    color=color or _rgb(part.color),
                    opacity=opacity,
                    cast_shadow=False,
                    receive_shadow=False,
                )
                for part, shape, center in zip(
                    person.model.parts, person.model.shapes, person.model.centers_part, strict=True
                )
            ]
            for person in self._people
        ]
        """Of each person the meshes of the parts."""

    def pose(self, poses: Sequence[Array | None]) -> None:
        """Put everybody where a pose, (n_values,), says; who has none stays. Nobody is shown or hidden by it."""
        for person, handles, values in zip(self._people, self.handles, poses, strict=True):
            if values is not None:
                Ts = part_poses([PosedBody(person.model, values)])
                turns = rigid.quaternion_from_matrix(Ts[:, :3, :3])
                for handle, T, wxyz in zip(handles, Ts, turns, strict=True):
                    handle.position, handle.wxyz = T[:3, 3], wxyz

    def remove(self) -> None:
        """Take the meshes out of the scene."""
        for handles in self.handles:
            for handle in handles:
                handle.remove()

    def hide(self) -> None:
        """Hide everybody."""
        for handles in self.handles:
            _set_visible(handles, False)

    def look(self, view: View3d, hidden: frozenset[int], dimmed: frozenset[int]) -> None:
        """Show, colour and make translucent as a view says; but for people, by index, who are hidden or dimmed."""
        for index, (person, handles) in enumerate(zip(self._people, self.handles, strict=True)):
            opacity = _DIMMED * view.opacity if index in dimmed else view.opacity
            for part, handle in zip(person.model.parts, handles, strict=True):
                handle.color = _rgb(part.color if view.colors == "parts" else person.color)
                handle.opacity = None if opacity >= 1 else opacity
            _set_visible(handles, view.bodies and index not in hidden)


def _set_visible(handles: Sequence[viser.MeshHandle], visible: bool) -> None:
    for handle in handles:
        if handle.visible != visible:
            handle.visible = visible


def _add_surroundings(server: viser.ViserServer, session: Session) -> viser.GridHandle:
    up = up_rotation(session.up, session.floor)[:, 2]
    server.scene.set_up_direction(up)
    _place_eye(server, [c.camera for c in session.cameras], up)
    return server.scene.add_grid(
        "/floor",
        width=8.0,
        height=8.0,
        cell_size=0.5,
        section_size=1.0,
        cell_color=_CELL_RGB,
        section_color=_SECTION_RGB,
        shadow_opacity=0.0,  # shadows would double the work of a browser without a graphics card
    )


def _place_eye(server: viser.ViserServer, cameras: list[Camera], up: Array) -> None:
    """Look at the middle of what the cameras see, from beside and above the first."""
    middle = viewed_point(cameras)
    to_first = rigid.so3_exp(up * np.radians(25)) @ (cameras[0].center_world - middle)
    server.initial_camera.look_at = tuple(middle)
    server.initial_camera.position = tuple(middle + 0.9 * to_first)
    server.initial_camera.up = tuple(up)


def _rgb(color: str) -> tuple[int, int, int]:
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)
