"""The consensus of annotators: the mean of their poses, and of their joints."""

from collections.abc import Sequence

import numpy as np

from tracker.body.model import BodyModel
from tracker.body.motion.velocity import nearest_equivalent, shortest_step
from tracker.geometry.arrays import TINY, Array


def mean_pose(model: BodyModel, poses: Sequence[Array]) -> Array:
    """Return the mean of poses on the manifold of the body's joints, (n_values,).

    Angles are averaged the shorter way round. The mean of ball joints is that of rotations (Karcher mean), found by
    averaging the steps from the present mean.

    Args:
        model: the body of all.
        poses: (n_values,) each; at least one.
    """
    mean = np.array(poses[0], dtype=np.float64)
    while True:
        step = pose_steps(model, poses, mean).mean(axis=0)
        mean = model.retract(mean, step)
        if float(np.abs(step).max()) < TINY:  # rad and metres; the steps shrink quadratically
            return nearest_equivalent(model, mean, mean)


def pose_steps(model: BodyModel, poses: Sequence[Array], start: Array) -> Array:
    """Return the steps from one pose to others in the degrees of freedom, angles the shorter way round, (k, n_dofs)."""
    return np.array([shortest_step(model, pose, start) for pose in poses])


def mean_points(points: Array) -> Array:
    """Return the mean over the annotators of points, (n, k, m, 3) to (n, m, 3), metres."""
    return np.asarray(points.mean(axis=1))
