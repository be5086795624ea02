"""BVH files (Biovision hierarchy): a skeleton of joints with offsets, and its rotations frame by frame.

The root has the channels Xposition Yposition Zposition Zrotation Xrotation Yrotation, all other joints have Zrotation
Xrotation Yrotation, in degrees: R = R_z R_x R_y. The rest pose is the body's zero pose, which stands upright with
hanging arms and faces +z where y points up. Landmarks that lie at the end of a chain are End Sites; others are joints
that do not turn.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel
from tracker.files import write_text_atomic
from tracker.formats.file_names import identifiers
from tracker.geometry.arrays import Array
from tracker.geometry.euler import Order, continuous_euler_angles

ORDER: Order = "ZXY"
"""Order of the rotations of every joint."""
UPRIGHT_Y = np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]])
"""Rotation from the body's axes (x forward, y left, z up) to those of a file in which y points up and z forward."""


class BvhFrame(NamedTuple):
    """The axes and the unit of a file."""

    T_file_world: Array
    """Maps the world to the file's axes, (4, 4), metres."""
    R_file_body: Array
    """Maps the axes of a body part in the zero pose to the file's, (3, 3)."""
    per_metre: float = 1.0
    """Units of the file per metre."""


class _Node(NamedTuple):
    """A joint of the file: of the body model, or a landmark."""

    name: str
    part: int
    """The part that turns with it; -1 for a landmark."""
    offset: Array
    """From its parent, (3,), file units."""
    children: list["_Node"]
    end: Array | None
    """Offset of the End Site of a joint without children, (3,)."""


def write_bvh(
    path: str | Path,
    model: BodyModel,
    poses: Array,
    fps: float,
    frame: BvhFrame,
    tick: Callable[[], None] = lambda: None,
) -> None:
    """Write the motion of one body.

    Args:
        path: the file.
        model: the body of all poses.
        poses: one for each frame, (n, n_values); BVH has no way to leave one out.
        fps: frames per second.
        frame: axes and unit of the file.
        tick: called after each pose.
    """
    assert len(poses), "BVH needs a pose"
    names = identifiers(model.point_names)
    root = _hierarchy(model, names, frame)
    nodes = _in_order(root)
    Ts = np.empty((len(poses), len(model.parts), 4, 4))
    for i, values in enumerate(poses):
        Ts[i] = model.kinematics(values).Ts_world_part
        tick()
    columns = [frame.per_metre * (Ts[:, 0, :3, 3] @ frame.T_file_world[:3, :3].T + frame.T_file_world[:3, 3])]
    R_file = frame.T_file_world[:3, :3] @ Ts[:, :, :3, :3] @ frame.R_file_body.T
    for node in nodes:
        if node.part < 0:
            columns.append(np.zeros((len(poses), 3)))
            continue
        parent = model.parents[node.part]
        R = R_file[:, node.part] if parent < 0 else np.swapaxes(R_file[:, parent], -1, -2) @ R_file[:, node.part]
        columns.append(np.degrees(continuous_euler_angles(R, ORDER)))
    lines = ["HIERARCHY", *_lines(root, 0)]
    lines += ["MOTION", f"Frames: {len(poses)}", f"Frame Time: {1 / fps:.9f}"]
    lines += [" ".join(f"{x:.6f}" for x in row) for row in np.hstack(columns).tolist()]
    write_text_atomic(Path(path), "\n".join(lines) + "\n")


def _hierarchy(model: BodyModel, names: Sequence[str], frame: BvhFrame) -> _Node:
    """Build the tree of a body's joints and landmarks."""
    to_file = frame.per_metre * frame.R_file_body
    nodes: list[_Node] = []
    of_part: list[list[int]] = [[] for _ in model.parts]
    for i in range(len(model.joints), len(model.point_names)):
        of_part[int(model.point_parts[i])].append(i)
    for i, joint in enumerate(model.joints):
        has_child = i in model.parents
        end = None
        if not has_child and len(of_part[i]) == 1:
            end = to_file @ model.points_part[of_part[i].pop()]
        elif not has_child and not of_part[i]:  # readers draw a bone to the end of a chain
            end = to_file @ (2 * model.centers_part[i])
        offset = np.zeros(3) if joint.parent == "" else to_file @ (np.array(joint.position) * model.height_m)
        node = _Node(names[i], i, offset, [], end)
        nodes.append(node)
        if model.parents[i] >= 0:
            nodes[model.parents[i]].children.append(node)
    for part, points in enumerate(of_part):
        landmarks = [_Node(names[i], -1, to_file @ model.points_part[i], [], np.zeros(3)) for i in points]
        nodes[part].children.extend(landmarks)
    return nodes[0]


def _in_order(node: _Node) -> list[_Node]:
    """Return a joint and all below it in the order of the file."""
    return [node, *(below for child in node.children for below in _in_order(child))]


def _lines(node: _Node, depth: int) -> list[str]:
    """Format a joint and all below it."""
    tab = "\t" * depth
    rotations = " ".join(f"{axis}rotation" for axis in ORDER)
    channels = f"3 {rotations}" if depth else f"6 Xposition Yposition Zposition {rotations}"
    lines = [f"{tab}{'JOINT' if depth else 'ROOT'} {node.name}", f"{tab}{{", f"{tab}\tOFFSET {_vector(node.offset)}"]
    lines.append(f"{tab}\tCHANNELS {channels}")
    for child in node.children:
        lines += _lines(child, depth + 1)
    if node.end is not None:
        lines += [f"{tab}\tEnd Site", f"{tab}\t{{", f"{tab}\t\tOFFSET {_vector(node.end)}", f"{tab}\t}}"]
    return [*lines, f"{tab}}}"]


def _vector(v: Array) -> str:
    return " ".join(f"{x:.7f}" for x in v)
