"""Panel folders for body sizes in centimetres, one for each person."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import viser

from app.control.controller import Controller
from app.state.state import State
from tracker.body.dimensions import PartDimensions, dimensions_of, mirror_part
from tracker.body.limbs import display_name
from tracker.errors import TrackerError

_REFIT, _KEEP = "refit keyframes", "keep poses"
_HEADING = "**length · half depth · half width**, cm"


@dataclass(frozen=True)
class _Folder:
    """The controls of one person."""

    folder: viser.GuiFolderHandle
    height: viser.GuiInputHandle[float]
    alike: viser.GuiInputHandle[bool]
    parts: dict[str, viser.GuiVector3Handle]
    """By part: its length and half girths."""
    widths: dict[str, viser.GuiNumberHandle[float]]
    poses: viser.GuiDropdownHandle[str]
    apply: viser.GuiButtonHandle
    discard: viser.GuiButtonHandle
    note: viser.GuiMarkdownHandle


class BodyPanel:
    """The folders. They show the sizes being edited, otherwise the present ones. Entries go to the controller."""

    def __init__(self, server: viser.ViserServer, controller: Controller) -> None:
        """Build the folders."""
        self._server, self._controller, self._sizing = server, controller, controller.body_sizes
        self._folders = [self._add(i) for i in range(len(controller.session.people))]

    def show(self, state: State) -> None:
        """Show the sizes of the person worked on."""
        for person, controls in enumerate(self._folders):
            controls.folder.visible = person == state.person
            if person == state.person:
                self._show_one(person, controls, state)

    def _show_one(self, person: int, controls: _Folder, state: State) -> None:
        sizes, drafted = (
            dimensions_of(self._sizing.model(person)),
            state.draft is not None and state.draft.person == person,
        )
        _put(controls.height, _cm(sizes.height_m))
        _put(controls.alike, state.sides_alike)
        for name, row in controls.parts.items():
            _put(row, _row(sizes.parts[name]))
            other = mirror_part(name)
            row.visible = not (state.sides_alike and other in controls.parts and name.startswith("right_"))
            row.label = display_name(name.removeprefix("left_") if state.sides_alike else name)
        for name, number in controls.widths.items():
            _put(number, _cm(sizes.widths_m[name]))
        controls.discard.disabled = not drafted
        note = "Not applied yet: the blue outline shows it." if drafted else state.sizes_message
        if not note and state.revisions[person] != state.present[person]:
            note = "The pose of this frame belongs to other sizes and is shown with them."
        if controls.note.content != note:
            controls.note.content = note
        controls.note.visible = bool(note)

    def _add(self, person: int) -> _Folder:
        gui, sizes = self._server.gui, dimensions_of(self._controller.session.people[person].model)
        folder = gui.add_folder(f"Body of {self._controller.session.people[person].name}", expand_by_default=False)
        with folder:
            height = gui.add_number(
                "height, cm", _cm(sizes.height_m), step=0.5, hint="Body height; everything else scales with it"
            )
            alike = gui.add_checkbox("both sides alike", True, hint="Change left and right together")
            gui.add_markdown(_HEADING)
            parts = {
                name: gui.add_vector3(
                    display_name(name), _row(own), step=0.1,
                    hint=f"{display_name(name).capitalize()}: length between its joints; half its thickness, front to "
                    "back and side to side, at its middle; cm",
                )
                for name, own in sizes.parts.items()
            }  # fmt: skip
            widths = {
                name: gui.add_number(
                    f"{name}s apart, cm", _cm(own), step=0.1, hint=f"Distance of the centres of the {name} joints"
                )
                for name, own in sizes.widths_m.items()
            }
            poses = gui.add_dropdown(
                "stored poses", (_REFIT, _KEEP),
                hint="Refit keyframes: fit each to its former joints and pins in the new body, as one undoable edit. "
                "Keep poses: leave all as they are, in the body that they were made with",
            )  # fmt: skip
            apply = gui.add_button("Apply", hint="Make these the sizes of the body from now on; can be undone")
            discard = gui.add_button("Discard", hint="Return to the present sizes of the body")
            former = gui.add_button("Previous sizes", hint="Enter the sizes before the present ones; Apply sets them")
            note = gui.add_markdown("")
        controls = _Folder(folder, height, alike, parts, widths, poses, apply, discard, note)
        self._listen(person, controls, former)
        return controls

    def _listen(self, person: int, controls: _Folder, former: viser.GuiButtonHandle) -> None:
        sizing = self._sizing
        self._on(controls.height, lambda cm: sizing.set_height(person, cm / 100))
        self._on(controls.alike, sizing.couple)
        for name, row in controls.parts.items():
            self._on(row, partial(self._set_part, person, name))
        for name, number in controls.widths.items():
            self._on(number, partial(self._set_width, person, name))
        self._on(controls.apply, lambda _: sizing.apply(person, controls.poses.value == _REFIT))
        self._on(controls.discard, lambda _: sizing.discard())
        self._on(former, lambda _: sizing.recall(person))

    def _set_part(self, person: int, part: str, row_cm: tuple[float, float, float]) -> None:
        """Set the sizes of a part. Numbers that were not changed keep the digits that the panel does not show."""
        before = dimensions_of(self._sizing.model(person)).parts[part]
        same = zip((before.length_m, *before.girths_m), _row(before), row_cm, strict=True)
        length, first, second = (own if shown == entered else entered / 100 for own, shown, entered in same)
        self._sizing.set_part(person, part, PartDimensions(length, (first, second)))

    def _set_width(self, person: int, name: str, cm: float) -> None:
        self._sizing.set_width(person, name, cm / 100)

    def _on(self, control: Any, act: Callable[[Any], None]) -> None:
        """Call a function when a person uses a control. A refusal is shown, and the control returns to the state.

        Args:
            control: a control of viser.
            act: receives the value at the time of the event; a later state may overwrite it in the control.
        """

        async def done(event: viser.GuiEvent[Any]) -> None:
            if event.client is None:  # the program set it
                return
            try:
                await asyncio.to_thread(act, control.value)
            except TrackerError as error:
                event.client.add_notification("Body", str(error), color="red", auto_close_seconds=8.0)
                self.show(self._controller.state)

        (control.on_click if isinstance(control, viser.GuiButtonHandle) else control.on_update)(done)


def _put(control: Any, value: Any) -> None:
    if control.value != value:
        control.value = value


def _cm(length_m: float) -> float:
    return round(100 * length_m, 1)


def _row(sizes: PartDimensions) -> tuple[float, float, float]:
    return _cm(sizes.length_m), _cm(sizes.girths_m[0]), _cm(sizes.girths_m[1])
