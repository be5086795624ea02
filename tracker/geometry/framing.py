"""Points and rays in pictures: distance of points from cameras and their share in view, epipolar segments."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array
from tracker.geometry.cameras import NEAR_PLANE_M, Camera


class Framing(NamedTuple):
    """The place of some points in one camera's view."""

    camera: str
    distance_m: float
    """Distance of the points' centre from the camera."""
    n_inside: int
    """Number of points in the picture."""
    n_points: int
    is_behind: bool
    """Whether the centre lies behind the camera."""
    beside_px: float
    """Distance of the nearest point from the picture, px; 0 if a point is in it, NaN if all are behind the camera."""

    @property
    def text(self) -> str:
        """The place in words."""
        if self.n_inside:
            share = "in the picture" if self.n_inside == self.n_points else f"{self.n_inside} of {self.n_points} joints"
            return f"{self.distance_m:.2f} m, {share}"
        if self.is_behind or np.isnan(self.beside_px):
            return f"{self.distance_m:.2f} m, behind the camera"
        return f"{self.distance_m:.2f} m, {self.beside_px:.0f} px beside the picture"


def framings(cameras: Sequence[Camera], points_world: Array) -> tuple[Framing, ...]:
    """Return the place of points, (N, 3), N > 0, metres, in the view of each camera.

    It is in undistorted pixels, but for a fisheye lens in those of the footage, which alone have a border.
    """
    return tuple(_framing(camera, points_world) for camera in cameras)


def _framing(camera: Camera, points_world: Array) -> Framing:
    center = points_world.mean(axis=0)
    ahead = points_world[camera.depths(points_world) > NEAR_PLANE_M]
    points_px = camera.project(ahead) if camera.fisheye else camera.pinhole.project(ahead)
    beyond = np.maximum(np.maximum(-0.5 - points_px, points_px - (np.array(camera.size) - 0.5)), 0)
    beside = np.nan_to_num(np.linalg.norm(beyond, axis=-1), nan=np.inf)
    return Framing(
        camera.name,
        float(np.linalg.norm(center - camera.center_world)),
        int((beside == 0).sum()),
        len(points_world),
        bool(camera.depths(center) <= NEAR_PLANE_M),
        float(beside.min()) if len(ahead) else float("nan"),
    )


def epipolar_segment(source: Camera, target: Camera, point_px: Array) -> Array | None:
    """Project the viewing ray of a pixel of `source` into the image of `target`.

    Args:
        source: the camera in which the point was seen.
        target: the camera in which to draw.
        point_px: the point in undistorted pixels of `source`, (2,).

    Returns:
        The end points of the visible segment in undistorted pixels of `target`, (2, 2), clipped to its image,
        or None if the ray does not cross the image.
    """
    target = target.pinhole
    direction = target.T_camera_world[:3, :3] @ source.pinhole.rays(point_px)
    origin = rigid.apply(target.T_camera_world, source.center_world)
    # The part of the ray t >= 0 in front of the target: z(t) = o_z + t d_z >= near.
    t_low, t_high = 0.0, np.inf
    if abs(direction[2]) < TINY:
        if origin[2] < NEAR_PLANE_M:
            return None
    else:
        t_near = (NEAR_PLANE_M - origin[2]) / direction[2]
        t_low, t_high = (max(0.0, t_near), t_high) if direction[2] > 0 else (t_low, t_near)
    if t_high <= t_low:
        return None
    P = target.K @ np.stack([origin, direction], axis=1)  # (3, 2): homogeneous pixel as P @ (1, t)
    ends = np.stack([P @ (1.0, t_low), P[:, 1] if np.isinf(t_high) else P @ (1.0, t_high)])
    if abs(ends[1, 2]) < TINY:  # the ray runs parallel to the image: go far enough to leave it
        ends[1] = P @ (1.0, t_low + 1 / TINY)
    return _clip_segment(ends[:, :2] / ends[:, 2:], target.size)


def _clip_segment(segment_px: Array, size: tuple[int, int]) -> Array | None:
    """Clip a segment (2, 2) to the image by Liang and Barsky's method."""
    (start, end), t0, t1 = segment_px, 0.0, 1.0
    delta = end - start
    for axis in (0, 1):
        for sign, bound in ((-1.0, 0.5), (1.0, size[axis] - 0.5)):
            p, q = sign * delta[axis], bound - sign * start[axis]
            if abs(p) < TINY:
                if q < 0:
                    return None
            elif p < 0:
                t0 = max(t0, q / p)
            else:
                t1 = min(t1, q / p)
    return np.stack([start + t0 * delta, start + t1 * delta]) if t0 < t1 else None
