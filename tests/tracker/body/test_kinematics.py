"""The kinematics of a chain against that of the whole body; test_body.py holds the latter against its definition."""

import numpy as np
import pytest
from bodies import MODELS

from tracker.body.kinematics import chain_poses, forward_kinematics, point_jacobian
from tracker.body.limbs import limbs


@pytest.mark.parametrize("name", MODELS)
def test_a_chain_in_many_poses_is_where_the_whole_body_puts_it(name):
    """Placing one chain equals placing all to the last digit, and changes no input."""
    model, rng = MODELS[name], np.random.default_rng(3)
    base = model.retract(model.neutral(), rng.normal(size=model.n_dofs))
    for limb in limbs(model):
        start, *poses = model.retract(base, rng.normal(size=(30, model.n_dofs)) * limb.dofs)
        rest = model.kinematics(start)
        before = rest.Ts_world_part.copy()
        placed = chain_poses(model.tree, rest, limb.parts, np.array(poses))
        np.testing.assert_array_equal(placed, [model.kinematics(v).Ts_world_part[limb.parts] for v in poses])
        np.testing.assert_array_equal(rest.Ts_world_part, before)


def test_kernels_are_compiled_once_for_arrays_of_any_layout():
    model = MODELS["gavrila22"]

    def versions(values, points):
        model.point_jacobian(model.kinematics(values), np.zeros(2, int), points)
        return [len(kernel.signatures) for kernel in (forward_kinematics, point_jacobian)]

    usual = versions(model.neutral(), np.zeros((2, 3)))
    values, points = np.repeat(model.neutral(), 2)[::2], np.zeros((3, 2)).T
    assert versions(values, points) == usual
    values, points = model.neutral(), np.zeros((2, 3))
    values.flags.writeable = points.flags.writeable = False
    assert versions(values, points) == usual
