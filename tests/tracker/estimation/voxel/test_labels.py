"""Labels of voxels: the compiled kernel against plain numpy, and what it should find."""

import numpy as np
import pytest
from filter_states import some_state
from plain_voxels import label_voxels_plainly

from tracker.estimation.voxel.body_pose import state_of
from tracker.estimation.voxel.labels import NO_PART, LabelRule, label_voxels
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.formats.model_toml import load_model


@pytest.mark.parametrize("rule", [LabelRule(), LabelRule(9.0), LabelRule(9.0, True)])
def test_the_kernel_agrees_with_the_oracle(rule):
    states = [some_state(0), some_state(1)]
    points = np.random.default_rng(0).normal(size=(3000, 3)) * 0.5
    found, expected = (f(points, states, 0.03, rule) for f in (label_voxels, label_voxels_plainly))
    np.testing.assert_array_equal(found.labels, expected.labels)
    for a, b in zip(found.clouds, expected.clouds, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-9)
    assert (found.labels == NO_PART).any() == (rule.gate < np.inf)


def test_the_middle_of_each_part_belongs_to_it():
    state = some_state(2)
    labels = label_voxels(state.centers, [state], 0.03, LabelRule()).labels
    np.testing.assert_array_equal(labels, np.arange(10))


def test_an_uncertain_part_is_found_farther_away():
    """A forearm whose elbow may have bent takes voxels that would lie outside of its gate."""
    model = load_model("mikic10", 1.75)
    state = state_of(model, [model.neutral()], 0.1, VoxelSettings())
    P = 1e-6 * np.eye(state.layout.n)
    sure = state.with_covariance(P)
    P = P.copy()
    P[18:21, 18:21] = np.eye(3)  # rotation of the left forearm
    unsure = state.with_covariance(P)
    aside = state.centers[6] + (0.0, 0.25, 0.0)
    rule = LabelRule(16.0, True)
    assert label_voxels(aside[None], [sure], 0.03, rule).labels[0] == NO_PART
    assert label_voxels(aside[None], [unsure], 0.03, rule).labels[0] == 6
