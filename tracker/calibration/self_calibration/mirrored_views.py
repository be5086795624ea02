"""Find views that are mirrored, or whose files exchange left and right: cameras fit them at a wrong place."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tracker.calibration.check.point_problem import triangulate_all
from tracker.calibration.check.reprojection import Observations
from tracker.calibration.self_calibration.camera_chain import pose_before_joints
from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera


def require_unmirrored(cameras: Sequence[Camera], observed: Observations, sigma_px: float) -> None:
    """Check that no view agrees better with the joints of the other cameras if it is mirrored.

    A person seen from the front looks much like one who is seen from behind in a mirrored picture. Left as it is, such
    a view puts its camera on the other side, with errors that look small.

    Args:
        cameras: the calibrated cameras; of two, the other one alone finds no joints.
        observed: places of joints; some are grossly wrong.
        sigma_px: standard deviation of the others.

    Raises:
        CalibrationError: there is one.
    """
    mirrored = []
    for i, camera in enumerate(cameras):
        is_own = observed.cameras == i
        rest = replace(observed, cameras=observed.cameras[~is_own], groups=observed.groups[~is_own],
                       px=observed.px[~is_own])  # fmt: skip
        if len(np.unique(rest.cameras)) < 2:
            continue
        points, determined = triangulate_all(cameras, rest)
        own = is_own & (observed.groups < len(points))
        own[own] = determined[observed.groups[own]]
        px, joints = observed.px[own], points[observed.groups[own]]
        turned = np.array([camera.width - 1, 0]) + px * np.array([-1, 1])
        as_is, as_mirrored = (_misfit(camera, p, joints, sigma_px) for p in (px, turned))
        # Mirrored views spoil the joints of all, and gain a fifth; true ones lose as much. From afar both fit to 4%.
        if 1.1 * as_mirrored < as_is:
            mirrored.append(repr(camera.name))
    if mirrored:
        raise CalibrationError(
            f"expected key points that all cameras see alike, found that those of camera {' or '.join(mirrored)} agree "
            "better with the others if they are mirrored; check that its footage is not mirrored, and that left and "
            "right are not exchanged in its files"
        )


def _misfit(camera: Camera, px: Array, joints: Array, sigma_px: float) -> float:
    """Return the median distance of joints from their rays, as slopes, at the best pose of a camera; inf without."""
    rays = camera.rays(px) @ camera.T_world_camera[:3, :3]
    ahead = np.isfinite(rays).all(axis=1) & (rays[:, 2] > 0)
    rays, joints = rays[ahead], joints[ahead]
    slopes = rays[:, :2] / rays[:, 2:]
    T_camera_world = pose_before_joints(joints, slopes, sigma_px / float(camera.K[0, 0])) if len(joints) > 5 else None
    if T_camera_world is None:
        return np.inf
    seen = rigid.apply(T_camera_world, joints)
    return float(np.median(np.linalg.norm(seen[:, :2] / seen[:, 2:] - slopes, axis=1)))
