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


def _acquire(controller: Controller, _: int, message: wire.AcquireSizes) -> None:
    if message.action == "start":
        controller.body_acquisition.start(message.person, message.method)
    else:
        controller.body_acquisition.stop()


def _find_people(controller: Controller, _: int, message: wire.FindPeople) -> None:
    finding = controller.finding
    {"start": finding.start, "stop": finding.stop, "take": finding.take_best}[message.action]()


def _calibration(controller: Controller, _: int, message: CheckCalibration) -> None:
    calibrating = controller.calibrating
    actions: dict[str, Callable[[], None]] = {
        "start": calibrating.start,
        "stop": calibrating.stop,
        "preview": lambda: calibrating.preview(True),
        "leave": lambda: calibrating.preview(False),
        "apply": calibrating.apply,
        "track_again": calibrating.track_again,
    }
    actions[message.action]()


def _clocks(controller: Controller, _: int, message: UseClocks) -> None:
    clocks, n_cameras = controller.clocks, len(controller.session.cameras)
    for camera in (message.camera, message.other):
        if camera >= n_cameras:
            raise MessageError(f"a camera below {n_cameras}", str(camera))
    actions: dict[str, Callable[[], None]] = {
        "nudge": lambda: clocks.nudge(message.camera, message.frames),
        "estimate": lambda: clocks.estimate(message.way),
        "take": lambda: clocks.take(message.camera),
        "moment": lambda: clocks.find_moment((message.camera, message.other)),
        "stop": clocks.stop,
    }
    actions[message.action]()


def _observations(controller: Controller, _: int, message: UseObservations) -> None:
    observing = controller.observing
    actions: dict[str, Callable[[], None]] = {
        "show": lambda: observing.show(message.name),
        "judge": lambda: observing.judge(message.name),
        "take": lambda: observing.take(message.name),
        "track": lambda: observing.track(message.name, as_evidence=True),
        "detect": observing.detect,
        "detect_track": lambda: observing.detect(then_track=True),
        "track_contours": lambda: observing.track(message.name, as_evidence=False),
        "stop": observing.stop,
        "discard": observing.discard,
    }
    actions[message.action]()


def _plan(controller: Controller, _: int, message: plan_wire.PlanTasks) -> None:
    choice = FrameChoice(
        message.n if message.by == "every" else 0,
        (message.frames.strip() or "-") if message.by == "frames" else "",
        message.n if message.by == "diverse" else 0,
        message.by == "doubted",
    )
    controller.annotating.plan(choice, message.person, message.to, message.each)


def _decide(controller: Controller, _: int, message: plan_wire.DecideTask) -> None:
    annotating, person, frame = controller.annotating, message.person, message.frame
    actions: dict[str, Callable[[], None]] = {
        "verify": lambda: annotating.verify(person, frame, message.pose),
        "reject": lambda: annotating.reject(person, frame, message.comment, message.pose),
        "withdraw": lambda: annotating.withdraw(person, frame),
    }
    actions[message.action]()


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
    wire.AcquireSizes: _acquire,
    wire.FindPeople: _find_people,
    CheckCalibration: _calibration,
    UseClocks: _clocks,
    UseObservations: _observations,
    plan_wire.PlanTasks: _plan,
    plan_wire.DecideTask: _decide,
    plan_wire.WriteComment: _comment,
    plan_wire.ResolveComment: lambda controller, _, m: controller.annotating.resolve(m.uid, m.action == "resolve"),
    plan_wire.AskNextClick: lambda controller, _, m: controller.proposing.start(),
    UseCopy: _copy,
    SetCopyTolerance: lambda controller, _, m: controller.other_copies.set_tolerance(m.tolerance_mm / 1000),
}
