"""Each camera by itself over the floor, from crown and feet of a person who stands upright (Lv, Zhao and Nevatia 2006).

The crown stands one stature above the feet, wherever they are on the floor. That shows the vertical and the height of
the camera, in statures, as far as the person changes place; priors of a usual camera hold back what it does not show.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from tracker.calibration.boards.camera_graph import MIN_SHARED
from tracker.calibration.self_calibration.person_silhouettes import UprightRules
from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera


class _UsualCamera(NamedTuple):
    """Standard deviations of usual cameras. They only begin an adjustment, from 30 degrees and twice the height off."""

    tilt_rad: float = 0.5
    """How far it looks down."""
    roll_rad: float = 0.1
    log_height: float = 0.7
    """Logarithm of its height over the floor in statures."""
    independent: int = 20
    """Number of coordinates of ends of silhouettes that are taken for independent: those of ten steps."""


def cameras_over_floor(upright_px: Array, lenses: Sequence[Camera]) -> tuple[Camera, ...]:
    """Return cameras above the origin of a floor at z = 0, in statures; nothing relates them to each other.

    Args:
        upright_px: crown and feet, (F, V, 2, 2), original pixels; NaN where unknown.
        lenses: the cameras with their lenses.

    Raises:
        CalibrationError: a camera does not show the person upright.
    """
    return tuple(_over_floor(upright_px[:, i], lens) for i, lens in enumerate(lenses))


def on_floor(camera: Camera, feet_px: Array) -> Array:
    """Return where feet, (F, 2), original pixels, stand on the floor, (F, 2); NaN beyond the horizon."""
    rays = camera.rays(feet_px)
    with np.errstate(divide="ignore", invalid="ignore"):
        points = camera.center_world + rays * (camera.center_world[2] / -rays[:, 2:])
        return np.where(rays[:, 2:] < 0, points[:, :2], np.nan)


def _over_floor(upright_px: Array, lens: Camera) -> Camera:
    seen = upright_px[np.isfinite(upright_px).all(axis=(1, 2))]
    if len(seen) < MIN_SHARED:
        raise CalibrationError(
            f"expected the person upright in camera '{lens.name}' on at least {MIN_SHARED} frames, found {len(seen)}; "
            "film the whole person, who also walks upright"
        )
    held = replace(lens, T_world_camera=np.eye(4))
    feet, usual = held.rays(seen[:, 1]), _UsualCamera()
    sigmas_px = UprightRules().end * np.linalg.norm(seen[:, 0] - seen[:, 1], axis=1, keepdims=True)

    def errors(x: Array) -> Array:
        up = _up(x)
        reach = np.exp(x[2]) / np.maximum(-feet @ up, np.finfo(np.float32).eps)
        off = held.project(feet * reach[:, None] + up) - seen[:, 0]
        off = np.where(np.isfinite(off), off, np.linalg.norm(lens.size)) / sigmas_px
        # Gross errors count by their logarithm. Of a person on one place, errors are alike from frame to frame.
        return np.concatenate(
            [np.arcsinh(off).ravel(), max(1.0, np.sqrt(off.size / usual.independent)) * x / usual[:3]]
        )

    starts = product((0.0, usual.tilt_rad), (-usual.log_height, 0.0, usual.log_height))
    best = min((least_squares(errors, (tilt, 0.0, height)) for tilt, height in starts), key=lambda fit: fit.cost)
    up = _up(best.x)
    forward = np.array([0.0, 0.0, 1.0]) - up[2] * up
    forward /= np.linalg.norm(forward)
    turn = np.stack([np.cross(forward, up), forward, up])
    return replace(lens, T_world_camera=rigid.transform(turn, np.array([0.0, 0.0, np.exp(best.x[2])])))


def _up(x: Array) -> Array:
    """Return the vertical in a camera that looks down by an angle and is rolled by another."""
    tilt, roll = x[:2]
    return np.array([np.sin(roll) * np.cos(tilt), -np.cos(roll) * np.cos(tilt), -np.sin(tilt)])
