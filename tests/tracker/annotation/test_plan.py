"""Tasks with their states, comments, and the choice of frames."""

import pytest
from annotated_copies import new_store, pose

from tracker.annotation.frame_choice import dealt, diverse_frames, doubted_frames
from tracker.annotation.plan import (
    add_comment,
    add_tasks,
    count_states,
    decide,
    read_comments,
    read_tasks,
    resolve_comment,
)
from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.formats.model_toml import load_model
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import AssessmentChange, MarkChange, PoseChange, PoseRecord
from tracker.session.store.stored_poses import StoredPose


@pytest.fixture
def store(tmp_path):
    """A store with tasks of anybody on frames 0 to 2, and of anna and ben on frame 5."""
    store = new_store(tmp_path / "annotations.sqlite")
    add_tasks(store, [("ann", 5, "anna"), ("ann", 5, "ben")])
    yield store
    store.close()


def state(store, frame, annotator=""):
    (task,) = [t for t in read_tasks(store) if (t.row.frame, t.row.annotator) == (frame, annotator)]
    return task.state, task.by


def drag(store, frame, x=1, author="anna", keyframe=True):
    store.commit("Drag", [PoseChange("ann", frame, pose(x, keyframe=keyframe))], author=author)


def test_a_keyframe_annotates_a_frame_and_undo_takes_that_back(store):
    assert state(store, 1) == ("draft", "")
    drag(store, 1, keyframe=False)
    assert state(store, 1) == ("draft", "")
    drag(store, 1)
    assert state(store, 1) == ("annotated", "anna")
    store.undo()
    assert state(store, 1) == ("draft", "")
    store.commit("Mark", [MarkChange("ann", 1, keyframe=True, reviewed=True)], author="ben")
    assert state(store, 1) == ("annotated", "ben")


def test_each_annotator_has_a_task_of_the_same_frame(store):
    drag(store, 5, author="anna")
    assert (state(store, 5, "anna"), state(store, 5, "ben")) == (("annotated", "anna"), ("draft", ""))


def test_a_verified_pose_that_changes_is_to_be_verified_again(store, monkeypatch):
    monkeypatch.setenv("QUADRILLE_ANNOTATOR", "rita")
    drag(store, 1)
    assert decide(store, ("ann", 1), "verified") == 1
    assert state(store, 1) == ("verified", "rita")
    values = store.pose("ann", 1).values
    store.commit("audit", [AssessmentChange("ann", 1, values, "good", "", (), None)], by_program=True)
    assert state(store, 1) == ("verified", "rita")  # assessed, not changed
    drag(store, 1, 2)
    assert state(store, 1) == ("annotated", "anna")


def test_a_verdict_is_on_one_pose_alone(store):
    drag(store, 1, 1)
    decide(store, ("ann", 1), "rejected", "elbow")
    drag(store, 1, 2)
    decide(store, ("ann", 1), "verified", author="rita")
    assert store.tasks.verifications()["ann", 1].author == "rita"
    store.undo()  # the rejected pose, which is older than the verdict on the other
    assert state(store, 1)[0] == "rejected"
    assert store.tasks.verifications() == {}
    store.redo()
    assert state(store, 1) == ("verified", "rita")
    assert store.tasks.verifications()["ann", 1].author == "rita"


def test_a_verified_pose_that_comes_back_is_verified_again_by_the_verdict_on_it(store):
    for x, reviewer in ((1, "rita"), (2, "tom")):
        drag(store, 1, x)
        decide(store, ("ann", 1), "verified", author=reviewer)
    store.undo()
    assert state(store, 1) == ("verified", "rita")
    assert store.tasks.verifications()["ann", 1].author == "rita"
    decide(store, ("ann", 1), "rejected", "elbow")
    assert (state(store, 1)[0], store.tasks.verifications()) == ("rejected", {})


def test_a_gesture_that_goes_on_after_the_verdict_is_to_be_verified_again(store):
    edit = store.commit("Drag", [PoseChange("ann", 1, pose(1, keyframe=True))], author="anna").edit
    decide(store, ("ann", 1), "verified")
    store.amend(edit, [PoseChange("ann", 1, pose(2, keyframe=True))])
    assert state(store, 1) == ("annotated", "anna")
    assert store.tasks.verifications() == {}


@pytest.mark.parametrize("in_tree", [True, False])
def test_an_annotation_that_is_taken_back_is_none(store, in_tree):
    drag(store, 5, 1, author="ben")
    drag(store, 5, 2, author="anna")
    assert state(store, 5, "anna") == ("annotated", "anna")
    store.undo_own("anna", in_tree=in_tree)
    assert (state(store, 5, "anna"), state(store, 5, "ben")) == (("draft", ""), ("annotated", "ben"))
    store.redo_own("anna", in_tree=in_tree)
    assert state(store, 5, "anna") == ("annotated", "anna")


def test_a_tracked_pose_that_is_verified_is_reviewed(store):
    drag(store, 1, keyframe=False, author="")
    decide(store, ("ann", 1), "verified")
    assert store.pose("ann", 1).reviewed
    assert not store.pose("ann", 1).keyframe
    assert state(store, 1)[0] == "verified"


def test_a_rejected_pose_is_a_task_until_its_annotator_changes_it(store):
    drag(store, 1)
    decide(store, ("ann", 1), "rejected", "elbow")
    (task,) = [t for t in read_tasks(store) if t.row.frame == 1]
    assert (task.state, task.comment) == ("rejected", "elbow")
    drag(store, 1, 2)
    (task,) = [t for t in read_tasks(store) if t.row.frame == 1]
    assert (task.state, task.comment) == ("annotated", "")


def test_a_task_is_withdrawn_and_planned_again(store):
    decide(store, ("ann", 5), "withdrawn", of="ben")
    assert state(store, 5, "ben")[0] == "withdrawn"
    assert count_states(read_tasks(store)) == {"draft": 4, "annotated": 0, "verified": 0, "rejected": 0, "total": 4}
    assert add_tasks(store, [("ann", 5, "ben"), ("ann", 5, "anna")]) == 1
    assert state(store, 5, "ben")[0] == "draft"


def test_there_is_nothing_to_decide_without_a_task_or_to_verify_without_a_pose(store):
    with pytest.raises(TrackerError, match="expected a task of ann in frame 9, found none"):
        decide(store, ("ann", 9), "rejected", "x")
    with pytest.raises(TrackerError, match="expected a pose of ann in frame 1 to verify, found none"):
        decide(store, ("ann", 1), "verified")


def test_comments_are_resolved_and_opened_again(store, monkeypatch):
    monkeypatch.setenv("QUADRILLE_ANNOTATOR", "rita")
    uid = add_comment(store, ("ann", 1), " wrist too high ", "left_forearm")
    add_comment(store, ("ann", 1), "other")
    assert [(c.row.text, c.row.limb, c.row.author, c.resolved) for c in read_comments(store)] == [
        ("wrist too high", "left_forearm", "rita", False), ("other", "", "rita", False),
    ]  # fmt: skip
    resolve_comment(store, uid[:12])
    assert [(c.resolved, c.resolved_by) for c in read_comments(store)] == [(True, "rita"), (False, "")]
    resolve_comment(store, uid, resolved=False)
    assert [c.resolved for c in read_comments(store)] == [False, False]
    with pytest.raises(TrackerError, match="found 0 that begin with 'x'"):
        resolve_comment(store, "x")
    with pytest.raises(TrackerError, match="expected a comment, found an empty text"):
        add_comment(store, ("ann", 1), " ")


def test_the_plan_survives_and_is_checked(store, tmp_path):
    store.close()
    again = AnnotationStore(tmp_path / "annotations.sqlite")
    assert len(read_tasks(again)) == 5
    again.close()


def test_frames_are_dealt_out_in_turns_or_all_to_each():
    assert dealt([0, 5, 9], [], each=False) == [(0, ""), (5, ""), (9, "")]
    assert dealt([0, 5, 9], ["a", "b"], each=False) == [(0, "a"), (5, "b"), (9, "a")]
    assert dealt([0, 5], ["a", "b"], each=True) == [(0, "a"), (5, "a"), (0, "b"), (5, "b")]


def test_diverse_poses_differ_in_posture_not_in_place():
    model = load_model("gavrila22", 1.7)
    bent = model.neutral()
    bent[-1] = bent[-1] + 1.0

    def stored(values, status="good"):
        record = PoseRecord(values, ("tracked",) * len(values), 1, status=status)
        return StoredPose(PosedBody(model, values), record)

    elsewhere = model.neutral()
    elsewhere[:2] += 3.0
    poses = {0: stored(model.neutral()), 1: stored(elsewhere, "lost"), 2: stored(bent), 3: stored(model.neutral())}
    chosen = diverse_frames(poses, 2)
    assert len(chosen) == 2
    assert 2 in chosen
    assert doubted_frames(poses) == [1]
    assert diverse_frames({}, 2) == []
