"""Derivatives of the images of points by the corrections of a camera, by numpy: the oracle of `piece_kernels`."""

import numpy as np

from tracker.geometry.camera_correction import FOCAL, POSITION, ROTATION
from tracker.geometry.rigid import skew, so3_exp


def columns(camera, correction, points_world, px_by_point):
    """Differentiate the images of points by a further step of a correction, except that of the clock.

    Args:
        camera: with the correction, without lens distortion.
        correction: (8,).
        points_world: (N, 3), metres.
        px_by_point: derivatives of their images by them, (N, 2, 3), px per metre.

    Returns:
        (N, 2, 7), px per radian, metre and 1.
    """
    R = camera.T_camera_world[:3, :3]
    points_camera = points_world @ R.T + camera.T_camera_world[:3, 3]
    px_by_camera = px_by_point @ R.T
    out = np.empty((len(points_world), 2, FOCAL + 1))
    out[:, :, ROTATION] = -px_by_camera @ skew(points_camera)
    out[:, :, POSITION] = -px_by_camera @ so3_exp(correction[ROTATION])
    slopes = points_camera[:, :2] / points_camera[:, 2:]
    out[:, :, FOCAL] = slopes @ camera.K[:2, :2].T
    return out
