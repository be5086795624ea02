"""Read a BVH file (Biovision hierarchy), a skeleton and its rotations in each frame, and replace points in one.

To replace points, the skeleton is turned, since the file has lengths and rotations, not points.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from tracker.errors import FormatError, Remedy
from tracker.formats.number_rows import MAX_NAMES, NumberRows, check_size
from tracker.formats.text_files import TABLE_BYTES, TextKind, read_lines
from tracker.formats.text_patch import TextPatch
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array, IntArray, Mask
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


class PatchedBvh(NamedTuple):
    """A file whose skeleton was turned."""

    data: bytes
    farthest_m: float
    """Largest distance of a replaced point from its place, which constant lengths and held points may keep it from."""


class _Channels(NamedTuple):
    """The channels of a skeleton."""

    owners: Sequence[int]
    """Joint of each, (n_channels,)."""
    is_turn: Mask
    """Whether each is a rotation, (n_channels,)."""
    moves: Mask
    """Whether each moves each joint, (n_channels, n_joints)."""


def patch_bvh(path: Path, unit_m: float | None, changes: Mapping[int, Array], is_known: Mask) -> PatchedBvh:
    """Return a file with some points moved as near to their places as its skeleton lets them.

    A value changes only if it moves a replaced point, and no known one that stays, unless that one hangs below a
    replaced one. All other bytes stay.

    Args:
        path: the file, which has been read before.
        unit_m: metres per unit.
        changes: positions, (n_points, 3), metres, by row, from 0; points of NaN stay.
        is_known: whether each point stands for one of the body, (n_points,).
    """
    motion = read_bvh_motion(path, unit_m)
    below = _below(motion.joints)
    channels = _channels_of(motion.joints, below)
    new, farthest_m = dict[int, dict[int, float]](), 0.0
    for row, points in changes.items():
        is_new = np.asarray(np.isfinite(points).all(axis=-1))
        is_held = is_known & ~is_new & ~below[is_new].any(axis=0)
        free = np.flatnonzero(channels.moves[:, is_new].any(axis=1) & ~channels.moves[:, is_held].any(axis=1))
        values = _reaching(motion.joints, channels, motion.values[row], free, points)
        new[row] = dict(zip(free.tolist(), (values / motion.units)[free].tolist(), strict=True))
        distances = np.linalg.norm(posed(motion.joints, values[None]).positions[0] - points, axis=-1)
        farthest_m = max(farthest_m, float(distances[is_new].max(initial=0.0)))
    patch = TextPatch(path.read_bytes())
    patch.replace_words(len(motion.values), new, 4)  # at 1 m, a ten thousandth of a degree is 2 micrometres
    return PatchedBvh(patch.encoded(), farthest_m)


def _reaching(joints: Sequence[BvhJoint], channels: _Channels, values: Array, free: IntArray, points: Array) -> Array:
    """Return values that bring joints next to points in the sense of least squares, (n_channels,); near the old ones.

    Args:
        joints: of the skeleton.
        channels: its channels.
        values: where to begin, (n_channels,).
        free: numbers of the channels that may change.
        points: of the joints, (n_joints, 3); of NaN for none.
    """
    if not len(free):
        return values
    has_point = np.asarray(np.isfinite(points).all(axis=-1))

    def full(x: Array) -> Array:
        out = values.copy()
        out[free] = x
        return out[None]

    def residuals(x: Array) -> Array:
        return (posed(joints, full(x)).positions[0] - points)[has_point].ravel()

    def jacobian(x: Array) -> Array:
        positions, axes = (of_frame[0] for of_frame in posed(joints, full(x)))
        arms = positions[None] - positions[channels.owners][:, None]
        columns = np.where(channels.is_turn[:, None, None], np.cross(axes[:, None], arms), axes[:, None])
        columns = np.where(channels.moves[..., None], columns, 0.0)[free][:, has_point]
        return columns.reshape(len(free), -1).T

    return full(least_squares(residuals, values[free], jacobian, xtol=1e-3).x)[0]


def _below(joints: Sequence[BvhJoint]) -> Mask:
    """Return whether each joint is above each other one, (n_joints, n_joints)."""
    out = np.zeros((len(joints), len(joints)), np.bool_)
    for i, joint in enumerate(joints):
        if joint.parent >= 0:
            out[:, i] = out[:, joint.parent]
            out[joint.parent, i] = True
    return out


def _channels_of(joints: Sequence[BvhJoint], below: Mask) -> _Channels:
    owners = [i for i, joint in enumerate(joints) for _ in joint.channels]
    is_turn = np.array([c.endswith("rotation") for joint in joints for c in joint.channels])
    itself = np.eye(len(joints), dtype=np.bool_)[owners] & ~is_turn[:, None]
    return _Channels(owners, is_turn, below[owners] | itself)
