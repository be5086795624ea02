"""Panels beside the 3-D view: pose sliders, and the panels of body sizes and settings."""

from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser

from app.control.controller import Controller
from app.runtime.jobs import LatestWinsWorker
from app.scene3d.body_panel import BodyPanel
from app.scene3d.settings_panel import SettingsPanel
from app.scene3d.throttle import Throttle
from app.state.state import State
from tracker.body.model import BodyModel
from tracker.errors import TrackerError

_REACH_M = 6.0
"""Reach of the position sliders to either side of the initial position, metres."""
_REST_S = 0.2
"""Time between updates of the sliders. Nobody reads numbers faster, and the panes go first."""


@dataclass(frozen=True)
class _Change:
    """A move of a slider."""

    person: int
    dof: int
    value: float
    """Radians or metres."""


class Panels:
    """The panels. They show the state, and what is entered goes to the controller."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Build the panels and follow the controller's state."""
        self._server, self._controller = server, controller
        self._throttle = Throttle(controller)
        self._edits = LatestWinsWorker(self._apply, "sliders")
        self._sliders: list[list[viser.GuiSliderHandle[float]]] = []
        self._folders: list[viser.GuiFolderHandle] = []
        middle = controller.state.people[0].values[:3]
        for index, person in enumerate(controller.session.people):
            folder = server.gui.add_folder(f"Pose of {person.name}", expand_by_default=False)
            with folder:
                self._sliders.append(self._add_sliders(index, person.model, middle))
            self._folders.append(folder)
        self._body = BodyPanel(server, controller)
        self._settings = SettingsPanel(server, controller)
        latest = LatestWinsWorker(self._show, "panels", _REST_S)
        controller.subscribe(latest.offer)
        latest.offer(controller.state)

    def _add_sliders(self, person: int, model: BodyModel, middle: np.ndarray) -> list[viser.GuiSliderHandle[float]]:
        sliders = []
        for joint_index, joint in enumerate(model.joints):
            dofs = np.flatnonzero(model.dof_joint == joint_index)
            if not len(dofs) or joint.kind == "ball":
                continue
            with self._server.gui.add_folder(joint.name.replace("_", " "), expand_by_default=joint_index == 0):
                for dof in dofs:
                    sliders.append(self._add_slider(person, model, int(dof), middle))
        return sliders

    def _add_slider(self, person: int, model: BodyModel, dof: int, middle: np.ndarray) -> viser.GuiSliderHandle[float]:
        name = model.dof_names[dof].partition(".")[2]
        if model.dof_is_length[dof]:
            low, high, unit, step = 100 * (middle[dof] - _REACH_M), 100 * (middle[dof] + _REACH_M), "cm", 0.5
        else:
            low, high = np.degrees(np.clip(model.limits[dof], -np.pi, np.pi))
            unit, step = "deg", 0.5
        low, high = float(np.floor(low)), float(np.ceil(high))
        value = _slider_value(model, dof, self._controller.state.poses[person])
        slider = self._server.gui.add_slider(f"{name}, {unit}", low, high, step, min(max(value, low), high))

        @slider.on_update
        async def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:  # otherwise the program set it
                target = event.target.value / 100 if model.dof_is_length[dof] else float(np.radians(event.target.value))
                self._edits.offer(_Change(person, dof, target), (person, dof))

        return slider

    def _apply(self, change: _Change) -> None:
        with suppress(TrackerError):  # locked: the slider returns to the state's value
            self._controller.pose_edits.set_dof(change.person, change.dof, change.value)
        self._show(self._controller.state)

    def _show(self, state: State) -> None:
        due = self._throttle.due(state)
        if due is None:
            return
        state = due
        with self._server.atomic():
            self._settings.show(state.settings)
            self._body.show(state)
            for index, (sliders, folder) in enumerate(zip(self._sliders, self._folders, strict=True)):
                folder.visible = index == state.person
                model = self._controller.models[index]
                plain = [d for d in range(model.n_dofs) if model.joints[model.dof_joint[d]].kind != "ball"]
                for slider, dof in zip(sliders, plain, strict=True):
                    value = _slider_value(model, dof, state.poses[index])
                    slider.disabled = dof in state.locked[index]
                    shown = min(max(value, slider.min), slider.max)
                    if abs(slider.value - shown) > 1e-6:
                        slider.value = shown  # type: ignore[misc]


def _slider_value(model: BodyModel, dof: int, values: np.ndarray) -> float:
    """Return a degree of freedom in degrees or centimetres. Angles without limits are wrapped to [-180, 180)."""
    value = float(values[model.dof_value[dof]])
    if model.dof_is_length[dof]:
        return round(100 * value, 2)
    if not np.all(np.isfinite(model.limits[dof])):
        value = float((value + np.pi) % (2 * np.pi) - np.pi)
    return round(float(np.degrees(value)), 2)
