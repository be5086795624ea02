"""What the program tells a page, as pure functions of the state (docs/protocol.md)."""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from app.drawing import dof_labels, overlays, part_outlines, pin_marks
from app.drawing.curves import plots_of, samples
from app.drawing.floor_lines import floor_lines
from app.state.floor_picking import Picking
from app.state.page_view import View
from app.state.progress import TrackState
from app.state.search import ReplayState, SearchState
from app.state.state import State
from tracker.evidence.view_evidence import ViewEvidence
from tracker.posing.drag import minor_points
from tracker.session.session import Session
from tracker.store.records import SOURCES, STATUSES, FrameNumbers, HistoryEntry

_FEW_CELLS = 2000
"""Cells of the timeline that travel by name; more go as columns, a tenth of the bytes and of the work."""
_NO_POSE = 255
_NO_CELL: dict[str, Any] = {
    "source": "",
    "cost_px": None,
    "keyframe": False,
    "status": "",
    "remark": "",
    "reviewed": False,
    "ambiguous": False,
}


def session(session: Session) -> dict[str, Any]:
    """What a page needs to know of the session, once."""
    return {
        "type": "session",
        "name": session.name,
        "fps": session.fps,
        "n_frames": session.n_frames,
        "cameras": [
            {"name": c.camera.name, "width": c.camera.width, "height": c.camera.height} for c in session.cameras
        ],
        "people": [
            {
                "name": p.name,
                "color": p.color,
                "model": p.model.name,
                "height_m": p.model.height_m,
                "points": list(p.model.point_names),
                "minor": list(minor_points(p.model)),
                "bones": [list(b) for b in overlays.bones(p.model)],
                "parts": [part.name for part in p.model.parts],
                **dof_labels.described(p.model),
            }
            for p in session.people
        ],
    }


def state(session: Session, state: State) -> dict[str, Any]:
    """The texts and figures of the page."""
    shown, drawn = state.people[state.person], state.drawn
    return {
        "type": "state",
        "frame": state.frame,
        "person": state.person,
        "point": state.point,
        "people": [
            {
                "source": p.source,
                "status": p.status,
                "shown": i not in state.visibility.hidden,
                "alternatives": len(p.others),
            }
            for i, p in enumerate(state.people)
        ],
        "solo": state.visibility.solo,
        "cost_px": drawn.cost_px,
        "view_costs_px": list(drawn.view_costs_px),
        "source": shown.source,
        "status": shown.status,
        "remark": shown.remark,
        "part_costs_px": list(shown.parts_px),
        "dofs": dof_labels.shown(session.people[state.person].model, shown.values),
        "locked": sorted(state.locked[state.person]),
        "other_sizes": state.revisions[state.person] != state.present[state.person],
        "job": _job(state.search),
        "replay": _replay(state.search_view.replay),
        "track": _track(state.track),
        "range": asdict(state.ranges),
        "follow": state.follow,
        "snapped": state.snapped,
        "floor": _floor(state.floor.picking),
        "footage": asdict(state.footage),
        "compiling": state.compiling,
        "undo": state.undo,
        "redo": state.redo,
        "saved": state.save_error is None,
        "save_error": state.save_error,
    }


def overlay(session: Session, state: State, page: int, view: View, views: Sequence[ViewEvidence] | None) -> bytes:
    """The vectors over the views that a page shows.

    Args:
        session: with its cameras and people.
        state: what to draw.
        page: number of the page, whose drags the message answers.
        view: what the page shows.
        views: the evidence of the shown frame, where it is at hand.
    """
    segments, rows, first = [], [], 0
    for path in [
        *overlays.paths(session, state, view, views),
        *pin_marks.pin_lines(session, state, view),
        *floor_lines(session, state),
    ]:
        count = len(path.segments_px)
        rows.append(
            {
                "camera": path.camera,
                "person": path.person,
                "kind": path.kind,
                "color": path.color,
                "first": first,
                "count": count,
            }
        )
        segments.append(path.segments_px)
        first += count
    parts = []
    for outline in part_outlines.outlines(session, state, view):
        count = len(outline.segments_px)
        what = {"camera": outline.camera, "person": outline.person, "part": outline.part, "depth": outline.depth}
        parts.append(what | {"first": first, "count": count})
        segments.append(outline.segments_px)
        first += count
    met = pin_marks.meeting(session, state)
    header = {
        "type": "overlay",
        "frame": state.frame,
        "seq": dict(state.drag_seqs).get(page, 0),
        "job": state.search.running,
        "paths": rows,
        "outlines": parts,
        # Joints are there to be taken, and a step that is replayed is no pose to be taken.
        "handles": [h._asdict() for h in overlays.handles(session, state, view.cameras)]
        if state.search_view.replay is None
        else [],
        "pins": [p._asdict() for p in pin_marks.pin_marks(session, state)],
        "triangulation": None if met is None else met._asdict() | {"marks": [m._asdict() for m in met.marks]},
    }
    return binary(header, np.concatenate(segments).astype("<f4").tobytes() if segments else b"")


def timeline(
    cells: Mapping[int, dict[str, Any] | None], replace: bool, person: int | None = None
) -> dict[str, Any] | bytes:
    """Cells of the timeline: a few by name, many as columns.

    Args:
        cells: by frame; None for a frame that has no pose any more.
        replace: whether all other frames have no pose.
        person: whose, of several; None for what is said of all together.
    """
    if len(cells) <= _FEW_CELLS:
        named = {str(k): cell for k, cell in cells.items()}
        return {"type": "timeline", "person": person, "cells": named, "replace": replace}
    frames = sorted(cells)
    rows = [cells[k] or _NO_CELL for k in frames]
    header = {
        "type": "cells",
        "person": person,
        "replace": replace,
        "count": len(frames),
        "sources": SOURCES,
        "statuses": STATUSES,
        "remarks": {str(k): row["remark"] for k, row in zip(frames, rows, strict=True) if row["remark"]},
    }
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
    return binary(header, np.array(frames, dtype="<u4").tobytes() + costs.tobytes() + columns.tobytes())


def history(entries: Sequence[HistoryEntry], limit: int) -> dict[str, Any]:
    """The history, latest entry first.

    Args:
        entries: that redo and undo can reach, at most `limit` and one more of each.
        limit: how many of each the page shows.
    """
    undone, done = [e for e in entries if e.undone], [e for e in entries if not e.undone]
    return {
        "type": "history",
        "entries": [e._asdict() for e in [*undone[-limit:], *done[:limit]]],
        "later": len(undone) > limit,
        "earlier": len(done) > limit,
    }


def disagreeing(frames: Sequence[int]) -> dict[str, Any]:
    """The frames that disagree with their neighbours, all of them."""
    return {"type": "inconsistent", "frames": list(frames)}


def curves(
    session: Session, person: int, group: str, frames: Sequence[int], rows: Sequence[FrameNumbers], replace: bool
) -> bytes:
    """A group of curves of one person on some frames; NaN where a frame has no pose.

    Args:
        session: with its cameras and people.
        person: whose.
        group: one of `curves.GROUPS`.
        frames: the frames that the message is about, ascending.
        rows: what is stored on those of them that have a pose.
        replace: whether all other frames have no pose.
    """
    model, cameras = session.people[person].model, [c.camera.name for c in session.cameras]
    plots = plots_of(model, cameras, group)
    header = {
        "type": "curves",
        "group": group,
        "person": person,
        "replace": replace,
        "count": len(frames),
        "plots": [{"title": p.title, "unit": p.unit, "labels": list(p.labels)} for p in plots],
    }
    values = samples(model, plots, frames, rows)
    return binary(header, np.asarray(frames, dtype="<u4").tobytes() + values.astype("<f4").tobytes())


def binary(header: dict[str, Any], payload: bytes) -> bytes:
    """`[uint32 LE length of the header][header: JSON, UTF-8][payload]`."""
    head = json.dumps(header).encode()
    return struct.pack("<I", len(head)) + head + payload


def _floor(picking: Picking | None) -> dict[str, Any] | None:
    """How far the clicking of the floor's points has come."""
    if picking is None:
        return None
    last = picking.picks[-1]
    return {
        "point": len(picking.picks),
        "views": len(last.marks),
        "marked": any(p.marks for p in picking.picks),
        "known": last.point_world is not None,
        "error_px": last.error_px,
        "ready": picking.plane is not None,
        "why": picking.why or last.why,
    }


def _job(job: SearchState) -> dict[str, Any]:
    return {
        "running": job.running,
        "kind": job.kind,
        "stage": job.stage,
        "stages": list(job.stages),
        "evaluations": job.evaluations,
        "per_second": job.per_second,
        "best_px": job.best_px,
        "message": job.message,
    }


def _replay(replay: ReplayState | None) -> dict[str, Any] | None:
    if replay is None:
        return None
    return {"run": replay.run, "step": replay.step, "steps": replay.steps, "stage": replay.stage}


def _track(track: TrackState) -> dict[str, Any]:
    return {
        "running": track.running,
        "first": track.first,
        "last": track.last,
        "at": track.at,
        "done": track.done,
        "total": track.total,
        "per_second": track.per_second,
        "doubtful": track.doubtful,
        "lost": track.lost,
        "back": track.back,
        "message": track.message,
    }
