"""Draw pins: their distance from the model, their triangulation, and their epipolar lines in the other views."""

from dataclasses import dataclass

import numpy as np

from app.drawing.overlay_colors import KIND_COLORS
from app.drawing.overlays import Path
from app.drawing.seen_bodies import bodies_in
from app.state.page_view import View
from app.state.state import State, finite_or_none
from tracker.geometry.framing import epipolar_segment
from tracker.geometry.triangulation import PointObservation, triangulate
from tracker.session.session import Session


@dataclass(frozen=True)
class PinMark:
    """A pin in its view, and the model's point there."""

    camera: int
    person: int
    point: str
    u: float
    v: float
    model_u: float | None
    """Null for a point behind the camera, likewise `model_v`."""
    model_v: float | None


@dataclass(frozen=True)
class TriangulationMark:
    """The image of a triangulated point in a view."""

    camera: int
    u: float
    v: float
    error_px: float | None
    """Distance from the pin of this view, px; null where there is no pin."""


@dataclass(frozen=True)
class PinTriangulation:
    """The point in space that the pins of the joint worked on determine."""

    person: int
    point: str
    pins: int
    """Number of views in which it is pinned."""
    error_px: float | None
    """Root mean square distance of the pins from the images of the point, px; null where they determine none."""
    why: str
    """Why there is no point, and what to do; empty where there is one."""
    marks: tuple[TriangulationMark, ...]
    """Images of the point; empty where there is none."""


def pin_marks(session: Session, state: State) -> list[PinMark]:
    """Return all pins of the frame, of visible people."""
    out, bodies = [], bodies_in(session, state)
    for person, (info, pins) in enumerate(zip(session.people, state.pins, strict=True)):
        if not pins or person in state.visibility.hidden:
            continue
        for point, camera, position_px, _ in pins:
            source, index = session.cameras[camera], info.model.point_names.index(point)
            then = bodies[person].ahead(source.clock.offset_frames(state.frame))
            u, v = source.camera.pinhole.project(then.points_world[index])
            out.append(PinMark(camera, person, point, *position_px, finite_or_none(u), finite_or_none(v)))
    return out


def pin_triangulation(session: Session, state: State) -> PinTriangulation | None:
    """Triangulate the pins of the joint worked on; None where it has none."""
    pins = _of_joint(state)
    if not pins or state.point is None:
        return None
    views = [c.camera.pinhole for c in session.cameras]
    found = triangulate([views[p.camera] for p in pins], np.array([p.position_px for p in pins]))
    if found.point_world is None:
        return PinTriangulation(state.person, state.point, len(pins), None, found.why, ())
    errors = dict(zip((p.camera for p in pins), found.errors_px.tolist(), strict=True))
    marks = []
    for index, view in enumerate(views):
        u, v = view.project(found.point_world)
        if np.isfinite(u):
            marks.append(TriangulationMark(index, float(u), float(v), errors.get(index)))
    rms = float(np.sqrt(np.mean(found.errors_px**2)))
    return PinTriangulation(state.person, state.point, len(pins), rms, "", tuple(marks))


def pin_lines(session: Session, state: State, view: View) -> list[Path]:
    """Draw the lines of sight of the pins of the joint worked on in the other views."""
    out: list[Path] = []
    if "epipolar" not in view.layers:
        return out
    for _, camera, position_px, _ in _of_joint(state):
        source = session.cameras[camera].camera.pinhole
        for index, target in enumerate(session.cameras):
            segment = None
            if index != camera and index in view.cameras:
                segment = epipolar_segment(source, target.camera.pinhole, np.array(position_px))
            if segment is not None:
                row = segment.reshape(1, 4).astype(np.float32)
                out.append(Path(index, state.person, "epipolar", KIND_COLORS["epipolar"], row))
    return out


def _of_joint(state: State) -> list[PointObservation]:
    """Return the pins of the joint worked on; none of a hidden person."""
    if not state.pins or state.person in state.visibility.hidden:
        return []
    return [p for p in state.pins[state.person] if p.point == state.point]
