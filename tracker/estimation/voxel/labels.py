"""Assign voxels to the parts of predicted figures by Mahalanobis distance (MTHC01 Sect. 4).

Compiled kernel: assign voxels to parts, and sum up the moments of each part.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.estimation.voxel.figure import N_PARTS
from tracker.estimation.voxel.kalman import product
from tracker.estimation.voxel.state import FilterState
from tracker.geometry.arrays import Array

NO_PART = -1
"""Label of a voxel that belongs to no part."""
_UPPER = np.triu_indices(3)
"""Rows and columns of the distinct elements of a symmetric matrix."""


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


class LabelRule(NamedTuple):
    """How voxels are assigned to parts."""

    gate: float = np.inf
    """Squared Mahalanobis distance from which on a voxel belongs to no part; the paper has none."""
    widened: bool = False
    """Whether parts are widened by the uncertainty of their centres; the paper does not say so."""


def label_voxels(points: Array, states: Sequence[FilterState], size_m: float, rule: LabelRule) -> Labels:
    """Assign each voxel to the part from which its Mahalanobis distance is least.

    A part that is widened gets thinner: the logarithm of its volume is added to the squared distance, so that the
    label is the likeliest one of parts that are filled evenly.

    Args:
        points: centres of the voxels, (N, 3), metres.
        states: predicted figures of all people, with their covariances.
        size_m: edge of a voxel, metres; it widens the parts.
        rule: how they are assigned.
    """
    centers, rotations, metrics = _parts(states, size_m, rule.widened)
    labels = np.empty(len(points), dtype=np.int16)
    moments = np.zeros((len(centers), N_MOMENTS))
    packed = np.column_stack([metrics[0][:, *_UPPER], metrics[1]])
    label_and_sum(np.ascontiguousarray(points), centers, rotations, packed, rule.gate, labels, moments)
    return Labels(labels, _clouds(moments, size_m))


def _parts(states: Sequence[FilterState], size_m: float, widened: bool) -> tuple[Array, Array, tuple[Array, Array]]:
    """Return centres and rotations of all parts, and inverse covariances in their frames with what each adds."""
    shapes = np.concatenate([(s.figure.sigma_shares * s.sizes) ** 2 + size_m**2 / 12 for s in states])
    centers = np.concatenate([s.centers for s in states])
    rotations = np.concatenate([s.rotations for s in states])
    covariances = shapes[:, :, None] * np.eye(3)
    if not widened:
        return centers, rotations, (np.asarray(np.linalg.inv(covariances), np.float64), np.zeros(len(centers)))
    of_centers = np.concatenate([_center_covariances(s) for s in states])
    covariances += np.einsum("mji,mjk,mkl->mil", rotations, of_centers, rotations)
    added = np.log(np.linalg.det(covariances)) - np.log(shapes).sum(axis=1)
    return centers, rotations, (np.asarray(np.linalg.inv(covariances), np.float64), np.asarray(added, np.float64))


def _center_covariances(state: FilterState) -> Array:
    """Return the covariance of the centre of each part, (10, 3, 3), square metres."""
    J = state.center_jacobian
    JP = product(J.reshape(3 * N_PARTS, -1), state.covariance).reshape(J.shape)
    return np.asarray(JP @ np.swapaxes(J, 1, 2))


def _clouds(moments: Array, size_m: float) -> PartClouds:
    counts = moments[:, 0]
    n = np.maximum(counts, 1.0)[:, None]
    means = moments[:, 1:4] / n
    second = np.empty((len(moments), 3, 3))
    rows, columns = _UPPER
    second[:, rows, columns] = second[:, columns, rows] = moments[:, 4:] / n
    covariances = second - means[:, :, None] * means[:, None, :] + np.eye(3) * size_m**2 / 12
    return PartClouds(counts, means, covariances)


N_MOMENTS = 10
"""Number of voxels, sums of x, y, z, and of xx, xy, xz, yy, yz, zz in the frame of the part."""


@njit(**NO_REFCOUNT)
def label_and_sum(
    points: Array, centers: Array, rotations: Array, metrics: Array, gate: float,
    labels: NDArray[np.int16], moments: Array,
) -> None:  # fmt: skip
    """Fill labels and moments; see `labels.label_voxels`.

    Args:
        points: centres of the voxels, (N, 3), metres.
        centers: of the parts, (M, 3), metres.
        rotations: of the parts, (M, 3, 3).
        metrics: inverse covariance of each part in its frame, xx, xy, xz, yy, yz, zz, and what is added to the
            squared distance, (M, 7).
        gate: squared Mahalanobis distance from which on a voxel belongs to no part.
        labels: the result, (N,).
        moments: the result, (M, `N_MOMENTS`), initially 0.
    """
    for n in range(points.shape[0]):
        best, least = -1, np.inf
        bx, by, bz = 0.0, 0.0, 0.0
        for m in range(centers.shape[0]):
            dx, dy, dz = points[n, 0] - centers[m, 0], points[n, 1] - centers[m, 1], points[n, 2] - centers[m, 2]
            R, w = rotations[m], metrics[m]
            x = R[0, 0] * dx + R[1, 0] * dy + R[2, 0] * dz
            y = R[0, 1] * dx + R[1, 1] * dy + R[2, 1] * dz
            z = R[0, 2] * dx + R[1, 2] * dy + R[2, 2] * dz
            squared = w[0] * x * x + w[3] * y * y + w[5] * z * z + 2.0 * (w[1] * x * y + w[2] * x * z + w[4] * y * z)
            if squared < gate and squared + w[6] < least:
                best, least = m, squared + w[6]
                bx, by, bz = x, y, z
        labels[n] = best
        if best >= 0:
            sums = moments[best]
            sums[0] += 1.0
            sums[1] += bx
            sums[2] += by
            sums[3] += bz
            sums[4] += bx * bx
            sums[5] += bx * by
            sums[6] += bx * bz
            sums[7] += by * by
            sums[8] += by * bz
            sums[9] += bz * bz
