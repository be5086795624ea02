"""Panel folder "View": the camera to look through, and what the 3-D view draws."""

from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from app.control.controller import Controller
from app.runtime.jobs import LatestWinsWorker
from app.state.floor_picking import FloorState
from app.state.state import State
from app.state.view_3d import MAX_TRAIL_FRAMES
from tracker.errors import TrackerError
from tracker.posing.grab import minor_points

_FREE = "free"
_COLORS = {"parts": "parts", "people": "people"}
_REST_S = 0.1


class ViewPanel:
    """The folder. It shows the state, and what is chosen goes to the controller."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Build the folder and follow the controller's state."""
        self._server, self._controller = server, controller
        self._choices = LatestWinsWorker(self._choose, "view")
        view = controller.state.view_3d
        gui = server.gui
        with gui.add_folder("View", expand_by_default=False):
            self._camera = gui.add_dropdown(
                "look through",
                (_FREE, *(c.camera.name for c in controller.session.cameras)),
                hint="Look through a camera, its image behind the bodies (Y: the camera under the pointer). "
                "Turning the view leaves it",
            )
            self._controls: dict[str, Any] = {
                "bodies": gui.add_checkbox("bodies", view.bodies, hint="Draw the bodies"),
                "colors": gui.add_dropdown(
                    "colours by", tuple(_COLORS.values()), initial_value=_COLORS[view.colors],
                    hint="Each part, or each person, in a colour of its own",
                ),
                "opacity": gui.add_slider(
                    "opacity", 0.1, 1.0, 0.05, view.opacity, hint="Lower it to see what the bodies hide"
                ),
                "cameras": gui.add_checkbox(
                    "cameras", view.cameras, hint="Draw the cameras; a click on one looks through it"
                ),
                "images": gui.add_checkbox(
                    "camera images", view.images, hint="Show the image of each camera, a moment after the frame changes"
                ),
                "floor": gui.add_checkbox("floor", view.floor, hint="Draw a grid on the floor, a line every 50 cm"),
                "gizmos": gui.add_checkbox(
                    "gizmos", view.gizmos, hint="Draw the handles that move the body and turn the selected joint"
                ),
                "ghost": gui.add_checkbox(
                    "prediction", view.ghost,
                    hint="Draw in grey the pose that the tracker predicts here, from the poses before",
                ),
            }  # fmt: skip
            self._floor = gui.add_markdown("")
            self._set_floor = gui.add_button(
                "Set the floor", hint="Click three points of the floor in the views (Shift+Y)"
            )
            self._previous_floor = gui.add_button("Previous floor", hint="Restore the floor before the last change")
            self._ghost = gui.add_markdown("")
            self._ghost.visible = False
            self._points = self._add_trails()
        self._shown: dict[str, object] = {}  # the last value of each control in the state
        self._listen()
        latest = LatestWinsWorker(self._show, "view panel", _REST_S)
        controller.subscribe(latest.offer)
        latest.offer(controller.state)

    def set_prediction_note(self, text: str) -> None:
        """Show the frames that the prediction was made from, or why there is none; empty hides the note."""
        self._ghost.content = f"*prediction {text}*" if text else ""
        self._ghost.visible = bool(text)

    def _add_trails(self) -> dict[str, viser.GuiCheckboxHandle]:
        gui, view = self._server.gui, self._controller.state.view_3d
        with gui.add_folder("Trails", expand_by_default=False):
            self._controls["trail_frames"] = gui.add_slider(
                "frames", 1, MAX_TRAIL_FRAMES, 1, view.trail_frames,
                hint="Length of a trail to either side of the shown frame: blue before it, orange after it",
            )  # fmt: skip
            none = gui.add_button("None", hint="No trails")
            # One box per name of a point: it stands for that point of every body.
            models = self._controller.models
            names = list(dict.fromkeys(n for m in models for n in m.point_names if n not in minor_points(m)))
            boxes = {
                name: gui.add_checkbox(
                    name.replace("_", " "), name in view.trail_points, hint="Draw the trail of this point"
                )
                for name in names
            }

        @none.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            self._offer(event, lambda: self._controller.view_3d.choose(trail_points=frozenset()), "trail_points")

        return boxes

    def _listen(self) -> None:
        """Send what a person changes to the controller."""
        view_3d = self._controller.view_3d

        @self._camera.on_update
        async def _(event: viser.GuiEvent[Any]) -> None:
            options = list(self._camera.options)
            index = options.index(self._camera.value) - 1
            self._offer(event, lambda: view_3d.snap(None if index < 0 else index), "camera")

        @self._set_floor.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            self._offer(event, self._controller.floor.begin, "floor")

        @self._previous_floor.on_click
        async def _(event: viser.GuiEvent[Any]) -> None:
            self._offer(event, self._controller.floor.revert, "floor")

        def watch(field: str, control: Any) -> None:
            @control.on_update
            async def _(event: viser.GuiEvent[Any]) -> None:
                value = control.value
                if field == "colors":
                    value = next(key for key, label in _COLORS.items() if label == value)
                self._offer(event, lambda: view_3d.choose(**{field: value}), field)

        for field, control in self._controls.items():
            watch(field, control)
        for box in self._points.values():
            box.on_update(self._points_changed)

    async def _points_changed(self, event: viser.GuiEvent[Any]) -> None:
        chosen = frozenset(name for name, box in self._points.items() if box.value)
        self._offer(event, lambda: self._controller.view_3d.choose(trail_points=chosen), "trail_points")

    def _offer(self, event: viser.GuiEvent[Any], change: Callable[[], None], key: str) -> None:
        if event.client is not None:  # otherwise the program set it
            self._choices.offer((change, event.client), key)

    def _choose(self, choice: tuple[Callable[[], None], viser.ClientHandle]) -> None:
        change, client = choice
        try:
            change()
        except TrackerError as error:
            client.add_notification("View", str(error), color="red", auto_close_seconds=8.0)

    def _show(self, state: State) -> None:
        view = state.view_3d
        with self._server.atomic():
            _set(self._camera, self._camera.options[0 if state.snapped is None else state.snapped + 1])
            _set_text(self._floor, _describe(state.floor))
            self._previous_floor.disabled = not state.floor.former
            for field, control in self._controls.items():
                value = getattr(view, field)
                self._update(field, control, _COLORS[value] if field == "colors" else value)
            for name, box in self._points.items():
                self._update(name, box, name in view.trail_points)

    def _update(self, key: str, control: Any, value: object) -> None:
        """Set a control if its value in the state changed.

        A choice that the state does not have yet stays, even if the state changes for another reason.
        """
        if self._shown.get(key) != value:
            self._shown[key] = value
            _set(control, value)


def _describe(floor: FloorState) -> str:
    """Describe the floor."""
    if floor.plane is None:
        return f"*floor of the calibration, up is {floor.up}*"
    cosine = np.clip(np.abs(floor.plane.normal).max(), -1, 1)
    tilt, height = np.degrees(np.arccos(cosine)), 100 * floor.plane.offset_m
    return f"*floor set by hand: {tilt:.1f}° off {floor.up}, at {height:.1f} cm*"


def _set_text(markdown: viser.GuiMarkdownHandle, text: str) -> None:
    if markdown.content != text:
        markdown.content = text


def _set(control: Any, value: object) -> None:
    if control.value != value:
        control.value = value
