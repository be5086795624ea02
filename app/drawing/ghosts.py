"""Draw poses beside the shown one: alternatives, those of another copy, and former places of limbs that a fit moved."""

import numpy as np

from app.drawing.overlay_colors import KIND_COLORS
from app.drawing.overlays import Path, PathKind, traced
from app.drawing.seen_bodies import picture_times
from app.state.page_view import View
from app.state.state import State
from tracker.body.limbs import limb_display_name, limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.posing.edits import copy_dofs
from tracker.geometry.arrays import IntArray
from tracker.session.session import Session


def ghost_lines(session: Session, state: State, view: View) -> list[Path]:
    """Draw the alternatives of the reason in the views that a page shows, in their order.

    Each has a path in each view, which may be empty: the rank of a path is that of its alternative.
    """
    reason, out = state.drawn.reason, list[Path]()
    if reason is None or "alternatives" not in view.layers or "contours" not in state.compiled:
        return out
    person, model = reason.person, state.models[reason.person]
    if person in state.people_not_drawn:
        return out
    times = picture_times(session, state.frame, view.cameras)
    for other in reason.alternatives or ():
        body, parts = PosedBody(model, other.values, state.velocity(person)), _parts_of(model, other.limbs)
        out += _outlined(session, times, body, person, "alternative", parts)
    return out


def copy_lines(session: Session, state: State, view: View) -> list[Path]:
    """Draw the poses that another copy of the session has on the shown frame."""
    copy, out = state.other_copy, list[Path]()
    if copy is None or "contours" not in view.layers or "contours" not in state.compiled:
        return out
    times = picture_times(session, state.frame, view.cameras)
    for person, poses in enumerate(copy.poses):
        body = poses.get(state.frame)
        if body is not None and person not in state.people_not_drawn:
            out += _outlined(session, times, body, person, "other_copy", np.arange(len(body.model.parts)))
    return out


def former_limb_lines(session: Session, state: State, view: View) -> list[Path]:
    """Draw each limb that a fit moved untouched, in the views that a page shows, as when it is taken back."""
    last = state.compared
    if last is None or last.is_before_shown or "contours" not in state.compiled:
        return []
    out, times = list[Path](), picture_times(session, state.frame, view.cameras)
    for person, move in last.moved:
        if person not in state.visibility.hidden:
            model = state.models[person]
            values = copy_dofs(model, state.poses[person], last.before[person].values, move.limb.dofs)
            body = PosedBody(model, values, state.velocity(person))
            out += _outlined(session, times, body, person, "former", np.array(move.limb.parts))
    return out


def _outlined(
    session: Session, times: dict[int, float], body: PosedBody, person: int, kind: PathKind, parts: IntArray
) -> list[Path]:
    """Draw the visible contours of some parts of one body alone, in views given with the times of their pictures."""
    out = []
    for index, time in times.items():
        contour = traced([body.ahead(time)], session.cameras[index].camera.pinhole)
        pieces = contour.pieces_px[np.isin(contour.parts, parts) & ~contour.occluded]
        out.append(Path(index, person, kind, KIND_COLORS[kind], pieces))
    return out


def _parts_of(model: BodyModel, names: tuple[str, ...]) -> IntArray:
    """Return the parts of some limbs; all parts of a body that is elsewhere as a whole."""
    chosen = [x.parts for x in limbs(model) if limb_display_name(x.name) in names]
    return np.concatenate(chosen) if chosen else np.arange(len(model.parts))
