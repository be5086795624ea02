"""Derivatives of a projection with lens distortion by the point and by the camera.

A camera is corrected by R' = exp([w]x) R, C' = C + R^T t, with R from world to camera: w and t are in its own axes. The
focal lengths become e^(s+a) fx and e^(s-a) fy, with the skew like fx. Principal point and distortion are added to.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array
from tracker.geometry.cameras import NEAR_PLANE_M, Camera
from tracker.geometry.lenses import fisheye_limit, fisheye_radii


def consecutive(**sizes: int) -> dict[str, slice]:
    """Return columns that follow one another by their names, from how many each name has."""
    return {name: slice(end - sizes[name], end) for name, end in zip(sizes, accumulate(sizes.values()), strict=True)}


_COLUMNS = consecutive(rotation=3, shift=3, focal=1, aspect=1, principal=2)
"""Columns of a camera's correction before those of its distortion."""
ROTATION, SHIFT = _COLUMNS["rotation"], _COLUMNS["shift"]
"""Columns of the correction of a pose: rotation vector w, rad, and shift t of the centre, metres."""
POSE = slice(0, SHIFT.stop)
"""Both."""
FOCAL, ASPECT = _COLUMNS["focal"].start, _COLUMNS["aspect"].start
"""Columns of the logarithms of the focal length (s) and of the root of fx / fy (a)."""
PRINCIPAL = _COLUMNS["principal"]
"""Columns of the principal point, px."""
DISTORTION = slice(PRINCIPAL.stop, None)
"""Columns of the distortion, in OpenCV's order."""
N_BEFORE_DISTORTION = DISTORTION.start


class ProjectionDerivatives(NamedTuple):
    """Points in the picture of a camera, with derivatives."""

    px: Array
    """Original pixels, (N, 2); NaN where the camera shows no such point."""
    by_point: Array
    """Derivatives by the points in the world, (N, 2, 3), px per metre."""
    by_camera: Array
    """Derivatives by the correction of the camera, (N, 2, n_columns)."""


def n_camera_parameters(camera: Camera) -> int:
    """Return how many numbers correct a camera: 10, and one for each coefficient of its distortion."""
    return N_BEFORE_DISTORTION + camera.distortion.size


def moved_camera(camera: Camera, step: Array) -> Camera:
    """Correct a camera by a step, (n_columns,)."""
    R = camera.T_camera_world[:3, :3]
    T_world_camera = rigid.transform(
        (rigid.so3_exp(step[ROTATION]) @ R).T, camera.center_world + R.T @ step[SHIFT]
    )  # fmt: skip
    K = camera.K.copy()
    K[0, :2] *= np.exp(step[FOCAL] + step[ASPECT])
    K[1, 1] *= np.exp(step[FOCAL] - step[ASPECT])
    K[:2, 2] += step[PRINCIPAL]
    return replace(camera, K=K, distortion=camera.distortion + step[DISTORTION], T_world_camera=T_world_camera)


def camera_difference(camera: Camera, other: Camera) -> Array:
    """Return the step that leads from a camera to another one with the same model of the lens, (n_columns,)."""
    R, R_other = camera.T_camera_world[:3, :3], other.T_camera_world[:3, :3]
    fx, fy = np.log(other.K[0, 0] / camera.K[0, 0]), np.log(other.K[1, 1] / camera.K[1, 1])
    return np.concatenate(
        [
            rigid.so3_log(R_other @ R.T),
            R @ (other.center_world - camera.center_world),
            [(fx + fy) / 2, (fx - fy) / 2],
            other.K[:2, 2] - camera.K[:2, 2],
            other.distortion - camera.distortion,
        ]
    )


def project_with_columns(camera: Camera, points_world: Array) -> ProjectionDerivatives:
    """Project points to original pixels, and differentiate by the points and by the camera.

    Args:
        camera: the camera with its lens.
        points_world: (N, 3), metres.
    """
    R = camera.T_camera_world[:3, :3]
    points_camera = rigid.apply(camera.T_camera_world, points_world)
    slopes, by_direction, by_distortion = (_fisheye if camera.fisheye else _brown_conrady)(
        points_camera, camera.distortion
    )
    K = camera.K[:2, :2]
    by_point_camera = K @ by_direction
    offsets = slopes @ K.T
    by_camera = np.zeros((len(points_world), 2, n_camera_parameters(camera)))
    by_camera[:, :, ROTATION] = by_point_camera @ -rigid.skew(points_camera)
    by_camera[:, :, SHIFT] = -by_point_camera
    by_camera[:, :, FOCAL] = offsets
    by_camera[:, :, ASPECT] = offsets * (1.0, -1.0)
    by_camera[:, :, PRINCIPAL] = np.eye(2)
    by_camera[:, :, DISTORTION] = K @ by_distortion
    return ProjectionDerivatives(offsets + camera.K[:2, 2], by_point_camera @ R, by_camera)


def _brown_conrady(points: Array, distortion: Array) -> tuple[Array, Array, Array]:
    """Return distorted slopes, (N, 2), and their derivatives by points and coefficients, (N, 2, 3) and (N, 2, n)."""
    k1, k2, p1, p2, k3, k4, k5, k6 = np.pad(distortion, (0, 8 - distortion.size))
    z = np.where(points[:, 2] > NEAR_PLANE_M, points[:, 2], np.nan)
    x, y = points[:, 0] / z, points[:, 1] / z
    r2 = x * x + y * y
    above, below = 1 + r2 * (k1 + r2 * (k2 + r2 * k3)), 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
    radial = above / below
    # The derivative of the radial factor by r2.
    slope = (k1 + r2 * (2 * k2 + 3 * r2 * k3) - radial * (k4 + r2 * (2 * k5 + 3 * r2 * k6))) / below
    mixed = 2 * (p1 * x + p2 * y) + 2 * slope * x * y
    by_slopes = _matrices(
        [radial + 2 * slope * x * x + 2 * p1 * y + 6 * p2 * x, mixed],
        [mixed, radial + 2 * slope * y * y + 6 * p1 * y + 2 * p2 * x],
    )
    # The columns of `by_slopes` over z, and their mixture for z.
    by_point = np.empty((len(points), 2, 3))
    by_point[:, :, :2] = by_slopes / z[:, None, None]
    by_point[:, :, 2] = -by_point[:, :, 0] * x[:, None] - by_point[:, :, 1] * y[:, None]
    xy = np.stack([x, y], axis=1)
    by_distortion = np.empty((len(points), 2, 8))
    by_distortion[:, :, 0] = xy * (r2 / below)[:, None]
    by_distortion[:, :, 1] = by_distortion[:, :, 0] * r2[:, None]
    by_distortion[:, :, 2:4] = _matrices([2 * x * y, r2 + 2 * x * x], [r2 + 2 * y * y, 2 * x * y])
    by_distortion[:, :, 4] = by_distortion[:, :, 1] * r2[:, None]
    if distortion.size > 5:
        by_distortion[:, :, 5:] = by_distortion[:, :, [0, 1, 4]] * -radial[:, None, None]
    tangents = np.stack([2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y], axis=1)
    return xy * radial[:, None] + tangents, by_point, by_distortion[:, :, : distortion.size]


def _fisheye(points: Array, distortion: Array) -> tuple[Array, Array, Array]:
    """Return the same of the equidistant model."""
    across = np.linalg.norm(points[:, :2], axis=1)
    angle = np.arctan2(across, points[:, 2])
    angle = np.where(angle <= fisheye_limit(distortion), angle, np.nan)
    a2 = angle * angle
    radius, by_angle = fisheye_radii(angle, distortion)
    # On the axis the direction across is undetermined, and the model is that of a pinhole.
    tiny = across < TINY * np.maximum(np.abs(points[:, 2]), TINY)
    safe = np.where(tiny, 1.0, across)
    unit = np.where(tiny[:, None], (1.0, 0.0), points[:, :2] / safe[:, None])
    side = np.stack([-unit[:, 1], unit[:, 0]], axis=1)
    squared = across**2 + points[:, 2] ** 2
    along = np.concatenate([unit * points[:, 2:], -across[:, None]], axis=1) * (by_angle / squared)[:, None]
    turning = np.where(tiny, 1 / np.where(tiny, points[:, 2], 1.0), radius / safe)
    by_point = unit[:, :, None] * along[:, None]
    by_point[:, :, :2] += side[:, :, None] * side[:, None] * turning[:, None, None]
    powers = angle[:, None] * a2[:, None] ** np.arange(1, 5)
    by_distortion = np.asarray(unit[:, :, None] * powers[:, None], dtype=np.float64)[:, :, : distortion.size]
    return np.asarray(unit * radius[:, None]), by_point, by_distortion


def _matrices(*rows: Sequence[Array]) -> Array:
    """Return matrices from their rows of columns, each (N,); (N, rows, columns)."""
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
