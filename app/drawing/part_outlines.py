"""The parts of bodies that a pointer can take by their surface, as outlines in each view."""

from typing import NamedTuple

import numpy as np

from app.state.page_view import View
from app.state.state import State
from tracker.body.model import PosedBody
from tracker.geometry.arrays import FloatArray
from tracker.posing import picking
from tracker.session.session import Session


class Outline(NamedTuple):
    """Where a view shows a part, to be pointed at."""

    camera: int
    person: int
    part: int
    depth: float
    """Distance of the part, metres: of parts that overlap the nearest is meant."""
    segments_px: FloatArray
    """The closed convex outline as x0, y0, x1, y1, (N, 4), undistorted px."""


def outlines(session: Session, state: State, view: View) -> list[Outline]:
    """The parts that a pointer can take in the views that a page shows: all of everybody who is shown.

    There are none while a hand holds a point, and of a part that is held by its surface there is that one alone: what
    the hand does not need would only make it wait. A step that is replayed is no pose to be taken.
    """
    drag = state.drag
    if "joints" not in view.layers or state.look.replay is not None or (drag is not None and not drag.by_surface):
        return []
    bodies = [PosedBody(p.model, v) for p, v in zip(session.people, state.poses, strict=True)]
    out = []
    seen = sorted(view.cameras)
    found = picking.part_hulls(bodies, [session.cameras[index].camera.pinhole for index in seen])
    for index, parts in zip(seen, found, strict=True):
        for one in parts:
            if one.body in state.cast.hidden:
                continue
            if drag is None or (one.body, one.part) == (drag.person, drag.part):
                out.append(Outline(index, one.body, one.part, one.depth_m, _closed(one.polygon_px)))
    return out


def _closed(polygon_px: FloatArray) -> FloatArray:
    """The sides of a polygon, (n, 2), as x0, y0, x1, y1, (n, 4)."""
    sides = np.empty((len(polygon_px), 4), np.float32)
    sides[:, :2], sides[:-1, 2:], sides[-1, 2:] = polygon_px, polygon_px[1:], polygon_px[0]
    return sides
