"""Lengths of the shortest paths through the voxels of a figure: they hardly change with its pose."""

import itertools
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.geometry.arrays import Array

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


VoxelGraph: TypeAlias = "csr_matrix"
"""Distances of neighbouring voxels, (N, N), each pair once, in edges of a voxel."""
_STEPS = np.array([s for s in itertools.product((-1, 0, 1), repeat=3) if s > (0, 0, 0)])
"""From a voxel to its neighbours across a face, an edge or a corner, one of each opposite pair, (13, 3)."""


def neighbor_graph(figure: Voxels) -> VoxelGraph:
    """Return the graph of a figure's voxels. It does not depend on the scale of the figure."""
    from scipy.sparse import coo_matrix  # imported lazily: loading scipy takes 0.2 s

    at, n = figure.indices + 1, len(figure.indices)
    numbers = np.full(np.add(figure.grid.shape, 2), -1)
    numbers[tuple(at.T)] = np.arange(n)
    neighbors = np.stack([numbers[tuple((at + step).T)] for step in _STEPS], axis=1)
    voxels, steps = np.nonzero(neighbors >= 0)
    lengths = np.linalg.norm(_STEPS, axis=1)[steps]
    return coo_matrix((lengths, (voxels, neighbors[voxels, steps])), shape=(n, n)).tocsr()


def path_lengths(graph: VoxelGraph, sources: NDArray[np.bool_], size_m: float) -> Array:
    """Return the length of the shortest path from the sources to each voxel, (N,), metres; infinite where none leads.

    Args:
        graph: of the figure.
        sources: the voxels from which paths begin, (N,).
        size_m: edge of a voxel, metres.
    """
    from scipy.sparse.csgraph import dijkstra

    found = dijkstra(graph, directed=False, indices=np.flatnonzero(sources), min_only=True)
    return np.asarray(size_m * found)
