"""Relative pose of two cameras from joints that both see (Hartley and Zisserman 2004, Sect. 9.6)."""

from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np

from tracker.calibration.boards.view_choice import MIN_CORNERS
from tracker.calibration.check.reprojection import column_ends
from tracker.calibration.self_calibration.joint_adjustment import AdjustedJoints, Gauge, adjust_joints
from tracker.calibration.self_calibration.seen_joints import SeenJoints
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.camera_columns import ROTATION
from tracker.geometry.cameras import Camera


class TwoViews(NamedTuple):
    """Two cameras and the joints that both see, with the distance between the cameras as the unit."""

    pair: tuple[int, int]
    adjusted: AdjustedJoints
    rotation_sigma: float
    """Standard deviation of their relative rotation, rad."""


def relate(seen: SeenJoints, pair: tuple[int, int], a: Camera, b: Camera) -> TwoViews | None:
    """Return two cameras with known lenses; None where the joints that both see do not determine them.

    The relative pose with the least median of epipolar errors needs no threshold, and is fitted to all joints robustly.
    """
    observations = seen.observations(pair)
    at = [observations.of_camera(i) for i in range(2)]
    rays = [c.rays(observations.px[part]) for c, part in zip((a, b), at, strict=True)]
    x, y = (r[:, :2] / r[:, 2:] for r in rays)
    valid = np.isfinite(x).all(axis=1) & np.isfinite(y).all(axis=1)
    if valid.sum() < MIN_CORNERS:
        return None
    E, _ = cv2.findEssentialMat(x[valid], y[valid], np.eye(3), cv2.LMEDS)
    if E is None or E.shape != (3, 3):
        return None
    _, R, t, _ = cv2.recoverPose(E, x[valid], y[valid], np.eye(3))
    T_b_a = rigid.transform(np.asarray(R, dtype=np.float64), np.asarray(t, dtype=np.float64).ravel())
    cameras = (replace(a, T_world_camera=np.eye(4)), replace(b, T_world_camera=rigid.inverse(T_b_a)))
    adjusted = adjust_joints(cameras, observations, seen.n_joints, Gauge(0, 1))
    if adjusted is None or len(adjusted.observed.px) < len(observations.px) / 2:
        return None  # rays to most joints are parallel
    return TwoViews(pair, adjusted, _rotation_sigma(adjusted))


def _rotation_sigma(adjusted: AdjustedJoints) -> float:
    start = column_ends(adjusted.cameras)[1]
    variances: Array = np.diag(adjusted.fit.covariance)[start:][ROTATION]
    return float(np.sqrt(variances.sum()))
