"""Derivatives of the points of a figure by the error state (MTHC01 Sect. 4)."""

import numpy as np

from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.tracking.voxel.figure import N_PARTS, PARENTS, TORSO
from tracker.tracking.voxel.state import FilterState


def center_jacobian(state: FilterState) -> Array:
    """Return the derivative of the centres of all parts by the error state, (10, 3, n) (MTHC01 Sect. 4)."""
    at, R, parents = state.layout, state.rotations, list(PARENTS)
    figure, sizes = state.figure, state.sizes
    by_parent = -R[parents] @ rigid.skew(figure.parent_shares * sizes[parents])
    by_own = R @ rigid.skew(figure.own_shares * sizes)
    out = np.zeros((N_PARTS, 3, at.n))
    out[TORSO, :, at.center_at] = np.eye(3)
    for i in range(1, N_PARTS):
        p = PARENTS[i]
        out[i] = out[p]
        out[i, :, 3 * p : 3 * p + 3] += by_parent[i]
        out[i, :, 3 * i : 3 * i + 3] += by_own[i]
        if at.sizes:
            first = at.sizes_at.start
            out[i, :, first + 3 * p : first + 3 * p + 3] += R[p] * figure.parent_shares[i]
            out[i, :, first + 3 * i : first + 3 * i + 3] -= R[i] * figure.own_shares[i]
    return out


def point_jacobian(state: FilterState, by_center: Array, part: int, shares: Array) -> Array:
    """Return the derivative of a point of a part by the error state, (3, n).

    Args:
        state: the state.
        by_center: derivatives of the centres, see `center_jacobian`.
        part: index of the part.
        shares: position of the point in half sizes of the part, (3,).
    """
    return np.asarray(by_center[part] + _point(state, part, shares))


def _point(state: FilterState, part: int, shares: Array) -> Array:
    """Return the derivative of a point of a part relative to the part's centre, (3, n)."""
    at, R = state.layout, state.rotations[part]
    out = np.zeros((3, at.n))
    out[:, 3 * part : 3 * part + 3] = -R @ rigid.skew(shares * state.sizes[part])
    if at.sizes:
        first = at.sizes_at.start + 3 * part
        out[:, first : first + 3] = R * shares
    return out
