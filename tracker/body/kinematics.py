"""Forward kinematics of a joint tree: the compiled kernels of `BodyModel.kinematics`."""

from enum import IntEnum, auto
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.geometry.arrays import Array, IntArray


class Operation(IntEnum):
    """Kinds of operations of a joint."""

    TRANSLATE = auto()
    REVOLVE = auto()
    BALL = auto()


class Tree(NamedTuple):
    """A joint tree as arrays."""

    parents: IntArray
    """Index of each part's parent, -1 for the root, (n_parts,)."""
    offsets: Array
    """Position of each part's joint in its parent's frame, (n_parts, 3), metres."""
    ops: IntArray
    """Operations of the joints in order: `Operation` and index of the joint, (n_ops, 2)."""
    axes: Array
    """Unit axis of each operation of kind revolve, (n_ops, 3)."""


class Kinematics(NamedTuple):
    """The poses of all parts, and the axes of all degrees of freedom."""

    Ts_world_part: Array
    """Part poses, (n_parts, 4, 4), metres."""
    axes_world: Array
    """Unit axis of each degree of freedom, (n_dofs, 3): of rotation, or of translation for the root's x, y, z."""
    origins_world: Array
    """A point on each rotation axis, (n_dofs, 3), metres."""


@njit(**NO_REFCOUNT)
def forward_kinematics(values: Array, tree: Tree, Ts: Array, axes: Array, origins: Array) -> None:
    """Fill the arrays of a `Kinematics` from the values of a pose, (n_values,)."""
    op, dof, value = 0, 0, 0
    for part in range(tree.parents.shape[0]):
        op, dof, value = _place_part(
            part, op, dof, value, values, tree.parents, tree.offsets, tree.ops, tree.axes, Ts, axes, origins
        )


def chain_poses(tree: Tree, rest: Kinematics, chain: IntArray, poses: Array) -> Array:
    """Place one chain of parts in many poses that differ only in its joints.

    Args:
        tree: the joint tree.
        rest: kinematics of any pose that agrees with these outside the chain.
        chain: indices of the parts, each the child of the one before, (n,).
        poses: (C, n_values).

    Returns:
        Poses of these parts, (C, n, 4, 4), metres.
    """
    out = np.empty((len(poses), len(chain), 4, 4))
    unread = np.empty((len(rest.axes_world), 3))
    _place_chain(np.ascontiguousarray(poses), tree, _starts(tree), rest.Ts_world_part.copy(), unread, chain, out)
    return out


@njit(**NO_REFCOUNT)
def _place_chain(
    poses: Array, tree: Tree, starts: IntArray, Ts: Array, unread: Array, chain: IntArray, out: Array
) -> None:
    """Fill the poses of the parts of a chain; see `chain_poses`. Its rows of `Ts` (n_parts, 4, 4) are overwritten."""
    for c in range(poses.shape[0]):
        for i in range(chain.shape[0]):
            p = chain[i]
            _place_part(
                p, starts[p, 0], starts[p, 1], starts[p, 2], poses[c], tree.parents, tree.offsets, tree.ops, tree.axes,
                Ts, unread, unread,
            )  # fmt: skip
            for k in range(4):
                for m in range(4):
                    out[c, i, k, m] = Ts[p, k, m]


@njit(nogil=True, cache=True)
def _starts(tree: Tree) -> IntArray:
    """Return the first operation, degree of freedom and value of each part's joint, (n_parts, 3)."""
    out = np.zeros((tree.parents.shape[0], 3), np.int64)
    op, dof, value = 0, 0, 0
    for part in range(out.shape[0]):
        out[part] = op, dof, value
        while op < tree.ops.shape[0] and tree.ops[op, 1] == part:
            kind = tree.ops[op, 0]
            dof += 1 if kind == Operation.REVOLVE else 3
            value += 1 if kind == Operation.REVOLVE else 3 if kind == Operation.TRANSLATE else 4
            op += 1
    return out


@njit(inline="always", **NO_REFCOUNT)
def _place_part(  # noqa: C901
    part: int, op: int, dof: int, value: int, values: Array, parents: IntArray, offsets: Array, ops: IntArray,
    op_axes: Array, Ts: Array, axes: Array, origins: Array,
) -> tuple[int, int, int]:  # fmt: skip
    """Place a part whose parent is placed, and the axes of its joint.

    Args:
        part: index of the part.
        op: index of the first operation of its joint.
        dof: index of its first degree of freedom.
        value: index of its first value.
        values: the pose, (n_values,).
        parents: of all parts, see `Tree`.
        offsets: see `Tree`.
        ops: see `Tree`.
        op_axes: axes of the operations, see `Tree`.
        Ts: poses of all parts, see `Kinematics`; that of this part is filled in.
        axes: see `Kinematics`; those of the joint are filled in.
        origins: the same.

    Returns:
        The first operation, degree of freedom and value of the next part.
    """
    parent, T = parents[part], Ts[part]
    for i in range(3):
        for j in range(3):
            T[i, j] = Ts[parent, i, j] if parent >= 0 else (1.0 if i == j else 0.0)
    x, y, z = offsets[part, 0], offsets[part, 1], offsets[part, 2]
    for i in range(3):
        base = Ts[parent, i, 3] if parent >= 0 else 0.0
        T[i, 3] = base + T[i, 0] * x + T[i, 1] * y + T[i, 2] * z
    first_dof = dof
    while op < ops.shape[0] and ops[op, 1] == part:
        kind = ops[op, 0]
        if kind == Operation.TRANSLATE:
            for k in range(3):
                T[k, 3] += values[value + k]
                for i in range(3):
                    axes[dof + k, i] = 1.0 if i == k else 0.0
            dof += 3
            value += 3
        else:
            if kind == Operation.REVOLVE:
                ax, ay, az = op_axes[op, 0], op_axes[op, 1], op_axes[op, 2]
                for i in range(3):
                    axes[dof, i] = T[i, 0] * ax + T[i, 1] * ay + T[i, 2] * az
                half = 0.5 * values[value]
                s = np.sin(half)
                qw, qx, qy, qz = np.cos(half), s * ax, s * ay, s * az
                dof += 1
                value += 1
            else:
                qw, qx, qy, qz = values[value], values[value + 1], values[value + 2], values[value + 3]
                norm = np.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
                qw, qx, qy, qz = qw / norm, qx / norm, qy / norm, qz / norm
                value += 4
            _turn(T, qw, qx, qy, qz)
            if kind == Operation.BALL:  # the three dofs of a ball turn about the axes of its child
                for k in range(3):
                    for i in range(3):
                        axes[dof + k, i] = T[i, k]
                dof += 3
        op += 1
    for k in range(first_dof, dof):
        for i in range(3):
            origins[k, i] = T[i, 3]
    T[3, 0] = T[3, 1] = T[3, 2] = 0.0
    T[3, 3] = 1.0
    return op, dof, value


@njit(inline="always", **NO_REFCOUNT)
def _turn(T: Array, w: float, x: float, y: float, z: float) -> None:
    """Multiply the rotation of a pose (4, 4) from the right by the rotation of a unit quaternion."""
    xx, xy, xz = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    yx, yy, yz = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    zx, zy, zz = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    for i in range(3):
        a, b, c = T[i, 0], T[i, 1], T[i, 2]
        T[i, 0], T[i, 1], T[i, 2] = a * xx + b * yx + c * zx, a * xy + b * yy + c * zy, a * xz + b * yz + c * zz


@njit(**NO_REFCOUNT)
def place_point(T: Array, x: Array) -> tuple[float, float, float]:
    """Return the place of a point of a part, (3,), by the pose of the part, (4, 4), metres."""
    return (
        T[0, 0] * x[0] + T[0, 1] * x[1] + T[0, 2] * x[2] + T[0, 3],
        T[1, 0] * x[0] + T[1, 1] * x[1] + T[1, 2] * x[2] + T[1, 3],
        T[2, 0] * x[0] + T[2, 1] * x[1] + T[2, 2] * x[2] + T[2, 3],
    )


@njit(nogil=True, cache=True)
def place_points(
    poses: Array, tree: Tree, is_length: NDArray[np.bool_], moves: NDArray[np.bool_], parts: IntArray,
    points_part: Array, places: Array, out: Array,
) -> None:  # fmt: skip
    """Fill the places, (T, N, 3), of points fixed to parts, (N, 3), in poses, (T, n_values), and their derivatives, (T,
    N, 3, n_dofs)."""
    n_dofs, Ts = moves.shape[0], np.empty((tree.parents.shape[0], 4, 4))
    axes, origins = np.empty((n_dofs, 3)), np.empty((n_dofs, 3))
    for t in range(poses.shape[0]):
        forward_kinematics(poses[t], tree, Ts, axes, origins)
        for n in range(parts.shape[0]):
            places[t, n, 0], places[t, n, 1], places[t, n, 2] = place_point(Ts[parts[n]], points_part[n])
        point_jacobian(Kinematics(Ts, axes, origins), is_length, moves, parts, places[t], out[t])


@njit(nogil=True, cache=True)
def point_jacobian(
    kinematics: Kinematics,
    is_length: NDArray[np.bool_],
    moves: NDArray[np.bool_],
    parts: IntArray,
    points: Array,
    out: Array,
) -> None:
    """Fill (N, 3, n_dofs) with the derivatives of points fixed to parts; see `BodyModel.point_jacobian`."""
    axes, origins = kinematics.axes_world, kinematics.origins_world
    for dof in range(axes.shape[0]):
        ax, ay, az = axes[dof, 0], axes[dof, 1], axes[dof, 2]
        for n in range(points.shape[0]):
            if not moves[dof, parts[n]]:
                out[n, 0, dof] = out[n, 1, dof] = out[n, 2, dof] = 0.0
            elif is_length[dof]:
                out[n, 0, dof], out[n, 1, dof], out[n, 2, dof] = ax, ay, az
            else:
                x, y, z = points[n, 0] - origins[dof, 0], points[n, 1] - origins[dof, 1], points[n, 2] - origins[dof, 2]
                out[n, 0, dof], out[n, 1, dof], out[n, 2, dof] = ay * z - az * y, az * x - ax * z, ax * y - ay * x
