"""Outline two bodies in a neutral pose, from the front and from the side, for comparison."""

from collections.abc import Sequence

import numpy as np

from app.state.people import BodyOutlines, Line, SideOutlines
from tracker.body.model import BodyModel, PosedBody
from tracker.evidence.contours import occluding_contours
from tracker.geometry.cameras import Camera

_SIZE_PX = (240, 480)
_AWAY_M = 60.0
"""Distance of the camera: so far that there is almost no perspective."""
_MARGIN = 1.04
_SIDES = {"front": (1.0, 0.0), "side": (0.0, 1.0)}


def body_outlines(before: BodyModel, after: BodyModel) -> BodyOutlines:
    """Return the outlines of a body before and after its sizes changed, with the feet at the same height."""
    tall_m = _MARGIN * max(before.height_m, after.height_m)
    front, side = (
        SideOutlines(_outline(before, direction, tall_m), _outline(after, direction, tall_m))
        for direction in _SIDES.values()
    )
    return BodyOutlines(_SIZE_PX, front, side)


def _outline(model: BodyModel, direction: Sequence[float], tall_m: float) -> tuple[Line, ...]:
    """Return the visible contours of a standing body seen from a horizontal direction."""
    pose = PosedBody(model, model.neutral())
    feet_m = min(
        float((T[:3, :3] @ (shape.triangles().vertices + center).T + T[:3, 3:])[2].min())
        for shape, center, T in zip(model.shapes, model.centers_part, pose.kinematics.Ts_world_part, strict=True)
    )
    width, height = _SIZE_PX
    focal = height * _AWAY_M / tall_m
    K = np.array([[focal, 0.0, width / 2], [0.0, focal, height / 2], [0.0, 0.0, 1.0]])
    away = np.array([*direction, 0.0])
    T_world_camera = np.eye(4)
    T_world_camera[:3, 0] = np.cross((0.0, 0.0, 1.0), away)
    T_world_camera[:3, 1], T_world_camera[:3, 2] = (0.0, 0.0, -1.0), -away
    T_world_camera[:3, 3] = _AWAY_M * away + np.array([0.0, 0.0, feet_m + tall_m / 2])
    seen = occluding_contours.trace([pose], Camera("outline", _SIZE_PX, K, np.zeros(0), T_world_camera))
    lines = np.round(seen.pieces_px[~seen.occluded].astype(np.float64), 1)
    return tuple((float(a), float(b), float(c), float(d)) for a, b, c, d in lines)
