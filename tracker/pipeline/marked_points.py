"""Points of people that users have marked in the images: the ends of drags, which are stored with the pose."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tracker.body.model import BodyModel
from tracker.estimation.fitting.hypothesis import SETTLED_M
from tracker.footage.camera_source import CameraSource
from tracker.geometry.arrays import Array
from tracker.geometry.triangulation import PointObservation
from tracker.session.store.records import SEEN, Pin, PoseRecord

_Seen = dict[str, dict[str, Any]]
"""Position in each camera, original px, by point."""


def user_marked_points(
    cameras: Sequence[CameraSource], model: BodyModel, record: PoseRecord, pins: Sequence[Pin] = ()
) -> list[PointObservation]:
    """Return the points of a person that users have marked on a frame, ascending by point and name of the camera.

    Args:
        cameras: the session's views. Points in other views are left out.
        model: the person's body. Points that it does not have are left out.
        record: the stored pose, with the ends of drags.
        pins: pins of the person on the frame, which go before the ends of drags.
    """
    index = {c.camera.name: i for i, c in enumerate(cameras)}
    positions = {(p, c): uv for p, views in record.settings.get(SEEN, {}).items() for c, uv in views.items()}
    positions |= {(pin.point, pin.camera): pin.position_px for pin in pins}
    out = []
    for (point, camera), position_px in sorted(positions.items()):
        if camera in index and point in model.point_names:
            u, v = cameras[index[camera]].camera.undistort_points(np.array(position_px))
            out.append(PointObservation(point, index[camera], (float(u), float(v))))
    return out


def with_drag_ends(cameras: Sequence[CameraSource], seen: _Seen, ends: Sequence[PointObservation]) -> _Seen:
    """Return stored points with the ends of drags, which replace former ones in their views."""
    seen = dict(seen)
    for at in ends:
        camera = cameras[at.camera].camera
        u, v = camera.distort_points(np.array(at.position_px))
        seen[at.point] = {**seen.get(at.point, {}), camera.name: [float(u), float(v)]}
    return seen


def without_moved(model: BodyModel, seen: _Seen, before: Array, after: Array) -> _Seen:
    """Return stored points without those that an edit of the pose, (n_values,) each, moves by more than `SETTLED_M`.

    Nothing stays where the body has other values.
    """
    if not seen or len(before) != len(after):
        return {}
    off_m = np.linalg.norm(model.points_world(after) - model.points_world(before), axis=1)
    stays = {name for name, off in zip(model.point_names, off_m, strict=True) if off <= SETTLED_M}
    return {name: views for name, views in seen.items() if name in stays}
