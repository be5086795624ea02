"""Before and after of fits and searches: what is compared, how long it holds, and where the page warns."""

import json
from dataclasses import replace

import numpy as np
import pytest
from gestures import PAGE, drag, pixel_of, wait_for

from app.control.session import comparing
from app.drawing import joint_handles, overlays
from app.drawing.ghosts import former_limb_lines
from app.messages import encoding
from app.state.page_view import View
from app.state.people import ShownPose
from tracker.body.limbs import limbs
from tracker.errors import TrackerError
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.search.best_first import SearchSettings

QUICK = TrackSettings(search=SearchSettings(passes=(1.0,), max_expansions=3))
CONTOURS = View(frozenset({"contours"}), (1, 1, 1, 1), False)


@pytest.fixture
def fitted(controller):
    drag(controller, "left_wrist", (20.0, 5.0))
    before = controller.state
    controller.pinning.fit(0)
    return controller, before


def test_a_fit_is_compared_with_the_pose_before_it(fitted):
    controller, before = fitted
    state = controller.state
    message = encoding.state(controller.session, state).compared
    assert (message.work, message.is_before_shown) == ("fit", False)
    assert message.before_px == pytest.approx(before.cost_px)
    assert message.after_px == state.cost_px < message.before_px
    assert message.before_view_costs_px == pytest.approx(before.view_costs_px)
    assert message.after_view_costs_px == state.view_costs_px


def test_the_views_show_the_pose_before_and_nothing_is_undone(fitted):
    controller, before = fitted
    result, undo = controller.state, controller.state.undo
    controller.comparing.show_before(True)
    state = controller.state
    assert state.drawn.poses[0] is before.poses[0]
    assert encoding.state(controller.session, state).cost_px == pytest.approx(before.cost_px)
    assert (state.people, state.undo, state.saved) == (result.people, undo, True)
    kinds = {p.kind for p in overlays.paths(controller.session_of(state), state, CONTOURS, None)}
    assert "result" in kinds  # the result, to see where they differ
    assert not state.is_stored_drawn
    # Joints of the pose that is drawn tell in which views they are visible.
    binary = encoding.overlay(controller.session, state, PAGE, CONTOURS, None)
    header = json.loads(binary[4 : 4 + int.from_bytes(binary[:4], "little")])
    drawn = joint_handles.handles(controller.session, state.drawn, CONTOURS.cameras)
    assert [(h["point"], h["u"], h["visible"]) for h in header["handles"]] == [(h.point, h.u, h.visible) for h in drawn]
    controller.comparing.show_before(False)
    assert controller.state.drawn is controller.state


@pytest.mark.slow
@pytest.mark.parametrize("change", ["undo", "drag", "seek", "size"])
def test_a_comparison_ends_with_the_result(fitted, change):
    controller, _ = fitted
    controller.comparing.show_before(True)
    if change == "undo":
        controller.history.undo()
    elif change == "drag":
        drag(controller, "left_wrist", (5.0, 0.0))
    elif change == "seek":
        controller.navigation.seek(3)
    else:
        controller.body_sizes.set_height(0, 1.1 * controller.models[0].height_m)
        controller.body_sizes.apply(0, refit=True)
    assert controller.state.compared is None
    assert controller.state.drawn is controller.state
    with pytest.raises(TrackerError, match="fit or search"):
        controller.comparing.show_before(True)


def test_a_comparison_is_back_with_its_result(fitted):
    controller, _ = fitted
    noted = controller.state.compared
    controller.history.undo()
    controller.history.redo()
    assert controller.state.compared is noted
    controller.navigation.seek(1)
    controller.navigation.seek(0)
    assert controller.state.compared is noted


def test_a_search_is_compared_with_its_start(controller):
    before = controller.state
    controller.search.set_settings(QUICK)
    controller.search.step()
    wait_for(lambda: controller.state.compared is not None)
    first = controller.state.compared
    controller.search.run()
    wait_for(lambda: controller.state.search.message)
    with controller.lock:
        last = controller.state.compared
    assert (first.work, first.number) == ("search", last.number)
    assert last.before[0].values is before.poses[0]
    assert last.before_px == pytest.approx(before.cost_px)
    assert last.after_px < last.before_px
    controller.comparing.show_before(True)
    controller.replay.show(1, 0)
    assert not controller.state.compared.is_before_shown


def test_a_fit_that_leaves_a_placed_joint_is_reported(fitted):
    controller, _ = fitted  # the wrist alone was placed, beside the person: the fit takes it away
    assert "left the left wrist 7 cm from where you placed it" in controller.state.compared.warning
    assert "body's sizes" in controller.state.compared.warning
    controller.held_points.set(0, None, held=False)
    drag(controller, "torso", (3.0, 0.0))
    controller.pinning.fit(0)
    assert controller.state.compared.warning == ""  # nothing is held


def test_a_fit_that_leaves_a_pin_is_reported(fitted):
    controller, _ = fitted
    noted, session_state = controller.state.compared, controller.session_state
    controller.held_points.set(0, None, held=False)
    u, v = pixel_of(controller, "right_wrist", camera=1)
    for off_px, is_left in ((1.0, False), (40.0, True)):
        controller.pinning.begin(PAGE, 0, 1, 0, "right_wrist", (u + off_px, v), live=False)
        controller.pinning.end(PAGE)
        placed = {0: comparing._placed_points(session_state, 0, noted.before[0].values)}
        left = comparing._farthest_left(session_state, noted, placed)
        assert (left is not None and left[:2] == (0, "right wrist") and 0.1 < left[2] < 1.0) == is_left


def test_a_joint_is_measured_from_where_it_was_put_and_not_from_where_later_drags_took_it(controller):
    """The elbow that the trunk carried away comes back to its place: nothing is left behind."""
    session_state, model = controller.session_state, controller.models[0]
    drag(controller, "left_elbow", (8.0, 0.0))
    put = controller.state.poses[0]
    drag(controller, "torso", (150.0, 0.0))
    moved = controller.state.poses[0]
    i = model.point_names.index("left_elbow")
    assert np.linalg.norm(model.points_world(moved)[i] - model.points_world(put)[i]) > comparing._LEFT_M
    costs = session_state.costs((moved,))
    session_state.set(people=session_state.people_with_pose(0, put))
    comparing.note_comparison(session_state, "fit", (ShownPose(moved, "manual"),), costs, [0])
    placed = {0: comparing._placed_points(session_state, 0, moved)}
    assert {at.camera for at in placed[0]["left_elbow"]} == {0}
    elbow_alone = {0: {"left_elbow": placed[0]["left_elbow"]}}
    assert comparing._farthest_left(session_state, controller.state.comparison, elbow_alone) is None


def test_a_placement_in_one_view_says_nothing_of_depth():
    eye, was = np.array([0.0, -4.0, 1.0]), np.array([0.0, 0.0, 1.0])
    assert comparing._across(was, np.array([0.0, 0.5, 1.0]), eye) == pytest.approx(0.0)
    assert comparing._across(was, np.array([0.1, 0.5, 1.0]), eye) == pytest.approx(0.1)
    assert comparing._across(was, np.array([0.0, 0.5, 1.0]), None) == pytest.approx(0.5)


def test_costs_that_disagree_are_reported(fitted):
    controller, _ = fitted
    for before_px, after_px, views_before, views_after, words in [
        (5.0, 5.4, (5.0, 5.0), (5.4, 5.4), "raised the cost from 5.00 to 5.40 px; undo it"),
        (5.0, 4.6, (5.0, 5.0), (6.0, 3.2), "raised that of FRONT from 5.00 to 6.00"),
        (5.0, 4.6, (5.0, 5.0), (5.2, 4.0), ""),
        (5.0, 4.6, (1.0, None), (1.25, 5.0), ""),  # a large share of little
        (None, None, (), (), ""),
    ]:
        noted = replace(
            controller.state.compared,
            before_px=before_px, after_px=after_px,
            before_view_costs_px=views_before, after_view_costs_px=views_after,
        )  # fmt: skip
        warning = comparing._warning(controller.session_state, noted, {})
        assert (words in warning) if words else warning == ""
    place = tuple(pixel_of(controller, "right_wrist"))
    controller.pinning.begin(PAGE, 0, 0, 0, "right_wrist", place, live=False)
    controller.pinning.end(PAGE)
    controller.held_points.set(0, None, held=False)
    for after_px, words in ((5.4, ""), (6.0, "pins and edges disagree")):  # pins may raise the cost a little
        costs = {"before_view_costs_px": (), "after_view_costs_px": ()}
        noted = replace(controller.state.comparison, before_px=5.0, after_px=after_px, **costs)
        warning = comparing._warning(controller.session_state, noted, {0: {}})
        assert (words in warning) if words else warning == ""


def test_a_limb_that_nobody_touched_is_named_drawn_and_taken_back_alone(controller):
    session_state, model = controller.session_state, controller.models[0]
    bent = np.array(controller.state.poses[0])
    bent[model.value_names.index("right_shoulder.abduction")] += 0.2
    session_state.show_pose(0, bent)
    for point in ("left_wrist", "left_ankle"):
        drag(controller, point, (2.0, 0.0))
    before = controller.state.people
    arm, leg = (next(x for x in limbs(model) if x.name.startswith(name)) for name in ("right_forearm", "left_calf"))
    after = np.array(before[0].values)
    for name in ("right_shoulder.abduction", "right_shoulder.elevation", "left_hip.abduction", "right_hip.elevation"):
        after[model.value_names.index(name)] += 0.02 if name.startswith("right_hip") else 0.5
    session_state.set(people=session_state.people_with_pose(0, after))
    comparing.note_comparison(session_state, "fit", before, session_state.costs((after,)), [0])
    session_state.save("fit", "fitted", None, 0)
    # The left leg was touched, and the right one hardly moved.
    ((person, move),) = controller.state.compared.moved
    assert (person, move.limb.name) == (0, "right_forearm")
    was, now = model.points_world(before[0].values), model.points_world(after)
    i = model.point_names.index("right_wrist")
    comparing.note_comparison(session_state, "search", before, session_state.costs((after,)), [0])
    assert controller.state.compared.moved == ()
    comparing.note_comparison(session_state, "fit", before, session_state.costs((after,)), [0])
    assert move.distance_m == pytest.approx(np.linalg.norm(now[i] - was[i]), abs=0.001)
    lines = former_limb_lines(controller.session, controller.state, CONTOURS)
    assert {line.camera for line in lines if len(line.segments_px)} == {0, 1, 2, 3}
    u, v = controller.session.cameras[0].camera.pinhole.project(was[i])
    first = next(line for line in lines if line.camera == 0).segments_px
    assert np.hypot(first[:, 0] - u, first[:, 1] - v).min() < 15

    controller.pinning.take_limb_back(0)
    back = controller.state.poses[0]
    of_arm = np.isin(model.value_names, np.array(model.dof_names)[arm.dofs])
    np.testing.assert_array_equal(back[of_arm], before[0].values[of_arm])
    np.testing.assert_array_equal(back[~of_arm], after[~of_arm])
    assert leg.dofs.any()
    assert controller.state.undo == "take back right arm, frame 0"
    assert controller.state.compared.moved == ()
    assert former_limb_lines(controller.session, controller.state, CONTOURS) == []
    with pytest.raises(TrackerError, match="undo takes back the whole fit"):
        controller.pinning.take_limb_back(0)


def test_all_limbs_that_nobody_touched_are_taken_back_at_once(fitted):
    controller, _ = fitted
    before, session_state = controller.state.people, controller.session_state
    after = np.array(before[0].values)
    for name in ("right_shoulder.abduction", "left_hip.abduction"):
        after[controller.models[0].value_names.index(name)] += 0.5
    session_state.set(people=session_state.people_with_pose(0, after))
    comparing.note_comparison(session_state, "fit", before, session_state.costs((after,)), [0])
    assert len(controller.state.compared.moved) == 2
    controller.pinning.take_limb_back(0, every=True)
    np.testing.assert_array_equal(controller.state.poses[0], before[0].values)
    assert controller.state.compared.moved == ()


def test_a_fit_of_one_limb_leaves_the_rest_of_the_body(fitted):
    controller, _ = fitted
    model, before = controller.models[0], controller.state.poses[0]
    pose = np.array(before)
    for name in ("right_shoulder.abduction", "left_hip.abduction"):
        pose[model.value_names.index(name)] += 0.15
    controller.session_state.show_pose(0, pose)
    controller.pinning.fit(0, 0, "right_wrist")
    after = controller.state.poses[0]
    moved = {name.split(".")[0] for name, a, b in zip(model.value_names, pose, after, strict=True) if a != b}
    assert moved
    assert moved <= {"right_shoulder", "right_elbow"}
    assert controller.state.undo == "fit right arm to edges, frame 0"
    assert controller.state.compared.after_px < controller.state.compared.before_px
