"""Commands of the inspector: settings, the 3-D view and body sizes (docs/protocol.md)."""

from collections.abc import Callable
from typing import Any

import msgspec

from app.control.controller import Controller
from app.control.tracking import track_settings
from app.messages import annotation as plan_wire
from app.messages import inspector as wire
from app.messages.base import Command
from app.messages.cameras import CheckCalibration, UseClocks
from app.messages.observation import SetCopyTolerance, UseCopy, UseObservations
from app.messages.parsing import MessageError
from app.page.by_action import by_action
from tracker.annotation.frame_choice import FrameChoice
from tracker.body.dimensions import PartDimensions, dimensions_of
from tracker.formats.model_toml import PRESETS
from tracker.validation import quoted


def _track_settings(controller: Controller, _: int, message: wire.SetTrackSettings) -> None:
    before, changes = controller.state, msgspec.to_builtins(message.changes)
    choices = track_settings.with_choices(before.run_choices, changes, controller.session.camera_names)
    after = track_settings.changed(before.settings, choices)
    if after != before.settings:
        controller.search.set_settings(after)
    controller.tracking.choose(choices)
    if (after, choices) != (before.settings, before.run_choices):
        controller.tracking.store_settings()


def _view_3d(controller: Controller, _: int, message: wire.SetView3d) -> None:
    changes = msgspec.to_builtins(message.changes)
    if "trail_points" in changes:
        changes["trail_points"] = frozenset(changes["trail_points"])
    if changes.get("character") and changes["character"] not in PRESETS:
        raise MessageError(f"one of {', '.join(PRESETS)} as 'changes.character'", quoted(changes["character"]))
    controller.view_3d.choose(**changes)


def _part(controller: Controller, _: int, message: wire.SetPartSizes) -> None:
    before = dimensions_of(controller.body_sizes.model(message.person)).parts
    if message.part not in before:
        raise MessageError("a part of the body as 'part'", quoted(message.part))
    own = before[message.part]
    changes = msgspec.to_builtins(message)
    girths_m = (changes.get("half_depth_m", own.girths_m[0]), changes.get("half_width_m", own.girths_m[1]))
    sizes = PartDimensions(changes.get("length_m", own.length_m), girths_m)
    controller.body_sizes.set_part(message.person, message.part, sizes)


def _width(controller: Controller, _: int, message: wire.SetGirdleWidth) -> None:
    if message.girdle not in dimensions_of(controller.body_sizes.model(message.person)).widths_m:
        raise MessageError("a girdle of the body as 'girdle'", quoted(message.girdle))
    controller.body_sizes.set_width(message.person, message.girdle, message.width_m)


def _change_body(controller: Controller, _: int, message: wire.ChangeBody) -> None:
    if message.to not in PRESETS:
        raise MessageError(f"one of {', '.join(PRESETS)} as 'to'", quoted(message.to))
    controller.body_sizes.change_body(message.person, message.to)


def _draft(controller: Controller, _: int, message: wire.DraftSizes) -> None:
    if message.action == "discard":
        controller.body_sizes.discard()
        controller.body_acquisition.forget()
    else:
        controller.body_sizes.recall(message.person)


def _clocks(controller: Controller, page: int, message: UseClocks) -> None:
    for camera in (message.camera, message.other):
        if camera >= len(controller.session.cameras):
            raise MessageError(f"a camera below {len(controller.session.cameras)}", str(camera))
    _CLOCKS(controller, page, message)


_CLOCKS = by_action(
    nudge=lambda controller, m: controller.clocks.nudge(m.camera, m.frames),
    estimate=lambda controller, m: controller.clocks.estimate(m.way),
    take=lambda controller, m: controller.clocks.take(m.camera),
    moment=lambda controller, m: controller.clocks.find_moment((m.camera, m.other)),
    stop=lambda controller, _: controller.clocks.stop(),
)


def _plan(controller: Controller, _: int, message: plan_wire.PlanTasks) -> None:
    choice = FrameChoice(
        message.n if message.by == "every" else 0,
        (message.frames.strip() or "-") if message.by == "frames" else "",
        message.n if message.by == "diverse" else 0,
        message.by == "doubted",
    )
    controller.annotating.plan(choice, message.person, message.to, message.each)


def _comment(controller: Controller, _: int, message: plan_wire.WriteComment) -> None:
    if message.frame >= controller.session.n_frames:
        raise MessageError(f"a frame below {controller.session.n_frames} as 'frame'", str(message.frame))
    controller.annotating.comment(message.person, message.frame, message.limb, message.text)


def _copy(controller: Controller, _: int, message: UseCopy) -> None:
    if message.action == "leave":
        controller.other_copies.leave()
    else:
        controller.other_copies.decide(message.person, message.frame, message.action)


INSPECTOR_COMMANDS: dict[type[Command], Callable[[Controller, int, Any], None]] = {
    wire.SetTrackSettings: _track_settings,
    wire.SetView3d: _view_3d,
    wire.SetHeight: lambda controller, _, m: controller.body_sizes.set_height(m.person, m.height_m),
    wire.SetPartSizes: _part,
    wire.SetGirdleWidth: _width,
    wire.CoupleSides: lambda controller, _, m: controller.body_sizes.couple(m.on),
    wire.ApplySizes: lambda controller, _, m: controller.body_sizes.apply(m.person, m.refit),
    wire.ChangeBody: _change_body,
    wire.DraftSizes: _draft,
    wire.AcquireSizes: by_action(
        start=lambda controller, m: controller.body_acquisition.start(m.person, m.method),
        stop=lambda controller, _: controller.body_acquisition.stop(),
    ),
    wire.FindPeople: by_action(
        start=lambda controller, _: controller.finding.start(),
        stop=lambda controller, _: controller.finding.stop(),
        take=lambda controller, _: controller.finding.take_best(),
    ),
    CheckCalibration: by_action(
        start=lambda controller, _: controller.calibrating.start(),
        stop=lambda controller, _: controller.calibrating.stop(),
        preview=lambda controller, _: controller.calibrating.preview(True),
        leave=lambda controller, _: controller.calibrating.preview(False),
        apply=lambda controller, _: controller.calibrating.apply(),
        track_again=lambda controller, _: controller.calibrating.track_again(),
    ),
    UseClocks: _clocks,
    UseObservations: by_action(
        show=lambda controller, m: controller.observing.show(m.name),
        judge=lambda controller, m: controller.observing.judge(m.name),
        take=lambda controller, m: controller.observing.take(m.name),
        track=lambda controller, m: controller.observing.track(m.name, as_evidence=True),
        track_contours=lambda controller, m: controller.observing.track(m.name, as_evidence=False),
        detect=lambda controller, _: controller.observing.detect(),
        detect_track=lambda controller, _: controller.observing.detect(then_track=True),
        stop=lambda controller, _: controller.observing.stop(),
        discard=lambda controller, _: controller.observing.discard(),
    ),
    plan_wire.PlanTasks: _plan,
    plan_wire.DecideTask: by_action(
        verify=lambda controller, m: controller.annotating.verify(m.person, m.frame, m.pose),
        reject=lambda controller, m: controller.annotating.reject(m.person, m.frame, m.comment, m.pose),
        withdraw=lambda controller, m: controller.annotating.withdraw(m.person, m.frame),
    ),
    plan_wire.WriteComment: _comment,
    plan_wire.ResolveComment: lambda controller, _, m: controller.annotating.resolve(m.uid, m.action == "resolve"),
    plan_wire.AskNextClick: lambda controller, _, m: controller.proposing.start(),
    UseCopy: _copy,
    SetCopyTolerance: lambda controller, _, m: controller.other_copies.set_tolerance(m.tolerance_mm / 1000),
}
