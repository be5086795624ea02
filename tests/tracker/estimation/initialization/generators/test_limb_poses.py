"""Poses of limbs that a search tries."""

import numpy as np
import pytest

from tracker.estimation.initialization.generators.limb_poses import (
    changes_around,
    changes_within_limits,
    moving_limbs,
    trunk_parts,
)
from tracker.formats.model_toml import PRESETS, load_model
from tracker.geometry import rigid

MODEL = load_model("gavrila34")


def posed(changes):
    return MODEL.clip(MODEL.retract(MODEL.neutral(), changes))


@pytest.mark.parametrize("name", PRESETS)
def test_legs_come_before_arms_and_the_rest_is_trunk(name):
    model = load_model(name)
    names = [limb.name for limb in moving_limbs(model)]
    assert [any(n in name for n in ("calf", "foot", "leg")) for name in names] == [True, True, False, False]
    limb_parts = np.concatenate([limb.parts for limb in moving_limbs(model)])
    assert sorted([*limb_parts, *trunk_parts(model)]) == list(range(len(model.parts)))


def test_poses_reach_all_over_the_joint_limits():
    for limb, changes in zip(moving_limbs(MODEL), changes_within_limits(MODEL), strict=True):
        assert not changes[:, ~limb.dofs].any()
        wide = limb.dofs & ~np.isfinite(MODEL.spreads)
        low, high = MODEL.limits[wide].T
        assert np.all(np.ptp(changes[:, wide], axis=0) > 0.9 * (high - low))


def test_no_limb_ends_in_the_trunk():
    torso = MODEL.part_index["torso"]
    for limb, changes in zip(moving_limbs(MODEL), changes_within_limits(MODEL), strict=True):
        last = int(limb.parts[-1])
        for pose in posed(changes)[::16]:
            Ts = MODEL.kinematics(pose).Ts_world_part
            middle = rigid.apply(Ts[last], MODEL.centers_part[last])
            local = rigid.apply(rigid.inverse(Ts[torso]), middle) - MODEL.centers_part[torso]
            assert MODEL.shapes[torso].inside_outside(local) > 0.7


def test_poses_around_another_are_near_and_hold_small_joints():
    dofs = np.flatnonzero(moving_limbs(MODEL)[-1].dofs)
    changes = changes_around(MODEL, dofs, 64, 0.2)
    held = np.isfinite(MODEL.spreads[dofs])
    assert np.std(changes[:, dofs[~held]]) == pytest.approx(0.2, rel=0.15)
    assert np.std(changes[:, dofs[held]]) == pytest.approx(0.06, rel=0.2)
    root = np.arange(6)
    assert np.std(changes_around(MODEL, root, 64, 0.2, 0.05)[:, :3]) == pytest.approx(0.05, rel=0.2)
