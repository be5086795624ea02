"""What a page wants of searches: to run, watch, replay and compare them, and to look at the cost (docs/protocol.md)."""

from collections.abc import Callable, Mapping
from typing import Any

from app.control.controller import Controller
from app.control.search import search_settings

Message = Mapping[str, Any]


def _search(controller: Controller, _: int, message: Message) -> None:
    person = _number(message.get("person"))
    if person is not None and not 0 <= person < len(controller.models):
        raise ValueError(f"there is no person {person}")
    actions: dict[str, Callable[[], None]] = {
        "step": lambda: controller.search.step(person),
        "stage": lambda: controller.search.run_stage(person),
        "frame": lambda: controller.search.run(person),
        "again": lambda: controller.search.run_again(_number(message.get("run")), person),
        "stop": controller.activities.stop,
    }
    actions[message["action"]]()


def _pace(controller: Controller, _: int, message: Message) -> None:
    speed = message["per_second"]
    controller.search.set_speed(None if speed is None else float(speed))


def _settings(controller: Controller, _: int, message: Message) -> None:
    before = controller.state.settings
    after = search_settings.changed(before, controller.models, dict(message["changes"]))
    if after != before:
        controller.search.set_settings(after)


def _replay(controller: Controller, _: int, message: Message) -> None:
    if message["run"] is None:
        controller.replay.leave()
    else:
        controller.replay.show(int(message["run"]), int(message["step"]))


def _preview(controller: Controller, _: int, message: Message) -> None:
    controller.replay.preview(int(message["run"]), _number(message["candidate"]))


def _take(controller: Controller, _: int, message: Message) -> None:
    controller.replay.take(int(message["run"]), _number(message["candidate"]))


def _landscape_set(controller: Controller, _: int, message: Message) -> None:
    controller.cost_landscape.set_value(int(message["person"]), int(message["dof"]), float(message["value"]))


def _number(value: Any) -> int | None:
    return None if value is None else int(value)


SEARCHING: dict[str, Callable[[Controller, int, Message], None]] = {
    "search": _search,
    "search_speed": _pace,
    "search_settings": _settings,
    "replay": _replay,
    "compare": lambda controller, _, message: controller.replay.compare(_number(message["run"])),
    "preview": _preview,
    "take": _take,
    "landscape": lambda controller, _, message: controller.cost_landscape.choose(str(message["dof"])),
    "landscape_set": _landscape_set,
}
