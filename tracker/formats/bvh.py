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
    hierarchy, parts = _hierarchy(model, names, frame)
    Ts = np.empty((len(poses), len(model.parts), 4, 4))
    for i, values in enumerate(poses):
        Ts[i] = model.kinematics(values).Ts_world_part
        tick()
    columns = [frame.per_metre * (Ts[:, 0, :3, 3] @ frame.T_file_world[:3, :3].T + frame.T_file_world[:3, 3])]
    R_file = frame.T_file_world[:3, :3] @ Ts[:, :, :3, :3] @ frame.R_file_body.T
    for part in parts:
        if part < 0:
            columns.append(np.zeros((len(poses), 3)))
            continue
        parent = model.parents[part]
        R = R_file[:, part] if parent < 0 else np.swapaxes(R_file[:, parent], -1, -2) @ R_file[:, part]
        columns.append(np.degrees(continuous_euler_angles(R, ORDER)))
    lines = ["HIERARCHY", *hierarchy, "MOTION", f"Frames: {len(poses)}", f"Frame Time: {1 / fps:.9f}"]
    lines += [" ".join(f"{x:.6f}" for x in row) for row in np.hstack(columns).tolist()]
    write_text_atomic(Path(path), "\n".join(lines) + "\n")


def _hierarchy(model: BodyModel, names: Sequence[str], frame: BvhFrame) -> tuple[list[str], list[int]]:
    """Return the lines of a body's joints and landmarks, and the part that each turns in this order; -1 for none."""
    to_file, parts = frame.per_metre * frame.R_file_body, list[int]()

    def of_part(part: int, depth: int) -> list[str]:
        parts.append(part)
        joint, inner = model.joints[part], list[str]()
        for child, parent in enumerate(model.parents):
            if parent == part:
                inner += of_part(child, depth + 1)
        landmarks = [i for i in range(len(model.joints), len(names)) if model.point_parts[i] == part]
        if not inner and len(landmarks) < 2:  # readers draw a bone to the end of a chain
            end = model.points_part[landmarks[0]] if landmarks else 2 * model.centers_part[part]
            inner = _block("End Site", depth + 1, to_file @ end)
            landmarks = []
        for i in landmarks:
            parts.append(-1)
            end_site = _block("End Site", depth + 2, np.zeros(3))
            inner += _block(
                f"JOINT {names[i]}", depth + 1, to_file @ model.points_part[i], [_channels(depth + 1), *end_site]
            )
        offset = to_file @ (np.array(joint.position) * model.height_m) if depth else np.zeros(3)
        return _block(f"{'JOINT' if depth else 'ROOT'} {names[part]}", depth, offset, [_channels(depth), *inner])

    return of_part(0, 0), parts


def _channels(depth: int) -> str:
    rotations = " ".join(f"{axis}rotation" for axis in ORDER)
    channels = f"3 {rotations}" if depth else f"6 Xposition Yposition Zposition {rotations}"
    return "\t" * (depth + 1) + f"CHANNELS {channels}"


def _block(head: str, depth: int, offset: Array, inner: Sequence[str] = ()) -> list[str]:
    """Return the lines of a joint or of the end of a chain."""
    tab, place = "\t" * depth, " ".join(f"{x:.7f}" for x in offset)
    return [f"{tab}{head}", f"{tab}{{", f"{tab}\tOFFSET {place}", *inner, f"{tab}}}"]
