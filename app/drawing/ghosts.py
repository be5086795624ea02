"""Draw poses beside the shown one: limbs that are elsewhere in poses about as good, and the poses of another copy."""

import numpy as np

from app.drawing.overlay_colors import KIND_COLORS
from app.drawing.overlays import Path
from app.drawing.seen_bodies import picture_times
from app.state.page_view import View
from app.state.state import State
from tracker.body.limbs import limb_display_name, limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.contours import occluding_contours
from tracker.contours.pieces import PIECE_PX
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
    if person in state.undrawn:
        return out
    for other in reason.alternatives or ():
        body, parts = PosedBody(model, other.values, state.velocity(person)), _parts_of(model, other.limbs)
        for index, time in picture_times(session, state.frame, view.cameras).items():
            camera = session.cameras[index].camera.pinhole
            contour = occluding_contours.trace([body.ahead(time)], camera, PIECE_PX * max(1.0, max(camera.size) / 640))
            pieces = contour.pieces_px[np.isin(contour.parts, parts) & ~contour.occluded]
            out.append(Path(index, person, "alternative", KIND_COLORS["alternative"], pieces))
    return out


def copy_lines(session: Session, state: State, view: View) -> list[Path]:
    """Draw the poses that another copy of the session has on the shown frame."""
    copy, out = state.other_copy, list[Path]()
    if copy is None or "contours" not in view.layers or "contours" not in state.compiled:
        return out
    for person, poses in enumerate(copy.poses):
        body = poses.get(state.frame)
        if body is None or person in state.undrawn:
            continue
        for index in picture_times(session, state.frame, view.cameras):
            camera = session.cameras[index].camera.pinhole
            contour = occluding_contours.trace([body], camera, PIECE_PX * max(1.0, max(camera.size) / 640))
            pieces = contour.pieces_px[~contour.occluded]
            out.append(Path(index, person, "other_copy", KIND_COLORS["other_copy"], pieces))
    return out


def _parts_of(model: BodyModel, names: tuple[str, ...]) -> IntArray:
    """Return the parts of some limbs; all parts of a body that is elsewhere as a whole."""
    chosen = [x.parts for x in limbs(model) if limb_display_name(x.name) in names]
    return np.concatenate(chosen) if chosen else np.arange(len(model.parts))
