"""Draw the setting of the floor: the marks, their lines of sight, and the plane as a grid."""

import numpy as np

from app.drawing.overlay_colors import KIND_COLORS
from app.drawing.overlays import Path
from app.state.floor_picking import Picking
from app.state.state import State
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.geometry.framing import epipolar_segment
from tracker.geometry.ground_plane import GroundPlane, up_rotation
from tracker.session.session import Session

_MARK_PX = 7.0
"""Half the size of a mark in an image 640 px wide, px."""
_HALF_WIDTH_M = 2.0
_STEP_M = 0.5
_PIECE_M = 0.1
"""Length of the pieces of grid lines. Of a line that passes behind a camera the visible pieces remain."""


def floor_lines(session: Session, state: State) -> list[Path]:
    """Draw the marks, epipolar lines and the previewed plane in all views; nothing unless the floor is being set."""
    picking = state.floor.picking
    if picking is None:
        return []
    views = [c.camera.pinhole for c in session.cameras]
    out = []
    for index, view in enumerate(views):
        if picking.plane is not None:
            middle = np.mean([p.point_world for p in picking.picks if p.point_world is not None], axis=0)
            grid = _grid(picking.plane, up_rotation(state.floor.up, picking.plane), middle)
            out.append(Path(index, 0, "floor", KIND_COLORS["floor"], _seen(view, grid)))
        out.append(Path(index, 0, "floor", KIND_COLORS["floor"], _marks(picking, index, view)))
        lines = _lines_of_sight(picking, index, views)
        if lines:
            # Paths of this kind are drawn whatever the layers: they show where to click.
            lines_px = np.array(lines, dtype=np.float32).reshape(-1, 4)
            out.append(Path(index, 0, "floor_sight", KIND_COLORS["floor_sight"], lines_px))
    return out


def _grid(plane: GroundPlane, R: Array, middle: Array) -> Array:
    """Return pieces of the lines of a square grid in a plane, (N, 2, 3), metres."""
    along = np.arange(-_HALF_WIDTH_M, _HALF_WIDTH_M + 1e-9, _PIECE_M)
    x, y = np.meshgrid(along, np.arange(-_HALF_WIDTH_M, _HALF_WIDTH_M + 1e-9, _STEP_M))
    origin = middle - (plane.normal @ middle - plane.offset_m) * plane.normal
    lines = np.concatenate([np.stack([x, y], -1), np.stack([y, x], -1)])  # (lines, pieces, 2)
    points = origin + lines @ R[:, :2].T
    return np.stack([points[:, :-1], points[:, 1:]], axis=2).reshape(-1, 2, 3)


def _seen(view: Camera, pieces: Array) -> np.ndarray:
    """Project pieces of lines into a view: x0, y0, x1, y1, (N, 4), undistorted px."""
    ends = view.project(pieces).reshape(-1, 4)
    return ends[np.all(np.isfinite(ends) & (np.abs(ends) < 4 * max(view.size)), axis=1)].astype(np.float32)


def _marks(picking: Picking, index: int, view: Camera) -> np.ndarray:
    """Draw a cross for each mark in a view, and a smaller one at the triangulated point."""
    size, rows = _MARK_PX * max(view.size) / 640, []
    for pick in picking.picks:
        marks = [(m[1], m[2], size) for m in pick.marks if m[0] == index]
        if pick.point_world is not None:
            u, v = view.project(pick.point_world)
            if np.isfinite(u):
                marks.append((u, v, size / 2))
        for u, v, s in marks:
            rows += [(u - s, v - s, u + s, v + s), (u - s, v + s, u + s, v - s)]
    return np.array(rows, dtype=np.float32).reshape(-1, 4)


def _lines_of_sight(picking: Picking, index: int, views: list[Camera]) -> list[Array]:
    """Draw the epipolar lines of the current point in a view in which it is not marked."""
    marks = picking.picks[-1].marks
    if any(m[0] == index for m in marks):
        return []
    lines = (epipolar_segment(views[m[0]], views[index], np.array(m[1:])) for m in marks)
    return [line for line in lines if line is not None]
