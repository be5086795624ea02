"""Euler angles of rotations over time, without jumps."""

import warnings
from typing import Literal

import numpy as np

from tracker.geometry import rigid
from tracker.geometry.arrays import Array

Order = Literal["XYZ", "ZXY"]
_LOCK_RAD = 1e-5
"""Distance of the middle angle from a quarter turn at which the first and the third axis coincide."""


def euler_matrix(angles: Array, order: Order) -> Array:
    """Return the rotations of intrinsic Euler angles, `(..., 3)` rad in the given order, as `(..., 3, 3)`."""
    first, second, third = (rigid.so3_exp(angles[..., i, None] * _axis(axis)) for i, axis in enumerate(order))
    return first @ second @ third


def continuous_euler_angles(R: Array, order: Order) -> Array:
    """Return the Euler angles of rotations that follow one another, each as near as possible to the ones before.

    Every rotation has two triples of angles within a turn. At a quarter turn of the middle angle, only the sum or
    difference of the others is determined; the third one then keeps its value.

    Args:
        R: rotations in order of time, (n, 3, 3).
        order: three different axes, such as `ZXY`: R = R_z R_x R_y (intrinsic).

    Returns:
        Angles in the order of the axes, (n, 3), rad; not bounded, because they do not jump by turns.
    """
    from scipy.spatial.transform import Rotation  # imported lazily: takes 0.1 s to load

    if not len(R):
        return np.empty((0, 3))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Gimbal lock")
        found = np.asarray(Rotation.from_matrix(R).as_euler(order))
    before = np.zeros(3)
    for i, angles in enumerate(found):
        if abs(abs(angles[1]) - np.pi / 2) < _LOCK_RAD:
            angles = _unlocked(R[i], angles[1], before[2], order)
        other = np.array([angles[0] + np.pi, np.pi - angles[1], angles[2] + np.pi])
        turn = 2 * np.pi
        near = [a + turn * np.round((before - a) / turn) for a in (angles, other)]
        before = found[i] = min(near, key=lambda a: float(np.abs(a - before).sum()))
    return found


def _axis(name: str) -> Array:
    """Return the unit vector of an axis, (3,)."""
    return np.eye(3)["XYZ".index(name)]


def _unlocked(R: Array, second: float, third: float, order: Order) -> Array:
    """Return the angles of a rotation whose first and third axis coincide, for a given third angle."""
    rest = euler_matrix(np.array([0.0, second, third]), order)
    first = rigid.so3_log(R @ rest.T) @ _axis(order[0])
    return np.array([first, second, third])
