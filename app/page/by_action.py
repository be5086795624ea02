"""Commands whose action says what is done."""

from collections.abc import Callable
from typing import Any

from app.control.controller import Controller


def by_action(**runs: Callable[[Controller, Any], object]) -> Callable[[Controller, int, Any], None]:
    """Return a command that calls one of these functions, by the action of its message, with the message."""

    def run(controller: Controller, _: int, message: Any) -> None:
        runs[message.action](controller, message)

    return run
