"""Retarget a pose to another body: the joints keep their positions in space as far as the bones allow."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.estimation.fitting.gauss_newton import JOINT_M, UNKNOWN, PointTargets, PosePrior, ResidualBlock, solve
from tracker.estimation.fitting.pins import pin_block
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.geometry.triangulation import PointObservation


def retarget_pose(
    pose: Array,
    source: BodyModel,
    target: BodyModel,
    pins: Sequence[PointObservation] = (),
    cameras: Sequence[Camera] = (),
    active_dofs: NDArray[np.bool_] | None = None,
) -> Array:
    """Fit a pose of one body to its joints in another, and to its pins. Joints that one of them lacks stay neutral.

    Args:
        pose: the pose, (n_values,).
        source: body that it was made with.
        target: body that it is fitted to.
        pins: pins of the person.
        cameras: all views, for the pins.
        active_dofs: degrees of freedom that may change, (n_dofs,); all by default.

    Returns:
        The pose of the target body, (n_values,); unchanged if the bodies are the same.
    """
    if source is target:
        return pose
    points = np.array([i for i, n in enumerate(target.point_names) if n in source.point_names], dtype=np.int64)
    start = _values_by_name(pose, source, target)
    places = source.points_world(pose)[[source.point_names.index(target.point_names[i]) for i in points]]
    blocks: list[ResidualBlock] = [
        PointTargets(points, places, np.full(len(points), 1 / JOINT_M)),
        PosePrior(start, np.full(target.n_dofs, 1 / UNKNOWN)),
    ]
    if pins:
        blocks.append(pin_block(target, cameras, pins))
    return solve(target, start, blocks, active_dofs).pose


def _values_by_name(pose: Array, source: BodyModel, target: BodyModel) -> Array:
    """Return a pose of another body, (n_values,), with the values that both bodies name, and neutral ones."""
    if source.value_names == target.value_names:
        return pose
    known = dict(zip(source.value_names, pose, strict=True))
    neutral = zip(target.value_names, target.neutral(), strict=True)
    return target.clip(np.array([known.get(name, value) for name, value in neutral]))
