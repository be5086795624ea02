"""Several people in the program: whom the views show, whom searches and fits move, copied poses, lanes."""

import numpy as np
import pytest
from gestures import FRONT, PAGE, drag, pixel_of, wait_for

from app.drawing import joint_handles, overlays, part_outlines, pin_marks
from app.state.page_view import View
from tracker.errors import TrackerError
from tracker.estimation.chamfer.tracker import TrackSettings
from tracker.estimation.search.best_first import SearchSettings

ANN, BOB = 0, 1
QUICK = TrackSettings(search=SearchSettings(passes=(1.0,), max_expansions=2))
ALL = View(frozenset(("contours", "hidden", "joints")), (1, 1, 1, 1))


def drawn_people(controller):
    """Whose lines are drawn, whose joints, whose parts can be taken, whose pins are there."""
    session, state = controller.session, controller.state
    drawn = (
        overlays.paths(session, state, ALL, None),
        joint_handles.handles(session, state, ALL.cameras),
        part_outlines.part_hulls(session, state, ALL),
        pin_marks.pin_marks(session, state),
    )
    return [{one.person for one in kind} for kind in drawn]


def searched(controller, person):
    controller.search.set_settings(QUICK)
    controller.search.run(person)
    wait_for(lambda: controller.state.search.message)


def test_people_whom_nobody_has_placed_stand_beside_each_other(couple):
    ann, bob = (m.points_world(p) for m, p in zip(couple.models, couple.state.poses, strict=True))
    np.testing.assert_allclose(np.linalg.norm(bob[0] - ann[0]), 0.9, atol=0.02)
    assert abs(bob[0, 2] - ann[0, 2]) < 0.01  # on the same floor
    assert pixel_of(couple, "torso", person=BOB)[0] > pixel_of(couple, "torso", person=ANN)[0] + 50


def test_a_hidden_person_is_not_drawn_and_stays(couple):
    for person in (ANN, BOB):
        couple.pinning.begin(PAGE, 0, FRONT, person, "left_wrist", (100.0, 100.0), False)
        couple.pinning.end(PAGE)
    before = couple.state
    assert drawn_people(couple) == [{ANN, BOB}] * 4
    couple.visibility.show(BOB, False)
    assert drawn_people(couple) == [{ANN}] * 4
    now = couple.state
    assert (now.people, now.undo, now.cost_px) == (before.people, before.undo, before.cost_px)
    couple.visibility.show(BOB, True)
    assert drawn_people(couple) == [{ANN, BOB}] * 4


def test_parts_hidden_by_another_person_are_dashed(couple):
    drag(couple, "torso", pixel_of(couple, "torso", person=ANN) - pixel_of(couple, "torso", person=BOB), person=BOB)

    def visible_px():
        """Length of ann's visible contours, px."""
        paths = overlays.paths(couple.session, couple.state, ALL, None)
        rows = np.concatenate([p.segments_px for p in paths if (p.person, p.kind) == (ANN, "model")])
        return np.hypot(rows[:, 2] - rows[:, 0], rows[:, 3] - rows[:, 1]).sum()

    beside = visible_px()
    couple.visibility.show(BOB, False)
    assert visible_px() == beside


def test_solo_lasts_until_it_is_taken_back(couple):
    couple.visibility.solo(True)
    couple.navigation.select(BOB, None)
    assert couple.state.visibility.solo
    couple.visibility.solo(False)
    assert not couple.state.visibility.solo


@pytest.mark.slow
@pytest.mark.parametrize("person", [ANN, BOB])
def test_one_is_searched_and_the_other_stays_a_draft(couple, person):
    before = couple.state.people
    searched(couple, person)
    run = couple.replay.runs()[-1]
    assert {stage.person for stage in run.stages} == {person}
    assert couple.state.people[1 - person] is before[1 - person]
    assert couple.state.people[person].source == "searched"
    assert set(couple.stored_poses.timeline(0, person)) == {0}
    assert couple.stored_poses.timeline(0, 1 - person) == {}


def test_a_search_of_others_takes_the_place_of_the_one_that_stands(couple):
    couple.search.set_settings(QUICK)
    for done, person in enumerate((None, ANN, ANN), 1):
        couple.search.step(person)
        wait_for(lambda n=done: sum(len(r.steps) for r in couple.replay.runs()) == n and not couple.search.running)
    first, second = couple.replay.runs()
    assert (first.over, {s.person for s in first.stages}) == (True, {ANN, BOB})
    assert (second.over, len(second.steps), {s.person for s in second.stages}) == (False, 2, {ANN})


@pytest.mark.slow
def test_a_fit_is_of_those_who_have_been_placed_or_of_one(couple):
    couple.pinning.fit(0)
    assert [p.source for p in couple.state.people] == ["fitted", None]
    couple.pinning.fit(0, BOB)
    assert [p.source for p in couple.state.people] == ["fitted", "fitted"]
    ann = couple.state.people[ANN]
    couple.pinning.begin(PAGE, 0, FRONT, ANN, "left_wrist", tuple(pixel_of(couple, "left_wrist") + 10), False)
    couple.pinning.end(PAGE)
    couple.pinning.fit(0, BOB)
    assert couple.state.people[ANN] is ann  # pinned, but not meant
    couple.pinning.fit(0)
    assert [p.source for p in couple.state.people] == ["pinned", "fitted"]


def test_a_pose_is_bent_as_the_others_and_stays_in_its_place(couple):
    model = couple.models[ANN]
    drag(couple, "left_wrist", (30.0, -40.0))
    couple.pose_edits.turn(ANN, [model.dof_names.index("torso.twist")], 0.5)
    ann, bob = couple.state.poses
    couple.pose_edits.copy_person(BOB, ANN)
    bent = couple.state.poses[BOB]
    np.testing.assert_array_equal(bent[:6], bob[:6])
    np.testing.assert_allclose(bent[6:], ann[6:])
    assert couple.state.people[BOB].source == "manual"
    assert couple.state.undo == "bob: copy the pose of ann, frame 0"
    couple.history.undo()
    assert couple.state.people[BOB].source is None
    with pytest.raises(TrackerError, match="expected another person"):
        couple.pose_edits.copy_person(BOB, BOB)


def test_each_person_has_a_lane_of_the_timeline(couple):
    version = couple.state.timeline_version
    drag(couple, "torso", (5.0, 0.0), person=BOB)
    assert couple.stored_poses.timeline(0, ANN) == {}
    assert couple.stored_poses.timeline(0, BOB)[0]["keyframe"]
    couple.navigation.seek(1)
    drag(couple, "torso", (5.0, 0.0), person=ANN)
    assert [sorted(couple.stored_poses.timeline(version, p)) for p in (None, ANN, BOB)] == [[0, 1]] * 3
    assert couple.stored_poses.timeline(version, ANN)[0] is None
    assert set(couple.stored_poses.timeline()) == {0, 1}
