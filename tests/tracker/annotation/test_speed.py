"""Seconds and edits per verified frame, from the times of the history."""

from contextlib import closing

import pytest
from annotated_copies import copied, merged, new_store, pose

from tracker.annotation import plan
from tracker.annotation.speed import measure_speed
from tracker.errors import DamagedStoreError
from tracker.session.store import edit_tree
from tracker.session.store.records import PoseChange


@pytest.fixture
def at(monkeypatch):
    """Set the clock of the store, seconds after midnight."""

    def set_clock(seconds):
        text = f"2030-01-01T00:{seconds // 60:02}:{seconds % 60:02}.000+00:00"
        for module in (edit_tree, plan):
            monkeypatch.setattr(module, "now", lambda: text)

    return set_clock


def test_pauses_do_not_count_and_a_pose_belongs_to_its_annotator(tmp_path, at):
    at(0)
    store = new_store(tmp_path / "annotations.sqlite")

    def drag(seconds, frame, author, keyframe=True):
        at(seconds)
        store.commit("Drag", [PoseChange("ann", frame, pose(seconds, keyframe=keyframe))], author=author)

    drag(100, 1, "anna")
    drag(110, 1, "anna")  # 10 s
    drag(170, 2, "anna")  # 60 s: still work
    drag(231, 2, "anna")  # 61 s: a pause
    drag(240, 2, "ben", keyframe=False)
    at(300)
    for frame, seconds in ((1, 300), (2, 304)):
        at(seconds)
        plan.decide(store, ("ann", frame), "verified", author="rita")
    speeds = {s.name: s for s in measure_speed(store)}
    anna, ben, rita = (speeds[name] for name in ("anna", "ben", "rita"))
    assert (anna.verified, anna.edits, anna.edit_seconds, anna.decisions) == (2, 4, 70.0, 0)
    assert (anna.seconds_per_frame, anna.edits_per_frame, anna.seconds_per_decision) == (35.0, 2.0, None)
    assert (ben.verified, ben.edits, ben.seconds_per_frame) == (0, 1, None)
    assert (rita.verified, rita.decisions, rita.seconds_per_decision) == (0, 2, 2.0)
    assert {s.name: s for s in measure_speed(store, pause_s=61)}["anna"].edit_seconds == 131.0
    store.close()


@pytest.mark.parametrize("table", ["edits", "task_states"])
def test_a_time_that_is_none_is_named(tmp_path, table):
    """Of a store from elsewhere, for the speed and for a merge."""
    with closing(new_store(tmp_path / "a")) as store:
        store.commit("Drag", [PoseChange("ann", 1, pose(1))], author="anna")
        plan.add_tasks(store, [("ann", 1, "")])
        plan.decide(store, ("ann", 1), "verified", author="rita")
    with closing(copied(tmp_path / "a", tmp_path / "b")) as store:
        store._connection.db.execute(f"UPDATE {table} SET time = 'yesterday'")
        with pytest.raises(DamagedStoreError, match=r"expected a time in UTC such as .*, found 'yesterday'"):
            measure_speed(store)
    with pytest.raises(DamagedStoreError, match="found 'yesterday'"):
        merged(tmp_path / "a", tmp_path / "b", tmp_path / "ab")
