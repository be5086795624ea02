"""Poses between two poses: angles the shorter way, balls and the root by the shortest rotation.

A joint with limits goes straight from one angle to the other, which never leaves its range. An angle without limits
may wind, so it goes the shorter way round. Three angles in a row that turn the whole body say little one by one: the
root turns about one fixed axis, from the one orientation to the other (spherical linear interpolation, K. Shoemake
1985), and its angles are read off on the way.
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
        shares: how far from start to end, (n,), each from 0 to 1.

    Returns:
        Poses within the joints' limits, (n, n_values). Angles that wind go on from `start` without a jump.
    """
    shares = np.asarray(shares, dtype=np.float64)
    step = model.difference(end, start)
    winds = ~model.dof_is_length & np.all(np.isinf(model.limits), axis=1) & _is_angle(model)
    step[winds] = _wrapped(step[winds])
    values = model.retract(start, shares[:, None] * step)
    for i, joint in enumerate(model.joints):
        if joint.free and joint.kind == "revolute" and _tells_all_rotations(joint):
            at = model.dof_value[(model.dof_joint == i) & ~model.dof_is_length]
            values[:, at] = _turned(joint, np.asarray(start)[at], np.asarray(end)[at], shares)
    return model.clip(values)


def _turned(joint: Joint, start: Array, end: Array, shares: Array) -> Array:
    """Angles of a joint of three axes on the shortest rotation, (n, 3), rad."""
    from scipy.spatial.transform import Rotation  # takes a tenth of a second, which who opens a session need not wait

    R_start, R_end = _rotation(joint, start), _rotation(joint, end)
    turn = rigid.so3_log(R_start.T @ R_end)
    R = R_start @ rigid.so3_exp(shares[:, None] * turn)  # (n, 3, 3)
    axes = np.array([a.direction for a in joint.axes])
    with warnings.catch_warnings():
        # Where the first axis lies along the third, one of the two angles is free, and any choice is right.
        warnings.filterwarnings("ignore", message="Gimbal lock")
        angles = np.asarray(Rotation.from_matrix(R).as_davenport(axes, "intrinsic"))
    # The first angles next to those given, and then no jump of whole turns.
    return start + np.unwrap(np.concatenate([np.zeros((1, 3)), angles - start]), axis=0)[1:]


def _rotation(joint: Joint, angles: Array) -> Array:
    """Rotation of a joint of three axes, (3, 3)."""
    first, second, third = (rigid.so3_exp(np.array(a.direction) * v) for a, v in zip(joint.axes, angles, strict=True))
    return first @ second @ third


def _tells_all_rotations(joint: Joint) -> bool:
    """Whether a joint has three axes, each across the one before, so that it reaches every orientation."""
    if len(joint.axes) != 3:
        return False
    first, second, third = (np.array(a.direction) for a in joint.axes)
    return bool(abs(first @ second) < 1e-9 and abs(second @ third) < 1e-9)


def _is_angle(model: BodyModel) -> np.ndarray:
    """Whether a degree of freedom is an angle that is a value itself, not a step of a ball, (n_dofs,)."""
    return np.array([model.joints[i].kind == "revolute" for i in model.dof_joint])


def _wrapped(angles: Array) -> Array:
    """Angles within half a turn of 0."""
    return (angles + np.pi) % (2 * np.pi) - np.pi
