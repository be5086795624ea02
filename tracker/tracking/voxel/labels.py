"""Assign voxels to the parts of predicted figures by Mahalanobis distance (MTHC01 Sect. 4)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Array
from tracker.tracking.voxel.figure import N_PARTS
from tracker.tracking.voxel.label_kernels import N_MOMENTS, label_and_sum
from tracker.tracking.voxel.state import FilterState

NO_PART = -1
"""Label of a voxel that belongs to no part."""


class PartClouds(NamedTuple):
    """The voxels of each of M parts in numbers, in the frame of the predicted part about its predicted centre."""

    counts: Array
    """Number of voxels, (M,)."""
    means: Array
    """Mean, (M, 3), metres; 0 without voxels."""
    covariances: Array
    """Covariance with that of the voxels' own extent, (M, 3, 3), square metres."""

    def of_person(self, index: int) -> "PartClouds":
        """Return the parts of one of several figures."""
        own = slice(N_PARTS * index, N_PARTS * (index + 1))
        return PartClouds(self.counts[own], self.means[own], self.covariances[own])


class Labels(NamedTuple):
    """Voxels assigned to the parts of one or several figures."""

    labels: NDArray[np.int16]
    """Index of the part of each voxel, (N,); 10 for each figure, in their order; `NO_PART` where none is near."""
    clouds: PartClouds


def label_voxels(points: Array, states: Sequence[FilterState], size_m: float, gate: float = np.inf) -> Labels:
    """Assign each voxel to the part from which its Mahalanobis distance is least.

    Args:
        points: centres of the voxels, (N, 3), metres.
        states: predicted figures of all people.
        size_m: edge of a voxel, metres; it widens the parts.
        gate: squared distance from which on a voxel belongs to no part; the paper has none.
    """
    centers, rotations, sigmas = _parts(states, size_m)
    labels = np.empty(len(points), dtype=np.int16)
    moments = np.zeros((len(centers), N_MOMENTS))
    label_and_sum(np.ascontiguousarray(points), centers, rotations, sigmas, gate, labels, moments)
    return Labels(labels, _clouds(moments, size_m))


def label_voxels_plainly(points: Array, states: Sequence[FilterState], size_m: float, gate: float = np.inf) -> Labels:
    """Return the same without a compiled kernel: the oracle of `label_voxels`."""
    centers, rotations, sigmas = _parts(states, size_m)
    local = np.einsum("mji,nmj->nmi", rotations, points[:, None] - centers)
    distances = np.sum((local / sigmas) ** 2, axis=2)
    labels = distances.argmin(axis=1).astype(np.int16)
    labels[distances.min(axis=1) >= gate] = NO_PART
    moments = np.zeros((len(centers), N_MOMENTS))
    for m in range(len(centers)):
        own = local[labels == m, m]
        moments[m] = [len(own), *own.sum(axis=0), *(own.T @ own)[np.triu_indices(3)]]
    return Labels(labels, _clouds(moments, size_m))


def _parts(states: Sequence[FilterState], size_m: float) -> tuple[Array, Array, Array]:
    sigmas = [np.sqrt((s.figure.sigma_shares * s.sizes) ** 2 + size_m**2 / 12) for s in states]
    return (
        np.concatenate([s.centers for s in states]),
        np.concatenate([s.rotations for s in states]),
        np.concatenate(sigmas),
    )


def _clouds(moments: Array, size_m: float) -> PartClouds:
    counts = moments[:, 0]
    n = np.maximum(counts, 1.0)[:, None]
    means = moments[:, 1:4] / n
    second = np.empty((len(moments), 3, 3))
    rows, columns = np.triu_indices(3)
    second[:, rows, columns] = second[:, columns, rows] = moments[:, 4:] / n
    covariances = second - means[:, :, None] * means[:, None, :] + np.eye(3) * size_m**2 / 12
    return PartClouds(counts, means, covariances)
