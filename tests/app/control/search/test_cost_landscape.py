"""The cost along one degree of freedom, against costs computed one by one."""

import numpy as np
import pytest
from gestures import drag, wait_for

from app.control.search.cost_landscape import SAMPLES, landscape
from tracker.errors import TrackerError
from tracker.estimation.chamfer.settings import pose_cost


@pytest.mark.slow
@pytest.mark.parametrize("name", ["left_shoulder.abduction", "torso.x", "torso.twist"])
def test_it_is_what_the_cost_says_one_by_one(name, controller):
    state, models = controller.state, controller.models
    views = controller.frames.evidence(0)
    dof = models[0].dof_names.index(name)
    grid = landscape(views, models, state.poses, state.settings, 0, dof)
    assert len(grid.values) == SAMPLES
    assert grid.current == state.poses[0][dof]
    assert grid.values[0] <= grid.current <= grid.values[-1]
    low, high = models[0].limits[dof]
    if np.isfinite(low):
        assert (grid.values[0], grid.values[-1]) == (pytest.approx(low), pytest.approx(high))
    cost = pose_cost(views, models, state.poses, state.settings)
    for i in range(0, SAMPLES, 20):
        pose = state.poses[0].copy()
        pose[dof] = grid.values[i]
        one = cost((pose,))
        assert grid.totals_px[i] == pytest.approx(one.total_px, rel=1e-9)
        np.testing.assert_allclose(grid.view_costs_px[i], one.view_costs_px, rtol=1e-9)
    assert grid.current_px == pytest.approx(state.cost_px)


def test_it_follows_the_pose_while_a_page_looks(controller):
    drag(controller, "torso", (4.0, 0.0))
    assert controller.state.landscape is None  # nobody looks
    controller.cost_landscape.watch(7, True)
    controller.cost_landscape.choose("left_elbow.extension")
    dof = controller.models[0].dof_names.index("left_elbow.extension")
    wait_for(lambda: controller.state.landscape is not None and controller.state.landscape.dof == dof)
    controller.pose_edits.set_dof(0, dof, 0.5)
    wait_for(lambda: controller.state.landscape.current == pytest.approx(0.5))
    controller.cost_landscape.watch(7, False)
    controller.pose_edits.set_dof(0, dof, 0.9)
    controller.navigation.seek(1)
    assert controller.state.landscape.current == pytest.approx(0.5)


def test_it_begins_with_the_selected_point_and_follows_it(controller):
    names = controller.models[0].dof_names

    def shown(joint):
        wait_for(lambda: controller.state.landscape and names[controller.state.landscape.dof].startswith(f"{joint}."))

    controller.navigation.select(0, "left_wrist")  # it turns with the elbow
    controller.cost_landscape.watch(7, True)
    shown("left_elbow")
    controller.cost_landscape.choose("torso.x")
    shown("torso")
    controller.navigation.select(0, "right_knee")
    shown("right_knee")
    controller.cost_landscape.choose("torso.x")
    shown("torso")
    controller.cost_landscape.watch(7, False)
    controller.cost_landscape.watch(7, True)
    shown("right_knee")


def test_a_value_is_set_as_an_edit(controller):
    dof = controller.models[0].dof_names.index("left_elbow.extension")
    before = controller.state.poses[0][dof]
    controller.pose_edits.set_along(0, [dof], [0.4])
    assert controller.state.poses[0][dof] == pytest.approx(0.4)
    assert controller.state.undo == "set left elbow extension, frame 0"
    controller.history.undo()
    assert controller.state.poses[0][dof] == before
    controller.dof_locks.set(0, [dof], True)
    with pytest.raises(TrackerError, match="unlock it to change it"):
        controller.pose_edits.set_along(0, [dof], [0.4])
    with pytest.raises(TrackerError, match="found others"):
        controller.pose_edits.set_along(0, [0], [float("nan")])
    with pytest.raises(TrackerError, match="choose one from the list"):
        controller.cost_landscape.choose("tail.wag")
