"""Replace points of a BVH file: its skeleton is turned, since the file has lengths and rotations, not points."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from tracker.formats.bvh_reading import BvhJoint, posed, read_bvh_motion
from tracker.formats.text_patch import TextPatch
from tracker.geometry.arrays import Array, IntArray, Mask


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
    channels = _channels(motion.joints, below)
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


def _channels(joints: Sequence[BvhJoint], below: Mask) -> _Channels:
    owners = [i for i, joint in enumerate(joints) for _ in joint.channels]
    is_turn = np.array([c.endswith("rotation") for joint in joints for c in joint.channels])
    itself = np.eye(len(joints), dtype=np.bool_)[owners] & ~is_turn[:, None]
    return _Channels(owners, is_turn, below[owners] | itself)
