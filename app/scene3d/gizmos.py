"""Gizmos in the 3-D view: one moves and turns the root of the person worked on, one turns the selected joint."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import viser

from app.control.controller import Controller
from app.runtime.jobs import LatestWinsWorker
from app.scene3d.throttle import Throttle
from app.state.state import State
from tracker.estimation.posing.edits import joint_of
from tracker.geometry import rigid
from tracker.geometry.arrays import Array

_ROOT_SCALE, _JOINT_SCALE = 0.3, 0.2
_REST_S = 0.1
"""Time between updates of the gizmos' positions."""

_Which = Literal["root", "joint"]


@dataclass(frozen=True, eq=False)
class _Pull:
    """A move of a gizmo."""

    which: _Which
    drag: int
    """Number of the drag that it belongs to."""
    person: int
    part: int
    position_world: Array
    """(3,), metres."""
    R_world: Array
    """(3, 3)."""
    ended: bool


class Gizmos:
    """The gizmos. They follow the state, and their moves go to the controller."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Add the gizmos and follow the controller's state."""
        self._server, self._controller = server, controller
        self._held: _Which | None = None
        self._drags = 0
        self._about: dict[_Which, tuple[int, int]] = {"root": (0, 0), "joint": (0, 0)}  # person, part
        add = server.scene.add_transform_controls
        self._handles: dict[_Which, viser.TransformControlsHandle] = {
            "root": add("/gizmos/root", _ROOT_SCALE, disable_sliders=True, depth_test=False, visible=False),
            "joint": add(
                "/gizmos/joint", _JOINT_SCALE, disable_axes=True, disable_sliders=True, depth_test=False, visible=False
            ),
        }
        self._pulls, self._throttle = LatestWinsWorker(self._apply, "gizmos"), Throttle(controller)
        for which, handle in self._handles.items():
            self._listen(which, handle)
        latest = LatestWinsWorker(self._show, "gizmo positions", _REST_S)
        controller.subscribe(latest.offer)
        latest.offer(controller.state)

    def _listen(self, which: _Which, handle: viser.TransformControlsHandle) -> None:
        @handle.on_update
        async def _(event: Any) -> None:
            if event.phase == "start":
                self._held, self._drags = which, self._drags + 1
                return
            R = rigid.matrix_from_quaternion(np.array(event.target.wxyz))
            person, part = self._about[which]
            position = np.array(event.target.position, dtype=np.float64)
            # The end has a key of its own, so that no newer pull replaces it.
            ended = event.phase == "end"
            self._pulls.offer(_Pull(which, self._drags, person, part, position, R, ended), (which, ended))

    def _apply(self, pull: _Pull) -> None:
        position = pull.position_world if pull.which == "root" else None
        self._controller.pose_edits.place_part(pull.person, pull.part, pull.R_world, position, ("gizmo", pull.drag))
        if pull.ended:
            self._held = None
            self._show(self._controller.state)  # the joint may be at a limit

    def _show(self, state: State) -> None:
        due = self._throttle.due(state)
        if due is None:
            return
        state = due
        model, values = state.models[state.person], state.poses[state.person]
        joint = joint_of(model, state.point)
        Ts = model.kinematics(values).Ts_world_part
        is_busy = state.track.running or state.search.running or not state.is_stored_drawn
        shown = not is_busy and state.person not in state.people_not_drawn
        with self._server.atomic():
            for which, part in (("root", 0), ("joint", joint)):
                handle = self._handles[which]
                visible = shown and state.view_3d.gizmos and (which == "root" or joint != 0)
                if handle.visible != visible:
                    handle.visible = visible
                if which == self._held or not visible:
                    continue
                self._about[which] = state.person, part
                handle.position = Ts[part, :3, 3]
                handle.wxyz = rigid.quaternion_from_matrix(Ts[part, :3, :3])
