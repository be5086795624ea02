"""Error of triangulated points that is to be expected of calibrated cameras, from the cameras' covariance."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.calibration.check.rig_adjustment import column_ends
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, Mask
from tracker.geometry.camera_derivatives import project_with_columns
from tracker.geometry.cameras import Camera

_OUTSIDE = 0.05
"""Probability beyond either bound of the 90% interval."""
_DRAWS = 4000
"""Errors that are drawn for the quantiles: their own error is then some 2%."""
MAX_POINTS = 300
"""Most points of the volume; their errors are alike."""


class VolumeAccuracy(NamedTuple):
    """Root mean square error of points in a volume, metres, after the best rigid fit, without noise of their own.

    An interval for the one true value: with a probability of 90% it lies between the bounds.
    """

    expected_m: float
    """Median of its distribution."""
    low_m: float
    high_m: float


def in_pictures(cameras: Sequence[Camera], points_world: Array) -> Mask:
    """Return which cameras have which points in their pictures, (n_cameras, P)."""
    out = []
    for camera in cameras:
        px = camera.project(points_world)
        with np.errstate(invalid="ignore"):
            inside = np.all((px >= -0.5) & (px <= np.array(camera.size) - 0.5), axis=1)
        out.append(inside & camera.within_lens(camera.undistort_points(np.where(inside[:, None], px, 0.0))))
    return np.array(out)


def expected_error(
    cameras: Sequence[Camera], covariance: Array, points_world: Array, with_scale: bool = True
) -> VolumeAccuracy:
    """Propagate the covariance of cameras to points that they triangulate: the points nearest to their rays.

    Where a camera is off by c, its ray passes a point at -A^+ B c, with A and B the derivatives of the picture by point
    and camera. The triangulated point moves by the mean of these, weighted by what the rays determine (I - d d^T). The
    best rigid motion of all points is taken off, so that the covariance may have any gauge.

    Args:
        cameras: the calibrated cameras.
        covariance: of the corrections of all cameras, (n, n).
        points_world: points in the volume, (P, 3), metres; those in fewer than two pictures are left out.
        with_scale: whether a wrong scale is an error; otherwise the best scale is taken off, too.
    """
    shown = in_pictures(cameras, points_world)
    shown, points = shown[:, shown.sum(axis=0) >= 2], points_world[shown.sum(axis=0) >= 2]
    if not len(points):
        return VolumeAccuracy(np.inf, np.inf, np.inf)
    ends = column_ends(cameras)
    normal, moves = np.zeros((len(points), 3, 3)), np.zeros((len(points), 3, ends[-1]))
    for i, camera in enumerate(cameras):
        at = shown[i]
        found = project_with_columns(camera, points[at])
        inverse = np.linalg.pinv(found.by_point)
        normal[at] += inverse @ found.by_point
        moves[at, :, ends[i] : ends[i + 1]] -= inverse @ found.by_camera
    field = np.asarray(np.linalg.solve(normal, moves), dtype=np.float64).reshape(3 * len(points), -1)
    middle = points - points.mean(axis=0)
    rigid_moves = np.concatenate([np.tile(np.eye(3), (len(points), 1)), -rigid.skew(middle).reshape(-1, 3)], axis=1)
    if not with_scale:
        rigid_moves = np.column_stack([rigid_moves, middle.ravel()])
    basis, _ = np.linalg.qr(rigid_moves)
    field -= basis @ (basis.T @ field)
    # The mean square is a sum of squared Gaussian numbers whose variances are these eigenvalues.
    values, vectors = np.linalg.eigh(covariance)
    factor = field @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    variances = np.linalg.eigvalsh(factor.T @ factor / len(points))
    normals = np.random.default_rng(0).normal(size=(_DRAWS, len(variances)))
    low, median, high = np.quantile(np.sqrt(normals**2 @ np.maximum(variances, 0.0)), (_OUTSIDE, 0.5, 1 - _OUTSIDE))
    return VolumeAccuracy(float(median), float(low), float(high))
