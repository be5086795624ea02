"""Updates for the inspector of a page: only what changed since the last ones (docs/protocol.md)."""

from collections.abc import Sequence
from typing import cast

import numpy as np

from app.control.controller import Controller
from app.control.tracking import track_settings
from app.drawing import dof_labels
from app.drawing.misfit_field import NO_MISFITS, MisfitField, misfit_field
from app.messages import annotation as plan_wire
from app.messages import inspector as wire
from app.messages import observation as observed
from app.messages.base import Message, made_of
from app.messages.search import CostMapMessage, GhostPose, LimbReason, PartReason, ReasonMessage, TriedSearch
from app.page.feeds.cameras import calibration, clocks
from app.state.annotation import AnnotationState, ProposedClick
from app.state.floor_picking import FloorState
from app.state.identity import are_same
from app.state.observations import ObservationsState
from app.state.page_view import View
from app.state.people import AcquisitionState
from app.state.progress import FindState
from app.state.run_choices import RunChoices
from app.state.state import State
from tracker.body.dimensions import HEIGHT_LIMITS_M, dimensions_of, size_limits_m
from tracker.body.limbs import Search, SearchKind, limb_display_name, limbs
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.posing.grab import minor_points
from tracker.evaluation.judging.judge import Doubt
from tracker.formats.model_toml import PRESETS
from tracker.geometry.arrays import Array
from tracker.pipeline.calibration_check import CalibrationCheck
from tracker.pipeline.methods import METHODS

_MAX_LISTED = 500
"""Entries of the list by severity that a page receives: more than a person goes through at once."""


class InspectorFeed:
    """Remembers which settings and sizes one page has received."""

    def __init__(self) -> None:
        """Begin with nothing sent."""
        self._made_from: tuple[object, ...] = ()
        self._sent: list[Message] = []
        self._drawn: tuple[CalibrationCheck | None, MisfitField] = None, NO_MISFITS

    def is_due(self, state: State, _: View | None = None) -> bool:
        """Return whether there may be updates; quick, because during drags a state follows every few milliseconds."""
        return not are_same(_ingredients(state), self._made_from)

    def updates(self, controller: Controller, state: State) -> list[Message]:
        """Return the messages that bring the page up to date."""
        self._made_from = _ingredients(state)
        now: list[Message] = [
            settings(state.settings, state.run_choices), view_3d(controller, state), body_sizes(controller, state),
            acquisition(state.acquisition), finding(state.finding, [c.camera.name for c in controller.session.cameras]),
            clocks(controller.session, state.clocks),
            calibration(state.calibration, len(state.people), self._misfits(controller, state.calibration.check)),
            observations(state.observations, [p.name for p in controller.session.people]),
            annotation(state.annotation, [p.name for p in controller.session.people], controller.session.camera_names),
            reason(state, controller.session.camera_names), *cost_map(state),
        ]  # fmt: skip
        changed = [message for message in now if message not in self._sent]
        self._sent = now
        return changed

    def _misfits(self, controller: Controller, check: CalibrationCheck | None) -> MisfitField:
        """Return where the contours of a check miss the edges; summed up once."""
        if self._drawn[0] is not check:
            sizes = [c.camera.pinhole.size for c in controller.session.cameras]
            self._drawn = check, NO_MISFITS if check is None else misfit_field(check.residuals, sizes)
        return self._drawn[1]


def _ingredients(state: State) -> tuple[object, ...]:
    """Return what the messages are made from, for comparison by identity."""
    return (
        state.settings, state.run_choices, state.view_3d, state.floor, state.prediction_note, state.person, state.draft,
        state.present, state.sides_alike, state.sizes_message, state.acquisition,
        state.finding, state.calibration, state.clocks, state.observations, state.annotation, state.reasons,
        state.reason, state.frame, state.people[state.person].trace, state.cost_map,
    )  # fmt: skip


def settings(found: TrackSettings, choices: RunChoices) -> wire.SettingsMessage:
    """Describe the settings of tracker and search."""
    default = TrackSettings()
    return wire.SettingsMessage(choices, search_values(found), RunChoices(), search_values(default), methods())


def methods() -> tuple[wire.MethodInfo, ...]:
    """Describe the tracking methods and their options."""
    found = []
    for method in METHODS.values():
        default = track_settings.defaults(method)
        options = tuple(
            wire.OptionInfo(
                o.name, o.label, _sentence(o.help), o.kind, dict(o.choices or {}), o.limits, o.step, default[o.name]
            )
            for o in method.options
            if o.is_on_page
        )
        found.append(wire.MethodInfo(method.name, method.label, _sentence(method.help), options))
    return tuple(found)


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]


def search_values(found: TrackSettings) -> wire.SearchValues:
    """Describe the settings of the search that hold for all stages."""
    return made_of(
        wire.SearchValues,
        found.search,
        theta_px=found.theta_px,
        outliers=found.outliers,
        passes=tuple(found.search.passes),
    )


def view_3d(controller: Controller, state: State) -> wire.View3dMessage:
    """Describe what the 3-D view shows."""
    models = [p.model for p in controller.session.people]
    names = dict.fromkeys(n for m in models for n in m.point_names if n not in minor_points(m))
    return wire.View3dMessage(state.view_3d, _floor(state.floor), state.prediction_note, tuple(names), PRESETS)


def body_sizes(controller: Controller, state: State) -> wire.BodySizesMessage:
    """Describe the sizes of the person worked on."""
    person = state.person
    sizes = dimensions_of(controller.body_sizes.model(person))
    parts = (wire.PartSizes(name, p.length_m, *p.girths_m) for name, p in sizes.parts.items())
    return wire.BodySizesMessage(
        person=person,
        body=controller.session.people[person].model.name,
        bodies=PRESETS,
        height_m=sizes.height_m,
        parts=tuple(parts),
        widths=tuple(wire.GirdleWidth(name, width_m) for name, width_m in sizes.widths_m.items()),
        sides_alike=state.sides_alike,
        edited=state.draft is not None and state.draft.person == person,
        has_former=controller.body_sizes.has_former(person),
        outcome=state.sizes_message,
        height_limits_m=HEIGHT_LIMITS_M,
        size_limits_m=size_limits_m(sizes.height_m),
    )


def acquisition(found: AcquisitionState) -> wire.AcquisitionMessage:
    """Describe an acquisition of sizes."""
    result, outlines = None, found.outlines
    if outlines is not None:
        result = made_of(
            wire.AcquisitionResult, found, size_px=outlines.size_px, front=outlines.front, side=outlines.side
        )
    return made_of(wire.AcquisitionMessage, found, result=result)


def finding(found: FindState, cameras: Sequence[str]) -> wire.FindingMessage:
    """Describe the search for people.

    Args:
        found: its state.
        cameras: names of all cameras.
    """
    axes = tuple(wire.SilhouetteAxes(cameras.index(n), people) for n, people in found.axes.items() if n in cameras)
    return made_of(wire.FindingMessage, found, axes=axes, stage=found.trying or found.stage)


def observations(found: ObservationsState, people: Sequence[str]) -> observed.ObservationsMessage:
    """Describe imported observations.

    Args:
        found: their state.
        people: names of the people of the session.
    """
    judged = tuple(
        observed.JudgedPerson(j.person, j.share_in_order, len(j.frames), tuple(j.sentences)) for j in found.judgements
    )
    doubts = [(people.index(j.person), d) for j in found.judgements for d in j.worst if d.verdict.is_doubted]
    doubts.sort(key=lambda own: (-round(own[1].verdict.probability_off, 2), -own[1].verdict.distance_m))
    worst = tuple(_judged_limb(person, doubt) for person, doubt in doubts[:_MAX_LISTED])
    shown, is_previewed = found.shown.name if found.shown is not None else "", found.plan is not None
    return made_of(
        observed.ObservationsMessage, found, shown=shown, is_previewed=is_previewed, people=judged,
        worst=worst, off=len(doubts),
    )  # fmt: skip


def _judged_limb(person: int, doubt: Doubt) -> observed.JudgedLimb:
    verdict = doubt.verdict
    return observed.JudgedLimb(
        person, doubt.frame, doubt.limb, verdict.joint, verdict.reason, round(verdict.probability_off, 3),
        round(1000 * verdict.distance_m),
    )  # fmt: skip


def annotation(found: AnnotationState, people: Sequence[str], cameras: Sequence[str]) -> plan_wire.AnnotationMessage:
    """Describe the plan of annotation.

    Args:
        found: its state.
        people: names of the people of the session; rows of others are left out.
        cameras: names of all cameras.
    """
    index = {name: i for i, name in enumerate(people)}
    tasks = tuple(
        plan_wire.TaskInfo(
            index[t.row.person], t.row.frame, t.row.annotator, cast(plan_wire.TaskState, t.state), t.comment, t.by,
            t.row.kind == "disagreement", t.pose,
        )
        for t in found.tasks
        if t.row.person in index
    )  # fmt: skip
    comments = tuple(
        plan_wire.CommentInfo(
            c.row.uid, index[c.row.person], c.row.frame, limb_display_name(c.row.limb) if c.row.limb else "",
            c.row.text, c.row.author, c.resolved,
        )
        for c in found.comments
        if c.row.person in index
    )  # fmt: skip
    speeds = tuple(
        plan_wire.SpeedInfo(
            s.name, s.verified, s.seconds_per_frame, s.edits_per_frame, s.decisions, s.seconds_per_decision
        )
        for s in found.speeds
    )
    return plan_wire.AnnotationMessage(found.author, tasks, comments, speeds, _proposal(found.proposed, cameras))


def _proposal(found: ProposedClick, cameras: Sequence[str]) -> plan_wire.ClickProposal:
    click = found.click
    described = None if click is None else plan_wire.NextClick(
        click.frame, click.person, click.limb, tuple(cameras.index(v) for v in click.views), round(click.gain_mm, 3),
        click.reason,
    )  # fmt: skip
    error = None if found.found is None else round(found.found.error_mm, 2)
    interval = None if found.found is None else found.found.interval_mm
    return plan_wire.ClickProposal(
        found.number, found.running, found.message, described, error, interval,
        None if found.after_mm is None else round(found.after_mm, 2),
    )  # fmt: skip


def reason(state: State, cameras: Sequence[str]) -> ReasonMessage:
    """Describe why the shown pose is in doubt, or how far the work on that is.

    Args:
        state: with the reason.
        cameras: names of all cameras.
    """
    found, work = state.reason, state.reasons
    limbs_of, parts, notes = tuple[LimbReason, ...](), tuple[PartReason, ...](), tuple[str, ...]()
    worst = None if found is None else found.contradiction
    if found is not None:
        table, model = found.table, state.models[found.person]
        of_limbs = limbs(model)
        trunk = tuple(sorted(set(range(len(model.parts))).difference(*(x.parts.tolist() for x in of_limbs))))
        of_body = [LimbReason(limb_display_name(x.name), tuple(x.parts.tolist())) for x in of_limbs]
        limbs_of = (LimbReason("trunk", trunk), *of_body)
        parts = tuple(
            PartReason(
                _column(table.below, i), _column(table.outside, i), _column(table.usual_outside, i),
                _column(table.contour_px, i), _column(table.usual_contour_px, i), float(table.below_in_all[i]),
            )
            for i in range(len(model.parts))
        )  # fmt: skip
        bare = [name for name, row in zip(cameras, table.outside, strict=True) if np.isnan(row).all()]
        if bare:
            notes = (f"Without a background or masks, nothing is known of the outside in {', '.join(bare)}.",)
    return ReasonMessage(
        state.frame, state.person, work.running, work.stage, work.share, work.message,
        "" if worst is None else worst.sentence, None if worst is None else worst.part,
        None if worst is None else worst.view, limbs_of, parts, notes,
        () if found is None else tuple(GhostPose(round(o.nats, 1), o.limbs) for o in found.alternatives or ()),
        tried(state.people[state.person].trace),
    )  # fmt: skip


_SEARCHES: dict[SearchKind, str] = {
    "limbs": "{}",
    "exchange": "{} exchanged",
    "body": "whole body",
    "samples": "samples around the pose",
    "path": "{}, by all frames together",
    "repair": "{}, by colours of the run",
}
"""Words of each kind of search, with the names of its limbs."""


def tried(trace: Sequence[Search] | None) -> tuple[TriedSearch, ...] | None:
    """Describe the searches of the tracker on a frame."""
    if trace is None:
        return None
    names = [" and ".join(map(limb_display_name, x.limbs)) for x in trace]
    words = [_SEARCHES[x.kind].format(own or "pose") for x, own in zip(trace, names, strict=True)]
    return tuple(TriedSearch(w, x.before_nats, x.after_nats, x.taken) for w, x in zip(words, trace, strict=True))


def cost_map(state: State) -> tuple[CostMapMessage, ...]:
    """Describe the cost over two degrees of freedom; empty without one."""
    found = state.cost_map
    if found is None:
        return ()
    a, b = (float(dof_labels.factors(state.models[found.person])[dof]) for dof in found.dofs)
    across, up = tuple((a * found.across).round(2).tolist()), tuple((b * found.up).round(2).tolist())
    nats = tuple(tuple(row) for row in found.nats.round(1).tolist())
    return (CostMapMessage(found.person, found.dofs, (a * found.current[0], b * found.current[1]), across, up, nats),)


def _column(cells: Array, i: int) -> tuple[float | None, ...]:
    """Return a column of cells by view, (V, n), for JSON."""
    return tuple(round(float(c), 3) if np.isfinite(c) else None for c in cells[:, i])


def _floor(floor: FloorState) -> wire.FloorInfo:
    if floor.plane is None:
        return wire.FloorInfo(floor.up, None, None, "", floor.former)
    cosine = np.clip(np.abs(floor.plane.normal).max(), -1, 1)
    tilt_deg = float(np.degrees(np.arccos(cosine)))
    return wire.FloorInfo(floor.up, tilt_deg, floor.plane.offset_m, floor.origin, floor.former)
