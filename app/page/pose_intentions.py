"""What a page wants of a pose without a drag: messages of the pane socket to the controller (docs/protocol.md)."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from app.control.controller import Controller
from app.drawing import dof_labels


def pose(controller: Controller, _: int, message: Mapping[str, Any]) -> None:
    """Carry out a message of type `pose`.

    Raises:
        TrackerError: it cannot be done; says why.
        KeyError, TypeError, ValueError: the message is not understood.
    """
    edits, person, frame = controller.pose_edits, int(message["person"]), int(message["frame"])
    if not 0 <= person < len(controller.models):
        raise ValueError(f"there is no person {person}")
    model = controller.models[person]
    point = message.get("point")
    if point is not None and point not in model.point_names:
        raise ValueError(f"'{point}' is no point of {model.name}")

    def of_dof(name: str) -> tuple[int, float]:
        dof = int(message["dof"])
        if not 0 <= dof < model.n_dofs:
            raise ValueError(f"there is no degree of freedom {dof}")
        return dof, _finite(message[name]) / float(dof_labels.factors(model)[dof])

    def nudge() -> None:
        right_m, up_m = (_finite(message[name]) / 100 for name in ("right", "up"))
        edits.nudge(person, point, int(message["camera"]), right_m, up_m, frame)

    actions: dict[str, Callable[[], None]] = {
        "set": lambda: edits.set_dof(person, *of_dof("value"), frame),
        "turn": lambda: edits.turn(person, *of_dof("by"), frame),
        "nudge": nudge,
        "mirror": lambda: edits.mirror(person, frame),
        "copy": lambda: edits.copy_from(person, int(message["from"]), frame),
        "copy_person": lambda: edits.copy_person(person, int(message["from"]), frame),
        "alternative": lambda: controller.alternatives.take_alternative(person, frame),
        "reset": lambda: edits.reset(person, point, frame),
        "lock": lambda: controller.dof_locks.set(person, [int(d) for d in message["dofs"]], bool(message["locked"])),
    }
    actions[message["action"]]()


def _finite(value: Any) -> float:
    number = float(value)
    if not np.isfinite(number):
        raise ValueError("a number that is not finite")
    return number
