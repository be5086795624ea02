"""Read a BVH file (Biovision hierarchy): a skeleton, and its rotations in each frame."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.formats.number_rows import MAX_NAMES, NumberRows, check_size
from tracker.formats.text_files import TABLE_BYTES, TextKind, read_lines
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array
from tracker.validation import MAX_NUMBER, FrameRate, check, quoted

_KIND = TextKind("BVH file", TABLE_BYTES, FormatError, "export it again")
_CHANNELS = tuple(f"{axis}{what}" for what in ("position", "rotation") for axis in "XYZ")


class BvhJoint(NamedTuple):
    """A joint of the hierarchy, or the end of a chain."""

    name: str
    parent: int
    """Number of its parent; -1 for the root."""
    offset: tuple[float, ...]
    """From its parent, (3,), units of the file."""
    channels: tuple[str, ...]


class BvhMotion(NamedTuple):
    """A skeleton that moves."""

    joints: list[BvhJoint]
    """In the order of the file: parents first. Offsets in metres."""
    values: Array
    """Of all channels, (n_frames, n_channels), metres and radians."""
    units: Array
    """Metres or radians per unit of each channel in the file, (n_channels,)."""
    rate: float
    """Frames per second."""


class BvhPose(NamedTuple):
    """Places of a skeleton in n frames."""

    positions: Array
    """Of the joints, (n, n_joints, 3), metres."""
    axes: Array
    """Of the channels: along which they move or about which they turn, (n, n_channels, 3), in the axes of the file."""


def read_bvh(path: Path, unit_m: float | None) -> MarkerTable:
    """Read the positions of all joints, and of the ends of chains as `PARENT_end`, in the axes of the file.

    Args:
        path: the file.
        unit_m: metres per unit, which BVH does not state.

    Raises:
        FormatError: the file is malformed, or the unit is not given.
    """
    motion = read_bvh_motion(path, unit_m)
    names, frames = tuple(j.name for j in motion.joints), np.arange(len(motion.values))
    points = posed(motion.joints, motion.values).positions
    return MarkerTable(names, frames, frames / motion.rate, points, motion.rate)


def read_bvh_motion(path: Path, unit_m: float | None) -> BvhMotion:
    """Read a skeleton and its motion; see `read_bvh`."""
    where = f"BVH file {path}"
    lines = ((n, line.split()) for n, line in enumerate(read_lines(path, _KIND), 1))
    words = ((n, some) for n, some in lines if some)
    joints = _read_hierarchy(words, where)
    n_promised, seconds = _read_motion_head(words, where)
    if unit_m is None:
        raise FormatError(f"{where}: expected the unit of its lengths, which BVH never states", Remedy("say_unit"))
    units = np.array([unit_m if c.endswith("position") else np.radians(1) for j in joints for c in j.channels])
    rows = NumberRows(where, " ", 1 + len(units), n_required=1 + len(units))
    for k, (line, some) in enumerate(words):
        rows.add(" ".join([str(k), *some]), line)
    frames, values = rows.table(MAX_NUMBER)
    if len(frames) < n_promised:
        raise FormatError(f"{where}: expected {n_promised} frames, found {len(frames)}; copy or export it again")
    check_size((len(frames), len(joints), 12), where)
    rate = float(check(1 / seconds, FrameRate, f"{where}, Frame Time", FormatError))
    joints = [j._replace(offset=tuple(unit_m * x for x in j.offset)) for j in joints]
    return BvhMotion(joints, values * units, units, rate)


def _read_hierarchy(words: Iterator[tuple[int, list[str]]], where: str) -> list[BvhJoint]:
    """Return the joints in the order of the file, from HIERARCHY to MOTION.

    Raises:
        FormatError: a line is not as expected; the message has its number.
    """
    joints: list[BvhJoint] = []
    open_joints: list[int] = []
    named = ("", "")
    for n, some in words:
        key = some[0].upper()
        if key == "MOTION" and joints and not open_joints:
            _check_names(joints, where)
            return joints
        if key in ("ROOT", "JOINT") and len(some) > 1 and (key == "JOINT") == bool(open_joints):
            named = (key, " ".join(some[1:]))
        elif key == "END" and open_joints:
            named = (key, f"{joints[open_joints[-1]].name}_end")
        elif key == "{" and named[0] and len(joints) < MAX_NAMES:
            joints.append(BvhJoint(named[1], open_joints[-1] if open_joints else -1, (), ()))
            open_joints.append(len(joints) - 1)
            named = ("", "")
        elif key == "OFFSET" and open_joints:
            joints[open_joints[-1]] = joints[open_joints[-1]]._replace(offset=_offset(some[1:], f"{where}, line {n}"))
        elif key == "CHANNELS" and open_joints:
            channels = _channels(some[1:], f"{where}, line {n}")
            joints[open_joints[-1]] = joints[open_joints[-1]]._replace(channels=channels)
        elif key == "}" and open_joints and joints[open_joints[-1]].offset:
            open_joints.pop()
        elif key != "HIERARCHY" or joints:
            raise FormatError(f"{where}, line {n}: expected a joint of the hierarchy, found {quoted(' '.join(some))}")
    raise FormatError(f"{where}: expected HIERARCHY, joints and MOTION, found the end of the file; export it again")


def _check_names(joints: list[BvhJoint], where: str) -> None:
    names = [j.name for j in joints]
    if len(set(names)) < len(names):
        twice = next(n for n in names if names.count(n) > 1)
        raise FormatError(f"{where}: expected each joint's name once, found {quoted(twice)} twice; rename one")


def _offset(words: list[str], where: str) -> tuple[float, ...]:
    try:
        offset = tuple(float(w) for w in words)
    except ValueError:
        offset = ()
    if len(offset) != 3 or not all(abs(x) <= MAX_NUMBER for x in offset):
        raise FormatError(f"{where}: expected OFFSET with three numbers, found {quoted(' '.join(words))}; correct it")
    return offset


def _channels(words: list[str], where: str) -> tuple[str, ...]:
    channels = tuple(w.capitalize() for w in words[1:])
    wrong = [c for c in channels if c not in _CHANNELS]
    if wrong or not words or words[0] != str(len(channels)) or len(set(channels)) < len(channels):
        expected = f"the number of channels and {', '.join(_CHANNELS)}"
        raise FormatError.mismatch(where, expected, quoted(" ".join(words)), "correct it")
    return channels


def _read_motion_head(words: Iterator[tuple[int, list[str]]], where: str) -> tuple[int, float]:
    """Return the number of frames, and the time from one to the next, s."""
    n, frames = next(words, (0, []))
    m, times = next(words, (0, []))
    try:
        n_frames, seconds = int(frames[-1]), float(times[-1])
    except (ValueError, IndexError):
        n_frames, seconds = 0, 0.0
    if [w.lower() for w in frames[:-1]] != ["frames:"] or [w.lower() for w in times[:-1]] != ["frame", "time:"]:
        raise FormatError(f"{where}, lines {n} and {m}: expected Frames: and Frame Time:; export it again")
    if n_frames < 1 or not 0 < seconds < MAX_NUMBER:
        raise FormatError(f"{where}, line {m}: expected a time above 0 s, found {quoted(times[-1])}; correct it")
    return n_frames, seconds


def posed(joints: Sequence[BvhJoint], values: Array) -> BvhPose:
    """Return where a skeleton is with some values of its channels, (n, n_channels), metres and radians."""
    n = len(values)
    R, t = np.empty((len(joints), n, 3, 3)), np.empty((len(joints), n, 3))
    axes = np.empty((n, values.shape[1], 3))
    column = 0
    for i, joint in enumerate(joints):
        above = np.broadcast_to(np.eye(3), (n, 3, 3)) if joint.parent < 0 else R[joint.parent]
        own, at = above, np.tile(np.array(joint.offset), (n, 1))
        for channel in joint.channels:
            axis, cell = "XYZ".index(channel[0]), values[:, column]
            if channel.endswith("position"):
                at[:, axis] = cell  # positions replace the offset, as common readers have it
                axes[:, column] = above[:, :, axis]
            else:
                axes[:, column] = own[:, :, axis]
                own = own @ _turns(axis, cell)
            column += 1
        R[i] = own
        t[i] = np.einsum("nij,nj->ni", above, at) + (0.0 if joint.parent < 0 else t[joint.parent])
    return BvhPose(np.swapaxes(t, 0, 1), axes)


def _turns(axis: int, angles: Array) -> Array:
    """Return rotations about an axis, (n, 3, 3)."""
    out = np.zeros((len(angles), 3, 3))
    a, b = (axis + 1) % 3, (axis + 2) % 3
    out[:, axis, axis] = 1.0
    out[:, a, a] = out[:, b, b] = np.cos(angles)
    out[:, b, a], out[:, a, b] = np.sin(angles), -np.sin(angles)
    return out
