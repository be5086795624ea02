"""Knowledge of cameras and lenses before any observation, as standard deviations of their corrections."""

from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import Array
from tracker.geometry.camera_derivatives import (
    ASPECT,
    DISTORTION,
    FOCAL,
    PRINCIPAL,
    ROTATION,
    SHIFT,
    n_camera_parameters,
)
from tracker.geometry.cameras import Camera


class CameraPrior(NamedTuple):
    """Standard deviations of the corrections of a camera; 0 holds one, infinity leaves it free."""

    rotation_rad: float
    shift_m: float
    focal: float
    """Of the logarithm of the focal length."""
    aspect: float
    """Of the logarithm of the root of fx / fy."""
    principal: float
    """Of the principal point, as a share of the longer side of the picture."""
    radial: float
    """Of each radial coefficient."""
    tangential: float
    """Of each tangential coefficient."""


UNKNOWN_LENS = CameraPrior(np.inf, np.inf, 0.5, 0.003, 0.015, 0.3, 0.005)
"""A camera of which only the size of the picture is known. Focal lengths of 0.6 to 1.6 times the longer side cover
horizontal fields of view from 35 to 80 degrees. Sensors have square pixels to some thousandths. The four lenses of
`board_real` have coefficients of up to 0.34 and 0.013, and principal points up to 0.02 sides off."""
CALIBRATED = CameraPrior(float(np.radians(1.0)), 0.05, 0.01, 0.001, 0.005, 0.02, 0.001)
"""A camera that was calibrated once and may have been moved since: by a degree, 5 cm and 1% of its focal length."""

NEWS = 0.5
"""Largest standard deviation, as a share of that before, at which observations determine a number. At a half they have
added three times as much as was known."""


def prior_sigmas(camera: Camera, prior: CameraPrior, pose: bool = True, lens: bool = True) -> Array:
    """Return the standard deviations of the corrections of a camera, (n_columns,).

    Args:
        camera: its picture and its lens model.
        prior: what is known.
        pose: whether its pose may move.
        lens: whether its focal length, principal point and distortion may move.
    """
    out = np.zeros(n_camera_parameters(camera))
    if pose:
        out[ROTATION], out[SHIFT] = prior.rotation_rad, prior.shift_m
    if lens:
        out[FOCAL], out[ASPECT] = prior.focal, prior.aspect
        out[PRINCIPAL] = prior.principal * max(camera.size)
        out[DISTORTION] = prior.radial
        if not camera.fisheye:
            out[DISTORTION][2:4] = prior.tangential
    return out
