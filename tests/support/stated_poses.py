"""Poses as programs of another convention write them: the numbers that a file states."""

import numpy as np

from tracker.formats.calibrations.convention_names import CONVENTIONS as CONVENTIONS
from tracker.formats.calibrations.pose_conventions import read_pose
from tracker.geometry import rigid

_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])


def stated(T_camera_world, convention):
    """Return what a file of a convention states for a pose, (4, 4)."""
    T = _OPENGL @ T_camera_world if convention.endswith("-opengl") else T_camera_world
    R, t = T[:3, :3], T[:3, 3]
    numbers = {
        "world-to-camera": (R, t),
        "camera-to-world": (R.T, -R.T @ t),
        "row-vectors": (R.T, t),
        "camera-position": (R, -R.T @ t),
    }
    pose = rigid.transform(*numbers[convention.removesuffix("-opengl")])
    np.testing.assert_allclose(read_pose(pose, convention), T_camera_world, atol=1e-9)
    return pose
