"""Commands that run, watch, replay and compare searches, and that use the cost landscape (docs/protocol.md)."""

from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np

from app.control.controller import Controller
from app.control.search import search_settings
from app.drawing import dof_labels
from app.messages import search as wire
from app.messages.base import Command


def _search(controller: Controller, _: int, message: wire.RunSearch) -> None:
    match message.action:
        case "step":
            controller.search.step(message.person)
        case "stage":
            controller.search.run_stage(message.person)
        case "frame":
            controller.search.run(message.person)
        case "contours" | "chains":
            controller.search.fit_contours(message.person, by_chains=message.action == "chains")
        case "stop":
            controller.activities.stop()


def _settings(controller: Controller, _: int, message: wire.SetSearchSettings) -> None:
    before = controller.state.settings
    after = search_settings.changed(before, controller.models, msgspec.to_builtins(message.changes))
    if after != before:
        controller.search.set_settings(after)


def _replay(controller: Controller, _: int, message: wire.ReplayStep) -> None:
    if message.run is None:
        controller.replay.leave()
    else:
        controller.replay.show(message.run, message.step)


def _cost_map(controller: Controller, page: int, message: wire.ShowCostMap) -> None:
    if message.dofs is None:
        controller.cost_map.leave(page)
    else:
        controller.cost_map.watch(page, message.person, message.dofs)


def _set_cost_map_place(controller: Controller, _: int, message: wire.SetCostMapPlace) -> None:
    factors = dof_labels.factors(controller.models[message.person])
    values = [v / factors[d] if d < len(factors) else np.nan for v, d in zip(message.values, message.dofs, strict=True)]
    controller.pose_edits.set_along(message.person, message.dofs, values)


def _reason(controller: Controller, page: int, message: wire.AskReason) -> None:
    if message.action == "stop":
        controller.reasons.stop()
    else:
        controller.reasons.watch(page, message.action == "ask")


SEARCH_COMMANDS: dict[type[Command], Callable[[Controller, int, Any], None]] = {
    wire.RunSearch: _search,
    wire.RepeatSearch: lambda controller, _, m: controller.search.run_again(m.run, m.person),
    wire.SetSearchSpeed: lambda controller, _, m: controller.search.set_speed(m.per_second),
    wire.SetSearchSettings: _settings,
    wire.ReplayStep: _replay,
    wire.CompareRun: lambda controller, _, m: controller.replay.compare(m.run),
    wire.PreviewCandidate: lambda controller, _, m: controller.replay.preview(m.run, m.candidate),
    wire.TakeCandidate: lambda controller, _, m: controller.replay.take(m.run, m.candidate),
    wire.ShowLandscape: lambda controller, _, m: controller.cost_landscape.choose(m.dof),
    wire.ShowCostMap: _cost_map,
    wire.SetCostMapPlace: _set_cost_map_place,
    wire.AskReason: _reason,
    wire.SetLandscapeDof: lambda controller, _, m: controller.pose_edits.set_along(m.person, [m.dof], [m.value]),
}
