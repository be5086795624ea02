"""The cost over two degrees of freedom, against costs computed one by one."""

import numpy as np
import pytest
from gestures import drag, wait_for

from app.control.search.cost_map import SAMPLES, cost_map
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.by_frame.pose_score import scorer_without_prediction

PAGE = 7
JOINTS = ("left_shoulder.abduction", "left_elbow.extension")


def dofs_of(controller):
    return tuple(controller.models[0].dof_names.index(name) for name in JOINTS)


@pytest.mark.slow
def test_it_is_what_the_score_says_one_by_one(controller):
    model, pose, dofs = controller.models[0], controller.state.poses[0], dofs_of(controller)
    views, bodies, settings = controller.frames.evidence(0), (PosedBody(model, pose),), controller.state.settings
    grid = cost_map(views, bodies, 0, dofs, settings)
    assert grid.nats.shape == (SAMPLES, SAMPLES)
    assert grid.current == tuple(pose[list(dofs)])
    for dof, values in zip(dofs, (grid.across, grid.up), strict=True):
        assert values[0] >= model.limits[dof, 0] - 1e-9
        assert values[-1] <= model.limits[dof, 1] + 1e-9
        assert values[-1] - values[0] <= np.radians(120) + 1e-9
    scorer = scorer_without_prediction(views, bodies, 0, settings)
    present = scorer.costs_with_priors(model, pose[None])[0]
    for row, column in ((0, 0), (7, 21), (30, 4)):
        other = pose.copy()
        other[list(dofs)] = grid.across[column], grid.up[row]
        cost = scorer.costs_with_priors(model, other[None])[0]
        assert grid.nats[row, column] == pytest.approx(cost - present, abs=1e-6)


def test_it_follows_the_pose_while_a_page_looks_and_a_place_is_taken(opened):
    controller, names = opened(), " and ".join(JOINTS).replace("_", " ").replace(".", " ")
    dofs = dofs_of(controller)
    drag(controller, "torso", (4.0, 0.0))
    assert controller.state.cost_map is None  # nobody looks
    controller.cost_map.watch(PAGE, 0, dofs)
    wait_for(lambda: controller.state.cost_map is not None, 60)
    controller.pose_edits.set_along(0, dofs, (0.4, 0.7))
    assert tuple(controller.state.poses[0][list(dofs)]) == pytest.approx((0.4, 0.7))
    assert controller.state.undo == f"set {names}, frame 0"
    wait_for(lambda: controller.state.cost_map.current == pytest.approx((0.4, 0.7)), 60)
    controller.history.undo()
    wait_for(lambda: controller.state.cost_map.current != pytest.approx((0.4, 0.7)), 60)
    controller.cost_map.leave(PAGE)
    before = controller.state.cost_map
    controller.pose_edits.set_dof(0, dofs[0], 0.2)
    controller.navigation.seek(1)
    assert controller.state.cost_map is before


def test_wrong_degrees_of_freedom_are_refused(controller):
    dofs = dofs_of(controller)
    for wrong in ((dofs[0], dofs[0]), (0, 999), (-1, 2)):
        with pytest.raises(TrackerError, match="expected two different degrees of freedom"):
            controller.cost_map.watch(PAGE, 0, wrong)
    with pytest.raises(TrackerError, match="expected finite values"):
        controller.pose_edits.set_along(0, dofs, (0.1, np.nan))
    with pytest.raises(TrackerError, match="expected finite values"):
        controller.pose_edits.set_along(0, (dofs[0], dofs[0]), (0.1, 0.2))
    controller.dof_locks.set(0, [dofs[1]], True)
    with pytest.raises(TrackerError, match="left elbow extension is locked"):
        controller.pose_edits.set_along(0, dofs, (0.1, 0.2))
