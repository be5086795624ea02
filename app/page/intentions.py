"""What a page wants, carried out: messages of the pane socket to methods of the controller (docs/protocol.md).

Whatever is missing from a message or is of the wrong kind ends in a KeyError, TypeError or ValueError, and nothing
has happened then.
"""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from app.control.controller import Controller
from app.page.pose_intentions import pose
from app.page.search_intentions import SEARCHING

Message = Mapping[str, Any]


def carry_out(controller: Controller, page: int, message: Message) -> None:
    """Do what a page asks for.

    Args:
        controller: of the session.
        page: number of the page.
        message: as it came.

    Raises:
        TrackerError: it cannot be done; says why.
        KeyError, TypeError, ValueError: the message is not understood.
    """
    _INTENTIONS[message["type"]](controller, page, message)


_MODES = {mode: mode for mode in ("move", "turn", "push")}


def _drag(controller: Controller, page: int, message: Message) -> None:
    dragging, phase, pointer_px = controller.dragging, message["phase"], _place(message)
    if phase == "start":
        camera, person, frame = int(message["camera"]), int(message["person"]), int(message["frame"])
        part = None if message.get("part") is None else int(message["part"])
        dragging.begin(page, camera, person, message["point"], pointer_px, frame, part)
    if phase == "cancel":
        dragging.cancel(page)
    else:
        dragging.move(page, pointer_px, int(message["seq"]), _MODES[message.get("mode", "move")])
    if phase == "end":
        dragging.end(page)


def _pin(controller: Controller, page: int, message: Message) -> None:
    pinning, phase, position_px = controller.pinning, message["phase"], _place(message)
    if phase == "start":
        camera, person, frame = int(message["camera"]), int(message["person"]), int(message["frame"])
        pinning.begin(page, frame, camera, person, message["point"], position_px, bool(message["live"]))
    elif phase == "cancel":
        pinning.cancel(page)
    else:
        pinning.move(page, position_px)
    if phase == "end":
        pinning.end(page)


def _unpin(controller: Controller, _: int, message: Message) -> None:
    camera = None if message["camera"] is None else int(message["camera"])
    controller.pinning.remove(int(message["frame"]), int(message["person"]), message["point"], camera)


def _fit(controller: Controller, _: int, message: Message) -> None:
    person = message.get("person")
    controller.pinning.fit(int(message["frame"]), None if person is None else _person(controller, message))


def _people(controller: Controller, _: int, message: Message) -> None:
    actions: dict[str, Callable[[], None]] = {
        "show": lambda: controller.visibility.show(_person(controller, message), bool(message["shown"])),
        "solo": lambda: controller.visibility.solo(bool(message["on"])),
    }
    actions[message["action"]]()


def _person(controller: Controller, message: Message) -> int:
    person = int(message["person"])
    if not 0 <= person < len(controller.models):
        raise ValueError(f"there is no person {person}")
    return person


def _place(message: Message) -> tuple[float, float]:
    """Where the pointer is, undistorted px."""
    position_px = float(message["u"]), float(message["v"])
    if not np.all(np.isfinite(position_px)):
        raise ValueError("a position that is not a number")
    return position_px


def _track(controller: Controller, _: int, message: Message) -> None:
    last = None if message.get("until") is None else int(message["until"])
    actions: dict[str, Callable[[], None]] = {
        "forward": lambda: controller.tracking.start(False, last),
        "backward": lambda: controller.tracking.start(True, last),
        "pause": controller.tracking.pause,
        "resume": controller.tracking.resume,
        "stop": controller.activities.stop,
    }
    actions[message["action"]]()


def _range(controller: Controller, _: int, message: Message) -> None:
    ranges, first, last = controller.ranges, int(message["first"]), int(message["last"])
    person = message.get("person")
    people = None if person is None else [int(person)]
    actions: dict[str, Callable[[], None]] = {
        "interpolate": lambda: ranges.interpolate(first, last, people),
        "clear": lambda: ranges.clear(first, last, people),
        "track_forward": lambda: ranges.track(first, last, backward=False),
        "track_backward": lambda: ranges.track(first, last, backward=True),
        "keyframe": lambda: ranges.mark(first, last, "keyframe", people),
        "reviewed": lambda: ranges.mark(first, last, "reviewed", people),
        "unreviewed": lambda: ranges.mark(first, last, "unreviewed", people),
        "none": lambda: ranges.mark(first, last, "none", people),
    }
    actions[message["action"]]()


def _mark(controller: Controller, _: int, message: Message) -> None:
    ranges = controller.ranges
    {"keyframe": ranges.toggle_keyframe, "reviewed": ranges.toggle_reviewed}[message["toggle"]]()


def _snap(controller: Controller, _: int, message: Message) -> None:
    camera = message["camera"]
    controller.view_3d.snap(None if camera is None else int(camera))


def _floor(controller: Controller, _: int, message: Message) -> None:
    floor, action = controller.floor, message["action"]
    if action == "mark":
        floor.mark(int(message["camera"]), _place(message))
        return
    actions = {
        "begin": floor.begin,
        "next": floor.next_point,
        "take_back": floor.take_back,
        "apply": floor.apply,
        "cancel": floor.cancel,
        "revert": floor.revert,
    }
    actions[action]()


def _edit(edit: Any) -> int | None:
    return None if edit is None else int(edit)


_INTENTIONS: dict[str, Callable[[Controller, int, Message], None]] = {
    "seek": lambda controller, _, message: controller.navigation.seek(int(message["frame"])),
    "select": lambda controller, _, message: controller.navigation.select(int(message["person"]), message.get("point")),
    "drag": _drag,
    "pose": pose,
    "pin": _pin,
    "unpin": _unpin,
    "fit": _fit,
    "people": _people,
    "track": _track,
    "follow": lambda controller, _, message: controller.tracking.follow(bool(message["follow"])),
    "pause_3d": lambda controller, page, message: controller.view_3d.pause(page, bool(message["pause"])),
    "range": _range,
    "mark": _mark,
    "stop_range": lambda controller, _, __: controller.ranges.stop(),
    "snap": _snap,
    "floor": _floor,
    "undo": lambda controller, _, __: controller.history.undo(),
    "redo": lambda controller, _, __: controller.history.redo(),
    "go_to": lambda controller, _, message: controller.history.go_to(_edit(message["edit"])),
    "save": lambda controller, _, __: controller.history.save(),
    **SEARCHING,
}
