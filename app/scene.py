"""State to viser's 3-D scene: bodies, cameras, floor."""

import time

import numpy as np
import viser

from app.controller import Controller
from app.jobs import Latest
from app.state import State
from tracker import rigid
from tracker.body import Body
from tracker.cameras import Camera, viewed_point
from tracker.contours import part_poses
from tracker.posing import UP_ROTATIONS
from tracker.session import Session

_FRUSTUM_M = 0.25
_REST_S = 0.08
"""Time between updates: drawing the scene costs the browser more than drawing the panes, which go first."""
_SLOW_REST_S = 1.0
"""The same while a tracker runs and a page draws the scene without a graphics card."""


class Scene:
    """The 3-D view of a session."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Build the scene and follow the controller's state."""
        self._server, self._session = server, controller.session
        self._shown: tuple[object, ...] = ()
        self._shown_at = 0.0
        _add_surroundings(server, self._session)
        self._parts = [
            server.scene.add_mesh_simple(
                f"/people/{person.name}/{part.name}",
                np.asarray(shape.mesh().vertices) + center,
                np.asarray(shape.mesh().faces),
                color=_rgb(part.color),
                cast_shadow=False,
            )
            for person in self._session.people
            for part, shape, center in zip(
                person.model.parts, person.model.shapes, person.model.centers_part, strict=True
            )
        ]
        latest = Latest(self._show, "scene", _REST_S)
        controller.subscribe(latest.offer)
        latest.offer(controller.state)

    def _show(self, state: State) -> None:
        state = state.drawn
        poses = tuple(id(p) for p in state.poses)
        is_slow = state.track.running and bool(state.holding_3d)
        if poses == self._shown or state.rests_3d or (is_slow and time.monotonic() < self._shown_at + _SLOW_REST_S):
            return
        self._shown, self._shown_at = poses, time.monotonic()
        bodies = [Body(p.model, v) for p, v in zip(self._session.people, state.poses, strict=True)]
        Ts = part_poses(bodies)
        turns = rigid.quaternion_from_matrix(Ts[:, :3, :3])
        with self._server.atomic():
            for handle, T, wxyz in zip(self._parts, Ts, turns, strict=True):
                handle.position, handle.wxyz = T[:3, 3], wxyz


def _add_surroundings(server: viser.ViserServer, session: Session) -> None:
    cameras = [c.camera for c in session.cameras]
    sign = "" if session.up.startswith("-") else "+"
    server.scene.set_up_direction(f"{sign}{session.up}")  # type: ignore[arg-type]
    server.scene.add_grid(
        "/floor",
        width=8.0,
        height=8.0,
        cell_size=0.5,
        section_size=1.0,
        wxyz=rigid.quaternion_from_matrix(UP_ROTATIONS[session.up]),
        shadow_opacity=0.0,  # shadows would double the work of a browser without a graphics card
    )
    for camera in cameras:
        T = camera.T_world_camera
        server.scene.add_camera_frustum(
            f"/cameras/{camera.name}",
            fov=2 * float(np.arctan2(camera.height / 2, camera.K[1, 1])),
            aspect=camera.width / camera.height,
            scale=_FRUSTUM_M,
            color=(120, 130, 140),
            wxyz=rigid.quaternion_from_matrix(T[:3, :3]),
            position=T[:3, 3],
        )
        server.scene.add_label(f"/cameras/{camera.name}/name", camera.name)
    _place_eye(server, cameras, session.up)


def _place_eye(server: viser.ViserServer, cameras: list[Camera], up: str) -> None:
    """Look at the middle of what the cameras see, from beside and above the first."""
    middle = viewed_point(cameras)
    to_first = rigid.so3_exp(UP_ROTATIONS[up][:, 2] * np.radians(25)) @ (cameras[0].center_world - middle)
    server.initial_camera.look_at = tuple(middle)
    server.initial_camera.position = tuple(middle + 0.9 * to_first)
    server.initial_camera.up = tuple(UP_ROTATIONS[up][:, 2])


def _rgb(color: str) -> tuple[int, int, int]:
    return int(color[1:3], 16), int(color[3:5], 16), int(color[5:7], 16)
