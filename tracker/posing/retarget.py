"""A pose taken over into a body of other sizes: the joints stay where they are in space, as far as the bones allow."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.fitting.gauss_newton import PointTargets, PosePrior, ResidualBlock, solve
from tracker.fitting.pins import pin_block
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.geometry.triangulation import PointObservation

_JOINT_M = 0.005
"""Standard deviation of a joint's place, metres."""
_LOOSE_RAD, _LOOSE_M = 0.5, 0.5
"""The same of the pose itself: it decides only what the joints leave open, such as the twist of a straight arm."""


def retarget_pose(
    values: Array,
    was: BodyModel,
    becomes: BodyModel,
    pins: Sequence[PointObservation] = (),
    cameras: Sequence[Camera] = (),
    free: NDArray[np.bool_] | None = None,
) -> Array:
    """Fit a pose of one body to its joints in another of the same degrees of freedom, and to its pins.

    Args:
        values: the pose, (n_values,).
        was: the body that it was made with.
        becomes: the body that it is wanted of.
        pins: where a person says that its points are seen.
        cameras: all views, for the pins.
        free: the degrees of freedom that may move, (n_dofs,); all by default.

    Returns:
        The pose in the other body, (n_values,); itself where the bodies are one.
    """
    if was is becomes:
        return values
    points = np.array([i for i, n in enumerate(becomes.point_names) if n in was.point_names], dtype=np.int64)
    places = was.points_world(values)[[was.point_names.index(becomes.point_names[i]) for i in points]]
    near = np.where(becomes.dof_is_length, 1 / _LOOSE_M, 1 / _LOOSE_RAD)
    blocks: list[ResidualBlock] = [
        PointTargets(points, places, np.full(len(points), 1 / _JOINT_M)),
        PosePrior(values, near),
    ]
    if pins:
        blocks.append(pin_block(becomes, cameras, pins))
    return solve(becomes, values, blocks, free, max_iterations=30, tolerance=1e-5).pose
