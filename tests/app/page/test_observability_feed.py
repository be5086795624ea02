"""Which page receives how well the views constrain the shown pose, and when."""

from dataclasses import replace

from app.page.feeds.observability import LAYER, ObservabilityFeed, observability
from app.state.page_view import View

SHOWN, HIDDEN = View(frozenset({"joints", LAYER}), (1.0,)), View(frozenset({"joints"}), (1.0,))


def test_only_a_page_that_shows_the_layer_receives_it_and_once_for_a_pose(controller):
    feed, state = ObservabilityFeed(), controller.state
    assert not feed.is_due(state, None)
    assert not feed.is_due(state, HIDDEN)
    assert feed.is_due(state, SHOWN)
    (message,) = feed.updates(controller, state)
    assert (message.frame, message.person) == (state.frame, state.person)
    assert not feed.is_due(state, SHOWN)
    moved = replace(state, people=tuple(replace(p, values=p.values + 0.1) for p in state.people))
    assert feed.is_due(moved, SHOWN)
    assert not feed.is_due(state, HIDDEN)
    assert feed.is_due(state, SHOWN)  # a layer that is shown again


def test_corrected_cameras_have_other_figures(controller):
    feed, state = ObservabilityFeed(), controller.state
    feed.updates(controller, state)
    assert feed.is_due(replace(state, calibration=replace(state.calibration, n_changes=1)), SHOWN)


def test_not_during_a_search_nor_before_contours_can_be_traced(controller):
    feed, state = ObservabilityFeed(), controller.state
    assert not feed.is_due(replace(state, search=replace(state.search, running=True)), SHOWN)
    assert not feed.is_due(replace(state, compiled=frozenset()), SHOWN)


def test_levels_follow_the_standard_deviations(controller):
    found = observability(controller.session, controller.state).dofs
    model = controller.state.models[0]
    assert len(found) == model.n_dofs
    twist = found[model.dof_names.index("left_shoulder.twist")]
    assert twist.level == "unknown"  # the arms hang straight
    assert twist.sentence == "twist of the left shoulder: not observable while the left elbow is straight"
    assert {d.level for d in found} >= {"unknown", "weak"}
    for dof in found:
        assert (dof.level == "unknown") == ("not observable" in dof.sentence)
