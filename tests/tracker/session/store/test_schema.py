import sqlite3
from contextlib import closing

import numpy as np
import pytest
from damage import altered, old_store

from tracker.annotation.plan import decide, read_tasks
from tracker.body.limbs import Search
from tracker.errors import DamagedStoreError, SessionError
from tracker.session.store import checksums, schema
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.backups import backups_of
from tracker.session.store.records import Alternative, AssessmentChange, MarkChange, Pin, PoseChange, PoseRecord
from tracker.session.store.schema import VERSION


@pytest.fixture
def path(tmp_path):
    return tmp_path / "annotations.sqlite"


def xs(store):
    """First value of every frame that has a pose."""
    return {row.frame: store.pose("ann", row.frame).values[0] for row in store.frames("ann")}


def upgraded(path, version, change):
    """Bring a store to the next version, as the program of that version did, and change it there."""
    altered(path, *schema._UPGRADES[version], change, f"PRAGMA user_version = {version + 1}")
    return path


def as_written(version):
    return pytest.fixture(lambda path: old_store(path, version))


version_1 = as_written(1)
"""Four edits, one amended and the last undone."""
version_3 = as_written(3)
"""A keyframe, two tracked frames, one cleared and brought back by undo."""
version_6 = as_written(6)
"""With checksums: a keyframe and two tracked frames."""
version_7 = as_written(7)
"""With limbs: a keyframe and two tracked frames."""
version_8 = as_written(8)
"""With errors: a keyframe and two tracked frames."""
version_9 = as_written(9)
"""Four edits of two authors, one an audit and the last undone."""
version_10 = as_written(10)
"""A keyframe that was verified, and a task without a pose."""


@pytest.fixture
def version_2(version_1):
    """The same store as the program of version 2 has left it, its poses with their settings."""
    return upgraded(version_1, 1, "UPDATE pose_changes SET settings = '{\"step_deg\": 7}'")


@pytest.fixture
def version_4(version_3):
    """The same store as the program of version 4 has left it, one pose reviewed."""
    return upgraded(version_3, 3, "UPDATE pose_changes SET reviewed = 1 WHERE frame = 3")


@pytest.fixture
def version_5(version_4):
    """The same store as the program of version 5 has left it, one pose with an alternative."""
    numbers = np.array([3.5, 2.0]).tobytes().hex()
    return upgraded(version_4, 4, f"INSERT INTO alternatives VALUES (3, 0, 1, X'{numbers}', 2.0)")


@pytest.mark.parametrize("read_only", [False, True])
def test_in_version_10_decisions_named_no_pose_and_counted_by_their_time(version_10, read_only):
    before = version_10.read_bytes()
    with AnnotationStore(version_10, read_only=read_only) as store:
        assert [(s.author, s.pose) for s in store.tasks.states()] == [("rita", None)]
        assert [(t.row.frame, t.state) for t in read_tasks(store)] == [(1, "verified"), (2, "draft")]
    assert (version_10.read_bytes() == before) == read_only


def test_a_store_of_version_10_takes_poses_of_decisions_and_is_still_checked(version_10):
    with AnnotationStore(version_10) as store:
        first = store.pose("ann", 1)
        store.commit("Drag", [PoseChange("ann", 1, PoseRecord(first.values + 1, ("manual",) * 2, 1, keyframe=True))])
        assert [t.state for t in read_tasks(store)] == ["annotated", "draft"]
        decide(store, ("ann", 1), "verified")
        assert len(store.tasks.states()[-1].pose) == 32
    altered(version_10, "UPDATE task_states SET pose = NULL")
    with pytest.raises(DamagedStoreError, match="rows of 'task_states'"):
        AnnotationStore(version_10)


def uids(path):
    with closing(sqlite3.connect(path)) as db:
        return [uid for (uid,) in db.execute("SELECT uid FROM edits ORDER BY id")]


@pytest.mark.parametrize("read_only", [False, True])
def test_in_version_9_edits_had_no_identities_and_nothing_was_planned(version_9, read_only):
    before = version_9.read_bytes()
    with AnnotationStore(version_9, read_only=read_only) as store:
        assert [(e.edit, e.author, e.undone) for e in store.history()] == [
            (4, "eve", True), (3, "", False), (2, "", False), (1, "eve", False),
        ]  # fmt: skip
        assert (store.tasks.tasks(), store.tasks.states(), store.tasks.comments()) == ([], [], [])
        assert [(m.frame, m.author) for m in store.tasks.keyframe_edits()] == [(1, "eve"), (1, "eve")]
        assert len({m.uid for m in store.tasks.makers_of_poses()}) == 2
    assert (version_9.read_bytes() == before) == read_only


def test_two_copies_of_a_store_of_version_9_agree_about_its_edits(version_9, tmp_path):
    copy = tmp_path / "copy.sqlite"
    copy.write_bytes(version_9.read_bytes())
    read = AnnotationStore(copy, read_only=True).tasks.keyframe_edits()
    for path in (version_9, copy):
        with AnnotationStore(path) as store:
            store.commit("new", [PoseChange("ann", 4, PoseRecord(np.zeros(2), ("manual",) * 2, 1))])
    mine, theirs = uids(version_9), uids(copy)
    assert mine[:4] == theirs[:4]
    assert read[0].uid == mine[0]
    assert len({*mine, *theirs}) == 6  # the new edits differ
    assert all(len(uid) == 32 for uid in mine)


def test_copies_of_a_store_of_version_9_that_were_edited_apart_before_their_upgrade(version_9, tmp_path):
    copy = tmp_path / "copy.sqlite"
    copy.write_bytes(version_9.read_bytes())
    with closing(sqlite3.connect(copy)) as db:
        checksums.register(db)
        db.execute("UPDATE edits SET time = '2026-11-28T00:00:00.000+00:00' WHERE id = 4")
        db.execute(f"UPDATE edits SET checksum = row_checksum({checksums.COLUMNS['edits'].removesuffix(', uid')})")
        db.execute("UPDATE contents SET total = (SELECT sum(checksum) FROM edits) WHERE name = 'edits'")
        db.commit()
    for path in (version_9, copy):
        AnnotationStore(path).close()
    mine, theirs = uids(version_9), uids(copy)
    assert mine[:3] == theirs[:3]
    assert mine[3] != theirs[3]


@pytest.mark.parametrize("read_only", [False, True])
def test_in_version_8_searches_were_not_kept_and_nothing_was_assessed_later(version_8, read_only):
    before = version_8.read_bytes()
    with AnnotationStore(version_8, read_only=read_only) as store:
        assert [(r.frame, r.status, r.assessed_since) for r in store.frames("ann")] == [
            (1, "", False), (2, "lost", False), (3, "doubtful", False),
        ]  # fmt: skip
        found = [store.pose("ann", k) for k in (1, 2, 3)]
        assert [(f.trace, f.author) for f in found] == [(None, "eve")] * 3
        np.testing.assert_array_equal(found[1].errors, [[[4, 1, 0], [1, 5, 2], [0, 2, 6]]])
    assert (version_8.read_bytes() == before) == read_only


def test_a_store_of_version_8_takes_searches_and_assessments_and_is_still_checked(version_8):
    with AnnotationStore(version_8) as store:
        trace = (Search("limbs", ("left_arm",), 41.0, 12.5, True), Search("samples", (), 12.5, None, False))
        store.commit("track", [PoseChange("ann", 4, PoseRecord(np.zeros(2), ("tracked",) * 2, 1, trace=trace))])
        keyframe = store.pose("ann", 1)
        store.commit("audit", [AssessmentChange("ann", 1, keyframe.values, "good", "", (), None)], by_program=True)
    again = AnnotationStore(version_8)
    assert again.pose("ann", 4).trace == trace
    assert again.pose("ann", 1).status == "good"


@pytest.mark.parametrize("read_only", [False, True])
def test_in_version_7_errors_were_not_known(version_7, read_only):
    before = version_7.read_bytes()
    with AnnotationStore(version_7, read_only=read_only) as store:
        assert [(r.frame, r.status, r.limbs_lost) for r in store.frames("ann")] == [
            (1, "", ()), (2, "lost", (0.5, 0.01)), (3, "doubtful", (0.5, 0.01)),
        ]  # fmt: skip
        assert [store.pose("ann", k).errors for k in (1, 2, 3)] == [None] * 3
    assert (version_7.read_bytes() == before) == read_only


def test_a_store_of_version_7_takes_errors_and_is_still_checked(version_7):
    with AnnotationStore(version_7) as store:
        errors = np.array([[[4, 1, 0], [1, 5, 2], [0, 2, 6]], np.eye(3)])
        store.commit("track", [PoseChange("ann", 4, PoseRecord(np.zeros(2), ("tracked",) * 2, 1, errors=errors))])
    np.testing.assert_array_equal(AnnotationStore(version_7).pose("ann", 4).errors, errors)


@pytest.mark.parametrize("read_only", [False, True])
def test_in_version_6_limbs_were_not_assessed(version_6, read_only):
    before = version_6.read_bytes()
    with AnnotationStore(version_6, read_only=read_only) as store:
        assert [(r.frame, r.status, r.limbs_lost) for r in store.frames("ann")] == [
            (1, "", ()), (2, "lost", ()), (3, "lost", ()),
        ]  # fmt: skip
        assert store.pose("ann", 2).remark == "left arm uncertain"
        assert [a.cost_px for a in store.alternatives("ann", 3)] == [2.0]
    assert (version_6.read_bytes() == before) == read_only


def test_a_store_of_version_6_takes_limbs_and_is_still_checked(version_6):
    with AnnotationStore(version_6) as store:
        record = PoseRecord(np.zeros(2), ("tracked",) * 2, 1, status="lost", limbs_lost=(0.9, 0.01))
        store.commit("track", [PoseChange("ann", 4, record)])
    assert AnnotationStore(version_6).frames("ann")[-1].limbs_lost == (0.9, 0.01)


def test_damage_of_a_store_of_version_6_is_found_before_it_is_upgraded(version_6):
    altered(version_6, "UPDATE pose_changes SET keyframe = 1 - keyframe WHERE frame = 1")
    with pytest.raises(DamagedStoreError, match="ann, frame 1"):
        AnnotationStore(version_6)


@pytest.mark.parametrize("read_only", [False, True])
def test_in_version_5_there_were_no_checksums(version_5, read_only):
    before = version_5.read_bytes()
    with AnnotationStore(version_5, read_only=read_only) as store:
        assert xs(store) == {1: store.pose("ann", 1).values[0], 2: 2.0, 3: 3.0}
        assert (store.pose("ann", 2).settings, store.pose("ann", 3).reviewed) == ({"step_deg": 5}, True)
        assert [a.cost_px for a in store.alternatives("ann", 3)] == [2.0]
    assert (version_5.read_bytes() == before) == read_only


def test_a_store_of_version_5_is_backed_up_as_it_was_and_then_checked(version_5):
    with AnnotationStore(version_5) as store:
        (backup,) = backups_of(version_5)
        with closing(sqlite3.connect(backup)) as db:
            assert schema.version(db) == 5
        assert store.undo() == "track"
    with closing(sqlite3.connect(version_5)) as db:
        columns = "SELECT name FROM pragma_table_info('pose_changes')"
        names = [n for (n,) in db.execute(f"SELECT name FROM sqlite_master UNION {columns}")]
        assert "program_settings" in names
        assert "told" not in names
        db.execute("UPDATE pose_changes SET keyframe = 1 - keyframe WHERE frame = 1")
        db.commit()
    with pytest.raises(DamagedStoreError, match="ann, frame 1"):
        AnnotationStore(version_5)


@pytest.mark.parametrize("read_only", [False, True])
def test_in_version_4_there_were_no_alternatives(version_4, read_only):
    before = version_4.read_bytes()
    with AnnotationStore(version_4, read_only=read_only) as store:
        assert [(r.frame, r.reviewed) for r in store.frames("ann")] == [(1, True), (2, False), (3, True)]
        assert store.alternatives("ann", 3) == ()
    assert (version_4.read_bytes() == before) == read_only


def test_a_store_of_version_4_takes_alternatives(version_4):
    with AnnotationStore(version_4) as store:
        here = store.pose("ann", 3)
        store.commit("track", [PoseChange("ann", 3, here, (Alternative(here.values + 1, here.model_revision, 2.0),))])
    (found,) = AnnotationStore(version_4).alternatives("ann", 3)
    np.testing.assert_array_equal(found.values, here.values + 1)


@pytest.mark.parametrize("read_only", [False, True])
def test_in_version_3_nobody_had_reviewed_but_keyframes(version_3, read_only):
    before = version_3.read_bytes()
    with AnnotationStore(version_3, read_only=read_only) as store:
        assert [(r.frame, r.keyframe, r.reviewed) for r in store.frames("ann")] == [
            (1, True, True), (2, False, False), (3, False, False),
        ]  # fmt: skip
        pose = store.pose("ann", 3)
        assert (pose.reviewed, pose.remark, pose.view_costs_px) == (False, "late", (1.0, None))
        assert pose.settings == {"step_deg": 5}
    assert (version_3.read_bytes() == before) == read_only


def test_a_store_of_version_3_takes_marks_and_gives_them_back(version_3):
    with AnnotationStore(version_3) as store:
        store.commit("review", [MarkChange("ann", 3, keyframe=False, reviewed=True)])
        assert [r.reviewed for r in store.frames("ann")] == [True, False, True]
        assert (store.undo(), store.undo(), store.redo()) == ("review", "track", "track")
        assert [r.reviewed for r in store.frames("ann")] == [True, False, False]
    assert AnnotationStore(version_3).redo() == "review"


def test_older_version_keeps_everything(version_1):
    store = AnnotationStore(version_1)
    assert xs(store) == {1: 0.3, 2: 2.0, 3: 3.0}
    assert [(h.label, h.undone) for h in store.history()] == [
        ("clear", True), ("track", False), ("drag", False), ("place", False),
    ]  # fmt: skip
    assert store.pins("ann", 1) == [Pin("left_wrist", "front", (10.25, -3.5))]
    assert store.setting("tree") == {"arms": [1]}
    back = store.pose("ann", 3)
    assert (back.cost_px, back.view_costs_px, back.part_costs_px, back.remark, back.program) == (
        1.5,
        (),
        (),
        "",
        "0.1.0",
    )
    assert store.undo() == "track"
    assert store.undo() == "drag"
    assert xs(store) == {1: 0.1}
    assert (store.pose("ann", 1).settings, store.pose("ann", 1).author) == ({"step_deg": 5}, "eve")
    assert [store.redo(), store.redo(), store.redo(), store.redo()] == ["drag", "track", "clear", None]
    assert xs(store) == {1: 0.3, 3: 3.0}
    record = PoseRecord(np.array([5.0]), ("manual",), 1, view_costs_px=(1.0,), remark="both")
    store.commit("new", [PoseChange("ann", 5, record)])
    assert store.undo() == "new"
    store.close()
    again = AnnotationStore(version_1)
    assert xs(again) == {1: 0.3, 3: 3.0}
    assert again.redo() == "new"
    assert again.pose("ann", 5).remark == "both"


def test_older_version_that_is_only_read_stays_as_it_is(version_1):
    before = version_1.read_bytes()
    with AnnotationStore(version_1, read_only=True) as store:
        assert store.pose("ann", 2).remark == ""
        assert [row.view_costs_px for row in store.frames("ann")] == [(), (), ()]
        assert [row.frame for row in store.frame_poses("ann", range(9))] == [1, 2, 3]
        assert [h.label for h in store.history()] == ["clear", "track", "drag", "place"]
    assert version_1.read_bytes() == before


@pytest.mark.parametrize("read_only", [False, True])
def test_settings_that_version_2_kept_with_each_pose(version_2, read_only):
    before = version_2.read_bytes()
    with AnnotationStore(version_2, read_only=read_only) as store:
        assert (store.pose("ann", 1).settings, store.pose("ann", 1).values[0]) == ({"step_deg": 7}, 0.3)
    assert (version_2.read_bytes() == before) == read_only


def test_settings_are_kept_once(path):
    store = AnnotationStore(path)
    revision = store.add_model_revision("ann", "")
    told = {"method": "chamfer", "search": "x" * 1000}

    def poses(frames, settings):
        return [
            PoseChange("ann", f, PoseRecord(np.zeros(2), ("tracked",) * 2, revision, settings=settings)) for f in frames
        ]

    store.commit("place", poses([0], {}))
    before = path.stat().st_size
    store.commit("track", poses(range(1, 200), told))
    assert path.stat().st_size - before < 200 * 200  # bytes
    store.commit("track", poses([7], told | {"step_deg": 3}))
    assert [store.pose("ann", f).settings for f in (0, 5, 7)] == [{}, told, told | {"step_deg": 3}]
    store.undo()
    assert store.pose("ann", 7).settings == told


def test_upgrade_is_whole_or_not_at_all(version_1, monkeypatch):
    before = version_1.read_bytes()
    broken = (*schema._UPGRADES[1][:2], "ALTER TABLE no_such_table ADD COLUMN x TEXT")
    monkeypatch.setitem(schema._UPGRADES, 1, broken)
    with pytest.raises(SessionError, match="no_such_table"):
        AnnotationStore(version_1)
    monkeypatch.undo()
    assert version_1.read_bytes() == before
    assert AnnotationStore(version_1).undo() == "track"


def test_newer_version(path):
    AnnotationStore(path).close()
    altered(path, f"PRAGMA user_version = {VERSION + 1}")
    with pytest.raises(SessionError, match=f"version {VERSION + 1}.*upgrade"):
        AnnotationStore(path)
