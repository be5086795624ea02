import numpy as np
import pytest

from tracker.voxels.paths import path_lengths


def test_paths_follow_the_voxels_round_a_corner():
    points = 0.02 * np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0], [9, 9, 9]], dtype=float)
    found = path_lengths(points, np.array([True, False, False, False, False, False]), 0.02)
    # Across the corner the path takes the diagonal.
    assert found[:5] == pytest.approx([0, 0.02, 0.04, 0.02 + 0.02 * np.sqrt(2), 0.04 + 0.02 * np.sqrt(2)])
    assert found[5] == np.inf
