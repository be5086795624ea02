"""Everything of a shared stretch but its pictures, as plain data: cameras, poses, curves, statuses.

Names of people are those of the session. Accounts and paths of this machine are left out.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from app.drawing import curves
from tracker.body.model import BodyModel
from tracker.compute.installed_package import program_version
from tracker.evidence.images.working_view import WorkingView
from tracker.geometry.cameras import Camera
from tracker.interchange.exports.motion import ExportedMotion, PersonMotion
from tracker.interchange.exports.provenance import pose_provenance
from tracker.session.session import Session
from tracker.session.store.records import FramePose


class SharedComment(NamedTuple):
    """A comment on a person in a frame."""

    person: str
    frame: int
    limb: str
    """Empty for the whole body."""
    text: str
    author: str
    """Name of an annotator, never that of an account."""
    resolved: bool


def describe(
    motion: ExportedMotion, views: Sequence[WorkingView], comments: Sequence[SharedComment] = ()
) -> dict[str, Any]:
    """Return what a shared page shows beside pictures and lines.

    Args:
        motion: the poses.
        views: the cameras of the pictures.
        comments: of the session; those on other frames or people are left out.
    """
    names, frames = {p.person.name for p in motion.exported}, set(motion.frames)
    session = motion.session
    cameras = zip(session.cameras, views, strict=True)
    return {
        "session": session.name,
        "program": program_version(),
        "fps": session.fps,
        "frames": list(motion.frames),
        "calibration": motion.calibration_note,
        "floor": _floor(session),
        "cameras": [_camera(source.camera.name, view.camera) for source, view in cameras],
        "people": [_person(motion, person) for person in motion.exported],
        "comments": [c._asdict() for c in comments if c.person in names and c.frame in frames],
    }


def _camera(name: str, camera: Camera) -> dict[str, Any]:
    """Return a camera with the corners of its picture as directions in the world."""
    u, v = camera.width - 0.5, camera.height - 0.5
    corners = np.array([(-0.5, -0.5), (u, -0.5), (u, v), (-0.5, v)])
    return {
        "name": name,
        "width": camera.width,
        "height": camera.height,
        "center": _rounded(camera.center_world),
        "corners": [_rounded(ray) for ray in camera.rays(corners)],
    }


def _floor(session: Session) -> dict[str, Any]:
    """Return the upward normal of the floor and its offset along it, metres."""
    if session.floor is not None:
        return {"normal": _rounded(session.floor.normal), "offset": round(float(session.floor.offset_m), 4)}
    normal = [0.0, 0.0, 0.0]
    normal["xyz".index(session.up[-1])] = -1.0 if session.up.startswith("-") else 1.0
    return {"normal": normal, "offset": 0.0}


def _person(motion: ExportedMotion, person: PersonMotion) -> dict[str, Any]:
    figures = {model: i for i, model in enumerate(person.models)}
    return {
        "index": person.index,
        "name": person.person.name,
        "color": person.person.color,
        "figures": [_figure(model) for model in figures],
        "poses": {frame: _pose(motion, person, frame, figures) for frame in person.poses},
        "plots": _plots(motion, person),
    }


def _figure(model: BodyModel) -> list[list[int]]:
    """Return the bones of a body as pairs of indices of its points."""
    index = {name: i for i, name in enumerate(model.point_names)}
    return [[index[a], index[b]] for a, b in model.bones]


def _pose(motion: ExportedMotion, person: PersonMotion, frame: int, figures: dict[BodyModel, int]) -> dict[str, Any]:
    found, body = pose_provenance(motion, person, frame).fields, person.body(frame)
    return {
        "figure": figures[body.model],
        "points": np.round(1000 * body.points_world).astype(int).ravel().tolist(),
        **{key: found[key] for key in ("status", "source", "keyframe", "reviewed", "remark", "program")},
        "time": found["edit_time"],
        "calibration": found["calibration_revision"],
        "body": f"{body.model.name}, revision {found['body_revision']}",
    }


def _plots(motion: ExportedMotion, person: PersonMotion) -> list[dict[str, Any]]:
    """Return the curves of the angles over the frames; poses of another body have none."""
    model, out = person.model, []
    rows = [
        FramePose(frame, pose.body.values, pose.record.cost_px, (), pose.record.model_revision)
        for frame, pose in sorted(person.poses.items())
        if pose.body.model.value_names == model.value_names
    ]
    for group in curves.GROUPS:
        plots = curves.plots_of(model, (), group)
        values = curves.samples(model, plots, motion.frames, rows)
        for plot in plots:
            own, values = values[: len(plot.labels)], values[len(plot.labels) :]
            numbers = [[None if np.isnan(x) else round(x, 1) for x in curve] for curve in own.astype(float).tolist()]
            out.append({"title": plot.title, "unit": plot.unit, "labels": plot.labels, "values": numbers})
    return out


def _rounded(values: Any) -> list[float]:
    return [round(float(x), 4) for x in values]
