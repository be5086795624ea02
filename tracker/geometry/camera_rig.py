"""Arrangement of the cameras of a rig: the point that all of them see, and its distance."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array
from tracker.geometry.cameras import Camera, across_lines

MIN_APART_M = 0.02
"""Least distance of two cameras, metres: no stereo camera for people is narrower."""
MIN_SPREAD_RAD = float(np.radians(8.0))
"""Largest angle between two optical axes below which they count as parallel: their point is then undetermined."""


@dataclass(frozen=True, eq=False)
class AxesPoint:
    """The point nearest to all optical axes of a rig, in the least squares sense."""

    position: Array
    """In the world and unit of the poses, (3,)."""
    angles_rad: Array
    """Angle between each axis and the direction from its camera to the point, (N,)."""
    distances: Array
    """Distance of each camera to the point, (N,), in the unit of the poses."""
    spread_rad: float
    """Largest angle between two axes."""

    @property
    def is_determined(self) -> bool:
        """Whether the axes differ enough to fix the point."""
        return self.spread_rad >= MIN_SPREAD_RAD


def scaled_cameras(cameras: Sequence[Camera], factor: float) -> tuple[Camera, ...]:
    """Return cameras in a world that is larger by a factor."""
    return tuple(
        replace(c, T_world_camera=rigid.transform(c.T_world_camera[:3, :3], factor * c.center_world)) for c in cameras
    )


def axes_point(Ts_world_camera: Sequence[Array] | Array) -> AxesPoint:
    """Find the point nearest to all optical axes.

    Args:
        Ts_world_camera: poses of at least one camera, each (4, 4), in any unit of length.
    """
    Ts = np.asarray(Ts_world_camera)
    centers, axes = Ts[:, :3, 3], Ts[:, :3, 2]
    middle = centers.mean(axis=0)
    # For parallel axes, the solution of minimum norm lies beside the cameras.
    offset = np.linalg.lstsq(*across_lines(centers - middle, axes), rcond=TINY)
    toward = middle + offset[0] - centers
    distances = np.linalg.norm(toward, axis=1)
    cosines = (axes * toward).sum(axis=1) / np.maximum(distances, TINY)
    spread = np.arccos(np.clip(axes @ axes.T, -1, 1)).max()
    return AxesPoint(middle + offset[0], np.arccos(np.clip(cosines, -1, 1)), distances, float(spread))
