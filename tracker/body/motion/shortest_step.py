"""Steps between poses in degrees of freedom, the shorter way round.

Two sets of angles give a joint of three axes, each orthogonal to the one before, the same rotation: `a, b, c` and `a +
180, 180 - b, c + 180` degrees, with `-b` where the third axis is the first. A search may find either. Numbers that jump
from one to the other (an Euler flip) look like a fast turn that nobody made.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.body.parts import Joint
from tracker.geometry.arrays import Array, IntArray


class _EulerJoint(NamedTuple):
    """A joint whose rotations have two sets of angles each."""

    dofs: IntArray
    """Its degrees of freedom, (3,)."""
    values: IntArray
    """Indices of its angles in a pose, (3,)."""
    middle_sum: float
    """Sum of the middle angles of both sets, rad."""
    limits: Array
    """Lowest and highest of each angle, (3, 2), rad."""
    centers: Array
    """Angles in the middle between both limits, (3,), rad; NaN without limits."""

    @classmethod
    def of(cls, model: BodyModel, joint: int, middle_sum: float) -> "_EulerJoint":
        """Return what is known of a joint, by its index."""
        dofs = np.flatnonzero((model.dof_joint == joint) & ~model.dof_is_length)
        limits = model.limits[dofs]
        centers = [np.mean(x) if np.isfinite(x).all() else np.nan for x in limits]
        return cls(dofs, model.dof_value[dofs], middle_sum, limits, np.array(centers))

    def other(self, angles: Array, near: Array) -> Array:
        """Return the other set of angles of the same rotations, (..., 3), each by the turn nearest to another, rad."""
        out = np.stack([angles[..., 0] + np.pi, self.middle_sum - angles[..., 1], angles[..., 2] + np.pi], axis=-1)
        return np.asarray(out - 2 * np.pi * np.round((out - near) / (2 * np.pi)))


def shortest_step(model: BodyModel, to: Array, start: Array) -> Array:
    """Return the shortest step, (n_dofs,), by which `BodyModel.retract` gets from one pose to another.

    The numbers that it leads to may be others than those of `to`, and beyond the joint limits: unlimited angles go the
    shorter way round, and joints to the nearer of their two sets of angles.
    """
    return _step_and_flips(model, to, start)[0]


def nearest_equivalent(
    model: BodyModel, poses: Array, reference: Array, active_dofs: NDArray[np.bool_] | None = None
) -> Array:
    """Return the same poses by numbers that are nearer to those of a reference.

    Args:
        model: the body.
        poses: (..., n_values).
        reference: (n_values,), or one for each pose.
        active_dofs: degrees of freedom that may change, (n_dofs,); None: all.

    Returns:
        Of the two sets of angles of each joint the nearer one, among those within the limits, (..., n_values).
    """
    out = np.array(poses)
    for joint in _euler_joints(model):
        if active_dofs is not None and not active_dofs[joint.dofs].all():
            continue
        near, own = reference[..., joint.values], out[..., joint.values]
        low, high = joint.limits.T
        other = joint.other(own, np.where(np.isnan(joint.centers), near, joint.centers))
        own_fits, other_fits = (np.isclose(x, np.clip(x, low, high)).all(axis=-1) for x in (own, other))
        is_nearer = ((other - near) ** 2).sum(axis=-1) < ((own - near) ** 2).sum(axis=-1)
        is_other = (other_fits & (is_nearer | ~own_fits))[..., None]
        out[..., joint.values] = np.where(is_other, np.clip(other, low, high), own)
    return out


def _step_and_flips(model: BodyModel, to: Array, start: Array) -> tuple[Array, list[int]]:
    """Return the shortest step, and the middle degrees of freedom of joints that go to their other set of angles."""
    step, flipped = model.difference(to, start), list[int]()
    winds = ~model.dof_is_length & np.isinf(model.limits).all(axis=1)
    step = np.where(winds, np.remainder(step + np.pi, 2 * np.pi) - np.pi, step)
    for joint in _euler_joints(model):
        rotation = step[joint.dofs]
        if rotation @ rotation <= np.pi**2 / 2:  # to the other set, both outer angles go by 180 degrees less
            continue
        other = joint.other(np.asarray(to)[joint.values], start[joint.values]) - start[joint.values]
        if other @ other < rotation @ rotation:
            step[joint.dofs] = other
            flipped.append(int(joint.dofs[1]))
    return step, flipped


@lru_cache(maxsize=16)
def _euler_joints(model: BodyModel) -> Sequence[_EulerJoint]:
    out = []
    for i, joint in enumerate(model.joints):
        middle_sum = middle_angle_sum(joint)
        if middle_sum is not None:
            out.append(_EulerJoint.of(model, i, middle_sum))
    return out


def middle_angle_sum(joint: Joint) -> float | None:
    """Return the sum of the middle angles of both sets of a joint, rad.

    None without three axes, each orthogonal to the one before: such a joint does not reach every orientation.
    """
    if joint.kind != "revolute" or len(joint.axes) != 3:
        return None
    first, second, third = (np.array(a.direction) for a in joint.axes)
    if not np.allclose([first @ second, second @ third], 0):
        return None
    return float(-2 * np.arctan2(second @ np.cross(first, third), first @ third))
