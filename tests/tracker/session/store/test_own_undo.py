"""Two annotators edit one store in turn; each undoes and redoes only what is their own."""

import random
from contextlib import suppress

import numpy as np
import pytest

from tracker.errors import OvertakenEditError, SessionError
from tracker.session.store import own_undo
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PinChange, PoseChange, PoseRecord


@pytest.fixture
def store(tmp_path):
    store = AnnotationStore(tmp_path / "annotations.sqlite", author="anna")
    store.add_model_revision("man", "a = 1")
    yield store
    store.close()
    AnnotationStore(tmp_path / "annotations.sqlite", read_only=True).close()  # its checksums hold


def put(store, author, frame, x, *more):
    changes = [PoseChange("man", f, PoseRecord(np.array([v]), ("manual",), 1)) for f, v in ((frame, x), *more)]
    return store.commit(f"{author} sets {x}", changes, author).edit


def xs(store):
    return {row.frame: float(store.pose("man", row.frame).values[0]) for row in store.frames("man")}


def test_each_undoes_and_redoes_their_own(store):
    put(store, "anna", 1, 10)
    put(store, "ben", 2, 20)
    assert store.undo_own().label == "anna sets 10"
    assert xs(store) == {2: 20}
    assert store.undo_own() is None
    assert store.undo_own("ben").in_tree is False, "the last edit of all takes back anna's"
    assert xs(store) == {}
    store.redo_own("anna")
    assert xs(store) == {1: 10}
    store.redo_own("ben")
    assert xs(store) == {1: 10, 2: 20}
    assert store.redo_own("ben") is store.redo_own("anna") is None


def test_many_steps_back_and_forth_over_one_pose(store):
    for x in (10, 11, 12):
        put(store, "anna", 1, x)
    put(store, "ben", 2, 20)
    shown = [xs(store)[1]]
    for _ in range(3):
        store.undo_own()
        shown.append(xs(store).get(1))
    for _ in range(3):
        store.redo_own()
        shown.append(xs(store).get(1))
    assert shown == [12, 11, 10, None, 10, 11, 12]
    assert xs(store)[2] == 20
    assert store.redo_own() is None


def test_later_changes_by_others_stay(store):
    put(store, "anna", 1, 10, (2, 11))
    put(store, "ben", 2, 20)
    assert store.undo_own().n_kept == 1
    assert xs(store) == {2: 20}


def test_an_edit_that_somebody_else_has_replaced_is_refused_by_name(store):
    put(store, "anna", 1, 10)
    put(store, "ben", 1, 20)
    before = store.done_edits()
    with pytest.raises(SessionError, match="ben changed it since"):
        store.undo_own()
    assert (xs(store), store.done_edits()) == ({1: 20}, before)
    store.undo_own("ben")
    store.undo_own("anna")
    assert xs(store) == {}


def test_pins_and_alternatives_follow(store):
    store.commit("pin", [PinChange("man", 1, "head", "LEFT", (3.0, 4.0))])
    store.commit("pin", [PinChange("man", 1, "head", "LEFT", (5.0, 6.0))])
    put(store, "ben", 2, 20)
    store.undo_own()
    assert [p.position_px for p in store.pins("man", 1)] == [(3.0, 4.0)]
    store.undo_own()
    assert store.pins("man", 1) == []


def test_a_new_edit_ends_what_could_be_redone(store):
    put(store, "anna", 1, 10)
    put(store, "ben", 2, 20)
    store.undo_own()
    put(store, "anna", 3, 30)
    assert store.redo_own() is None


def test_an_edit_of_sizes_below_others_is_refused(store):
    edit = store.commit("sizes", [], settings=lambda edit: {"sizes_edits": {str(edit): [["man", 1, 1]]}}).edit
    put(store, "ben", 2, 20)
    with pytest.raises(SessionError, match="others have worked on"):
        store.undo_own()
    assert edit in store.done_edits()


def test_any_order_of_two_annotators_leaves_each_their_own(store):
    """On frames of their own, each sees a private history, whatever the other does; the seed gives 300 moves."""
    chance = random.Random(5)
    at = {"anna": [], "ben": []}
    undone = {"anna": [], "ben": []}
    for x in range(300):
        name = chance.choice(["anna", "ben"])
        move = chance.choice(["edit", "edit", "undo", "redo"])
        if move == "edit":
            put(store, name, {"anna": 1, "ben": 2}[name], x)
            at[name].append(x)
            undone[name].clear()
        elif move == "undo" and at[name]:
            assert store.undo_own(name).label.endswith(f"sets {at[name][-1]}")
            undone[name].append(at[name].pop())
        elif move == "undo":
            assert store.undo_own(name) is None
        elif move == "redo" and (found := store.redo_own(name)):
            x_again = undone[name].pop()
            assert found.label.endswith(f"sets {x_again}")
            at[name].append(x_again)
        expected = {frame: at[who][-1] for who, frame in (("anna", 1), ("ben", 2)) if at[who]}
        assert xs(store) == expected, (x, name, move)


def test_without_the_tree_a_redo_outlives_edits_of_others(store):
    put(store, "anna", 1, 10)
    assert store.undo_own("anna", in_tree=False).in_tree is False
    put(store, "ben", 2, 20)
    assert store.own_labels("anna")[:2] == (None, "anna sets 10")
    store.redo_own("anna", in_tree=False)
    assert xs(store) == {1: 10, 2: 20}


def test_labels_name_what_a_move_would_take(store):
    assert store.own_labels()[:2] == (None, None)
    put(store, "anna", 1, 10)
    put(store, "ben", 2, 20)
    assert (store.own_labels()[:2], store.own_labels("ben")[:2]) == (("anna sets 10", None), ("ben sets 20", None))
    store.undo_own()
    store.undo_own("ben", in_tree=True)
    assert (store.own_labels()[:2], store.own_labels("ben")[:2]) == ((None, "anna sets 10"), (None, "ben sets 20"))


def simple_held(db, takers, first):
    """As `own_undo._held`, but from the whole history."""
    parents = dict(db.execute("SELECT id, parent FROM edits"))
    authors = dict(db.execute("SELECT id, author FROM edits"))
    ((edit,),) = db.execute("SELECT edit FROM head")
    held = []
    while edit is not None:
        held.append(edit)
        edit = parents[edit]
    for edit in list(held):  # the latest first
        if edit in held and edit in takers:
            held.remove(takers[edit])
    return iter([(e, authors[e]) for e in held])


@pytest.mark.slow
def test_labels_are_those_of_a_simple_search(store, monkeypatch):
    rng, found = random.Random("labels"), set()
    for step in range(150):
        name, move = rng.choice(("anna", "ben", "cleo")), rng.choice(("edit", "undo", "undo", "redo"))
        if move == "edit":
            put(store, name, len(name) + rng.randrange(2), step)
        else:
            with suppress(SessionError):
                (store.undo_own if move == "undo" else store.redo_own)(name, in_tree=rng.random() < 0.3)
        everybody = ("anna", "ben", "cleo", "nobody")
        labels = [store.own_labels(who) for who in everybody]
        found.update(labels)
        with monkeypatch.context() as simple:
            simple.setattr(own_undo, "_held", simple_held)
            assert labels == [store.own_labels(who) for who in everybody], step
    assert len(found) > 50


def test_a_long_history_is_not_read_for_the_last_edit(store):
    def steps(author):
        """Count steps of the query."""
        db, n = store._connection.db, []
        db.set_progress_handler(lambda: n.append(1), 1)
        store.own_labels(author)
        db.set_progress_handler(None, 0)
        return len(n)

    put(store, "ben", 2, 1)
    counts = []
    for _ in range(2):
        for x in range(100):
            put(store, "anna", 1, x)
        counts.append((steps("anna"), steps("nobody")))
    (few, none), (as_few, as_none) = counts
    assert abs(as_few - few) < 10, "not a step for each of a hundred edits"  # SQLite of today saves some
    assert as_none - none < 10 * 100, "one look at each author"


def test_a_gesture_goes_on_beside_edits_of_other_poses(store):
    drag = put(store, "anna", 1, 10)
    put(store, "ben", 2, 20)
    store.amend(drag, [PoseChange("man", 1, PoseRecord(np.array([11.0]), ("manual",), 1))])
    assert xs(store) == {1: 11, 2: 20}
    store.undo_own("anna")
    assert xs(store) == {2: 20}
    with pytest.raises(OvertakenEditError):
        store.amend(drag, [PoseChange("man", 2, PoseRecord(np.array([12.0]), ("manual",), 1))])


def test_a_gesture_that_was_undone_goes_on_no_more(store):
    drag = put(store, "anna", 1, 10)
    store.undo_own()
    put(store, "ben", 2, 20)
    with pytest.raises(OvertakenEditError):
        store.amend(drag, [PoseChange("man", 1, PoseRecord(np.array([11.0]), ("manual",), 1))])
