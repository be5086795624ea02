"""Sizes and orientations of solids from the covariance of their voxels (MTHC01 Sect. 3).

MTHC01 prints a half-axis of sqrt(3) sigma for the ellipsoid, which is exact for the shell of a sphere only. A solid
uniform ellipsoid has sqrt(5) sigma, an elliptical cylinder 2 sigma across and sqrt(3) sigma along its axis.
"""

from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import Array


def _half_axis(dimension: int) -> float:
    """Return the radius of a solid uniform ball in that many dimensions, in standard deviations along an axis."""
    return float(np.sqrt(dimension + 2))


ELLIPSOID = _half_axis(3)
"""Half-axis of a solid ellipsoid in standard deviations, along all axes."""
CYLINDER = np.array([_half_axis(2), _half_axis(2), _half_axis(1)])
"""Half-axes of a solid elliptical cylinder in standard deviations, twice across and once along its axis, (3,)."""


class PrincipalAxes(NamedTuple):
    """Centre, directions and spreads of a cloud of voxels."""

    center: Array
    """(3,), metres."""
    axes: Array
    """Unit directions as columns, (3, 3), by ascending spread; right-handed."""
    sigmas: Array
    """Standard deviations along them, (3,), metres, ascending."""


def principal_axes(points: Array, size_m: float) -> PrincipalAxes:
    """Return the principal axes of solid voxels.

    Args:
        points: centres of the voxels, (N, 3), N > 0, metres.
        size_m: edge of a voxel, metres. Its own variance of size^2 / 12 is that of a solid cube.
    """
    center = points.mean(axis=0)
    deviations = points - center
    variances, axes = np.linalg.eigh(deviations.T @ deviations / len(points) + np.eye(3) * size_m**2 / 12)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    return PrincipalAxes(center, axes, np.sqrt(variances))
