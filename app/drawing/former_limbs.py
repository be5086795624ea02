"""Draw the former places of limbs that a fit moved although nobody had touched them."""

import numpy as np

from app.drawing.overlay_colors import KIND_COLORS
from app.drawing.overlays import Path
from app.drawing.seen_bodies import picture_times
from app.state.page_view import View
from app.state.state import State
from tracker.body.model import PosedBody
from tracker.contours import occluding_contours
from tracker.contours.pieces import PIECE_PX
from tracker.posing.edits import copy_dofs
from tracker.session.session import Session


def former_limb_lines(session: Session, state: State, view: View) -> list[Path]:
    """Draw each limb in the views that a page shows, as it would be when it is taken back."""
    last = state.compared
    if last is None or last.is_before_shown or "contours" not in state.compiled:
        return []
    out = []
    for person, move in last.moved:
        if person in state.visibility.hidden:
            continue
        model = state.models[person]
        values = copy_dofs(model, state.poses[person], last.before[person].values, move.limb.dofs)
        body = PosedBody(model, values, state.velocity(person))
        for index, time in picture_times(session, state.frame, view.cameras).items():
            camera = session.cameras[index].camera.pinhole
            contour = occluding_contours.trace([body.ahead(time)], camera, PIECE_PX * max(1.0, max(camera.size) / 640))
            pieces = contour.pieces_px[np.isin(contour.parts, move.limb.parts) & ~contour.occluded]
            out.append(Path(index, person, "former", KIND_COLORS["former"], pieces))
    return out
