"""Two poses about as good: marked, drawn dashed, taken in place of each other, undone."""

import numpy as np
import pytest

from app.drawing import overlays
from app.state.page_view import View
from tracker.errors import TrackerError
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.edit_tree import now
from tracker.session.store.records import Alternative, PoseChange, PoseRecord, new_uid
from tracker.session.store.task_log import StateRow, TaskRow

ANN, BOB = 0, 1
VIEW = View(frozenset(("contours", "alternatives")), (1, 1, 1, 1))


@pytest.fixture
def tracked(couple, session, opened):
    """On frame 0 ann and bob may be each other, or bob's arm elsewhere; on frame 1 only that; frame 2 is clear."""
    ann, bob = couple.state.poses
    lifted = bob.copy()
    lifted[couple.models[BOB].value_names.index("left_shoulder.elevation")] += 0.8
    revisions = couple.state.revisions
    with AnnotationStore(session / "annotations.sqlite") as store:

        def found(person, frame, values, *others):
            record = PoseRecord(values, ("tracked",) * len(values), revisions[person], status="doubtful", cost_px=2.0)
            kept = tuple(Alternative(pose, revisions[person], cost_px) for pose, cost_px in others)
            return PoseChange(("ann", "bob")[person], frame, record, kept)

        here = [found(ANN, 0, ann, (bob, 2.25)), found(BOB, 0, bob, (lifted, 2.1), (ann, 2.25))]
        later = [found(ANN, 1, ann), found(BOB, 1, bob, (lifted, 2.1)), found(ANN, 2, ann), found(BOB, 2, bob)]
        store.commit("track", [*here, *later], by_program=True)
    return opened(), ann, bob, lifted


def drawn(controller):
    paths = overlays.paths(controller.session, controller.state, VIEW, None)
    return {p.person for p in paths if p.kind == "alternative" and len(p.segments_px)}


def ambiguous(controller, person=None):
    return [frame for frame, cell in controller.stored_poses.timeline(0, person).items() if cell["ambiguous"]]


def test_frames_with_another_pose_are_marked_and_show_it(tracked):
    controller, *_ = tracked
    assert [ambiguous(controller, p) for p in (None, ANN, BOB)] == [[0, 1], [0], [0, 1]]
    assert [len(p.alternatives) for p in controller.state.people] == [1, 2]
    assert drawn(controller) == {ANN, BOB}
    controller.visibility.show(ANN, False)
    assert drawn(controller) == {BOB}
    controller.navigation.seek(2)
    assert drawn(controller) == set()


@pytest.mark.slow
def test_the_other_pose_is_taken_vouched_for_and_left_again(tracked):
    controller, _, bob, lifted = tracked
    controller.navigation.seek(1)
    controller.alternatives.take_alternative(ANN)  # who has none: bob is meant
    np.testing.assert_array_equal(controller.state.poses[BOB], lifted)
    assert (controller.state.people[BOB].source, controller.state.people[ANN].source) == ("manual", "tracked")
    assert controller.state.undo == "take alternative pose of bob, frame 1"
    assert controller.stored_poses.timeline(0, BOB)[1]["keyframe"]
    assert (ambiguous(controller, BOB), drawn(controller)) == ([0], set())
    controller.alternatives.take_alternative(BOB)
    np.testing.assert_array_equal(controller.state.poses[BOB], bob)
    controller.history.undo()
    controller.history.undo()
    assert (ambiguous(controller, BOB), drawn(controller)) == ([0, 1], {BOB})
    assert controller.state.people[BOB].source == "tracked"


def test_people_who_may_be_each_other_are_exchanged_together(tracked):
    controller, ann, bob, lifted = tracked
    controller.alternatives.take_alternative(ANN)
    np.testing.assert_array_equal(controller.state.poses[ANN], bob)
    np.testing.assert_array_equal(controller.state.poses[BOB], ann)
    controller.history.undo()
    controller.alternatives.take_alternative(BOB)  # whose best other pose is another arm
    np.testing.assert_array_equal(controller.state.poses[ANN], ann)
    np.testing.assert_array_equal(controller.state.poses[BOB], lifted)


@pytest.mark.slow
def test_vouching_for_a_pose_is_a_choice(tracked):
    controller, *_ = tracked
    controller.navigation.seek(1)
    controller.navigation.select(BOB, None)
    controller.ranges.toggle_keyframe()
    assert (ambiguous(controller, BOB), drawn(controller)) == ([0], set())


@pytest.mark.slow
def test_without_another_pose_there_is_nothing_to_take(tracked):
    controller, *_ = tracked
    controller.navigation.seek(2)
    with pytest.raises(TrackerError, match="expected an alternative pose on frame 2, found none"):
        controller.alternatives.take_alternative(ANN)


@pytest.mark.parametrize("is_disputed", [True, False])
def test_a_keyframe_shows_its_alternative_only_while_two_merged_copies_disagree(couple, session, opened, is_disputed):
    ann, model = couple.state.poses[ANN], couple.state.models[ANN]
    other = model.retract(ann, 0.1 * (np.arange(model.n_dofs) < 2))
    with AnnotationStore(session / "annotations.sqlite") as store:
        record = PoseRecord(ann, ("manual",) * len(ann), couple.state.revisions[ANN], keyframe=True)
        back = Alternative(other, couple.state.revisions[ANN], None)
        store.commit("Merge", [PoseChange("ann", 0, record, (back,))])
        if is_disputed:
            task = TaskRow(new_uid(), "disagreement", "ann", 0, "", "", now())
            store.tasks.add([task], [StateRow(new_uid(), task.uid, "rejected", "two poses", "", now())])
    controller = opened()
    assert [len(p.alternatives) for p in controller.state.people] == [int(is_disputed), 0]
    assert drawn(controller) == ({ANN} if is_disputed else set())
    if is_disputed:
        controller.alternatives.take_alternative(ANN)
        np.testing.assert_array_equal(controller.state.poses[ANN], other)
        assert controller.state.people[ANN].alternatives == ()  # decided
