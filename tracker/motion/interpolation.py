"""Interpolate between two poses: angles the shorter way, ball joints and the root by the shortest rotation.

An angle with limits is interpolated linearly, which stays within the limits. An unlimited angle goes the shorter way
round. The three angles of a root that rotates freely are not interpolated one by one: the root rotates about one fixed
axis (spherical linear interpolation, K. Shoemake 1985), and its angles are computed from the rotation.
"""

import warnings

import numpy as np

from tracker.body.model import BodyModel
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
    step = model.difference(end, start)
    winds = ~model.dof_is_length & np.all(np.isinf(model.limits), axis=1) & _is_angle(model)
    step[winds] = _wrapped(step[winds])
    values = model.retract(start, shares[:, None] * step)
    for i, joint in enumerate(model.joints):
        if joint.free and joint.kind == "revolute" and _reaches_all_rotations(joint):
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


def _reaches_all_rotations(joint: Joint) -> bool:
    """Return whether a joint has three axes, each orthogonal to the one before: it reaches every orientation."""
    if len(joint.axes) != 3:
        return False
    first, second, third = (np.array(a.direction) for a in joint.axes)
    return bool(abs(first @ second) < 1e-9 and abs(second @ third) < 1e-9)


def _is_angle(model: BodyModel) -> np.ndarray:
    """Return whether each degree of freedom is an angle that is a value itself, not of a ball joint, (n_dofs,)."""
    return np.array([model.joints[i].kind == "revolute" for i in model.dof_joint])


def _wrapped(angles: Array) -> Array:
    """Wrap angles to half a turn around 0."""
    return (angles + np.pi) % (2 * np.pi) - np.pi
