import signal
import sqlite3
import subprocess
import sys
import textwrap
import threading
from dataclasses import fields, replace

import numpy as np
import pytest

from tracker.errors import SessionError
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import (
    Alternative,
    AssessmentChange,
    FrameRow,
    MarkChange,
    Pin,
    PinChange,
    PoseChange,
    PoseRecord,
)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "annotations.sqlite"


@pytest.fixture
def store(path):
    store = AnnotationStore(path)
    store.add_model_revision("ann", "a = 1")
    yield store
    store.close()


def pose(x, **more):
    return PoseRecord(np.array([x, 2.0, 1 / 3]), ("manual", "fitted", "tracked"), 1, **more)


def put(frame, x, person="ann", **more):
    return PoseChange(person, frame, pose(x, **more))


def xs(store, person="ann"):
    """First value of every frame that has a pose."""
    return {row.frame: store.pose(person, row.frame).values[0] for row in store.frames(person)}


def differing(one, other):
    """Names of the fields in which two poses differ, to the bit, but for those that the store fills in."""
    names = {field.name for field in fields(PoseRecord)} - {"author", "time", "program"}
    return {name for name in names if not np.array_equal(getattr(one, name), getattr(other, name))}


def test_pose_comes_back_whole(store, path):
    full = pose(
        0.1, keyframe=True, status="lost", cost_px=1.25, settings={"step_deg": 5, "tree": ["arms"]},
        view_costs_px=(0.5, None, 2.0), part_costs_px=(None, 0.25), remark="left arm relocated", reviewed=True,
        limbs_lost=(0.25, 0.9),
    )  # fmt: skip
    store.commit("Place", [PoseChange("ann", 7, full)], author="eve")
    store.close()
    back = AnnotationStore(path, read_only=True).pose("ann", 7)
    assert differing(back, full) == set()
    assert back.author == "eve"
    assert back.time.startswith("20")
    assert back.program


def test_nothing_there(store):
    assert store.pose("ann", 0) is None
    assert store.frames("ann") == []
    assert store.pins("ann", 0) == []
    assert store.undo() is None
    assert store.redo() is None
    assert store.history() == []


def test_people_have_their_own_poses(store):
    store.commit("a", [put(1, 10.0), put(1, 20.0, person="bob")])
    assert (xs(store), xs(store, "bob")) == ({1: 10.0}, {1: 20.0})


def test_frames_in_short(store):
    searched = PoseRecord(
        np.zeros(2), ("tracked", "searched"), 1, status="good", cost_px=0.5, view_costs_px=(None, 0.5),
        remark="twice", limbs_lost=(0.5,),
    )  # fmt: skip
    store.commit("a", [put(9, 1.0, keyframe=True), PoseChange("ann", 3, searched)])
    assert store.frames("ann") == [
        FrameRow(3, "searched", "good", 0.5, False, (None, 0.5), "twice", limbs_lost=(0.5,), change=2),
        FrameRow(9, "manual", "", None, True, reviewed=True, change=1),
    ]


def test_a_mark_leaves_the_pose_as_it_is(store):
    told = {"method": "chamfer"}
    put_it = put(
        3, 1.0, cost_px=0.5, status="good", settings=told, view_costs_px=(None, 0.5), part_costs_px=(2.0,), remark="x",
        limbs_lost=(0.5,),
    )  # fmt: skip
    store.commit("a", [put_it])
    before = store.pose("ann", 3)
    store.commit("verify", [MarkChange("ann", 3, keyframe=True, reviewed=True), MarkChange("ann", 4, True, True)])
    after = store.pose("ann", 3)
    assert (after.keyframe, after.reviewed) == (True, True)
    assert differing(after, before) == {"keyframe", "reviewed"}
    assert [row.frame for row in store.frames("ann")] == [3]  # where there is no pose there is nothing to mark
    assert store.frames_of(2) == [3]
    assert store.commit("track", [put(3, 9.0)], by_program=True).skipped == (("ann", 3),)
    store.undo()
    store.undo()
    assert not store.pose("ann", 3).keyframe


def first_of(alternatives):
    return [(a.values[0], a.cost_px) for a in alternatives]


def test_former_poses_are_those_of_the_edit_before(store):
    """Marks and steps within one edit do not count; undo is followed. A pose after a cleared one replaces nothing."""

    def former():
        return {frame: record.values[0] for frame, record in store.former_poses("ann", range(10)).items()}

    store.commit("one", [put(1, 10.0), put(2, 20.0)])
    assert former() == {}
    edit = store.commit("two", [put(1, 11.0)]).edit
    store.amend(edit, [put(1, 12.0), put(3, 30.0)])
    assert former() == {1: 10.0}  # not 11, a step on the way
    store.commit("mark", [MarkChange("ann", 1, True, True)])
    assert former() == {1: 10.0}
    store.commit("clear", [PoseChange("ann", 2, None)])
    store.commit("again", [put(2, 21.0)])
    assert former() == {1: 10.0}  # nothing was there to replace
    for _ in range(4):
        store.undo()
    assert former() == {}


def test_alternatives_come_and_go_with_their_pose(store, path):
    other = Alternative(np.array([7.0, 2.0, 1 / 3]), 1, 1.5)
    third = Alternative(np.array([8.0, 2.0, 1 / 3]), 1)
    store.commit("track", [PoseChange("ann", 3, pose(1.0), (other, third)), put(4, 1.0)])
    assert first_of(store.alternatives("ann", 3)) == [(7.0, 1.5), (8.0, None)]
    np.testing.assert_array_equal(store.alternatives("ann", 3)[0].values, other.values)
    assert store.alternatives("ann", 4) == store.alternatives("bob", 3) == ()
    store.commit("take the other", [PoseChange("ann", 3, pose(7.0), (Alternative(pose(1.0).values, 1, 1.4),))])
    assert first_of(store.alternatives("ann", 3)) == [(1.0, 1.4)]
    store.commit("drag", [put(3, 2.0)])
    assert store.alternatives("ann", 3) == ()
    store.undo()
    store.undo()
    assert first_of(store.alternatives("ann", 3)) == [(7.0, 1.5), (8.0, None)]
    store.close()
    assert first_of(AnnotationStore(path, read_only=True).alternatives("ann", 3)) == [(7.0, 1.5), (8.0, None)]


def test_a_marked_pose_keeps_its_alternatives(store):
    store.commit("track", [PoseChange("ann", 3, pose(1.0), (Alternative(pose(7.0).values, 1, 1.5),))])
    store.commit("review", [MarkChange("ann", 3, False, True)])
    store.commit("verify", [MarkChange("ann", 3, True, True), MarkChange("ann", 9, True, True)])
    assert first_of(store.alternatives("ann", 3)) == [(7.0, 1.5)]
    store.undo()
    assert first_of(store.alternatives("ann", 3)) == [(7.0, 1.5)]


def test_a_keyframe_that_a_program_leaves_alone_gets_no_alternatives(store):
    store.commit("hand", [put(3, 1.0, keyframe=True)])
    other = Alternative(pose(7.0).values, 1)
    store.commit("track", [PoseChange("ann", 3, pose(2.0), (other,))], by_program=True)
    assert store.alternatives("ann", 3) == ()


def test_a_new_pose_is_not_reviewed(store):
    store.commit("a", [put(3, 1.0)])
    store.commit("b", [MarkChange("ann", 3, False, True)])
    assert [row.reviewed for row in store.frames("ann")] == [True]
    store.commit("track", [put(3, 2.0)], by_program=True)
    assert [row.reviewed for row in store.frames("ann")] == [False]


def test_numbers_of_a_range(store):
    store.commit("a", [put(k, float(k), cost_px=0.5 * k, view_costs_px=(1.0, None)) for k in (1, 4, 6)])
    rows = store.frame_poses("ann", range(2, 6))
    assert [(row.frame, row.cost_px, row.view_costs_px) for row in rows] == [(4, 2.0, (1.0, None))]
    np.testing.assert_array_equal(rows[0].values, [4.0, 2.0, 1 / 3])
    assert [row.frame for row in store.frame_poses("ann", range(7))] == [1, 4, 6]


def test_a_status_is_one_of_those_known(store):
    with pytest.raises(AssertionError, match="fine"):
        store.commit("a", [put(1, 1.0, status="fine")])


def test_one_commit_is_one_undo(store):
    store.commit("first", [put(1, 1.0), put(2, 2.0)])
    store.commit("second", [put(1, 10.0), PoseChange("ann", 2, None), put(3, 30.0)])
    assert xs(store) == {1: 10.0, 3: 30.0}
    assert store.undo() == "second"
    assert xs(store) == {1: 1.0, 2: 2.0}
    assert store.undo() == "first"
    assert xs(store) == {}
    assert store.undo() is None
    assert store.redo() == "first"
    assert store.redo() == "second"
    assert xs(store) == {1: 10.0, 3: 30.0}
    assert store.redo() is None


def test_amended_edit_is_still_one_undo(store):
    store.commit("before", [put(1, 0.0)])
    edit = store.commit("drag", [put(1, 1.0)]).edit
    store.amend(edit, [put(1, 2.0)])
    store.amend(edit, [put(1, 3.0), put(2, 5.0)])
    assert xs(store) == {1: 3.0, 2: 5.0}
    assert store.undo() == "drag"
    assert xs(store) == {1: 0.0}
    assert store.redo() == "drag"
    assert xs(store) == {1: 3.0, 2: 5.0}
    assert [h.label for h in store.history()] == ["drag", "before"]


def test_amend_only_the_last_edit(store):
    edit = store.commit("drag", [put(1, 1.0)]).edit
    store.undo()
    with pytest.raises(SessionError, match="begin a new edit"):
        store.amend(edit, [put(1, 2.0)])
    store.commit("other", [put(1, 3.0)])
    with pytest.raises(SessionError, match="begin a new edit"):
        store.amend(edit, [put(1, 2.0)])
    assert xs(store) == {1: 3.0}


def test_commit_after_undo_drops_the_redo(store):
    for i in range(3):
        store.commit(str(i), [put(0, float(i))])
    store.undo()
    store.undo()
    store.commit("new", [put(0, 9.0)])
    assert store.redo() is None
    assert [(h.label, h.undone) for h in store.history()] == [("new", False), ("0", False)]
    assert store.undo() == "new"
    assert xs(store) == {0: 0.0}
    assert store.redo() == "new"
    assert xs(store) == {0: 9.0}


def test_log_keeps_what_can_no_longer_be_reached(store, path):
    store.commit("lost", [put(0, 1.0)])
    store.undo()
    store.commit("new", [put(0, 2.0)])
    db = sqlite3.connect(path)
    assert [r[0] for r in db.execute("SELECT label FROM edits ORDER BY id")] == ["lost", "new"]
    assert db.execute("SELECT count(*) FROM pose_changes").fetchone() == (2,)
    assert [r[0] for r in db.execute("SELECT kind FROM moves")] == ["undo"]


def test_history_and_undo_survive_a_restart(store, path):
    for i in range(3):
        store.commit(str(i), [put(0, float(i))])
    store.undo()
    store.close()
    again = AnnotationStore(path)
    assert [(h.label, h.undone) for h in again.history()] == [("2", True), ("1", False), ("0", False)]
    assert again.undo() == "1"
    assert xs(again) == {0: 0.0}
    assert (again.redo(), again.redo(), again.redo()) == ("1", "2", None)
    assert xs(again) == {0: 2.0}


def test_history_is_limited(store):
    for i in range(6):
        store.commit(str(i), [put(0, float(i))])
    store.undo()
    store.undo()
    store.undo()
    assert [(h.label, h.undone) for h in store.history(2)] == [("4", True), ("3", True), ("2", False), ("1", False)]


@pytest.mark.slow
def test_random_edits_match_a_list_of_states(store):
    """The store against the obvious: a list of snapshots and a cursor."""
    rng = np.random.default_rng(4)
    states, at, edit = [{}], 0, None
    for step in range(150):
        action = rng.choice(["commit", "commit", "amend", "undo", "redo"])
        if action in ("commit", "amend"):
            frames = rng.integers(0, 5, 3).tolist()
            changes = [PoseChange("ann", f, None) if rng.random() < 0.3 else put(f, float(step)) for f in frames]
            new = dict(states[at])
            for c in changes:
                new.pop(c.frame, None)
                if c.pose is not None:
                    new[c.frame] = c.pose.values[0]
            if action == "amend" and edit is not None:
                store.amend(edit, changes)
                states[at] = new
            else:
                edit = store.commit(str(step), changes).edit
                states[at + 1 :] = [new]
                at += 1
        else:
            moved = store.undo() if action == "undo" else store.redo()
            wanted = at - 1 if action == "undo" else at + 1
            assert (moved is not None) == (0 <= wanted < len(states))
            if moved is not None:
                at, edit = wanted, None
        assert xs(store) == states[at]


def test_programs_leave_keyframes_alone(store):
    store.commit("hand", [put(1, 1.0, keyframe=True), put(2, 2.0)])
    done = store.commit("Track", [put(1, 10.0), put(2, 20.0), put(3, 30.0)], by_program=True)
    assert done.skipped == (("ann", 1),)
    assert xs(store) == {1: 1.0, 2: 20.0, 3: 30.0}
    assert store.amend(done.edit, [PoseChange("ann", 1, None), put(4, 4.0)], by_program=True) == (("ann", 1),)
    assert xs(store) == {1: 1.0, 2: 20.0, 3: 30.0, 4: 4.0}
    store.commit("hand", [put(1, 5.0)])
    assert xs(store)[1] == 5.0  # a person may


def test_pins_are_part_of_the_history(store):
    store.commit("Pin", [PinChange("ann", 3, "left_wrist", "front", (10.25, -3.5))])
    store.commit("Move pin", [PinChange("ann", 3, "left_wrist", "front", (11.0, 0.0)), put(3, 1.0)])
    store.commit(
        "Other", [PinChange("ann", 3, "head", "front", (1.0, 2.0)), PinChange("bob", 3, "head", "left", (0, 0))]
    )
    assert store.pins("ann", 3) == [Pin("head", "front", (1.0, 2.0)), Pin("left_wrist", "front", (11.0, 0.0))]
    store.commit("Unpin", [PinChange("ann", 3, "left_wrist", "front", None)])
    assert store.pins("ann", 3) == [Pin("head", "front", (1.0, 2.0))]
    for _ in range(3):
        store.undo()
    assert store.pins("ann", 3) == [Pin("left_wrist", "front", (10.25, -3.5))]
    assert xs(store) == {}
    for _ in range(3):
        store.redo()
    assert store.pins("ann", 3) == [Pin("head", "front", (1.0, 2.0))]


def test_frames_of_an_edit(store):
    edit = store.commit("a", [put(9, 1.0), put(2, 1.0), PinChange("ann", 5, "head", "front", (1.0, 2.0))]).edit
    store.amend(edit, [put(9, 2.0), PinChange("ann", 2, "head", "front", None)])
    store.commit("b", [put(7, 1.0)])
    assert store.frames_of(edit) == [2, 5, 9]


def test_model_revisions(store):
    first = store.model_revisions("ann")[0]
    assert store.add_model_revision("ann", "a = 1") == first.id  # nothing new
    second = store.add_model_revision("ann", "a = 2")
    other = store.add_model_revision("bob", "a = 2")
    assert len({first.id, second, other}) == 3
    assert store.add_model_revision("ann", "a = 1") == first.id  # as it was before
    assert store.model_revision(second).toml == "a = 2"
    assert store.model_revision(first.id).toml == "a = 1"
    assert [r.id for r in store.model_revisions("ann")] == [first.id, second]


def test_pose_of_an_unknown_model_is_refused_and_nothing_is_kept(store):
    with pytest.raises(SessionError, match="FOREIGN KEY"):
        store.commit("bad", [put(1, 1.0), PoseChange("ann", 2, replace(pose(1.0), model_revision=99))])
    assert xs(store) == {}
    assert store.history() == []


def test_settings(store, path):
    assert store.setting("tree", "none") == "none"
    store.set_setting("tree", {"arms": [1, 2]})
    store.set_setting("tree", {"arms": [3]})
    assert AnnotationStore(path, read_only=True).setting("tree") == {"arms": [3]}


CHILD = textwrap.dedent("""
    import sys
    import numpy as np
    from tracker.session.store.annotation_store import AnnotationStore
    from tracker.session.store.records import PoseChange, PoseRecord
    store = AnnotationStore(sys.argv[1])
    store.add_model_revision("ann", "a = 1")
    edit = None
    for i in range(10**9):
        record = PoseRecord(np.array([float(i), 0.0]), ("manual", "manual"), 1)
        if i % 3:
            store.amend(edit, [PoseChange("ann", i % 7, record)])
        else:
            edit = store.commit(str(i), [PoseChange("ann", i % 7, record)]).edit
        print(i, flush=True)
""")


@pytest.mark.parametrize(
    "acknowledged", [pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow), 20]
)
def test_killed_program_loses_nothing_acknowledged(path, acknowledged):
    child = subprocess.Popen([sys.executable, "-c", CHILD, str(path)], stdout=subprocess.PIPE, text=True)
    for _ in range(acknowledged):
        last = int(child.stdout.readline())
    child.send_signal(signal.SIGKILL)
    child.wait()
    # It may have gone on before the signal came, but never the other way.
    last = max([last, *(int(line) for line in child.stdout.read().split())])
    store = AnnotationStore(path)
    kept = xs(store)
    newest = int(max(kept.values()))
    assert newest in (last, last + 1)
    assert kept == {i % 7: float(i) for i in range(max(0, newest - 6), newest + 1)}
    assert store.undo() == str(newest // 3 * 3)


def test_threads(store):
    def work(i):
        for k in range(10):
            store.commit(f"{i}", [put(i * 10 + k, float(k))])

    threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert len(store.frames("ann")) == 40
    assert len(store.history()) == 40


def test_writes_are_full_and_without_a_write_ahead_log(store):
    assert store._connection.db.execute("PRAGMA journal_mode").fetchone() == ("delete",)
    assert store._connection.db.execute("PRAGMA synchronous").fetchone()[0] >= 2


def test_read_only(store, path):
    reader = AnnotationStore(path, read_only=True)
    store.commit("a", [put(1, 1.0)])
    assert xs(reader) == {1: 1.0}
    with pytest.raises(SessionError, match="readonly"):
        reader.commit("b", [put(1, 2.0)])


def test_not_a_store(path):
    path.write_text("this is no database, and long enough to look at" * 100)
    with pytest.raises(SessionError, match="not a database"):
        AnnotationStore(path)


def test_missing(path):
    with pytest.raises(SessionError, match="not found"):
        AnnotationStore(path, read_only=True)


def assessment(x, status="doubtful"):
    errors = np.array([np.eye(3), 2 * np.eye(3)])
    return AssessmentChange("ann", 3, pose(x).values, status, "left arm uncertain", (0.5, 0.25), errors)


def test_a_program_assesses_a_keyframe_and_changes_nothing_else(store):
    keyframe = put(3, 1.0, keyframe=True, cost_px=0.5, settings={"seen": {}}, view_costs_px=(0.5, None))
    pin = PinChange("ann", 3, "left_wrist", "front", (1.0, 2.0))
    store.commit("pose", [replace(keyframe, alternatives=(Alternative(pose(2.0).values, 1, 0.6),)), pin], author="eve")
    before = store.pose("ann", 3)
    edit = store.commit("track", [put(4, 9.0)], author="adam", by_program=True).edit
    assert store.amend(edit, [assessment(1.0, "lost"), assessment(1.0)], by_program=True) == ()
    after = store.pose("ann", 3)
    assert (after.status, after.remark, after.limbs_lost) == ("doubtful", "left arm uncertain", (0.5, 0.25))
    np.testing.assert_array_equal(after.errors, assessment(1.0).errors)
    assert differing(after, before) == {"status", "remark", "limbs_lost", "errors"}
    assert (after.author, after.time, after.program) == (before.author, before.time, before.program)
    assert len(store.pins("ann", 3)) == len(store.alternatives("ann", 3)) == 1
    (row, _) = store.frames("ann")
    assert (row.status, row.keyframe, row.assessed_since) == ("doubtful", True, True)
    assert store.former_poses("ann", range(10)) == {}
    store.undo()
    assert (store.pose("ann", 3).status, store.frames("ann")[0].assessed_since) == ("", False)
    store.redo()
    assert store.pose("ann", 3).status == "doubtful"


def test_an_assessment_ends_with_the_pose_and_with_a_mark(store):
    store.commit("pose", [put(3, 1.0, keyframe=True)])
    store.commit("audit", [assessment(1.0)], by_program=True)
    store.commit("mark", [MarkChange("ann", 3, keyframe=True, reviewed=True)])
    assert [(r.status, r.assessed_since) for r in store.frames("ann")] == [("doubtful", False)]
    store.commit("drag", [put(3, 1.5, keyframe=True)])
    store.commit("audit", [assessment(1.0), assessment(1.0)._replace(frame=8)], by_program=True)
    found = store.pose("ann", 3)
    assert (found.values[0], found.status, found.errors) == (1.5, "", None)
    assert [r.frame for r in store.frames("ann")] == [3]


def test_a_log_is_read_as_of_one_moment(store, path, monkeypatch):
    store.commit("a", [put(1, 10.0)])
    reader = AnnotationStore(path, read_only=True)
    found = reader._connection.all

    def all_while_another_program_writes(sql, *rest):
        rows = found(sql, *rest)
        if "FROM edits" in sql:
            with pytest.raises(SessionError), store.impatient():
                store.commit("b", [put(2, 20.0)])
        return rows

    monkeypatch.setattr(reader._connection, "all", all_while_another_program_writes)
    log = reader.read_log()
    assert [edit.label for edit in log.edits] == ["a"]
    assert [key for edit in log.edits for key, _ in edit.poses] == [("ann", 1)]
    reader.close()
    store.commit("c", [put(2, 20.0)])
    assert xs(store) == {1: 10.0, 2: 20.0}
