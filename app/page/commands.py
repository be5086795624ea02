"""Commands of a page: messages of the pane socket to calls of the controller (docs/protocol.md)."""

from collections.abc import Callable
from typing import Any

import numpy as np

from app.control.controller import Controller
from app.messages import client as wire
from app.messages import pose as pose_wire
from app.messages.base import Command
from app.messages.parsing import MessageError
from app.page.by_action import by_action
from app.page.inspector_commands import INSPECTOR_COMMANDS
from app.page.pose_commands import POSE_COMMANDS, check_point, display_factor
from app.page.search_commands import SEARCH_COMMANDS


def dispatch(controller: Controller, page: int, message: wire.ClientMessage) -> None:
    """Carry out a message of a page.

    Args:
        controller: of the session.
        page: number of the page.
        message: as parsed.

    Raises:
        TrackerError: it cannot be done.
        MessageError: it names a camera or a person that the session does not have.
    """
    check_indices(controller, message)
    COMMANDS[type(message)](controller, page, message)


def check_indices(controller: Controller, message: wire.ClientMessage) -> None:
    """Check that the session has the camera and the person of a message.

    Raises:
        MessageError: it has not.
    """
    for name in ("camera", "person"):
        index = getattr(message, name, None)
        if index is not None:
            check_index(controller, name, index)


def check_index(controller: Controller, name: str, index: int) -> None:
    """Check that the session has a `camera` or `person`.

    Raises:
        MessageError: it has not.
    """
    count = len(controller.session.cameras if name == "camera" else controller.models)
    if index >= count:
        raise MessageError(f"an index below {count} as '{name}'", str(index))


def _drag(controller: Controller, page: int, message: pose_wire.Drag) -> None:
    dragging, pointer_px = controller.dragging, (message.u, message.v)
    if message.phase == "start":
        dragging.begin(
            page, message.camera, message.person, message.point, pointer_px, message.frame, message.part
        )  # fmt: skip
    if message.phase == "cancel":
        dragging.cancel(page)
    else:
        dragging.move(page, pointer_px, message.seq, message.mode, is_last=message.phase == "end")
    if message.phase == "end":
        dragging.end(page)


def _pin(controller: Controller, page: int, message: pose_wire.DragPin) -> None:
    pinning, position_px = controller.pinning, (message.u, message.v)
    if message.phase == "start":
        pinning.begin(
            page, message.frame, message.camera, message.person, message.point, position_px, message.live
        )  # fmt: skip
    elif message.phase == "cancel":
        pinning.cancel(page)
    else:
        pinning.move(page, position_px)
    if message.phase == "end":
        pinning.end(page)


def _fit(controller: Controller, _: int, message: pose_wire.FitPose) -> None:
    if message.person is not None:
        check_point(controller, message.person, message.point)
    controller.pinning.fit(message.frame, message.person, message.point)


def _range(controller: Controller, _: int, message: wire.EditRange) -> None:
    ranges, first, last = controller.ranges, message.first, message.last
    people = None if message.person is None else [message.person]
    match message.action:
        case "interpolate":
            ranges.interpolate(first, last, people)
        case "estimate":
            ranges.estimate(first, last, people)
        case "clear":
            ranges.clear(first, last, people)
        case "track_forward" | "track_backward":
            ranges.track(first, last, backward=message.action == "track_backward")
        case "take_replaced":
            ranges.take_replaced(first, last, people)
        case mark:
            ranges.mark(first, last, mark, people)


def _mark(controller: Controller, _: int, message: wire.ToggleMark) -> None:
    ranges = controller.ranges
    {"keyframe": ranges.toggle_keyframe, "reviewed": ranges.toggle_reviewed}[message.toggle]()


def _curves(controller: Controller, _: int, message: wire.EditCurves) -> None:
    factors = np.array([display_factor(controller, message.person, dof) for dof in message.dofs])
    amount = message.amount / (1.0 if message.action == "smooth" else factors)
    controller.ranges.edit_curves(message.first, message.last, message.person, message.dofs, message.action, amount)


def _compare_range(controller: Controller, _: int, message: wire.CompareRange) -> None:
    if message.first is None or message.last is None:
        controller.comparing_runs.leave()
    else:
        controller.comparing_runs.compare(message.first, message.last)


COMMANDS: dict[type[Command], Callable[[Controller, int, Any], None]] = {
    wire.Seek: lambda controller, _, m: controller.navigation.seek(m.frame),
    wire.Select: lambda controller, _, m: controller.navigation.select(m.person, m.point),
    wire.ShowPerson: lambda controller, _, m: controller.visibility.show(m.person, m.shown),
    wire.Solo: lambda controller, _, m: controller.visibility.solo(m.on),
    wire.ShowBefore: lambda controller, _, m: controller.comparing.show_before(m.shown),
    wire.LookThrough: lambda controller, _, m: controller.view_3d.look_through_camera(m.camera),
    wire.Pause3d: lambda controller, page, m: controller.view_3d.pause(page, m.pause),
    pose_wire.Drag: _drag,
    pose_wire.DragPin: _pin,
    pose_wire.RemovePins: lambda controller, _, m: controller.pinning.remove(m.frame, m.person, m.point, m.camera),
    pose_wire.FitPose: _fit,
    pose_wire.TakeLimbBack: lambda controller, _, m: controller.pinning.take_limb_back(m.frame, m.every),
    wire.StartTracking: lambda controller, _, m: controller.tracking.start(m.action == "backward", m.until),
    wire.ControlTracking: by_action(
        pause=lambda controller, _: controller.tracking.pause(),
        resume=lambda controller, _: controller.tracking.resume(),
        stop=lambda controller, _: controller.activities.stop(),
    ),
    wire.EditRange: _range,
    wire.EditCurves: _curves,
    wire.CompareRange: _compare_range,
    wire.StopRange: lambda controller, _, __: controller.ranges.stop(),
    wire.ToggleMark: _mark,
    wire.ConfirmKeyframe: lambda controller, _, m: controller.inconsistent_frames.confirm(m.person, m.frame),
    wire.FollowTracking: lambda controller, _, m: controller.tracking.follow(m.follow),
    wire.EditFloor: by_action(
        begin=lambda controller, _: controller.floor.begin(),
        next=lambda controller, _: controller.floor.next_point(),
        take_back=lambda controller, _: controller.floor.take_back(),
        apply=lambda controller, _: controller.floor.apply(),
        cancel=lambda controller, _: controller.floor.cancel(),
        from_feet=lambda controller, _: controller.floor.set_from_feet(),
        revert=lambda controller, _: controller.floor.revert(),
    ),
    wire.MarkFloor: lambda controller, _, m: controller.floor.mark(m.camera, (m.u, m.v)),
    wire.Undo: lambda controller, _, __: controller.history.undo(),
    wire.Redo: lambda controller, _, __: controller.history.redo(),
    wire.GoTo: lambda controller, _, m: controller.history.go_to(m.edit),
    wire.Save: lambda controller, _, __: controller.history.save(),
    **POSE_COMMANDS,
    **SEARCH_COMMANDS,
    **INSPECTOR_COMMANDS,
}
"""Action of each message. The connection itself carries out the subscriptions of its page (`socket`)."""
