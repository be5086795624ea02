"""Interpolate between two poses: angles the shorter way, ball joints and the root by the shortest rotation.

An angle goes the shortest way, linearly; of the two sets of angles of a shoulder the nearer one counts. The three
angles of a root that rotates freely are not interpolated one by one: the root rotates about one fixed axis (spherical
linear interpolation, K. Shoemake 1985), and its angles are computed from the rotation.
"""

import warnings

import numpy as np

from tracker.body.model import BodyModel
from tracker.body.motion.pose_steps import middle_angle_sum, nearest_equivalent, shortest_step
from tracker.body.parts import Joint
from tracker.geometry import rigid
from tracker.geometry.arrays import Array


def interpolate_pose(model: BodyModel, start: Array, end: Array, shares: Array) -> Array:
    """Interpolate from one pose to another.

    Args:
        model: the body.
        start: pose at share 0, (n_values,).
        end: pose at share 1, (n_values,).
        shares: fractions of the way from start to end, (n,), each from 0 to 1.

    Returns:
        Poses within the joints' limits, (n, n_values). Unlimited angles continue from `start` without a jump.
    """
    shares = np.asarray(shares, dtype=np.float64)
    values = model.retract(start, shares[:, None] * shortest_step(model, end, start))
    values = nearest_equivalent(model, values, values)  # within the limits
    for i, joint in enumerate(model.joints):
        if joint.free and middle_angle_sum(joint) is not None:
            at = model.dof_value[(model.dof_joint == i) & ~model.dof_is_length]
            values[:, at] = _slerp_angles(joint, np.asarray(start)[at], np.asarray(end)[at], shares)
    return model.clip(values)


def _slerp_angles(joint: Joint, start: Array, end: Array, shares: Array) -> Array:
    """Interpolate the angles of a joint of three axes along the shortest rotation, (n, 3), rad."""
    from scipy.spatial.transform import Rotation  # imported lazily: takes 0.1 s to load

    R_start, R_end = _rotation(joint, start), _rotation(joint, end)
    turn = rigid.so3_log(R_start.T @ R_end)
    R = R_start @ rigid.so3_exp(shares[:, None] * turn)  # (n, 3, 3)
    axes = np.array([a.direction for a in joint.axes])
    with warnings.catch_warnings():
        # With the first axis along the third, one of the two angles is free, and any choice is right.
        warnings.filterwarnings("ignore", message="Gimbal lock")
        angles = np.asarray(Rotation.from_matrix(R).as_davenport(axes, "intrinsic"))
    # Angles nearest to the start, then without jumps by whole turns.
    return start + np.unwrap(np.concatenate([np.zeros((1, 3)), angles - start]), axis=0)[1:]


def _rotation(joint: Joint, angles: Array) -> Array:
    """Return the rotation of a joint of three axes, (3, 3)."""
    first, second, third = (rigid.so3_exp(np.array(a.direction) * v) for a, v in zip(joint.axes, angles, strict=True))
    return first @ second @ third
