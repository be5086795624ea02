"""Exported poses in all views as arrays over views, frames, people and points."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Array
from tracker.interchange.exports.frame_views import FrameViews
from tracker.interchange.exports.motion import ExportedMotion
from tracker.interchange.exports.options import ExportOptions
from tracker.interchange.exports.views import exported_cameras


class ViewPoints(NamedTuple):
    """The points of F frames, P people and n points in V views."""

    points_px: Array
    """Joint centres, (V, F, P, n, 2), in the pixels of the export; NaN outside the picture, and without a pose."""
    visibility: NDArray[np.uint8]
    """A `KeypointFlag` of each, (V, F, P, n)."""


def view_arrays(
    motion: ExportedMotion, options: ExportOptions, points: tuple[str, ...], tick: Callable[[], None]
) -> ViewPoints:
    """Return the points of all exported people in all views.

    Args:
        motion: what is exported.
        options: its pixels.
        points: names of the points, (n,).
        tick: called after each frame.
    """
    cameras = exported_cameras(motion, options)
    shape = (len(cameras), len(motion.frames), len(motion.chosen), len(points))
    out = ViewPoints(np.full((*shape, 2), np.nan), np.zeros(shape, np.uint8))
    for i, frame in enumerate(motion.frames):
        views = FrameViews(motion, cameras, frame)
        for view in range(len(cameras)):
            for person, body, keypoints in views.seen(view):
                is_in = keypoints.visibility > 0
                columns = np.array([points.index(name) for name in body.model.point_names])[is_in]
                at = view, i, motion.chosen.index(person.index)
                out.points_px[at][columns] = keypoints.points_px[is_in]
                out.visibility[at][columns] = keypoints.visibility[is_in]
        tick()
    return out
