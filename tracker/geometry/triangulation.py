"""Triangulate a point from its observations in several views."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import TINY, Array
from tracker.geometry.cameras import NEAR_PLANE_M, Camera, across_lines, project_with_jacobian

_SIGMA_SHARE = 0.001
"""Standard deviation of a pin as a share of the longer side of the image: 0.64 px of 640. The true error of a hand is
about three times as large. The smaller value lets pins win over edges, whose errors all agree if the body's shape is
wrong. It is relative because large images are displayed smaller."""


MIN_ANGLE_RAD = np.radians(1.0)
"""Viewing rays that differ by less do not determine a depth: with pins 2 px off in images of 640 px, a point 4 m away
would be uncertain by more than 1 m."""


class PointObservation(NamedTuple):
    """The observed position of a body point in one view, set by a person."""

    point: str
    """One of the body model's `point_names`."""
    camera: int
    """Index of the view."""
    position_px: tuple[float, float]
    """Position of the point in the image, undistorted px."""
    ahead_frames: float = 0.0
    """Frames by which the picture was taken later than the frame, where a fit is to heed it; 0 in what is stored."""


def sigma_px(camera: Camera) -> float:
    """Return the standard deviation of a pin in the view of a camera with its lens, px."""
    return _SIGMA_SHARE * max(camera.size)


class Triangulation(NamedTuple):
    """The point in space observed by the pins of one body point."""

    point_world: Array | None
    """The point, (3,), metres; None if the pins do not determine it."""
    errors_px: Array
    """Reprojection error of each pin, (N,), px; NaN without a point."""
    why: str
    """Why there is no point, and what to do; empty if there is one."""


def triangulate(cameras: Sequence[Camera], positions_px: Array) -> Triangulation:
    """Find the point in space with the smallest reprojection error.

    The start is the point nearest to the viewing rays. Gauss-Newton then minimizes the squared distances in the images,
    in standard deviations of a pin.

    Args:
        cameras: the camera of each pin.
        positions_px: observed position of the point, undistorted px, (N, 2).
    """
    positions_px = np.asarray(positions_px, dtype=np.float64).reshape(-1, 2)
    views = [c.pinhole for c in cameras]
    rays = np.array([c.rays(p) for c, p in zip(views, positions_px, strict=True)]).reshape(-1, 3)
    if len(views) < 2:
        return _nowhere(views, "one view does not determine the depth: pin the joint in another view too")
    # Two views that face each other are as bad as two side by side.
    sines = np.linalg.norm(np.cross(rays[:, None], rays[None]), axis=-1)
    if sines.max() < np.sin(MIN_ANGLE_RAD):
        return _nowhere(views, "the lines of sight are almost parallel: pin the joint in a view from another side")
    A, b = across_lines(np.stack([c.center_world for c in views]), rays)
    point = np.asarray(np.linalg.solve(A, b), np.float64)
    point = _nearest_in_the_images(views, positions_px, np.array([sigma_px(c) for c in cameras]), point)
    behind = [c.name for c in views if c.depths(point) < NEAR_PLANE_M]
    if behind:
        return _nowhere(views, f"the lines of sight meet behind {' and '.join(behind)}: check the pins of this joint")
    return Triangulation(point, np.linalg.norm(_residuals(views, positions_px, point)[0], axis=1), "")


def _nowhere(views: Sequence[Camera], why: str) -> Triangulation:
    return Triangulation(None, np.full(len(views), np.nan), why)


def _residuals(views: Sequence[Camera], positions_px: Array, point: Array) -> tuple[Array, Array]:
    """Return projection minus pin in each view, (N, 2), px, and its derivative by the point, (N, 2, 3)."""
    Ts_camera_world, K = np.stack([c.T_camera_world for c in views]), np.stack([c.K for c in views])
    points_px, J = project_with_jacobian(Ts_camera_world, K, np.broadcast_to(point, (len(views), 3)))
    return points_px - positions_px, J


def _nearest_in_the_images(views: Sequence[Camera], positions_px: Array, sigmas_px: Array, point: Array) -> Array:
    """Minimize the reprojection error by Gauss-Newton; stop before a step that would lead behind a camera."""
    weights = 1 / sigmas_px[:, None]
    if min(c.depths(point) for c in views) < NEAR_PLANE_M:
        return point
    r, J = _residuals(views, positions_px, point)
    for _ in range(20):
        rows = (J * weights[:, :, None]).reshape(-1, 3)
        step = -np.linalg.lstsq(rows, (r * weights).ravel(), rcond=None)[0]
        if min(c.depths(point + step) for c in views) < NEAR_PLANE_M:
            break
        there = _residuals(views, positions_px, point + step)
        if np.sum((there[0] * weights) ** 2) >= np.sum((r * weights) ** 2):
            break
        point, (r, J) = point + step, there
        if np.linalg.norm(step) < TINY:
            break
    return point
