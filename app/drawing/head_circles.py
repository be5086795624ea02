"""Circles around the heads of all people, which a page blurs."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from app.drawing.seen_bodies import at_one_time, bodies_in, picture_times
from app.state.state import State
from tracker.body.model import ahead
from tracker.interchange.exports.faces import around, head_surface
from tracker.session.session import Session


@dataclass(frozen=True)
class HeadCircle:
    """What hides a head in one view, undistorted px."""

    camera: int
    u: float
    v: float
    radius_px: float


def head_circles(session: Session, state: State, cameras: Collection[int]) -> list[HeadCircle]:
    """Return the circles of all people in some views, given by index, whether they are drawn or not."""
    found = []
    for time, group in at_one_time(picture_times(session, state.frame, cameras)):
        bodies = [b for b in ahead(bodies_in(session, state), time) if "head" in b.model.part_index]
        surfaces = [head_surface(body) for body in bodies]
        for index in group:
            for px in (session.cameras[index].camera.pinhole.project(surface) for surface in surfaces):
                if (seen := np.isfinite(px).all(axis=1)).any():
                    (u, v), radius_px = around(px[seen])
                    found.append(HeadCircle(index, float(u), float(v), radius_px))
    return found
