"""Statuses that follow from the voxels near a figure."""

from types import SimpleNamespace

import numpy as np
import pytest
from filter_states import some_state

from tracker.estimation.voxel import assessment
from tracker.estimation.voxel.assessment import UnexplainedVoxels, assess
from tracker.estimation.voxel.figure import LIMBS, N_PARTS

LITRES = 1000
"""Voxels of a centimetre in a litre."""


@pytest.mark.parametrize(
    ("share", "litres", "expected"),
    [(1.0, 0, "good"), (1.0, 20, "doubtful"), (0.7, 0, "doubtful"), (0.7, 20, "lost"), (0.3, 0, "lost")],
)
def test_voxels_that_no_part_explains_are_a_lost_limb_only_where_one_has_left_its_place(
    monkeypatch, share, litres, expected
):
    """A phantom of the hull is no limb. The share is that of the left forearm's axis in voxels."""
    inside = np.ones((N_PARTS, 10))
    inside[LIMBS["left_arm"][-1]] = share
    monkeypatch.setattr(assessment, "occupied_near", lambda voxels, points: inside)
    frame = SimpleNamespace(n_views=4, broken=(), voxels=SimpleNamespace(grid=SimpleNamespace(size_m=0.01)))
    free = UnexplainedVoxels(np.zeros((litres * LITRES, 3)), False)
    assert assess(some_state(), frame, free, 1.0, ()).status == expected
