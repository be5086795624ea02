"""Levels of detail of a figure: parts that the voxels do not tell apart are measured together, or not at all.

MTHC01 Sect. 6 and Fig. 9 plan a hierarchy of models: a finer one is used where the data support it, part by part, "by
addition and deletion of appropriate rows" of the measurement. Three levels are built here. A part that stands apart is
measured alone. Legs that touch are measured as one piece. A limb that lies on the trunk is part of it: its rows are
left out, and it is carried along by the part that it hangs on.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.estimation.voxel.figure import LIMBS, N_PARTS, PARENTS
from tracker.estimation.voxel.kalman import LinearizedMeasurement
from tracker.estimation.voxel.labels import PartClouds
from tracker.estimation.voxel.state import FilterState
from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.geometry.arrays import Array

_MERGED = 0.4
"""Share of the side of a thigh or calf that touches that of the other leg, above which the two are one."""
_SWALLOWED = 0.2
"""Share of a part's volume in its voxels, below which others have taken them."""
_LEG_PAIRS = tuple(zip(LIMBS["left_leg"], LIMBS["right_leg"], strict=True))
"""Parts of the left and the right leg that are measured together."""


class ResolvedParts(NamedTuple):
    """Which parts the voxels resolve."""

    is_resolved: NDArray[np.bool_]
    """Whether a part is measured alone, (10,)."""
    n_merged: NDArray[np.int64]
    """Number of frames in a row on which a part was merged with another, (10,)."""

    @classmethod
    def finest(cls) -> "ResolvedParts":
        """Return the levels where every part stands apart."""
        return cls(np.ones(N_PARTS, dtype=bool), np.zeros(N_PARTS, dtype=np.int64))

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on the limbs that are not resolved."""
        found = []
        legs_closed = any(not self.is_resolved[[a, b]].any() for a, b in _LEG_PAIRS)
        if legs_closed:
            found.append("legs closed: measured as one")
        for name, parts in LIMBS.items():
            if not self.is_resolved[list(parts)].all() and not (legs_closed and name.endswith("leg")):
                found.append(f"{name.replace('_', ' ')} on the body: not resolved")
        return tuple(found)

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """Parts of both legs that are measured together."""
        return tuple((a, b) for a, b in _LEG_PAIRS if not self.is_resolved[[a, b]].any())


def find_resolved_parts(
    before: ResolvedParts,
    state: FilterState,
    voxels: Voxels,
    labels: NDArray[np.int16],
    first_label: int,
    patience: int,
) -> ResolvedParts:
    """Return which parts stand apart from the parts beside them.

    A coarser level waits: legs that pass each other touch for a few frames only, and the prediction tells them apart.

    Args:
        before: of the frame before.
        state: the figure with which the voxels were labelled.
        voxels: of the frame.
        labels: of the occupied voxels, (N,).
        first_label: label of its torso.
        patience: number of frames in a row on which a part must be merged before its level is coarser.
    """
    grid = np.full(np.add(voxels.grid.shape, 2), -1, dtype=np.int16)  # with a margin of one voxel
    own = labels - first_label
    own = np.where((own >= 0) & (own < N_PARTS), own, -1)
    at = np.ravel_multi_index(tuple(voxels.indices.T + 1), grid.shape)
    grid.flat[at] = own
    size_m, sizes = voxels.grid.size_m, state.sizes
    volumes = np.bincount(own[own >= 0], minlength=N_PARTS) * size_m**3 / (2 * np.pi * sizes.prod(axis=1))
    shares = np.zeros(N_PARTS)
    for leg, other in (pair for a, b in _LEG_PAIRS for pair in ((a, b), (b, a))):
        shares[leg] = _touching(grid, at[own == leg], other) * size_m**2 / (4 * sizes[leg, 1] * sizes[leg, 2])
    coarser = (shares > _MERGED) | (volumes < _SWALLOWED)
    n_merged = np.where(coarser, before.n_merged + 1, 0)
    resolved = np.where(before.is_resolved, n_merged < patience, ~coarser)
    for upper, lower in LIMBS.values():  # an upper arm beside the trunk still begins a forearm that stands out
        resolved[upper] |= resolved[lower]
    resolved[:2] = True
    return ResolvedParts(resolved, n_merged)


def _touching(grid: NDArray[np.int16], own: NDArray[np.int64], part: int) -> int:
    """Return the number of voxels, given by flat indices (N,), with a face on a part."""
    steps = np.array(grid.strides) // grid.itemsize
    beside = grid.ravel()[own + np.concatenate([steps, -steps])[:, None]]
    return int(np.count_nonzero((beside == part).any(axis=0)))


def measure_together(
    state: FilterState, clouds: PartClouds, pairs: tuple[tuple[int, int], ...], sigma_m: float
) -> LinearizedMeasurement | None:
    """Linearize the common centre of pairs of parts, or None if there are none with voxels.

    Args:
        state: the figure.
        clouds: the voxels of its parts.
        pairs: indices of the parts.
        sigma_m: standard deviation of the centre of a part, metres.
    """
    rows, jacobians = [], []
    for pair in pairs:
        own = list(pair)
        n = clouds.counts[own]
        if n.sum() > 0:
            offsets = np.einsum("pij,pj->pi", state.rotations[own], clouds.means[own])
            weights = n / n.sum()
            rows.append(weights @ offsets)
            jacobians.append(np.einsum("p,pij->ij", weights, state.center_jacobian[own]))
    if not rows:
        return None
    H: Array = np.concatenate(jacobians)
    return LinearizedMeasurement(np.concatenate(rows), H, np.eye(len(H)) * sigma_m**2)


def carried(before: FilterState, state: FilterState, levels: ResolvedParts) -> Array:
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
