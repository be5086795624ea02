"""Sizes edited by hand: a draft, a new revision of the body, keyframes refitted or kept, undo, restart, wrong input."""

import numpy as np
import pytest
from gestures import PAGE, drag, drag_on, pixel_of

from app.messages import encoding
from app.state.page_view import View
from tracker.body.dimensions import STATED_HEIGHT_SIGMA, PartDimensions, dimensions_of
from tracker.errors import TrackerError
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore

FRAMES = (0, 3)


def length(model, part="left_forearm"):
    return dimensions_of(model).parts[part].length_m


def lengthen(controller, by_m=0.01, part="left_forearm"):
    own = dimensions_of(controller.body_sizes.model(0)).parts[part]
    controller.body_sizes.set_part(0, part, PartDimensions(own.length_m + by_m, own.girths_m))


def joints(controller, frame):
    controller.navigation.seek(frame)
    return controller.models[0].points_world(controller.state.poses[0])


@pytest.fixture
def posed(controller):
    """Two keyframes, set by hand."""
    for frame in FRAMES:
        drag_on(controller, frame, "left_wrist", (6.0, -9.0))
    return controller


@pytest.mark.slow
def test_a_draft_is_drawn_and_changes_nothing(posed, session):
    before = posed.models[0]
    lengthen(posed)
    assert length(posed.body_sizes.model(0)) == pytest.approx(length(before) + 0.01)
    assert length(posed.body_sizes.model(0), "right_forearm") == pytest.approx(
        length(before) + 0.01
    )  # both sides alike
    view = View(frozenset(["contours"]), (1.0,) * 4)
    drawn = encoding.overlay(posed.session_of(posed.state), posed.state, PAGE, view, None)
    assert b'"new_sizes"' in drawn
    assert posed.models == (before,)
    posed.body_sizes.discard()
    assert posed.body_sizes.model(0) is before
    assert length(load_session(session).people[0].model) == length(before)


@pytest.mark.slow
def test_each_side_by_itself(posed):
    before = posed.models[0]
    posed.body_sizes.couple(False)
    lengthen(posed, part="right_thigh")
    assert length(posed.body_sizes.model(0), "right_thigh") == pytest.approx(length(before, "right_thigh") + 0.01)
    assert length(posed.body_sizes.model(0), "left_thigh") == pytest.approx(length(before, "left_thigh"))


def test_poses_that_keep_the_earlier_sizes_are_told(posed):
    posed.ranges.mark(FRAMES[1], FRAMES[1], "none", [0])
    lengthen(posed)
    posed.body_sizes.apply(0, refit=True)
    assert posed.state.sizes_message.startswith("Applied, 1 keyframe refitted")
    assert posed.state.sizes_message.endswith("average. 1 other pose keeps the earlier sizes until tracked again.")


@pytest.mark.slow
def test_keyframes_are_refitted_to_their_joints_as_one_edit(posed, session):
    was = {frame: joints(posed, frame) for frame in FRAMES}
    lengthen(posed)
    posed.body_sizes.apply(0, refit=True)
    assert posed.state.draft is None
    assert posed.state.sizes_message.startswith("Applied, 2 keyframes refitted, joints")
    for frame in FRAMES:
        off = np.linalg.norm(joints(posed, frame) - was[frame], axis=1)
        assert 0 < off.max() < 0.01
        assert off.mean() < 0.003
        assert posed.state.revisions == posed.state.present
        assert posed.state.people[0].source == "manual"
    assert length(posed.models[0]) == pytest.approx(length(load_session(session).people[0].model))
    assert posed.state.undo == "sizes of person, 2 keyframes refitted"


@pytest.mark.slow
def test_poses_that_are_kept_are_shown_with_their_own_body_and_marked(posed):
    old, was = posed.models[0], {frame: joints(posed, frame) for frame in FRAMES}
    lengthen(posed)
    posed.body_sizes.apply(0, refit=False)
    assert posed.session.people[0].model is not old
    for frame in FRAMES:
        np.testing.assert_array_equal(joints(posed, frame), was[frame])
        assert posed.models == (old,)
        assert encoding.state(posed.session, posed.state).other_sizes
    # A draft on a frame without a pose has the present body, its joints near those of the nearest pose.
    draft = joints(posed, 4)
    assert length(posed.models[0]) == pytest.approx(length(old) + 0.01)
    assert np.linalg.norm(draft - was[3], axis=1).max() < 0.01
    assert not encoding.state(posed.session, posed.state).other_sizes
    # An edit of a kept pose leaves it its body; refitting afterwards is a second edit.
    drag_on(posed, 3, "left_wrist", (3.0, 0.0))
    assert posed.models == (old,)
    assert posed.state.revisions != posed.state.present
    posed.body_sizes.apply(0, refit=True)
    assert posed.state.sizes_message.startswith("Applied, 2 keyframes refitted")
    assert posed.state.revisions == posed.state.present


@pytest.mark.slow
@pytest.mark.parametrize("refit", [True, False])
def test_undo_brings_the_old_body_back_also_after_a_restart(posed, opened, session, refit):
    was = {frame: joints(posed, frame) for frame in FRAMES}
    before = length(posed.models[0])
    lengthen(posed)
    posed.body_sizes.apply(0, refit=refit)
    again = opened()
    assert length(again.session.people[0].model) == pytest.approx(before + 0.01)
    again.history.undo()
    assert length(again.session.people[0].model) == pytest.approx(before)
    assert length(load_session(session).people[0].model) == pytest.approx(before)
    for frame in FRAMES:
        np.testing.assert_array_equal(joints(again, frame), was[frame])
        assert again.state.revisions == again.state.present
    again.history.redo()
    assert length(load_session(session).people[0].model) == pytest.approx(before + 0.01)
    assert opened().state.undo.startswith("sizes of person")


@pytest.mark.slow
def test_previous_sizes_are_one_click_away(posed):
    before = length(posed.models[0])
    with pytest.raises(TrackerError, match="sizes that person had before, found none"):
        posed.body_sizes.recall(0)
    lengthen(posed)
    posed.body_sizes.apply(0, refit=True)
    posed.body_sizes.recall(0)
    assert length(posed.body_sizes.model(0)) == pytest.approx(before)
    posed.body_sizes.apply(0, refit=True)
    assert length(posed.session.people[0].model) == pytest.approx(before)
    with AnnotationStore(posed.session.annotations_path, read_only=True) as store:
        assert len(store.model_revisions("person")) == 2  # the body that was there before, not a third


def test_wrong_sizes_are_refused_in_a_sentence(posed):
    with pytest.raises(TrackerError, match="enter a length of a body"):
        lengthen(posed, 9.0)
    with pytest.raises(TrackerError, match="height of 30 to 300 cm, found 0"):
        posed.body_sizes.set_height(0, 0.0)
    posed.body_sizes.set_height(0, posed.session.people[0].model.height_m)
    assert posed.body_sizes.model(0).height_sigma == STATED_HEIGHT_SIGMA  # as tall as before, but stated now
    posed.body_sizes.discard()
    with pytest.raises(TrackerError, match="distance of the hips"):
        posed.body_sizes.set_width(0, "hip", -0.1)
    assert posed.state.draft is None
    with pytest.raises(TrackerError, match="expected other sizes of person"):
        posed.body_sizes.apply(0, refit=True)


def test_tracking_goes_on_in_the_new_body(placed, tracker):
    was = joints(placed, 2)
    lengthen(placed)
    placed.body_sizes.apply(0, refit=False)
    tracker.track(placed, until=3, frames=1)
    assert placed.models == (placed.session.people[0].model,)
    assert placed.state.revisions == placed.state.present
    assert np.linalg.norm(joints(placed, 3) - was - (0.01, 0, 0), axis=1).max() < 0.01
    placed.navigation.seek(2)
    assert placed.state.revisions != placed.state.present
    assert placed.stored_poses.in_present_body(0, range(2, 4)).keys() == {2, 3}


@pytest.mark.slow
def test_a_drag_in_the_new_body_is_stored_with_it(posed):
    lengthen(posed)
    posed.body_sizes.apply(0, refit=True)
    drag(posed, "left_wrist", (5.0, 5.0))
    shown = posed.state.poses[0]
    posed.navigation.seek(0)
    posed.navigation.seek(3)
    assert posed.state.revisions == posed.state.present
    np.testing.assert_array_equal(posed.state.poses[0], shown)
    assert pixel_of(posed, "left_wrist").shape == (2,)
