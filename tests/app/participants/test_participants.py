"""People on one session: each has a frame and an undo of their own, edits of one pose are taken in turn."""

import re
import threading
import time

import numpy as np
import pytest
from gestures import FRONT, drag, drag_on, pixel_of, start_run, wait_for

from app.participants.participants import Participants
from app.storage.edit_claims import EditClaimError
from tracker.annotation.frame_choice import FrameChoice
from tracker.errors import TrackerError


def shown(controller):
    return controller.state.poses[0].tolist()


def test_each_has_a_frame_and_a_selection_of_their_own(anna, ben):
    anna.navigation.seek(3)
    ben.navigation.seek(7)
    ben.navigation.select(0, "head")
    assert (anna.state.frame, ben.state.frame) == (3, 7)
    assert (anna.state.point, ben.state.point) == (None, "head")


def test_a_newcomer_on_a_frame_with_evidence_sees_its_cost(anna, ben):
    assert ben.state.cost_px == anna.state.cost_px is not None


def test_others_see_an_edit_on_the_frame_that_they_look_at(anna, ben):
    ben.navigation.seek(3)
    ben.navigation.select(0, "head")
    anna.navigation.seek(3)
    before = shown(ben)
    drag(anna, "torso", (9.0, 0.0))
    assert shown(ben) == shown(anna) != before
    assert (ben.state.frame, ben.state.point, ben.state.saved) == (3, "head", True)
    assert ben.state.people[0].source == "manual"
    assert 3 in ben.stored_poses.timeline(1)


def test_an_edit_elsewhere_leaves_the_shown_pose_as_the_same_object(anna, ben):
    drag(ben, "torso", (4.0, 0.0))
    values = ben.state.people[0].values
    drag_on(anna, 3, "torso", (9.0, 0.0))
    assert ben.state.people[0].values is values, "nothing is drawn again"


def test_a_pose_is_edited_in_turn(anna, ben):
    start = tuple(pixel_of(anna, "torso"))
    anna.dragging.begin(1, FRONT, 0, "torso", start)
    with pytest.raises(EditClaimError, match="anna drags on frame 0"):
        ben.dragging.begin(2, FRONT, 0, "torso", start)
    with pytest.raises(EditClaimError, match="anna drags"):
        ben.pose_edits.turn(0, [0], 0.1, 0)
    assert ben.state.saved
    drag_on(ben, 1, "torso", (5.0, 0.0))  # another frame is free
    anna.dragging.move(1, (start[0] + 8, start[1]), 1)
    anna.dragging.end(1)
    drag_on(ben, 0, "torso", (5.0, 0.0))
    assert shown(anna) == shown(ben)


def test_both_drag_at_once_on_frames_of_their_own(anna, ben):
    """A drag that lasts adds to its entry although the other has stored one meanwhile; each entry is undone whole."""
    ben.navigation.seek(1)
    starts = {}
    for page, who in enumerate((anna, ben)):
        starts[page] = pixel_of(who, "torso")
        who.dragging.begin(page, FRONT, 0, "torso", tuple(starts[page]))
    for step in range(1, 5):
        for page, who in enumerate((anna, ben)):
            who.session_state.last_save = 0.0  # a checkpoint at every move
            who.dragging.move(page, tuple(starts[page] + (3.0 * step, 0.0)), step)
    for page, who in enumerate((anna, ben)):
        who.dragging.end(page)
    labels = [e.label for e in anna.history.entries(9)]
    assert labels == ["drag torso, frame 1", "drag torso, frame 0"]
    anna.history.undo()
    assert anna.stored_poses.rows(0)[0] == [1]
    assert (anna.state.frame, ben.state.frame) == (0, 1)


def test_undo_is_of_ones_own(anna, ben):
    drag(anna, "torso", (4.0, 0.0))
    drag_on(ben, 1, "torso", (5.0, 0.0))
    assert (anna.state.undo, ben.state.undo) == ("drag torso, frame 0", "drag torso, frame 1")
    anna.history.undo()
    assert anna.stored_poses.rows(0)[0] == [1]
    assert (anna.state.undo, anna.state.redo) == (None, "drag torso, frame 0")
    drag(ben, "torso", (5.0, 0.0))
    anna.history.redo()  # an edit of somebody else does not end it
    assert anna.stored_poses.rows(0)[0] == [0, 1]
    with pytest.raises(TrackerError, match="one by one"):
        anna.history.go_to(None)


def test_a_restart_knows_that_several_have_worked(people, opened):
    anna, ben = people.host, people.join("annotate", "ben").controller
    drag(anna, "torso", (4.0, 0.0))
    drag(ben, "torso", (4.0, 0.0))
    drag_on(ben, 1, "torso", (5.0, 0.0))
    people.close()
    again = opened()
    again.session_state.saver.moves._author = "anna"
    again.history.redo()
    with pytest.raises(TrackerError, match="ben changed it since"):
        again.history.undo()
    assert again.stored_poses.rows(0)[0] == [0, 1]


def test_alone_again_ones_own_entries_are_gone_along(people):
    anna, ben = people.host, people.join("annotate", "ben").controller
    drag(ben, "torso", (4.0, 0.0))
    first = anna.history.entries(1)[0].edit
    for frame in (1, 2):
        drag_on(anna, frame, "torso", (5.0, 0.0))
    last = anna.history.entries(1)[0].edit
    anna.history.go_to(first)
    assert anna.stored_poses.rows(0)[0] == [0]
    anna.history.go_to(last)
    assert anna.stored_poses.rows(0)[0] == [0, 1, 2]


def test_undo_waits_for_a_drag_of_the_same_pose(anna, ben):
    drag(ben, "torso", (4.0, 0.0))
    anna.dragging.begin(1, FRONT, 0, "torso", tuple(pixel_of(anna, "torso")))
    with pytest.raises(EditClaimError, match="anna drags"):
        ben.history.undo()
    anna.dragging.cancel(1)
    ben.history.undo()
    assert anna.stored_poses.rows(0)[0] == []


def test_alone_the_host_undoes_whatever_the_history_holds(people):
    drag(people.host, "torso", (4.0, 0.0))
    people.join("look", "rita")
    assert people.host.history.entries(1)
    people.host.history.go_to(None)
    assert people.host.stored_poses.rows(0)[0] == []


def test_a_canceled_drag_takes_back_its_checkpoints_only(anna, ben):
    ben.navigation.seek(1)
    start = pixel_of(anna, "torso")
    anna.dragging.begin(1, FRONT, 0, "torso", tuple(start))
    anna.session_state.last_save = 0.0
    anna.dragging.move(1, (start[0] + 6.0, start[1]), 1)
    drag(ben, "torso", (5.0, 0.0))
    anna.dragging.cancel(1)
    assert anna.stored_poses.rows(0)[0] == [1]


def test_a_link_without_a_name_watches_the_host(people):
    visit = people.join("review")
    assert (visit.controller, visit.role, visit.has_place, visit.link) == (people.host, "look", False, "review")
    assert people.present() == ()


def test_the_host_has_no_name_twice(people):
    assert people.join("host", "Anna").controller is people.host
    assert "nobody else has" in people.join("review", "ANNA").refusal
    second = people.join("host", "Anna's second tab")
    assert (second.role, second.controller is people.host) == ("annotate", False)


@pytest.mark.parametrize("name", ["\u0430nna", "\u0391nna", "ANN\u0410", "ann\u0251"])
def test_nobody_looks_like_the_host(people, name):
    for role in ("host", "annotate", "review"):
        assert "nobody else has, found anna" in people.join(role, name).refusal


def test_names_that_look_alike_are_two_people_of_whom_one_joins(people):
    first = people.join("annotate", "Marnie")
    second = people.join("annotate", "MARNIE")
    assert second.controller is first.controller
    assert "found Marnie, which looks alike" in people.join("annotate", "Mamie").refusal
    assert people.join("annotate", "Mandy").has_place
    people.leave(first)
    people.leave(second)
    assert people.join("annotate", "Mamie").name == "Mamie"


@pytest.mark.parametrize(
    "name", ["Zoe\u0301", "Nguy\u1ec5n", "\u674e", "\u0645\u0631\u06cc\u0645", "\uac00\ub098", "ben \U0001f642"]
)
def test_names_of_any_script_are_joined_by(people, name):
    assert people.join("annotate", name).has_place


@pytest.mark.parametrize(
    "name",
    ["ben\ufe0f", "ben\U000e0100", "b\u034fen", "b\u200den", "\u3164", "\uffa0", "\u115f", "\u2800", "ben\u2800"],
)
def test_invisible_characters_are_no_part_of_a_name(people, name):
    assert re.search(r"found U\+[0-9A-F]{4,5} in it", people.join("annotate", name).refusal)


@pytest.mark.parametrize(
    "name", ["n" + 60 * "\u0301", "be\u0330\u0331\u0332\u0333\u0334n", "\u0301ben", "...", "\U0001f642"]
)
def test_marks_without_a_letter_are_no_name(people, name):
    assert people.join("annotate", name).refusal


@pytest.mark.parametrize("name", ["x" * 61, "a\u202eb", "a\x00b", "\ud800"])
def test_a_name_that_cannot_be_shown_is_refused(people, name):
    visit = people.join("annotate", name)
    assert visit.refusal
    assert (visit.role, visit.has_place) == ("look", False)


def test_a_name_is_found_again_in_other_spaces_and_forms(people):
    one, other = people.join("review", " Zoe\u0308  Q "), people.join("review", "Zo\u00eb Q")
    assert one.controller is other.controller
    assert one.name == "Zo\u00eb Q"


def test_a_place_outlives_the_page_and_the_controller(opened):
    people = Participants(opened(), absent_s=0.05)
    visit = people.join("annotate", "ben")
    visit.controller.navigation.seek(5)
    n_threads = threading.active_count()
    people.leave(visit)
    wait_for(lambda: not people._others)
    wait_for(lambda: threading.active_count() < n_threads)
    assert people.join("annotate", "ben").controller.state.frame == 5
    people.close()


def test_present_participants_are_not_dropped(opened):
    people = Participants(opened(), absent_s=0.05)
    first, second = people.join("annotate", "ben"), people.join("annotate", "ben")
    people.leave(first)
    time.sleep(0.15)
    assert people.join("annotate", "ben").controller is second.controller
    people.close()


def test_the_number_of_people_is_bounded(people, monkeypatch):
    monkeypatch.setattr("app.participants.participants._MAX_PEOPLE", 2)
    first, _ = people.join("look", "a"), people.join("look", "b")
    assert "at most 2" in people.join("look", "c").refusal
    people.leave(first)
    assert people.join("look", "c").has_place


def test_others_see_who_is_where(people):
    changes = []
    people.subscribe(lambda: changes.append(people.present()))
    people.join("host")
    ben = people.join("annotate", "ben")
    ben.controller.navigation.seek(4)
    assert [(p.name, p.frame, p.doing) for p in people.present()] == [("anna", 0, ""), ("ben", 4, "")]
    ben.controller.dragging.begin(1, FRONT, 0, "torso", tuple(pixel_of(ben.controller, "torso")))
    assert people.present()[1].doing == "drags on frame 4"
    ben.controller.dragging.end(1)
    people.leave(ben)
    assert len(people.present()) == 1
    assert len(changes) >= 5


def test_a_reviewer_decides_under_their_own_name(people):
    host = people.host
    drag(host, "torso", (4.0, 0.0))
    host.annotating.plan(*_every_frame())
    rita = people.join("review", "rita").controller
    rita.annotating.verify(0, 0)
    (task,) = [t for t in rita.state.annotation.tasks if t.row.frame == 0]
    assert (task.state, task.by) == ("verified", "rita")
    assert host.state.annotation.tasks == rita.state.annotation.tasks
    assert rita.state.annotation.author == "rita"


def _every_frame():
    from tracker.annotation.frame_choice import FrameChoice

    return FrameChoice(every=1), None, [], False


def test_bodies_of_the_host_are_taken_over(anna, ben):
    drag(ben, "torso", (4.0, 0.0))
    ben.navigation.seek(2)
    height = anna.models[0].height_m
    ben.dragging.begin(1, FRONT, 0, "torso", tuple(pixel_of(ben, "torso")))
    anna.body_sizes.set_height(0, height + 0.1)
    with pytest.raises(EditClaimError, match="ben drags"):
        anna.body_sizes.apply(0, refit=False)
    ben.dragging.end(1)
    anna.body_sizes.apply(0, refit=False)
    ben.navigation.seek(5)
    assert ben.models[0].height_m == pytest.approx(height + 0.1)
    drag(ben, "torso", (4.0, 0.0))
    anna.navigation.seek(5)
    assert np.array_equal(anna.state.poses[0], ben.state.poses[0])


def test_a_run_of_one_leaves_the_others_to_other_frames(anna, ben, tracker):
    start_run(anna)
    ben.navigation.seek(4)
    with pytest.raises(EditClaimError, match="tracks frames 3 to 6"):
        drag(ben, "torso", (4.0, 0.0))
    drag_on(ben, 9, "torso", (4.0, 0.0))
    with pytest.raises(EditClaimError, match="tracks frames"):
        ben.ranges.track(2, 8, backward=False)
    tracker.let_go(1000)
    wait_for(lambda: not anna.tracking.running)
    ben.navigation.seek(4)
    assert ben.state.people[0].source == "tracked"
    ben.history.undo()
    assert anna.stored_poses.rows(0)[0] == [2, 3, 4, 5, 6]


@pytest.mark.slow
def test_a_verdict_on_a_pose_that_somebody_has_changed_since_is_refused(anna, ben):
    anna.annotating.plan(FrameChoice(frames="0"), None, [], each=False)
    drag(anna, "torso", (9.0, 0.0))
    wait_for(lambda: ben.state.annotation.tasks[0].state == "annotated")
    seen = ben.state.annotation.tasks[0].pose
    drag(anna, "torso", (-9.0, 0.0))
    wait_for(lambda: ben.state.annotation.tasks[0].pose != seen)
    undo = anna.state.undo
    for decide in (lambda: ben.annotating.verify(0, 0, seen), lambda: ben.annotating.reject(0, 0, "elbow", seen)):
        with pytest.raises(TrackerError, match="found another one by anna; look at it"):
            decide()
    assert (ben.state.annotation.tasks[0].state, anna.state.undo) == ("annotated", undo)
    anna.annotating.verify(0, 0, seen)  # her own work of a moment ago
    assert anna.state.annotation.tasks[0].state == "verified"
