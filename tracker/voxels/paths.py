"""Lengths of the shortest paths through the voxels of a figure: they hardly change with its pose."""

import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Array

_NEIGHBOR = 1.8
"""Largest distance of neighbors, in edges of a voxel: those that share a face, an edge or a corner."""


def path_lengths(points: Array, sources: NDArray[np.bool_], size_m: float) -> Array:
    """Return the length of the shortest path from the sources to each voxel, (N,), metres; infinite where none leads.

    Args:
        points: centres of the voxels, (N, 3), metres.
        sources: the voxels from which paths begin, (N,).
        size_m: edge of a voxel, metres.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import dijkstra
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(_NEIGHBOR * size_m, output_type="ndarray")
    lengths = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    graph = coo_matrix((lengths, (pairs[:, 0], pairs[:, 1])), shape=(len(points), len(points)))
    found = dijkstra(graph.tocsr(), directed=False, indices=np.flatnonzero(sources), min_only=True)
    return np.asarray(found)
