"""Two copies of one store, merged."""

import pytest
from annotated_copies import ACTIONS, FRAMES, act, all_edits, copied, merged, new_store, pose, shown
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tracker.annotation.edit_union import interleave
from tracker.annotation.numbered_settings import join_numbered, numbered_settings, renumbered
from tracker.annotation.plan import decide, read_tasks
from tracker.formats.model_toml import format_model, load_model
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.calibration_log import CALIBRATION_EDITS, CALIBRATIONS, present_revision, revisions_of_poses
from tracker.session.store.edit_log import Written
from tracker.session.store.records import AssessmentChange, MarkChange, PinChange, PoseChange

STEPS = st.lists(st.tuples(st.integers(0, ACTIONS - 1), st.sampled_from(FRAMES), st.integers(0, 9)), max_size=8)


def play(path, steps):
    with AnnotationStore(path) as store:
        for step in steps:
            act(store, *step)
    return path


@pytest.mark.slow
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(before=STEPS, mine=STEPS, theirs=STEPS, later=STEPS)
def test_merging_is_commutative_and_merging_again_changes_nothing(tmp_path_factory, before, mine, theirs, later):
    folder = tmp_path_factory.mktemp("merge")
    new_store(folder / "a").close()
    play(folder / "a", before)
    copied(folder / "a", folder / "b").close()
    play(folder / "a", mine)
    play(folder / "b", theirs)
    ab, ba = merged(folder / "a", folder / "b", folder / "ab"), merged(folder / "b", folder / "a", folder / "ba")
    assert shown(ab) == shown(ba)
    assert all_edits(ab) == all_edits(ba)
    for source in ("a", "b"):
        again = merged(ab, folder / source, folder / f"again_{source}")
        assert shown(again) == shown(ab)
        assert all_edits(again) == all_edits(ab)
    edits, _ = all_edits(ab)
    assert {*edits} >= {*all_edits(folder / "a")[0], *all_edits(folder / "b")[0]}
    play(folder / "b", later)  # a copy that goes on
    once = merged(ab, folder / "b", folder / "once")
    assert shown(once) == shown(merged(folder / "b", ab, folder / "other"))
    assert shown(merged(once, folder / "b", folder / "twice")) == shown(once)


@pytest.fixture
def copies(tmp_path):
    """The stores of anna and ben, copied from one; and a function that merges them and opens the result."""
    new_store(tmp_path / "a").close()
    a, b = (copied(tmp_path / "a", tmp_path / name, name) for name in ("anna", "ben"))

    def merge():
        a.close()
        b.close()
        return AnnotationStore(merged(tmp_path / "anna", tmp_path / "ben", tmp_path / "ab"))

    return a, b, merge


def put(frame, x, **more):
    return [PoseChange("ann", frame, pose(x, **more))]


def root(store, frame):
    return round(10 * store.pose("ann", frame).values[0])


def test_a_pose_that_one_copy_changed_is_taken_also_if_it_is_older(copies):
    a, b, merge = copies
    a.commit("a", put(0, 7))
    b.commit("b", put(1, 8))
    both = merge()
    assert (root(both, 0), root(both, 1)) == (7, 8)
    assert [e.label for e in both.history()] == ["b", "a", "first"]
    assert (both.undo(), both.undo(), root(both, 0)) == ("b", "a", 100)


def test_keyframes_that_differ_are_a_task_and_both_poses_stay(copies):
    a, b, merge = copies
    a.commit("a", put(0, 7, keyframe=True))
    b.commit("b", put(0, 8, keyframe=True))
    both = merge()
    assert (root(both, 0), both.pose("ann", 0).author) == (8, "ben")
    (other,) = both.alternatives("ann", 0)
    assert round(10 * other.values[0]) == 7
    (task,) = [t for t in read_tasks(both) if t.row.kind == "disagreement"]
    assert (task.row.frame, task.state) == (0, "rejected")
    assert task.comment == "two poses, up to 100 mm apart: ben's is shown, anna's is its alternative"
    both.commit("decide", put(0, 9, keyframe=True))
    assert [t.state for t in read_tasks(both) if t.row.kind == "disagreement"] == ["annotated"]


def test_keyframes_within_the_tolerance_are_no_task(copies):
    a, b, merge = copies
    a.commit("a", put(0, 7, keyframe=True))
    b.commit("b", put(0, 7.2, keyframe=True))
    both = merge()
    assert {t.row.kind for t in read_tasks(both)} == {"plan"}
    assert both.pose("ann", 0).author == "ben"


def test_a_keyframe_goes_before_a_later_pose_of_a_program(copies):
    a, b, merge = copies
    a.commit("a", put(0, 7, keyframe=True))
    b.commit("track", put(0, 8) + put(1, 8), by_program=True)
    both = merge()
    assert (root(both, 0), both.pose("ann", 0).author, root(both, 1)) == (7, "anna", 8)
    assert {t.row.kind for t in read_tasks(both)} == {"plan"}
    assert (both.undo(), root(both, 0)) == ("Merge", 8)


def test_a_verdict_stays_with_its_pose_where_that_of_the_other_copy_is_shown(copies):
    a, b, merge = copies
    b.commit("b", put(0, 7, keyframe=True))
    decide(a, ("ann", 0), "verified", author="rita")  # a pose that is elsewhere
    both = merge()
    assert (root(both, 0), both.pose("ann", 0).author) == (7, "ben")
    states = {t.row.kind: t.state for t in read_tasks(both) if t.row.frame == 0}
    assert states == {"plan": "annotated", "disagreement": "rejected"}
    assert both.tasks.verifications() == {}


def test_a_mark_and_an_assessment_of_one_pose_are_joined(copies):
    a, b, merge = copies
    a.commit("mark", [MarkChange("ann", 0, keyframe=True, reviewed=True)])
    values = b.pose("ann", 0).values
    b.commit("audit", [AssessmentChange("ann", 0, values, "doubtful", "left arm", (), None)], by_program=True)
    found = merge().pose("ann", 0)
    assert (found.keyframe, found.reviewed, found.status, found.remark) == (True, True, "doubtful", "left arm")


def test_a_common_edit_is_undone_if_one_copy_undid_it(copies):
    a, b, merge = copies
    a.undo()
    b.commit("b", put(1, 8))
    both = merge()
    assert both.pose("ann", 0) is None
    assert root(both, 1) == 8
    assert [e.label for e in both.history()] == ["b"]


def test_an_edit_that_its_own_copy_undid_stays_undone(copies):
    a, b, merge = copies
    a.commit("a", put(1, 7))
    a.undo()
    b.commit("b", put(2, 8))
    both = merge()
    assert both.pose("ann", 1) is None
    assert root(both, 2) == 8


def test_pins_go_with_the_pose_that_is_taken(copies):
    a, b, merge = copies
    pin = [PinChange("ann", 0, "left_wrist", "cam", (1.0, 2.0))]
    a.commit("a", put(0, 7, keyframe=True) + pin)
    b.commit("b", [*put(0, 8), pin[0]._replace(position_px=(3.0, 4.0))])
    assert [p.position_px for p in merge().pins("ann", 0)] == [(1.0, 2.0)]


def test_bodies_are_matched_by_content(copies):
    a, b, merge = copies
    tall, small = (format_model(load_model("gavrila22", h)) for h in (1.9, 1.5))
    a.add_model_revision("ann", tall)
    revisions = [b.add_model_revision("ann", toml) for toml in (small, tall)]
    b.commit("b", [PoseChange("ann", 1, pose(7).__class__(pose(7).values, pose(7).sources, revisions[1]))])
    both = merge()
    assert len(both.model_revisions("ann")) == 3
    assert both.model_revision(both.pose("ann", 1).model_revision).toml == tall


def test_poses_keep_the_calibration_that_they_were_made_with(copies):
    a, b, merge = copies
    revisions = [{"toml": str(i), "clocks": {}, "time": f"2026-01-0{i}"} for i in (1, 2)]
    a.set_setting(CALIBRATIONS, revisions)
    a.commit("calibrate", [], settings=lambda edit: {CALIBRATION_EDITS: {str(edit): [1, 2]}})
    a.commit("a", put(1, 7))
    b.commit("b", put(2, 8))
    both = merge()
    assert present_revision(both) == 2
    assert revisions_of_poses(both, "ann") == {0: 1, 1: 2, 2: 1}


def test_settings_are_joined_key_by_key(copies):
    a, b, merge = copies
    a.set_setting("locked", {"ann": ["head"]})
    b.set_setting("locked", {"bob": ["neck"]})
    a.set_setting("page", 1)
    b.commit("b", put(2, 8))
    b.set_setting("page", 2)
    both = merge()
    assert both.setting("locked") == {"ann": ["head"], "bob": ["neck"]}
    assert both.setting("page") == 2


def test_settings_without_numbers_find_their_numbers_again(copies):
    a, _, _ = copies
    a.set_setting("sizes_edits", {"1": [["ann", 1, 1]]})
    found = numbered_settings(a.read_log())
    uid = a.read_log().edits[0].uid
    written = Written({uid: 41}, {("ann", a.model_revision(1).toml): 7})
    assert renumbered(join_numbered(found, found), [uid], frozenset([uid]), written) == {
        "sizes_edits": {"41": [["ann", 7, 7]]}
    }


def test_an_undo_among_other_edits_finds_its_edit_again(copies):
    a, _, _ = copies
    edit = a.commit("mine", put(2, 1), author="eve").edit
    a.commit("other", put(3, 1), author="ben")
    taker = a.undo_own("eve").edit
    found = numbered_settings(a.read_log())
    order = [e.uid for e in a.read_log().edits]
    numbers = {uid: 100 + i for i, uid in enumerate(order)}
    at = {e.edit: 100 + i for i, e in enumerate(reversed(a.history(9)))}
    again = renumbered(join_numbered(found, found), order, frozenset(order), Written(numbers, {}))
    assert again == {"taken_back": {str(at[taker]): at[edit]}}


@pytest.mark.parametrize(
    ("one", "other", "joined"),
    [
        ([1, 4], [2, 3], [1, 2, 3, 4]),
        ([9, 1], [2], [2, 9, 1]),  # each keeps its own order
        ([1, 5, 2], [5, 3], [1, 5, 2, 3]),
        ([1, 2], [2, 1], [1, 2]),  # orders that cannot both be kept
        ([], [1], [1]),
    ],
)
def test_sequences_are_interleaved(one, other, joined):
    assert interleave(one, other, lambda x: x) == joined
    assert interleave(other, one, lambda x: x) == joined
