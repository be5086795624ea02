"""Distance of a set of points from cameras, and the share of it that is in the picture."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import Array
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
