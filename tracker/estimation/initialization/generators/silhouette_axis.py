"""Find the major axis of a silhouette by iterative principal component analysis (GD96 Sect. 4.1, Fig. 5).

Arms beside the trunk turn the first axis. Each round removes the points far aside of the axis, and finds it again.
"""

from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import Array, Mask
from tracker.geometry.cameras import Camera

_LATERAL = 2.0
"""Points farther aside of the axis are removed, in standard deviations of the points that are kept. A strip of even
width keeps all its points: its border lies at sqrt(3)."""
_MAX_ROUNDS = 12
"""Largest number of rounds. They end before where no other points are removed. With raised arms, more rounds would turn
the axis by 6 degrees (test_body_axis.py)."""
_MAX_POINTS = 5000
"""Largest number of points that are sampled from a silhouette."""
_MIN_POINTS = 30
"""Smallest number of pixels of a silhouette that has an axis."""


class MajorAxis(NamedTuple):
    """The major axis of the silhouette of one person in one view."""

    camera: Camera
    """Without lens distortion, at working scale."""
    points_px: Array
    """Points sampled from the silhouette, (n, 2), undistorted working px."""
    n_pixels: int
    """Number of pixels of the silhouette."""
    lines_px: Array
    """Ends of the successive approximations, (n_rounds, 2, 2), undistorted working px; the last is the axis."""
    elongation: float
    """1 less the ratio of the spreads across and along the axis: 0 for a disc, nearly 1 for a line."""

    @property
    def normal_world(self) -> Array:
        """Unit normal of the plane through the camera's centre and the axis, (3,)."""
        a, b = self.camera.rays(self.lines_px[-1])
        normal = np.cross(a, b)
        return np.asarray(normal / np.linalg.norm(normal))


def major_axis(mask: Mask, camera: Camera) -> MajorAxis | None:
    """Return the major axis of a silhouette; None if it has too few pixels.

    Args:
        mask: silhouette of one person, (H, W), raw pixels.
        camera: camera of these pixels, with its lens distortion.
    """
    rows, columns = np.nonzero(mask)
    if len(rows) < _MIN_POINTS:
        return None
    chosen = np.linspace(0, len(rows) - 1, min(len(rows), _MAX_POINTS)).astype(np.intp)
    points = camera.undistort_points(np.column_stack([columns, rows])[chosen].astype(np.float64))
    if camera.fisheye:  # far aside, a few pixels would outweigh the rest
        points = points[np.all((points >= -0.5) & (points <= np.array(camera.pinhole.size) - 0.5), axis=1)]
        if len(points) < _MIN_POINTS:
            return None
    kept, lines, elongation = np.ones(len(points), bool), [], 0.0
    for _ in range(_MAX_ROUNDS):
        center = points[kept].mean(axis=0)
        variances, axes = np.linalg.eigh(np.cov(points[kept].T))
        along, across = axes[:, 1], axes[:, 0]
        elongation = float(1 - np.sqrt(max(0.0, variances[0]) / variances[1]))
        ends = (points[kept] - center) @ along
        lines.append(center + np.outer([ends.min(), ends.max()], along))
        before, kept = kept, np.abs((points - center) @ across) <= _LATERAL * np.sqrt(variances[0])
        if np.array_equal(kept, before):
            break
    return MajorAxis(camera.pinhole, points, len(rows), np.array(lines), elongation)
