"""Messages to a page as pure functions of the state (docs/protocol.md)."""

import secrets
from collections.abc import Mapping, Sequence
from typing import Any, cast

import msgspec
import numpy as np

from app.drawing import dof_labels, joint_handles, overlays, part_outlines, pin_marks
from app.drawing.curves import CurveGroup, plots_of, samples
from app.drawing.epipolar_check import epipolar_check
from app.drawing.error_ellipses import error_ellipses
from app.drawing.floor_lines import floor_lines
from app.drawing.ghosts import copy_lines, former_limb_lines, ghost_lines
from app.drawing.seen_bodies import bodies_in
from app.messages import annotation as plan_wire
from app.messages import search
from app.messages import server as wire
from app.messages.base import encode_binary, made_of
from app.messages.binary_headers import CellsHeader, CurvesHeader, Outline, OverlayHeader, Path, Plot
from app.participants.participants import Presence, Visit
from app.state.comparison import RangeComparison
from app.state.floor_picking import Picking
from app.state.page_view import View
from app.state.role import Role
from app.state.state import State
from tracker.body.limbs import limb_display_name, limbs
from tracker.estimation.posing.grab import heading_points, minor_points
from tracker.estimation.tracking.pose_errors import DOUBTFUL_FROM, LOST_FROM
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import FloatArray
from tracker.session.session import Person, Session
from tracker.session.store.records import SOURCES, STATUSES, FramePose, HistoryEntry

_FEW_CELLS = 2000
"""Largest number of timeline cells sent by name. More are sent as columns, which take a tenth of the bytes and time."""
_NO_POSE = 255
_START = secrets.token_hex(8)
_NO_CELL: dict[str, Any] = {
    "source": "",
    "cost_px": None,
    "keyframe": False,
    "status": "",
    "remark": "",
    "reviewed": False,
    "ambiguous": False,
    "limbs_lost": (),
}


def session(session: Session, role: Role = "host", has_place: bool = True) -> wire.SessionMessage:
    """Describe the session to a page of a role, with a frame of its own or not."""
    cameras = tuple(wire.CameraInfo(c.camera.name, *c.camera.pinhole.size) for c in session.cameras)
    people = tuple(_person(p) for p in session.people)
    return wire.SessionMessage(
        session.name, session.fps, session.n_frames, cameras, people, DOUBTFUL_FROM, LOST_FROM, _START, role,
        has_place, session.has_outlines,
    )  # fmt: skip


def presence(visit: Visit, people: Sequence[Presence]) -> plan_wire.PresenceMessage:
    """Tell a page who is where."""
    own = visit.participant and (visit.role, visit.name)
    here = tuple(
        plan_wire.PresentPerson(p.name, p.role, p.frame, p.person, p.doing, (p.role, p.name) == own) for p in people
    )
    return plan_wire.PresenceMessage(visit.name, visit.refusal, visit.link, here)


def _person(person: Person) -> wire.PersonInfo:
    model = person.model
    fields = {
        "name": person.name,
        "color": person.color,
        "model": model.name,
        "height_m": model.height_m,
        "points": list(model.point_names),
        "minor": list(minor_points(model)),
        "heading": list(heading_points(model)),
        "bones": model.bones,
        "parts": [part.name for part in model.parts],
        "limbs": [limb_display_name(limb.name) for limb in limbs(model)],
        **dof_labels.described(model),
    }
    return msgspec.convert(fields, wire.PersonInfo)


def state(session: Session, state: State) -> wire.StateMessage:
    """Describe the texts and figures of the page."""
    shown, drawn, view, compared = state.people[state.person], state.drawn, state.search_view, state.compared
    people = tuple(
        wire.PersonState(p.source, _status(p.status), i not in state.visibility.hidden, len(p.alternatives))
        for i, p in enumerate(state.people)
    )
    return made_of(
        wire.StateMessage,
        state,
        people=people,
        solo=state.visibility.solo,
        cost_px=drawn.cost_px,
        view_costs_px=drawn.view_costs_px,
        source=shown.source,
        status=_status(shown.status),
        remark=shown.remark,
        is_checked=(state.person, state.frame) in state.checked,
        part_costs_px=shown.part_costs_px,
        expected_errors_m=tuple(shown.expected_errors_m.round(4).tolist()),
        dofs=tuple(dof_labels.shown(state.models[state.person], shown.values)),
        locked=tuple(sorted(state.locked[state.person])),
        other_sizes=state.revisions[state.person] != state.present[state.person],
        job=made_of(wire.Job, state.search),
        replay=None if view.replay is None else made_of(wire.ReplayedStep, view.replay),
        compared_run=view.compared_run,
        preview=None if view.preview is None else made_of(wire.PreviewedCandidate, view.preview),
        compared=None if compared is None else made_of(wire.Compared, compared),
        view_across=None if state.undetermined_depth is None else state.undetermined_depth.unseen.camera,
        track=made_of(wire.Track, state.track),
        range=made_of(wire.RangeWork, state.ranges),
        floor=_floor(state.floor.picking),
    )


def overlay(session: Session, state: State, page: int, view: View, views: Sequence[ViewEvidence] | None) -> bytes:
    """Draw the vectors over the views that a page shows.

    Args:
        session: with its cameras and people.
        state: what to draw.
        page: number of the page whose drags the message answers.
        view: what the page shows.
        views: the evidence of the shown frame, if it is cached.
    """
    segments: list[FloatArray] = []
    rows, hulls, first = [], [], 0
    for path in [
        *overlays.paths(session, state, view, views),
        *pin_marks.pin_lines(session, state, view),
        *floor_lines(session, state),
        *former_limb_lines(session, state, view),
        *ghost_lines(session, state, view),
        *copy_lines(session, state, view),
        *error_ellipses(session, state, view),
    ]:
        count = len(path.segments_px)
        rows.append(Path(path.camera, path.person, path.kind, path.color, path.side, first, count))
        segments.append(path.segments_px)
        first += count
    for hull in part_outlines.part_hulls(session, state, view):
        count = len(hull.segments_px)
        hulls.append(Outline(hull.camera, hull.person, hull.part, hull.depth, first, count))
        segments.append(hull.segments_px)
        first += count
    handles = joint_handles.handles(session, state.drawn, view.cameras)
    header = OverlayHeader(
        frame=state.frame,
        seq=dict(state.drag_seqs).get(page, 0),
        job=state.search.running,
        paths=tuple(rows),
        outlines=tuple(hulls),
        handles=tuple(handles),
        heads=tuple(joint_handles.head_circles(session, state.drawn, view.cameras)) if "faces" in view.layers else (),
        out_of_reach=joint_handles.out_of_reach(session, state),
        pins=tuple(pin_marks.pin_marks(session, state)),
        triangulation=pin_marks.pin_triangulation(session, state),
    )
    return encode_binary(header, np.concatenate(segments).astype("<f4").tobytes() if segments else b"")


def timeline(
    cells: Mapping[int, dict[str, Any] | None], replace: bool, person: int | None = None
) -> wire.TimelineMessage | bytes:
    """Describe cells of the timeline: a few by name, many as columns.

    Args:
        cells: by frame; None for a frame that has no pose any more.
        replace: whether all other frames have no pose.
        person: index of one person among several; None for all people together.
    """
    if len(cells) <= _FEW_CELLS:
        named = {str(k): None if cell is None else wire.Cell(**cell) for k, cell in cells.items()}
        return wire.TimelineMessage(person, named, replace)
    frames = sorted(cells)
    rows = [cells[k] or _NO_CELL for k in frames]
    header = CellsHeader(
        person=person,
        replace=replace,
        count=len(frames),
        sources=SOURCES,
        statuses=tuple(map(_status, STATUSES)),
        remarks={str(k): row["remark"] for k, row in zip(frames, rows, strict=True) if row["remark"]},
        limbs_lost={str(k): row["limbs_lost"] for k, row in zip(frames, rows, strict=True) if row["limbs_lost"]},
    )
    costs = np.array([row["cost_px"] for row in rows], dtype="<f4")  # None becomes NaN
    source, status = {name: i for i, name in enumerate(SOURCES)}, {name: i for i, name in enumerate(STATUSES)}
    columns = np.array(
        [
            [source.get(row["source"], _NO_POSE) for row in rows],
            [status[row["status"]] for row in rows],
            [row["keyframe"] + 2 * row["reviewed"] + 4 * row["ambiguous"] for row in rows],
        ],
        dtype=np.uint8,
    )
    return encode_binary(header, np.array(frames, dtype="<u4").tobytes() + costs.tobytes() + columns.tobytes())


def history(entries: Sequence[HistoryEntry], limit: int) -> wire.HistoryMessage:
    """List the history, latest entry first.

    Args:
        entries: those that redo and undo can reach, at most `limit + 1` of each.
        limit: how many of each the page shows.
    """
    undone, done = [e for e in entries if e.undone], [e for e in entries if not e.undone]
    shown = tuple(wire.HistoryEntry(*e) for e in [*undone[-limit:], *done[:limit]])
    return wire.HistoryMessage(shown, later=len(undone) > limit, earlier=len(done) > limit)


def curves(
    session: Session, person: int, group: CurveGroup, frames: Sequence[int], rows: Sequence[FramePose], replace: bool
) -> bytes:
    """Sample a group of curves of one person; NaN where a frame has no pose.

    Args:
        session: with its cameras and people.
        person: index of the person.
        group: which curves.
        frames: the frames of the message, ascending.
        rows: the stored poses on those of the frames that have one.
        replace: whether all other frames have no pose.
    """
    model, cameras = session.people[person].model, [c.camera.name for c in session.cameras]
    plots = plots_of(model, cameras, group)
    drawn = tuple(msgspec.convert(p._asdict(), Plot) for p in plots)
    header = CurvesHeader(group, person, replace, len(frames), drawn)
    values = samples(model, plots, frames, rows)
    return encode_binary(header, np.asarray(frames, dtype="<u4").tobytes() + values.astype("<f4").tobytes())


def _status(status: str) -> wire.Status:
    return cast(wire.Status, status)


def _floor(picking: Picking | None) -> wire.FloorPicking | None:
    if picking is None:
        return None
    last = picking.picks[-1]
    return wire.FloorPicking(
        point=len(picking.picks),
        views=len(last.marks),
        marked=any(p.marks for p in picking.picks),
        known=last.point_world is not None,
        error_px=last.error_px,
        ready=picking.plane is not None,
        why=picking.why or last.why,
    )


def inconsistent(state: State) -> search.InconsistentMessage:
    """List the frames and keyframes that disagree with the motion around them or with views."""
    doubts = tuple(
        search.KeyframeDoubt(
            doubt.person, doubt.frame, None if doubt.distance_m is None else round(100 * doubt.distance_m, 1),
            doubt.point,
            tuple(
                search.RaisedViewCost(view.camera, round(view.cost_px, 2), round(view.usual_px, 2))
                for view in doubt.views
            ),
            doubt.reason,
        )
        for doubt in state.keyframe_doubts
    )  # fmt: skip
    return search.InconsistentMessage(state.inconsistent_frames, doubts)


def epipolar(session: Session, state: State, points: Sequence[tuple[int, float, float]]) -> wire.EpipolarMessage:
    """Describe the line of sight of a pixel, by the corrected cameras while they are previewed."""
    mended = state.calibration.shown_on(state.frame)
    cameras = [c.camera for c in session.cameras] if mended is None else mended.cameras
    bodies = [b for i, b in enumerate(bodies_in(session, state)) if i not in state.people_not_drawn]
    found = epipolar_check(cameras, [(c, np.array([u, v])) for c, u, v in points], bodies)
    return wire.EpipolarMessage(found.lines, found.distance)


def range_comparison(found: RangeComparison | None) -> search.RangeComparisonMessage:
    """Describe the poses of a range against those that they replaced."""
    if found is None:
        return search.RangeComparisonMessage(None, None, (), (), None)
    return search.RangeComparisonMessage(found.first, found.last, found.frames, found.stretches, found.run)
