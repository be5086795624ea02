import numpy as np
import pytest
from figures import figure
from scipy.spatial import cKDTree

from tracker.evidence.voxels.geodesic_distance import neighbor_graph, path_lengths
from tracker.evidence.voxels.voxel_grid import VoxelGrid, Voxels


def test_paths_follow_the_voxels_round_a_corner():
    occupied = np.zeros((10, 10, 10), bool)
    occupied[tuple(np.transpose([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0], [9, 9, 9]]))] = True
    graph = neighbor_graph(Voxels(VoxelGrid(np.zeros(3), 0.02, occupied.shape), occupied))
    found = path_lengths(graph, np.array([True, False, False, False, False, False]), 0.02)
    # Across the corner the path takes the diagonal.
    assert found[:5] == pytest.approx([0, 0.02, 0.04, 0.02 + 0.02 * np.sqrt(2), 0.04 + 0.02 * np.sqrt(2)])
    assert found[5] == np.inf


def test_neighbours_share_a_face_an_edge_or_a_corner():
    voxels, _ = figure(0.05)
    graph, points = neighbor_graph(voxels), voxels.points_world
    pairs = cKDTree(points).query_pairs(1.8 * 0.05)
    assert {(min(a, b), max(a, b)) for a, b in zip(*graph.nonzero(), strict=True)} == pairs
    assert graph.nnz == len(pairs)
    a, b = graph.nonzero()
    np.testing.assert_allclose(0.05 * graph[a, b].A1, np.linalg.norm(points[a] - points[b], axis=1))


def test_the_graph_does_not_depend_on_the_scale():
    voxels, _ = figure(0.05)
    whole, half = neighbor_graph(voxels), neighbor_graph(voxels.scaled(0.5))
    assert (whole != half).nnz == 0
