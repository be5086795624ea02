"""Levels of detail of a figure: parts that the voxels do not tell apart are measured together, or not at all.

MTHC01 Sect. 6 and Fig. 9 plan a hierarchy of models: a finer one is used where the data support it, part by part, "by
addition and deletion of appropriate rows" of the measurement. Three levels are built here. A part that stands apart is
measured alone. Legs that touch are measured as one piece. A limb that lies on the trunk is part of it: its rows are
left out, and it is carried along by the part that it hangs on.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Array
from tracker.tracking.voxel.chain_jacobian import center_jacobian
from tracker.tracking.voxel.figure import LIMBS, N_PARTS, PARENTS, TORSO
from tracker.tracking.voxel.kalman import LinearizedMeasurement
from tracker.tracking.voxel.labels import PartClouds
from tracker.tracking.voxel.state import FilterState
from tracker.voxels.voxel_grid import Voxels

_MERGED, _APART = 0.5, 0.35
"""Share of a part's voxels that touch a part beside it, above which the two are one, and below which they are two."""
_JOINT_M = 0.02
"""Standard deviation of the centre of parts that are measured together, metres."""
_HIP_PAIRS = ((4, 5), (8, 9))
"""Parts of the left and the right leg that are measured together."""
_ALONG = 1.2
"""A joint's own parts touch there: contact with the parent counts beyond this many half widths from the joint."""


class Levels(NamedTuple):
    """Which parts the voxels resolve."""

    is_resolved: NDArray[np.bool_]
    """Whether a part is measured alone, (10,)."""

    @classmethod
    def finest(cls) -> "Levels":
        """Return the levels where every part stands apart."""
        return cls(np.ones(N_PARTS, dtype=bool))

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on the limbs that are not resolved."""
        found = []
        legs_closed = any(not self.is_resolved[[a, b]].any() for a, b in _HIP_PAIRS)
        if legs_closed:
            found.append("legs closed: measured as one")
        for name, parts in LIMBS.items():
            if not self.is_resolved[list(parts)].all() and not (legs_closed and name.endswith("leg")):
                found.append(f"{name.replace('_', ' ')} on the body: not resolved")
        return tuple(found)

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Parts of both legs that are measured together."""
        return tuple((a, b) for a, b in _HIP_PAIRS if not self.is_resolved[[a, b]].any())


def find_levels(
    before: Levels, state: FilterState, voxels: Voxels, labels: NDArray[np.int16], first_label: int
) -> Levels:
    """Return which parts stand apart from the parts beside them; a part changes its level clearly or not at all.

    Args:
        before: of the frame before.
        state: the figure with which the voxels were labelled.
        voxels: of the frame.
        labels: of the occupied voxels, (N,).
        first_label: label of its torso.
    """
    grid = np.full(voxels.grid.shape, -1, dtype=np.int16)
    at = tuple(voxels.indices.T)
    own = labels - first_label
    grid[at] = np.where((own >= 0) & (own < N_PARTS), own, -1)
    counts = np.bincount(grid[at][grid[at] >= 0], minlength=N_PARTS)
    shares = np.zeros(N_PARTS)
    for part in range(2, N_PARTS):
        if counts[part]:
            shares[part] = _touching(grid, state, voxels, part) / counts[part]
    resolved = np.where(before.is_resolved, shares <= _MERGED, shares <= _APART)
    resolved[:2] = True
    return Levels(resolved)


def _touching(grid: NDArray[np.int16], state: FilterState, voxels: Voxels, part: int) -> int:
    """Return the number of voxels of a part that touch a part which it does not end at."""
    own = np.argwhere(grid == part)
    beside = {PARENTS[part], part, -1} | {i for i in range(N_PARTS) if PARENTS[i] == part}
    foreign = np.array([i not in beside for i in range(-1, N_PARTS)])
    trunk = np.zeros(N_PARTS + 1, dtype=bool)
    trunk[TORSO + 1] = PARENTS[part] == TORSO
    touches, touches_trunk = np.zeros(len(own), dtype=bool), np.zeros(len(own), dtype=bool)
    for axis in range(3):
        for step in (-1, 1):
            there = own.copy()
            there[:, axis] += step
            valid = (there[:, axis] >= 0) & (there[:, axis] < grid.shape[axis])
            label = np.where(valid, grid[tuple(np.where(valid[:, None], there, 0).T)], -1) + 1
            touches |= foreign[label]
            touches_trunk |= trunk[label]
    # A limb meets the trunk at its joint; farther along, it lies on the trunk.
    root = state.centers[part] + state.rotations[part] @ (state.figure.own_shares[part] * state.sizes[part])
    far = np.linalg.norm(voxels.grid.centers(own) - root, axis=1) > _ALONG * 2 * state.sizes[part, :2].max()
    return int(np.count_nonzero(touches | (touches_trunk & far)))


def measure_together(
    state: FilterState, clouds: PartClouds, pairs: tuple[tuple[int, int], ...]
) -> LinearizedMeasurement | None:
    """Linearize the common centre of pairs of parts, or None if there are none with voxels.

    Args:
        state: the figure.
        clouds: the voxels of its parts.
        pairs: indices of the parts.
    """
    rows, jacobians, by_center = [], [], center_jacobian(state)
    for pair in pairs:
        own = list(pair)
        n = clouds.counts[own]
        if n.sum() > 0:
            offsets = np.einsum("pij,pj->pi", state.rotations[own], clouds.means[own])
            weights = n / n.sum()
            rows.append(weights @ offsets)
            jacobians.append(np.einsum("p,pij->ij", weights, by_center[own]))
    if not rows:
        return None
    H: Array = np.concatenate(jacobians)
    return LinearizedMeasurement(np.concatenate(rows), H, np.eye(len(H)) * _JOINT_M**2)


def carried(before: FilterState, state: FilterState, levels: Levels) -> Array:
    """Return the rotations of a state, (10, 3, 3), in which unresolved parts turn with the part that they hang on.

    Args:
        before: the state of the frame before.
        state: the present one.
        levels: which parts are resolved.
    """
    out = state.rotations.copy()
    for part in range(1, N_PARTS):
        if not levels.is_resolved[part]:
            parent = PARENTS[part]
            out[part] = out[parent] @ before.rotations[parent].T @ before.rotations[part]
    return out
