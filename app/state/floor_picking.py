"""The floor of the session, and the three points that the user clicks to set another."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from app.remedies import page_text
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.geometry.ground_plane import GroundPlane, floor_through
from tracker.geometry.triangulation import triangulate

N_POINTS = 3


@dataclass(frozen=True, eq=False)
class Pick:
    """One point of the floor, clicked in several views."""

    marks: tuple[tuple[int, float, float], ...] = ()
    """Index of the camera and clicked position, undistorted px; each camera at most once, in the order of clicks."""
    point_world: Array | None = None
    """Triangulated point, (3,), metres; None if the lines of sight do not meet."""
    error_px: float | None = None
    """Largest reprojection error, px."""
    why: str = "click it in a second view"
    """Why there is no point, as text for the user."""


@dataclass(frozen=True, eq=False)
class Picking:
    """The points clicked so far."""

    picks: tuple[Pick, ...] = (Pick(),)
    """Up to `N_POINTS`; the last is the current one."""
    plane: GroundPlane | None = None
    """The plane through three points."""
    why: str = ""
    """Why three points give no plane, as text for the user."""


@dataclass(frozen=True, eq=False)
class FloorState:
    """The floor of the session."""

    up: str = "z"
    """World axis that points up, or is nearest to it."""
    plane: GroundPlane | None = None
    """As set by the user; None for the plane through the world's origin."""
    picking: Picking | None = None
    """None while no floor is being set."""
    origin: str = ""
    """Source of the plane, for display; empty for that of the calibration, and after a restart."""
    former: bool = False
    """Whether a former floor can be restored."""


def with_mark(picking: Picking, cameras: Sequence[Camera], camera: int, u: float, v: float) -> Picking:
    """Mark the current point in a view, undistorted px, in place of its former mark there."""
    marks = (*(m for m in picking.picks[-1].marks if m[0] != camera), (camera, u, v))
    return _solved(replace(picking, picks=(*picking.picks[:-1], _triangulated(marks, cameras))), cameras)


def with_next(picking: Picking) -> Picking:
    """Begin the next point, if the current one is known and is not the last."""
    if picking.picks[-1].point_world is None or len(picking.picks) == N_POINTS:
        return picking
    return replace(picking, picks=(*picking.picks, Pick()))


def without_last(picking: Picking, cameras: Sequence[Camera]) -> Picking:
    """Remove the last mark: of the current point, or of the one before if it has none."""
    picks = picking.picks
    if not picks[-1].marks and len(picks) > 1:
        picks = picks[:-1]
    return _solved(replace(picking, picks=(*picks[:-1], _triangulated(picks[-1].marks[:-1], cameras))), cameras)


def _triangulated(marks: tuple[tuple[int, float, float], ...], cameras: Sequence[Camera]) -> Pick:
    if len(marks) < 2:
        return Pick(marks)
    found = triangulate([cameras[m[0]] for m in marks], np.array([m[1:] for m in marks]))
    if found.point_world is None:
        return Pick(marks, why="these lines of sight hardly cross; click it in a view from another side")
    return Pick(marks, found.point_world, float(found.errors_px.max()), "")


def _solved(picking: Picking, cameras: Sequence[Camera]) -> Picking:
    points = [p.point_world for p in picking.picks if p.point_world is not None]
    if len(points) < N_POINTS:
        return replace(picking, plane=None, why="")
    try:
        plane = floor_through(np.array(points), np.array([c.center_world for c in cameras]))
    except TrackerError as error:
        return replace(picking, plane=None, why=page_text(error))
    return replace(picking, plane=plane, why="")
