"""Errors of a stored pose are shown with it, and with nothing else: not after an edit, not on another frame."""

import numpy as np
import pytest
from gestures import PAGE, drag, grab
from page_visits import visiting

from tracker.session.store.records import PoseChange, PoseRecord

TRACKED, PLAIN = 3, 5
SIGMA_M = 0.04


def store_tracked(controller, names):
    """Store tracked poses of some people on two frames, with errors on the first of them."""
    session_state, changes = controller.session_state, []
    for i, (person, model) in enumerate(zip(controller.session.people, controller.models, strict=True)):
        errors = np.tile((1 + i) ** 2 * SIGMA_M**2 / 3 * np.eye(3), (len(model.point_names), 1, 1))
        values, revision = controller.state.poses[i], session_state.saver.revisions.current(i)
        for frame, known in ((TRACKED, errors), (PLAIN, None)):
            record = PoseRecord(values, ("tracked",) * len(values), revision, status="good", errors=known)
            changes += [PoseChange(person.name, frame, record)] if person.name in names else []
    session_state.saver.write("track", changes, None, by_program=True)
    session_state.show_frame(frame=TRACKED)
    return controller


@pytest.fixture
def tracked(opened):
    return store_tracked(opened(), ["person"])


def shown_error(controller, person=0):
    """The largest expected error of a person's points, metres; None if none is known."""
    found = controller.state.people[person].expected_errors_m
    assert len(found) in (0, len(controller.models[person].point_names))
    return None if not len(found) else pytest.approx(float(found.max()), rel=1e-4)


def test_they_are_those_of_the_shown_frame(tracked, opened):
    assert shown_error(tracked) == SIGMA_M
    tracked.navigation.seek(PLAIN)
    assert shown_error(tracked) is None
    tracked.navigation.seek(TRACKED)
    assert shown_error(tracked) == SIGMA_M
    tracked.navigation.seek(TRACKED + 1)  # a draft: the pose of the nearest frame
    assert tracked.state.people[0].source is None
    assert shown_error(tracked) is None
    again = opened()
    again.navigation.seek(TRACKED)
    assert shown_error(again) == SIGMA_M


def test_a_pose_changed_by_hand_has_none_until_it_is_undone(tracked):
    start = grab(tracked, "left_wrist")
    tracked.dragging.move(PAGE, tuple(start + 9), 1)
    assert shown_error(tracked) is None
    tracked.dragging.cancel(PAGE)
    assert shown_error(tracked) == SIGMA_M
    drag(tracked, "left_wrist", (9.0, 0.0))
    assert shown_error(tracked) is None
    tracked.navigation.seek(PLAIN)
    tracked.navigation.seek(TRACKED)
    assert shown_error(tracked) is None
    tracked.history.undo()
    assert shown_error(tracked) == SIGMA_M
    tracked.history.redo()
    assert shown_error(tracked) is None


def test_a_mark_leaves_them(tracked):
    tracked.ranges.toggle_keyframe()
    assert tracked.stored_poses.timeline()[TRACKED]["keyframe"]
    assert shown_error(tracked) == SIGMA_M


def test_an_edit_of_one_person_leaves_those_of_another(couple):
    store_tracked(couple, ["ann", "bob"])
    drag(couple, "left_wrist", (9.0, 0.0), person=1)
    assert [shown_error(couple, i) for i in (0, 1)] == [SIGMA_M, None]
    couple.navigation.seek(PLAIN)
    couple.navigation.seek(TRACKED)
    assert [shown_error(couple, i) for i in (0, 1)] == [SIGMA_M, None]


async def test_a_page_is_told_those_of_the_person_worked_on_and_their_ellipses_follow(couple):
    store_tracked(couple, ["ann", "bob"])
    async with visiting(couple) as page:
        await page.shows("errors", "joints")
        for person, error_m in ((0, SIGMA_M), (1, 2 * SIGMA_M)):
            await page.send("select", person=person, point=None)
            state = await page.hear("state", lambda m: m["person"] == person)  # noqa: B023
            assert state["expected_errors_m"] == [error_m] * len(couple.models[person].point_names)
            overlay = await page.hear("overlay", lambda m: "error" in {p["kind"] for p in m["paths"]})
            assert {(p["person"], p["kind"]) for p in overlay["paths"]} == {(person, "error")}
        await page.send("seek", frame=PLAIN)
        assert (await page.hear("state", lambda m: m["frame"] == PLAIN))["expected_errors_m"] == []
        assert (await page.hear("overlay", lambda m: m["frame"] == PLAIN))["paths"] == []
