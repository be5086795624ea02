"""Compiled kernel: how many voxels each of many poses of a limb explains."""

from tracker.compute.jit import njit
from tracker.compute.numba_options import NO_REFCOUNT
from tracker.geometry.arrays import Array


@njit(**NO_REFCOUNT)
def count_explained(points: Array, root: Array, upper: Array, lower: Array, reaches: Array, counts: Array) -> None:
    """Fill the number of points within reach of either segment of a limb.

    Args:
        points: (N, 3), metres.
        root: shoulder or hip, (3,), metres.
        upper: from the root to the elbow or knee of each pose, (K, 3), metres.
        lower: from there to the end, (K, 3), metres.
        reaches: distances from the segments within which points are explained, (2,), metres.
        counts: the result, (K,).
    """
    for k in range(upper.shape[0]):
        ux, uy, uz = upper[k, 0], upper[k, 1], upper[k, 2]
        lx, ly, lz = lower[k, 0], lower[k, 1], lower[k, 2]
        uu, ll = ux * ux + uy * uy + uz * uz, lx * lx + ly * ly + lz * lz
        n = 0
        for i in range(points.shape[0]):
            x, y, z = points[i, 0] - root[0], points[i, 1] - root[1], points[i, 2] - root[2]
            t = min(max((x * ux + y * uy + z * uz) / uu, 0.0), 1.0)
            a, b, c = x - t * ux, y - t * uy, z - t * uz
            near = a * a + b * b + c * c < reaches[0] * reaches[0]
            x, y, z = x - ux, y - uy, z - uz
            t = min(max((x * lx + y * ly + z * lz) / ll, 0.0), 1.0)
            a, b, c = x - t * lx, y - t * ly, z - t * lz
            near = near or a * a + b * b + c * c < reaches[1] * reaches[1]
            n += near
        counts[k] = n
