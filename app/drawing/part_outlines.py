"""Convex hulls of the body parts in each view, for picking parts with the pointer."""

from typing import NamedTuple

import numpy as np

from app.drawing.seen_bodies import at_one_time, bodies_in, picture_times
from app.state.page_view import View
from app.state.state import State
from tracker.body.model import ahead
from tracker.estimation.posing import picking
from tracker.geometry.arrays import FloatArray
from tracker.session.session import Session


class PartOutline(NamedTuple):
    """The convex hull of a part in a view."""

    camera: int
    person: int
    part: int
    depth: float
    """Distance of the part, metres. The nearest of overlapping hulls counts."""
    segments_px: FloatArray
    """Its closed outline as x0, y0, x1, y1, (N, 4), undistorted px."""


def part_hulls(session: Session, state: State, view: View) -> list[PartOutline]:
    """Return the hulls of all visible people in the views that a page shows.

    While a point is dragged there are none, and while a part is dragged there is only its own, because they would only
    delay the drag. A replayed or former pose has none, because it is not the stored one.
    """
    drag = state.drag
    if "joints" not in view.layers or not state.is_stored_drawn or (drag is not None and not drag.by_surface):
        return []
    out, people_not_drawn, found = [], state.people_not_drawn, dict[int, list[picking.PartHull]]()
    for time, group in at_one_time(picture_times(session, state.frame, view.cameras)):
        cameras = [session.cameras[index].camera.pinhole for index in group]
        hulls = picking.part_hulls(ahead(bodies_in(session, state), time), cameras)
        found |= dict(zip(group, hulls, strict=True))
    for index in sorted(found):
        for one in found[index]:
            if one.body in people_not_drawn:
                continue
            if drag is None or (one.body, one.part) == (drag.person, drag.part):
                out.append(PartOutline(index, one.body, one.part, one.depth_m, _closed(one.polygon_px)))
    return out


def _closed(polygon_px: FloatArray) -> FloatArray:
    """Return the sides of a polygon, (n, 2), as x0, y0, x1, y1, (n, 4)."""
    sides = np.empty((len(polygon_px), 4), np.float32)
    sides[:, :2], sides[:-1, 2:], sides[-1, 2:] = polygon_px, polygon_px[1:], polygon_px[0]
    return sides
