"""Levels of detail: closed legs and arms on the body are not told apart, and are again when they part."""

import numpy as np
import pytest
from figures import figure

from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.voxel.body_pose import state_of
from tracker.estimation.voxel.labels import label_voxels
from tracker.estimation.voxel.resolved_parts import ResolvedParts, carried, find_resolved_parts, measure_together
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.formats.model_toml import load_model

SETTINGS = VoxelSettings()


def seen(**pose):
    """State and voxels of a figure in a pose."""
    voxels, joints = figure(size_m=0.03, **pose)
    model = load_model("gavrila34", 1.76)
    return state_of(model, [fit_to_points(model, joints).pose], 0.1, SETTINGS), voxels


def levels_of(before=None, patience=1, **pose):
    state, voxels = seen(**pose)
    labels = label_voxels(voxels.points_world, [state], voxels.grid.size_m, SETTINGS.label_rule)
    return (
        find_resolved_parts(before or ResolvedParts.finest(), state, voxels, labels.labels, 0, patience),
        state,
        labels.clouds,
    )


@pytest.mark.slow
def test_limbs_apart_are_resolved():
    levels, _, _ = levels_of(arms_deg=35, legs_deg=12)
    assert levels.is_resolved.all()
    assert levels.notes == ()


@pytest.mark.slow
@pytest.mark.parametrize("side", ["left", "right"])
def test_arms_on_the_body_are_part_of_it(side):
    levels, _, _ = levels_of(arms_deg=-4, legs_deg=12)
    assert f"{side} arm on the body: not resolved" in levels.notes


@pytest.mark.slow
def test_closed_legs_are_measured_as_one_and_parted_again():
    levels, state, clouds = levels_of(arms_deg=35, legs_deg=-4.5)
    assert levels.notes == ("legs closed: measured as one",)
    assert levels.pairs
    together = measure_together(state, clouds, levels.pairs, 0.02)
    assert together.jacobian.shape == (3 * len(levels.pairs), state.layout.n)
    again, _, _ = levels_of(before=levels, arms_deg=35, legs_deg=12)
    assert again.is_resolved.all()


@pytest.mark.slow
def test_an_unresolved_arm_turns_with_the_trunk():
    levels, before, _ = levels_of(arms_deg=-4, legs_deg=12)
    step = np.zeros(before.layout.n)
    step[2] = 0.4
    after = before.retract(step)
    R = carried(before, after, levels)
    part = int(np.flatnonzero(~levels.is_resolved[:4])[0])
    np.testing.assert_allclose(R[0].T @ R[part], before.rotations[0].T @ before.rotations[part], atol=1e-12)


@pytest.mark.slow
def test_legs_that_touch_for_a_moment_stay_apart():
    once, _, _ = levels_of(patience=2, arms_deg=35, legs_deg=-4.5)
    assert once.is_resolved.all()
    twice, _, _ = levels_of(before=once, patience=2, arms_deg=35, legs_deg=-4.5)
    assert not twice.is_resolved.all()
