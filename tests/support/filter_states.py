"""States of the voxel tracker's filter."""

import numpy as np

from tracker.estimation.voxel.body_pose import state_of
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.formats.model_toml import load_model


def some_state(seed=0, settings=None):
    """A state with sizes and all velocities, away from any special pose."""
    model, rng = load_model("mikic10", 1.75), np.random.default_rng(seed)
    state = state_of(model, [model.neutral()], 0.1, settings or VoxelSettings(sizes="always"))
    step = 0.5 * rng.normal(size=state.layout.n)
    step[state.layout.sizes_at] *= 0.02
    return state.retract(step)
