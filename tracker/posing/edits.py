"""Whole poses changed at a stroke: mirrored, taken over from another frame or person, put back to neutral."""

import numpy as np
from numpy.typing import NDArray

from tracker.body.dimensions import mirror_part
from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.body.parts import Joint
from tracker.geometry.arrays import Array, IntArray
from tracker.posing.orient import orient

_MIRROR = np.diag([1.0, -1.0, 1.0])
"""What swaps the body's left and right: y points to the left in every part's frame."""
_ALIKE = 1e-6


def taken_over(model: BodyModel, values: Array, other: Array, dofs: NDArray[np.bool_]) -> Array:
    """A pose, (n_values,), with some degrees of freedom of another, (n_dofs,) bool; ball joints go as a whole."""
    at = model.dof_value[dofs]
    balls = np.array([model.joints[j].kind == "ball" for j in model.dof_joint[dofs]], dtype=bool)
    whole = balls & ~model.dof_is_length[dofs]
    out = np.array(values, dtype=np.float64)
    for index in np.unique(np.concatenate([at, *(at[whole] + k for k in (1, 2, 3))])):
        out[index] = other[index]
    return out


def bent_alike(model: BodyModel, values: Array, other: BodyModel, theirs: Array, free: NDArray[np.bool_]) -> Array:
    """A pose with the joints bent as in one of another body, where both have them by name; the root stays.

    Joints that turn about other axes there, or in another order, take over the rotation, not the angles.

    Args:
        model: the body that is to bend.
        values: its pose, (n_values,).
        other: the body that is bent so, of whatever model.
        theirs: the pose of that, (n_values of the other,).
        free: which degrees of freedom may change, (n_dofs,).

    Returns:
        The pose, (n_values,), within the body's own limits.
    """
    known = dict(zip(other.value_names, theirs, strict=True))
    wanted = np.array([known.get(n, own) for n, own in zip(model.value_names, values, strict=True)])
    joints = {joint.name: i for i, joint in enumerate(other.joints) if np.any(other.dof_joint == i)}
    unlike = [i for i, j in enumerate(model.joints) if j.name in joints and not _alike(j, other.joints[joints[j.name]])]
    same = free & (model.dof_joint != 0) & ~np.isin(model.dof_joint, unlike)
    out = model.clip(taken_over(model, values, wanted, same))
    before = other.kinematics(theirs).Ts_world_part[:, :3, :3]
    for i in unlike:  # parents first: what is turned in the world stands on its parent
        if i > 0:
            theirs_at = joints[model.joints[i].name]
            R_local = before[other.parents[theirs_at]].T @ before[theirs_at]
            R_parent = model.kinematics(out).Ts_world_part[model.parents[i], :3, :3]
            out = orient(model, out, i, R_parent @ R_local, free)
    return out


def _alike(joint: Joint, other: Joint) -> bool:
    """Whether two joints turn about the same axes in the same order."""
    if joint.kind != other.kind or joint.dof_names != other.dof_names:
        return False
    one, two = (np.array([a.direction for a in j.axes]) for j in (joint, other))
    return np.allclose(one, two, atol=_ALIKE)


def joint_of(model: BodyModel, point: str | None) -> int:
    """The joint whose degrees of freedom are meant by a point: its own, else that of the nearest part that moves."""
    part = 0 if point is None else int(model.point_parts[model.point_names.index(point)])
    while part > 0 and not np.any(model.dof_joint == part):
        part = model.parents[part]
    return part


def limb_of(model: BodyModel, point: str | None) -> tuple[str, NDArray[np.bool_]]:
    """What resetting a point's limb means: its name for people, and its degrees of freedom, (n_dofs,).

    A point of a limb means that limb, one of the trunk its joint; the root, or no point, means everything but the root.
    """
    joint = joint_of(model, point)
    if joint == 0:
        return "body", model.dof_joint != 0
    limb = next((x for x in limbs(model) if joint in x.parts), None)
    if limb is None:
        return model.joints[joint].name, model.dof_joint == joint
    return limb.name, limb.dofs


def mirrored(model: BodyModel, values: Array) -> Array:
    """Exchange left and right of a pose in the body's own plane of symmetry; the root stays where it is.

    With M = diag(1, -1, 1), a joint takes the rotation M R M of its counterpart, or of itself where it has none. About
    an axis a that is the rotation by the same angle about -M a.

    Args:
        model: the body; its joints pair by the names `left_` and `right_`.
        values: its pose, (n_values,).
    """
    out = np.array(values, dtype=np.float64)
    names = {joint.name: i for i, joint in enumerate(model.joints)}
    before = model.kinematics(values).Ts_world_part[:, :3, :3]
    for i, joint in enumerate(model.joints):  # parents first: what is turned in the world stands on its parent
        other = names.get(mirror_part(joint.name) or joint.name, i)
        if i == 0 or not np.any(model.dof_joint == i):
            continue
        at, at_other = _turns(model, i), _turns(model, other)
        signs = _signs(joint, model.joints[other])
        if signs is not None:
            out[at] = values[at_other] * signs
        else:
            R_local = before[model.parents[other]].T @ before[other]
            R_parent = model.kinematics(out).Ts_world_part[model.parents[i], :3, :3]
            out = orient(model, out, i, R_parent @ _MIRROR @ R_local @ _MIRROR)
    return model.clip(out)


def _turns(model: BodyModel, joint: int) -> IntArray:
    """Indices of the values by which a joint turns."""
    at = model.dof_value[(model.dof_joint == joint) & ~model.dof_is_length]
    return at[0] + np.arange(4) if model.joints[joint].kind == "ball" else at


def _signs(joint: Joint, other: Joint) -> Array | None:
    """Factors from the values of the other joint to those of this one; None where the axes do not pair."""
    if joint.kind != other.kind or len(joint.axes) != len(other.axes):
        return None
    if joint.kind == "ball":
        return np.array([1.0, -1.0, 1.0, -1.0])
    wanted = -np.array([a.direction for a in other.axes]) @ _MIRROR
    own = np.array([a.direction for a in joint.axes])
    signs = np.sign(np.sum(own * wanted, axis=1))
    return signs if np.allclose(own, signs[:, None] * wanted, atol=_ALIKE) else None
