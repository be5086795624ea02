"""Check the calibration by epipolar lines (GD96 Fig. 7): the line of sight of a pixel in all other views."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tracker.body.model import PosedBody
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.geometry.framing import epipolar_segment
from tracker.geometry.triangulation import triangulate

_NEAR_M = 0.3
"""Distance from a joint up to which a place is at the body: half a thigh with its girth, metres."""


@dataclass(frozen=True)
class EpipolarLine:
    """The visible part of a line in a view, undistorted px: straight there, whatever the lens."""

    camera: int
    x0: float
    y0: float
    x1: float
    y1: float


@dataclass(frozen=True)
class EpipolarDistance:
    """How far a second point is from the line of the first in its view."""

    camera: int
    px: float
    mm: float | None
    """The same at the body; null where both points do not show a place at a body."""


@dataclass(frozen=True)
class EpipolarCheck:
    """The lines of a point, and the distance of a second one."""

    lines: tuple[EpipolarLine, ...]
    distance: EpipolarDistance | None


def epipolar_check(
    cameras: Sequence[Camera], points: Sequence[tuple[int, Array]], bodies: Sequence[PosedBody]
) -> EpipolarCheck:
    """Draw the line of a pixel in all other views, and measure the distance of another pixel from it.

    Args:
        cameras: of all views.
        points: camera and position of the pixel, (2,), undistorted px, and of another one if there is one.
        bodies: people on the frame.
    """
    if not points:
        return EpipolarCheck((), None)
    views = [c.pinhole for c in cameras]
    source, pixel = points[0]
    found = {i: epipolar_segment(views[source], view, pixel) for i, view in enumerate(views) if i != source}
    lines = {i: segment for i, segment in found.items() if segment is not None}
    distance = None
    if len(points) > 1 and points[1][0] in lines:
        distance = _distance(views, points, lines[points[1][0]], bodies)
    rows = (EpipolarLine(i, *(round(float(x), 2) for x in segment.ravel())) for i, segment in lines.items())
    return EpipolarCheck(tuple(rows), distance)


def _distance(
    views: Sequence[Camera], points: Sequence[tuple[int, Array]], segment_px: Array, bodies: Sequence[PosedBody]
) -> EpipolarDistance:
    camera, pixel = points[1]
    along = segment_px[1] - segment_px[0]
    to_pixel = pixel - segment_px[0]
    px = abs(along[0] * to_pixel[1] - along[1] * to_pixel[0]) / max(float(np.linalg.norm(along)), 1e-9)
    place = triangulate([views[c] for c, _ in points], np.array([p for _, p in points])).point_world
    mm = None
    joints = [b.points_world for b in bodies]
    if place is not None and joints and np.linalg.norm(np.concatenate(joints) - place, axis=1).min() < _NEAR_M:
        mm = 1000 * px * float(views[camera].depths(place)) / float(views[camera].K[0, 0])
    return EpipolarDistance(camera, round(float(px), 2), None if mm is None else round(mm, 1))
