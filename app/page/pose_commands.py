"""Commands that edit a pose without a drag (docs/protocol.md)."""

from collections.abc import Callable
from typing import Any

import numpy as np

from app.control.controller import Controller
from app.drawing import dof_labels
from app.messages import pose as wire
from app.messages.base import Command
from app.messages.parsing import MessageError


def _set(controller: Controller, _: int, message: wire.SetDof) -> None:
    value = message.value / display_factor(controller, message.person, message.dof)
    controller.pose_edits.set_dof(message.person, message.dof, value, message.frame)


def _turn(controller: Controller, _: int, message: wire.TurnDofs) -> None:
    factors = [display_factor(controller, message.person, dof) for dof in message.dofs]
    if message.by is not None:
        steps = message.by / np.array(factors)
        controller.pose_edits.turn(message.person, message.dofs, steps, message.frame, message.drag)
    elif message.drag is not None:
        controller.pose_edits.cancel_drag(message.dofs, message.drag)


def _nudge(controller: Controller, _: int, message: wire.Nudge) -> None:
    check_point(controller, message.person, message.point)
    right_m, up_m = message.right / 100, message.up / 100
    controller.pose_edits.nudge(message.person, message.point, message.camera, right_m, up_m, message.frame)


def _copy_person(controller: Controller, _: int, message: wire.CopyPerson) -> None:
    if message.source >= len(controller.models):
        raise MessageError(f"an index below {len(controller.models)} as 'from'", str(message.source))
    controller.pose_edits.copy_person(message.person, message.source, message.frame)


def _reset(controller: Controller, _: int, message: wire.ResetLimb) -> None:
    check_point(controller, message.person, message.point)
    controller.pose_edits.reset(message.person, message.point, message.frame)


def _lock(controller: Controller, _: int, message: wire.LockDofs) -> None:
    for dof in message.dofs:
        display_factor(controller, message.person, dof)
    controller.dof_locks.set(message.person, message.dofs, message.locked)


def _hold(controller: Controller, _: int, message: wire.HoldPoint) -> None:
    check_point(controller, message.person, message.point)
    controller.held_points.set(message.person, message.point, message.held, message.frame)


POSE_COMMANDS: dict[type[Command], Callable[[Controller, int, Any], None]] = {
    wire.SetDof: _set,
    wire.TurnDofs: _turn,
    wire.Nudge: _nudge,
    wire.Mirror: lambda controller, _, m: controller.pose_edits.mirror(m.person, m.frame),
    wire.CopyFrame: lambda controller, _, m: controller.pose_edits.copy_from(m.person, m.source, m.frame),
    wire.CopyPerson: _copy_person,
    wire.TakeAlternative: lambda controller, _, m: controller.alternatives.take_alternative(m.person, m.frame, m.rank),
    wire.ResetLimb: _reset,
    wire.LockDofs: _lock,
    wire.HoldPoint: _hold,
}


def display_factor(controller: Controller, person: int, dof: int) -> float:
    """Return the factor from radians or metres to degrees or centimetres."""
    model = controller.models[person]
    if dof >= model.n_dofs:
        raise MessageError(f"a degree of freedom of {model.name} below {model.n_dofs}", str(dof))
    return float(dof_labels.factors(model)[dof])


def check_point(controller: Controller, person: int, point: str | None) -> None:
    """Raise a `MessageError` unless the person has a point of this name, or none is named."""
    model = controller.models[person]
    if point is not None and point not in model.point_names:
        raise MessageError(f"a point of {model.name}", f"'{point}'")
