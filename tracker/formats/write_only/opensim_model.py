"""OpenSim models (.osim): a body model whose coordinates are the angles of the poses; motions (.mot) of them over time.

A joint of up to three rotations about independent axes becomes a CustomJoint with the same axes in the same order. A
ball joint, and a joint whose axes OpenSim does not accept, turns by Euler angles about x, y and z. The root has
translations along the world's axes besides. Each body has the shape's ellipsoid, and the mass of that ellipsoid at the
density of water: enough for display and inverse kinematics, too rough for dynamics. A marker marks each point of the
body under its name, as in a TRC file.

A motion has a header with the name, the numbers of rows and columns and inDegrees, then tab-separated columns: time in
seconds, then one for each coordinate, in degrees and metres. Rows of frames without a pose are left out; OpenSim
interpolates by time.
"""

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.constants import g

from tracker.body.model import BodyModel
from tracker.body.parts import Joint
from tracker.files import write_text_atomic
from tracker.formats.file_names import identifier, identifiers
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.euler import Order, continuous_euler_angles

_DENSITY = 1000.0
"""Density of a body, kg/m^3: about that of water, in which people just float."""
_FREE = 100.0
"""Half the range of a coordinate without limits, metres or rad: more than any room, and any number of turns."""
_EULER: Order = "XYZ"
_AXES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
"""Axes of these angles in the frame of a joint."""
_SETS = ("Body", "Joint", "Marker")


@dataclass(frozen=True, eq=False)
class CoordinateJoint:
    """The coordinates of a joint in OpenSim."""

    names: tuple[str, ...]
    """Names of the coordinates: translations, then rotations."""
    axes: tuple[tuple[float, float, float], ...]
    """Axis of each rotation in the joint's frame, in order."""
    ranges: tuple[tuple[float, float], ...]
    """Range of each rotation, rad."""
    is_free: bool
    """Whether three translations come first."""
    by_euler: bool
    """Whether the rotations are Euler angles, computed from the rotation of the joint."""


def coordinate_joints(model: BodyModel) -> list[CoordinateJoint]:
    """Return the coordinates of each joint of a body, in the order of its joints."""
    found = [_coordinate_joint(joint) for joint in model.joints]
    names = iter(identifiers([name.replace(".", "_") for joint in found for name in joint.names]))
    return [replace(joint, names=tuple(next(names) for _ in joint.names)) for joint in found]


def _coordinate_joint(joint: Joint) -> CoordinateJoint:
    """Return the coordinates of a joint, with names that others may have too."""
    directions = np.array([a.direction for a in joint.axes]).reshape(-1, 3)
    is_dependent = len(directions) > 0 and np.linalg.matrix_rank(directions, tol=1e-3) < len(directions)
    if joint.kind == "ball" or is_dependent:
        names = (*joint.dof_names[: 3 * joint.free], *(f"{joint.name}.r{axis.lower()}" for axis in _EULER))
        return CoordinateJoint(names, _AXES, ((-_FREE, _FREE),) * 3, joint.free, by_euler=True)
    ranges = tuple((max(a.limits[0], -_FREE), min(a.limits[1], _FREE)) for a in joint.axes)
    axes = tuple(a.direction for a in joint.axes)
    return CoordinateJoint(tuple(joint.dof_names), axes, ranges, joint.free, by_euler=False)


def coordinate_values(model: BodyModel, poses: Array) -> Array:
    """Return the coordinates of poses, (n, n_values), in the order of `coordinate_joints`, (n, c), metres and rad."""
    columns = []
    Ts = np.array([model.kinematics(p).Ts_world_part for p in poses]).reshape(len(poses), len(model.parts), 4, 4)
    for i, joint in enumerate(coordinate_joints(model)):
        dofs = np.flatnonzero(model.dof_joint == i)
        if joint.is_free:
            columns.append(poses[:, model.dof_value[dofs[:3]]])
        if joint.by_euler:
            R, parent = Ts[:, i, :3, :3], model.parents[i]
            if parent >= 0:
                R = np.swapaxes(Ts[:, parent, :3, :3], -1, -2) @ R
            columns.append(continuous_euler_angles(R, _EULER))
        else:
            columns.append(poses[:, model.dof_value[dofs[3 * joint.is_free :]]])
    return np.hstack(columns)


def write_osim(path: str | Path, model: BodyModel, name: str, T_ground_world: Array, up: Sequence[float]) -> None:
    """Write a body as an OpenSim model.

    Args:
        path: the file.
        model: the body.
        name: of the model in the file.
        T_ground_world: pose of the poses' world in OpenSim's ground, (4, 4), metres.
        up: unit vector against gravity, in the ground.
    """
    document = ET.Element("OpenSimDocument", Version="40000")
    gravity = _vector(-g * np.asarray(up))
    top = _add(document, "Model", identifier(name), gravity=gravity, length_units="meters", force_units="N")
    part_names, joint_names = identifiers([p.name for p in model.parts]), identifiers([j.name for j in model.joints])
    bodies, joints, markers = (_add(_add(top, f"{kind}Set", f"{kind.lower()}set"), "objects") for kind in _SETS)
    for i, part in enumerate(part_names):
        _body(bodies, model, i, part)
    for i, coordinates in enumerate(coordinate_joints(model)):
        _joint(joints, model, i, coordinates, joint_names[i], part_names, T_ground_world)
    for i, point in enumerate(identifiers(model.point_names)):
        carrier, location = _marker_place(model, i)
        frame = f"/bodyset/{part_names[carrier]}"
        _add(markers, "Marker", point, socket_parent_frame=frame, location=_vector(location), fixed="true")
    ET.indent(document)
    text = ET.tostring(document, encoding="unicode")
    write_text_atomic(Path(path), f'<?xml version="1.0" encoding="UTF-8" ?>\n{text}\n')


def write_mot(path: str | Path, model: BodyModel, poses: Array, times: Array, title: str, note: str) -> None:
    """Write poses of one body.

    Args:
        path: the file.
        model: the body of all poses.
        poses: (n, n_values).
        times: time of each, ascending, (n,), s.
        title: name of the motion in OpenSim.
        note: a line of the header for people.
    """
    joints = coordinate_joints(model)
    names = [name for joint in joints for name in joint.names]
    is_length = np.array([i < 3 and joint.is_free for joint in joints for i in range(len(joint.names))])
    values = coordinate_values(model, poses)
    values[:, ~is_length] = np.degrees(values[:, ~is_length])
    lines = [title, "version=1", f"nRows={len(poses)}", f"nColumns={len(names) + 1}", "inDegrees=yes", note]
    lines.append("endheader")
    lines.append("\t".join(["time", *names]))
    for time, row in zip(times.tolist(), values.tolist(), strict=True):
        lines.append("\t".join([f"{time:.9f}", *(f"{x:.9f}" for x in row)]))
    write_text_atomic(Path(path), "\n".join(lines) + "\n")


def _marker_place(model: BodyModel, point: int) -> tuple[int, Array]:
    """Return the part that carries a marker, and the anatomical joint centre in its frame, (3,), metres."""
    offset, part = model.center_offsets[point], int(model.proximal_parts[point])
    if not offset.any():
        return int(model.point_parts[point]), model.points_part[point]
    on_joint = point < len(model.joints) and bool(model.joints[point].parent)
    at = np.array(model.joints[point].position) * model.height_m if on_joint else model.points_part[point]
    return part, at + offset


def _body(bodies: ET.Element, model: BodyModel, i: int, name: str) -> None:
    half_axes, center = np.array(model.parts[i].half_axes) * model.height_m, model.centers_part[i]
    mass = _DENSITY * 4 / 3 * np.pi * float(np.prod(half_axes))
    a2, b2, c2 = half_axes**2
    body = _add(bodies, "Body", name)
    frame = _add(_add(body, "components"), "PhysicalOffsetFrame", "shape")
    geometry = _add(_add(frame, "attached_geometry"), "Ellipsoid", "ellipsoid", socket_frame="..")
    rgb = [int(model.parts[i].color[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    _add(geometry, "Appearance", color=_vector(rgb))
    _add_texts(geometry, radii=_vector(half_axes))
    _add_texts(frame, socket_parent="..", translation=_vector(center), orientation="0 0 0")
    inertia = f"{_vector(mass / 5 * np.array([b2 + c2, a2 + c2, a2 + b2]))} 0 0 0"
    _add_texts(body, mass=f"{mass:.9g}", mass_center=_vector(center), inertia=inertia)


def _joint(
    joints: ET.Element,
    model: BodyModel,
    i: int,
    coordinates: CoordinateJoint,
    name: str,
    part_names: Sequence[str],
    T_ground_world: Array,
) -> None:
    parent, offset = model.parents[i], np.array(model.joints[i].position) * model.height_m
    T_parent_joint = rigid.transform(t=offset) if parent >= 0 else T_ground_world @ rigid.transform(t=offset)
    frames = {"socket_parent_frame": "parent_offset", "socket_child_frame": "child_offset"}
    joint = _add(joints, "CustomJoint" if coordinates.names else "WeldJoint", name, **frames)
    if coordinates.names:
        _coordinates(joint, coordinates)
    rows = _add(joint, "frames")
    parent_path = f"/bodyset/{part_names[parent]}" if parent >= 0 else "/ground"
    for frame, path, T in (
        ("parent_offset", parent_path, T_parent_joint),
        ("child_offset", f"/bodyset/{part_names[i]}", np.eye(4)),
    ):
        angles = _vector(continuous_euler_angles(T[None, :3, :3], _EULER)[0])
        place = {"translation": _vector(T[:3, 3]), "orientation": angles}
        _add(rows, "PhysicalOffsetFrame", frame, socket_parent=path, **place)
    if coordinates.names:
        _spatial_transform(joint, coordinates)


def _coordinates(joint: ET.Element, coordinates: CoordinateJoint) -> None:
    rows = _add(joint, "coordinates")
    ranges = ((-_FREE, _FREE),) * 3 * coordinates.is_free + coordinates.ranges
    for name, limits in zip(coordinates.names, ranges, strict=True):
        _add(rows, "Coordinate", name, range=_vector(limits), clamped="false")


def _spatial_transform(joint: ET.Element, coordinates: CoordinateJoint) -> None:
    found = _add(joint, "SpatialTransform")
    moved, turned = coordinates.names[: 3 * coordinates.is_free], coordinates.names[3 * coordinates.is_free :]
    for i, axis in enumerate(_completed(coordinates.axes)):
        _transform_axis(found, f"rotation{i + 1}", turned[i] if i < len(turned) else None, axis)
    for i, axis in enumerate(np.eye(3)):
        _transform_axis(found, f"translation{i + 1}", moved[i] if i < len(moved) else None, axis)


def _transform_axis(parent: ET.Element, name: str, coordinate: str | None, axis: Array) -> None:
    row = _add(parent, "TransformAxis", name, coordinates=coordinate or "", axis=_vector(axis))
    if coordinate is None:
        _add(row, "Constant", "function", value="0")
    else:
        _add(row, "LinearFunction", "function", coefficients=" 1 0")


def _completed(axes: Sequence[tuple[float, float, float]]) -> Array:
    """Return three independent axes, of which the first are given, (3, 3)."""
    found = [np.array(a, dtype=np.float64) for a in axes]
    while len(found) < 3:
        across = np.linalg.svd(np.array(found).reshape(-1, 3))[2][len(found) :]  # orthogonal to all of them
        found.append(across[0])
    return np.array(found)


def _add(parent: ET.Element, kind: str, name: str = "", **texts: str) -> ET.Element:
    """Add an element, which may have a name, with elements of text inside."""
    element = ET.SubElement(parent, kind, {"name": name} if name else {})
    _add_texts(element, **texts)
    return element


def _add_texts(parent: ET.Element, **texts: str) -> None:
    for name, text in texts.items():
        ET.SubElement(parent, name).text = text


def _vector(v: Sequence[float] | Array) -> str:
    return " ".join(f"{x:.12g}" for x in np.asarray(v, dtype=np.float64).tolist())
