"""Poses retargeted to bodies of other sizes."""

import numpy as np
import pytest
from staging import cameras_around, posed

from tracker.body.dimensions import PartDimensions, dimensions_of, with_dimensions
from tracker.estimation.fitting.retarget import retarget_pose
from tracker.formats.model_toml import load_model
from tracker.geometry.triangulation import PointObservation


@pytest.fixture(scope="module")
def bodies():
    """A body, and the same with forearms and thighs 1.5 cm longer."""
    model = load_model("gavrila34")
    sizes = dimensions_of(model)
    parts = {
        n: PartDimensions(p.length_m + 0.015 * n.endswith(("forearm", "thigh")), p.girths_m)
        for n, p in sizes.parts.items()
    }
    return model, with_dimensions(model, sizes._replace(parts=parts))


def off_m(values, becomes, was_values, was):
    return np.linalg.norm(becomes.points_world(values) - was.points_world(was_values), axis=1)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_joints_stay_where_they_are_as_far_as_the_bones_allow(bodies, seed):
    was, becomes = bodies
    values = posed(was, seed)
    retargeted = retarget_pose(values, was, becomes)
    assert off_m(values, becomes, values, was).max() > 0.014
    # A bone that is 15 mm longer leaves 7 mm at each end at best, unless others make room.
    assert off_m(retargeted, becomes, values, was).mean() < 0.007
    assert off_m(retargeted, becomes, values, was).max() < 0.014
    np.testing.assert_allclose(becomes.clip(retargeted), retargeted, atol=1e-12)


def test_the_same_body_keeps_the_pose_to_the_last_bit(bodies):
    was, _ = bodies
    values = posed(was, 1)
    assert retarget_pose(values, was, was) is values


def test_locked_dofs_stay(bodies):
    was, becomes = bodies
    values = posed(was, 1)
    free = np.array([not name.startswith("left_elbow") for name in was.dof_names])
    retargeted = retarget_pose(values, was, becomes, active_dofs=free)
    still = was.dof_value[~free]
    np.testing.assert_array_equal(retargeted[still], values[still])
    assert not np.array_equal(retargeted, values)


def test_pins_draw_a_joint_away_from_where_it_was(bodies):
    was, becomes = bodies
    values, cameras = posed(was, 2), cameras_around(3)
    wrist = was.point_names.index("left_wrist")
    place = was.points_world(values)[wrist] + (0.0, 0.0, 0.03)
    pins = [PointObservation("left_wrist", i, tuple(c.project(place))) for i, c in enumerate(cameras)]
    without, with_pins = (retarget_pose(values, was, becomes, p, cameras) for p in ((), pins))
    far = [np.linalg.norm(becomes.points_world(v)[wrist] - place) for v in (without, with_pins)]
    assert far[1] < far[0] - 0.01
