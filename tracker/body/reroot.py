"""Give a body another root: the part whose position and orientation in the world are the free-motion parameters.

KRH08 Sect. 5.4 notes that any part may be the root. The joints between the old root and the new one then turn the other
way: `T_parent_child = trans(p) R1 .. Rn` becomes `T_child_parent = Rn^-1 .. R1^-1 trans(-p)`. The angles stay the same,
in the reverse order and about the negated axes.
"""

from dataclasses import replace

import numpy as np

from tracker.body.model import BodyModel
from tracker.body.parts import Joint, Landmark, Part, SearchGroup
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array

_Place = tuple[float, float, float]


def reroot(model: BodyModel, part: str) -> BodyModel:
    """Return the same body with another root.

    A part on the way from the old root to the new one has its frame at the joint that now carries it. The pivot of the
    old root becomes a landmark. Joints between the two keep name, limits and spreads.

    Args:
        model: the body; its root has a ball joint, or three rotations about axes at right angles.
        part: name of the part that becomes the root.

    Raises:
        TrackerError: there is no such part, the root's rotations are not at right angles, or a joint on the way states
            an anatomical centre beside its pivot, which belongs to the part above it.
    """
    if part not in model.part_index:
        raise TrackerError(f"expected one of the parts {', '.join(model.part_index)} as root, found '{part}'")
    old = model.joints[0]
    if old.kind == "revolute":
        _root_axes(model)
    if part == old.child:
        return model
    way = _way(model, part)  # joints from the new root to the old one
    for joint in way:
        if any(joint.center_offset):
            raise TrackerError(
                f"expected joints without 'center_offset' between '{old.child}' and '{part}', found one of "
                f"'{joint.name}'; leave it out to give the body another root"
            )
    shifts = {j.parent: np.array(j.position) for j in way}  # of a part's frame, to the joint that now carries it
    name = part if part not in model.point_names else f"{part}_root"
    joints = [replace(old, name=name, child=part)]
    joints += [_reversed(j, shifts.get(j.child)) for j in way]
    joints += [
        replace(j, position=_shifted(j.position, shifts.get(j.parent))) for j in model.joints[1:] if j not in way
    ]
    ordered = _parent_first(joints)
    parts = {p.name: replace(p, center=_shifted(p.center, shifts.get(p.name))) for p in model.parts}
    pivot = Landmark(old.name, old.child, _shifted((0.0, 0.0, 0.0), shifts[old.child]))
    landmarks = (*(replace(m, position=_shifted(m.position, shifts.get(m.part))) for m in model.landmarks), pivot)
    landmarks = tuple(m for m in landmarks if m.name != name)
    ordered_parts: tuple[Part, ...] = tuple(parts[j.child] for j in ordered)
    return replace(
        model, joints=ordered, parts=ordered_parts, landmarks=landmarks, search_groups=_groups(model, old, name)
    )


def reroot_pose(model: BodyModel, pose: Array, rerooted: BodyModel) -> Array:
    """Convert a pose to the same body with another root.

    Args:
        model: the body of the pose.
        pose: (n_values,).
        rerooted: what `reroot` made of it.

    Returns:
        The pose, (n_values,), in the order of `rerooted.value_names`.
    """
    root, old = rerooted.joints[0], model.joints[0]
    T = model.kinematics(pose).Ts_world_part[model.part_index[root.child]]
    by_name = dict(zip(model.value_names, pose, strict=True))
    turned = {j.name for j in rerooted.joints[1:] if j.child != _joint_of(model, j.name).child}
    out = np.empty(len(rerooted.value_names))
    for i, name in enumerate(rerooted.value_names):
        joint, value = name.rsplit(".", 1)
        if joint == root.name:
            continue
        # The inverse of a unit quaternion is its conjugate.
        out[i] = -by_name[name] if joint in turned and value in ("qx", "qy", "qz") else by_name[name]
    n = 3 * root.free
    if root.free:
        out[:3] = T[:3, 3]
    if old.kind == "ball":
        from scipy.spatial.transform import Rotation  # imported lazily: takes 0.1 s to load

        out[n : n + 4] = Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=True)
    else:
        out[n : n + 3] = _root_angles(model, T[:3, :3])
    return out


def _way(model: BodyModel, part: str) -> list[Joint]:
    """Return the joints from a part up to the root's child."""
    way, at = [], model.part_index[part]
    while model.parents[at] >= 0:
        way.append(model.joints[at])
        at = model.parents[at]
    return way


def _joint_of(model: BodyModel, name: str) -> Joint:
    return next(j for j in model.joints if j.name == name)


def _reversed(joint: Joint, shift: Array | None) -> Joint:
    """Return a joint that carries its former parent; `shift` is that of its former child's frame."""
    axes = tuple(replace(a, direction=_negated(a.direction)) for a in joint.axes[::-1])
    return replace(joint, parent=joint.child, child=joint.parent, position=_shifted((0.0, 0.0, 0.0), shift), axes=axes)


def _negated(direction: _Place) -> _Place:
    x, y, z = direction
    return (0.0 - x, 0.0 - y, 0.0 - z)


def _shifted(place: _Place, shift: Array | None) -> _Place:
    """Return a place in the frame that has moved by a shift."""
    if shift is None:
        return place
    x, y, z = (float(v) for v in np.array(place) - shift)
    return x, y, z


def _parent_first(joints: list[Joint]) -> tuple[Joint, ...]:
    out, waiting = [joints[0]], joints[1:]
    while waiting:
        placed = {j.child for j in out}
        ready = next(j for j in waiting if j.parent in placed)
        out.append(ready)
        waiting.remove(ready)
    return tuple(out)


def _groups(model: BodyModel, old: Joint, name: str) -> tuple[SearchGroup, ...]:
    """Return the search groups with the new root's degrees of freedom in place of the old root's."""
    renamed = {n: f"{name}.{n.rsplit('.', 1)[1]}" for n in old.dof_names}
    return tuple(replace(g, dofs=tuple(renamed.get(d, d) for d in g.dofs)) for g in model.search_groups)


def _root_axes(model: BodyModel) -> Array:
    """Return the axes of the root's three rotations as columns, (3, 3).

    Raises:
        TrackerError: they are not three at right angles.
    """
    axes = np.array([a.direction for a in model.joints[0].axes]).reshape(-1, 3).T
    if axes.shape != (3, 3) or not np.allclose(axes.T @ axes, np.eye(3), atol=1e-6):
        raise TrackerError(
            f"expected a root with three rotations about axes at right angles, or a ball joint, found {axes.shape[1]} "
            f"rotations of '{model.joints[0].name}'; such a body has one root only"
        )
    return axes


def _root_angles(model: BodyModel, R: Array) -> Array:
    """Return the angles of the root's rotations, (3,), rad, that give a rotation (3, 3)."""
    from scipy.spatial.transform import Rotation  # imported lazily: takes 0.1 s to load

    B = _root_axes(model)
    # In the basis of the axes they are x, y, z; a left-handed basis turns the other way.
    return np.asarray(np.linalg.det(B) * Rotation.from_matrix(B.T @ R @ B).as_euler("XYZ"))
