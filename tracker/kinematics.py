"""Where the parts of a joint tree are: the compiled kernel under `BodyModel.kinematics`."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.rigid import Array

IntArray = NDArray[np.int64]

TRANSLATE, REVOLVE, BALL = 0, 1, 2
"""What an operation of a joint does."""


class Tree(NamedTuple):
    """A joint tree as arrays."""

    parents: IntArray
    """Index of each part's parent, -1 for the root, (n_parts,)."""
    offsets: Array
    """Where each part's joint sits in its parent's frame, (n_parts, 3), metres."""
    ops: IntArray
    """What the joints do, in order: kind (translate, revolve, ball) and index of the joint, (n_ops, 2)."""
    axes: Array
    """Unit axis of each operation that revolves, (n_ops, 3)."""


class Kinematics(NamedTuple):
    """Where a pose puts everything."""

    Ts_world_part: Array
    """Part poses, (n_parts, 4, 4), metres."""
    axes_world: Array
    """Unit axis of each degree of freedom, (n_dofs, 3): of rotation, or of translation for the root's x, y, z."""
    origins_world: Array
    """A point on each rotation axis, (n_dofs, 3), metres."""


@njit(nogil=True, cache=True)
def forward_kinematics(values: Array, tree: Tree, Ts: Array, axes: Array, origins: Array) -> None:  # noqa: C901
    """Fill the arrays of a `Kinematics` from the values of a pose, (n_values,)."""
    parents, offsets, ops = tree.parents, tree.offsets, tree.ops
    op, dof, value = 0, 0, 0
    R, step, parent_R = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    n_ops = ops.shape[0]
    for part in range(parents.shape[0]):
        parent = parents[part]
        for i in range(3):
            for j in range(3):
                parent_R[i, j] = Ts[parent, i, j] if parent >= 0 else (1.0 if i == j else 0.0)
                R[i, j] = parent_R[i, j]
        x, y, z = offsets[part, 0], offsets[part, 1], offsets[part, 2]
        for i in range(3):
            base = Ts[parent, i, 3] if parent >= 0 else 0.0
            Ts[part, i, 3] = base + parent_R[i, 0] * x + parent_R[i, 1] * y + parent_R[i, 2] * z
        first_dof = dof
        while op < n_ops and ops[op, 1] == part:
            kind = ops[op, 0]
            if kind == 0:
                for k in range(3):
                    Ts[part, k, 3] += values[value + k]
                    for i in range(3):
                        axes[dof + k, i] = 1.0 if i == k else 0.0
                dof += 3
                value += 3
            else:
                if kind == 1:
                    ax, ay, az = tree.axes[op, 0], tree.axes[op, 1], tree.axes[op, 2]
                    for i in range(3):
                        axes[dof, i] = R[i, 0] * ax + R[i, 1] * ay + R[i, 2] * az
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
                step[0, 0] = 1 - 2 * (qy * qy + qz * qz)
                step[0, 1] = 2 * (qx * qy - qw * qz)
                step[0, 2] = 2 * (qx * qz + qw * qy)
                step[1, 0] = 2 * (qx * qy + qw * qz)
                step[1, 1] = 1 - 2 * (qx * qx + qz * qz)
                step[1, 2] = 2 * (qy * qz - qw * qx)
                step[2, 0] = 2 * (qx * qz - qw * qy)
                step[2, 1] = 2 * (qy * qz + qw * qx)
                step[2, 2] = 1 - 2 * (qx * qx + qy * qy)
                for i in range(3):
                    a, b, c = R[i, 0], R[i, 1], R[i, 2]
                    for k in range(3):
                        R[i, k] = a * step[0, k] + b * step[1, k] + c * step[2, k]
                if kind == 2:  # the three dofs of a ball turn about the axes of its child
                    for k in range(3):
                        for i in range(3):
                            axes[dof + k, i] = R[i, k]
                    dof += 3
            op += 1
        for k in range(first_dof, dof):
            for i in range(3):
                origins[k, i] = Ts[part, i, 3]
        for i in range(3):
            for k in range(3):
                Ts[part, i, k] = R[i, k]
            Ts[part, 3, i] = 0.0
        Ts[part, 3, 3] = 1.0


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
