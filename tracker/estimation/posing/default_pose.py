"""Default pose of a body before a user has placed it."""

from collections.abc import Sequence

import numpy as np

from tracker.body.dimensions import standing_extent_m
from tracker.body.model import BodyModel
from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.formats.calibrations.pose_conventions import LOOK_DOWN
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera, viewed_point
from tracker.geometry.ground_plane import GroundPlane


def default_pose(
    model: BodyModel, cameras: Sequence[Camera], R_world_up: Array | None = None, beside_m: float = 0.0,
    floor: GroundPlane | None = None,
) -> Array:  # fmt: skip
    """Return an upright pose where the cameras look, on the floor if they all stand above it.

    Args:
        model: the body.
        cameras: the views.
        R_world_up: rotation whose z axis points up, (3, 3); by default the world's z points up.
        beside_m: distance from the middle to the right as the first camera sees it, metres.
        floor: of the session; None to put the root at the height at which the cameras look.
    """
    R = np.eye(3) if R_world_up is None else R_world_up
    middle = viewed_point(cameras) + beside_m * _rightward(cameras[0], R[:, 2])
    if floor is not None and all(c.center_world @ floor.normal > floor.offset_m for c in cameras):
        middle += (floor.offset_m - middle @ floor.normal - standing_extent_m(model)[0]) * floor.normal
    step = np.zeros(model.n_dofs)
    step[:3] = middle
    here = model.retract(model.neutral(), step)
    if np.array_equal(R, np.eye(3)):
        return here
    points = model.points_world(model.neutral()) @ R.T + middle
    return fit_to_points(model, dict(zip(model.point_names, points, strict=True))).pose


def _rightward(camera: Camera, up: Array) -> Array:
    """Return the level direction, (3,), that a camera sees as rightward, whatever its roll; any if it looks straight
    down."""
    right = np.cross(camera.T_world_camera[:3, 2], up)
    if np.linalg.norm(right) < LOOK_DOWN:
        right = np.cross(camera.T_world_camera[:3, 1], up)
    return np.asarray(right / np.linalg.norm(right))
