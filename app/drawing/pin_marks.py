"""What is drawn of pins: the pins and how far the model is off, where they meet, and their lines in the other views."""

from typing import NamedTuple

import numpy as np

from app.drawing.overlays import EPIPOLAR_COLOR, Path
from app.state.page_view import View
from app.state.state import State, finite_or_none
from tracker.geometry.cameras import epipolar_segment
from tracker.geometry.triangulation import PointObservation, triangulate
from tracker.session.session import Session


class PinMark(NamedTuple):
    """A pin in its view, and where the model has the point."""

    camera: int
    person: int
    point: str
    u: float
    v: float
    model_u: float | None
    """Undistorted px; None for a point behind the camera."""
    model_v: float | None


class MeetingMark(NamedTuple):
    """Where the point in space on which pins agree lies in a view."""

    camera: int
    u: float
    v: float
    error_px: float | None
    """Its distance from the pin of this view, px; None where there is no pin."""


class Meeting(NamedTuple):
    """Where the pins of the joint worked on meet."""

    person: int
    point: str
    pins: int
    """Number of views that it is pinned in."""
    error_px: float | None
    """Root of the mean squared distance of the pins from the images of the point, px; None where they do not meet."""
    why: str
    """Why they do not; empty where they do."""
    marks: tuple[MeetingMark, ...]


def pin_marks(session: Session, state: State) -> list[PinMark]:
    """All pins of the frame, of everybody who is shown."""
    out = []
    for person, (info, pins) in enumerate(zip(session.people, state.pins, strict=True)):
        if not pins or person in state.visibility.hidden:
            continue
        points = info.model.points_world(state.poses[person])
        for point, camera, position_px in pins:
            view = session.cameras[camera].camera.pinhole
            u, v = view.project(points[info.model.point_names.index(point)])
            out.append(PinMark(camera, person, point, *position_px, finite_or_none(u), finite_or_none(v)))
    return out


def meeting(session: Session, state: State) -> Meeting | None:
    """Where the pins of the joint worked on meet; None where it has none."""
    pins = _of_joint(state)
    if not pins or state.point is None:
        return None
    views = [c.camera.pinhole for c in session.cameras]
    found = triangulate([views[p.camera] for p in pins], np.array([p.position_px for p in pins]))
    if found.point_world is None:
        return Meeting(state.person, state.point, len(pins), None, found.why, ())
    errors = dict(zip((p.camera for p in pins), found.errors_px.tolist(), strict=True))
    marks = []
    for index, view in enumerate(views):
        u, v = view.project(found.point_world)
        if np.isfinite(u):
            marks.append(MeetingMark(index, float(u), float(v), errors.get(index)))
    rms = float(np.sqrt(np.mean(found.errors_px**2)))
    return Meeting(state.person, state.point, len(pins), rms, "", tuple(marks))


def pin_lines(session: Session, state: State, view: View) -> list[Path]:
    """The lines of sight of the pins of the joint worked on, as the other views see them."""
    out: list[Path] = []
    if "epipolar" not in view.layers:
        return out
    for _, camera, position_px in _of_joint(state):
        source = session.cameras[camera].camera.pinhole
        for index, target in enumerate(session.cameras):
            segment = None
            if index != camera and index in view.cameras:
                segment = epipolar_segment(source, target.camera.pinhole, np.array(position_px))
            if segment is not None:
                row = segment.reshape(1, 4).astype(np.float32)
                out.append(Path(index, state.person, "epipolar", EPIPOLAR_COLOR, row))
    return out


def _of_joint(state: State) -> list[PointObservation]:
    """The pins of the joint worked on; none of a person who is not shown."""
    if not state.pins or state.person in state.visibility.hidden:
        return []
    return [p for p in state.pins[state.person] if p.point == state.point]
