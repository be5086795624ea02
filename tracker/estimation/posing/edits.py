"""Edit whole poses: mirror them, copy from another frame or person, reset a limb."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tracker.body.dimensions import mirror_part
from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.body.parts import Joint
from tracker.estimation.posing.orient import orient
from tracker.geometry.arrays import Array, IntArray
from tracker.validation import ROUNDING

_MIRROR = np.diag([1.0, -1.0, 1.0])
"""Reflection that swaps the body's left and right: y points to the left in every part's frame."""


def is_plain(model: BodyModel, dof: int) -> bool:
    """Return whether a degree of freedom is a value of the pose, not an axis of a ball joint."""
    return model.value_names[model.dof_value[dof]] == model.dof_names[dof]


def current_value(model: BodyModel, pose: Array, dof: int) -> float:
    """Return the value of a degree of freedom, rad or metres; 0 for a ball joint, which turns from its present pose."""
    return float(pose[model.dof_value[dof]]) if is_plain(model, dof) else 0.0


def poses_along(model: BodyModel, pose: Array, dofs: Sequence[int], values: Array) -> Array:
    """Return poses, (N, n_values), with some degrees of freedom, (k,), at values, (N, k), rad or metres."""
    steps = np.zeros((len(values), model.n_dofs))
    steps[:, list(dofs)] = values - np.array([current_value(model, pose, dof) for dof in dofs])
    return model.retract(pose, steps)


def copy_dofs(model: BodyModel, pose: Array, other: Array, dofs: NDArray[np.bool_]) -> Array:
    """Return a pose, (n_values,), with some degrees of freedom, (n_dofs,) bool, of another; ball joints as a whole."""
    at = model.dof_value[dofs]
    balls = np.array([model.joints[j].kind == "ball" for j in model.dof_joint[dofs]], dtype=bool)
    whole = balls & ~model.dof_is_length[dofs]
    out = np.array(pose, dtype=np.float64)
    for index in np.unique(np.concatenate([at, *(at[whole] + k for k in (1, 2, 3))])):
        out[index] = other[index]
    return out


def copy_joint_angles(
    model: BodyModel, pose: Array, other: BodyModel, other_pose: Array, active_dofs: NDArray[np.bool_]
) -> Array:
    """Return a pose with the joint angles of another body where both have the joint by name; the root stays.

    A joint that turns about other axes, or in another order, copies the rotation instead of the angles.

    Args:
        model: the body to change.
        pose: its pose, (n_values,).
        other: the body to copy from, of any model.
        other_pose: its pose, (n_values of the other,).
        active_dofs: degrees of freedom that may change, (n_dofs,).

    Returns:
        The pose, (n_values,), within the body's own limits.
    """
    known = dict(zip(other.value_names, other_pose, strict=True))
    wanted = np.array([known.get(n, own) for n, own in zip(model.value_names, pose, strict=True)])
    joints = {joint.name: i for i, joint in enumerate(other.joints) if np.any(other.dof_joint == i)}
    unlike = [
        i
        for i, j in enumerate(model.joints)
        if j.name in joints and not _has_same_axes(j, other.joints[joints[j.name]])
    ]
    same = active_dofs & (model.dof_joint != 0) & ~np.isin(model.dof_joint, unlike)
    out = model.clip(copy_dofs(model, pose, wanted, same))
    before = other.kinematics(other_pose).Ts_world_part[:, :3, :3]
    for i in unlike:  # parents first: a world rotation depends on the parent
        if i > 0:
            other_index = joints[model.joints[i].name]
            R_local = before[other.parents[other_index]].T @ before[other_index]
            R_parent = model.kinematics(out).Ts_world_part[model.parents[i], :3, :3]
            out = orient(model, out, i, R_parent @ R_local, active_dofs)
    return out


def _has_same_axes(joint: Joint, other: Joint) -> bool:
    """Return whether two joints turn about the same axes in the same order."""
    if joint.kind != other.kind or joint.dof_names != other.dof_names:
        return False
    one, two = (np.array([a.direction for a in j.axes]) for j in (joint, other))
    return np.allclose(one, two, atol=ROUNDING)


def joint_of(model: BodyModel, point: str | None) -> int:
    """Return the joint of a point: its own, else that of the nearest ancestor that moves."""
    part = 0 if point is None else int(model.point_parts[model.point_names.index(point)])
    while part > 0 and not np.any(model.dof_joint == part):
        part = model.parents[part]
    return part


def limb_of(model: BodyModel, point: str | None) -> tuple[str, NDArray[np.bool_]]:
    """Return what resetting a point's limb resets: its display name and its degrees of freedom, (n_dofs,).

    A point of a limb stands for that limb, one of the trunk for its joint. The root, or no point, stands for everything
    but the root.
    """
    joint = joint_of(model, point)
    if joint == 0:
        return "body", model.dof_joint != 0
    limb = next((x for x in limbs(model) if joint in x.parts), None)
    if limb is None:
        return model.joints[joint].name, model.dof_joint == joint
    return limb.name, limb.dofs


def mirror_pose(model: BodyModel, pose: Array) -> Array:
    """Return a pose with left and right exchanged in the body's own plane of symmetry; the root stays.

    With M = diag(1, -1, 1), a joint takes the rotation M R M of its counterpart, or of itself without one. A rotation
    about an axis a becomes the rotation by the same angle about -M a.

    Args:
        model: the body; its joints pair by the names `left_` and `right_`.
        pose: its pose, (n_values,).
    """
    out = np.array(pose, dtype=np.float64)
    names = {joint.name: i for i, joint in enumerate(model.joints)}
    before = model.kinematics(pose).Ts_world_part[:, :3, :3]
    for i, joint in enumerate(model.joints):  # parents first: a world rotation depends on the parent
        other = names.get(mirror_part(joint.name) or joint.name, i)
        if i == 0 or not np.any(model.dof_joint == i):
            continue
        at, at_other = _turns(model, i), _turns(model, other)
        signs = _signs(joint, model.joints[other])
        if signs is not None:
            out[at] = pose[at_other] * signs
        else:
            R_local = before[model.parents[other]].T @ before[other]
            R_parent = model.kinematics(out).Ts_world_part[model.parents[i], :3, :3]
            out = orient(model, out, i, R_parent @ _MIRROR @ R_local @ _MIRROR)
    return model.clip(out)


def _turns(model: BodyModel, joint: int) -> IntArray:
    """Return the indices of the values by which a joint turns."""
    at = model.dof_value[(model.dof_joint == joint) & ~model.dof_is_length]
    return at[0] + np.arange(4) if model.joints[joint].kind == "ball" else at


def _signs(joint: Joint, other: Joint) -> Array | None:
    """Return the factors from the values of the other joint to those of this one; None if their axes do not pair."""
    if joint.kind != other.kind or len(joint.axes) != len(other.axes):
        return None
    if joint.kind == "ball":
        return np.array([1.0, -1.0, 1.0, -1.0])
    wanted = -np.array([a.direction for a in other.axes]) @ _MIRROR
    own = np.array([a.direction for a in joint.axes])
    signs = np.sign(np.sum(own * wanted, axis=1))
    return signs if np.allclose(own, signs[:, None] * wanted, atol=ROUNDING) else None
