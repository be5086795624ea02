"""Compiled kernel: assign voxels to parts, and sum up the moments of each part."""

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import njit
from tracker.compute.numba_options import NO_REFCOUNT
from tracker.geometry.arrays import Array

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
