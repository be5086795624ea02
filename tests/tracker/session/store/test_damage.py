"""What is wrong with a store is found when it is opened, and one sentence says what to do."""

import shutil

import numpy as np
import pytest
from damage import altered, old_store

from tracker.errors import DamagedStoreError, SessionError
from tracker.session.store import backups
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import Alternative, PinChange, PoseChange, PoseRecord


@pytest.fixture
def path(tmp_path):
    """A store with a pose, an alternative, a pin and a setting."""
    path = tmp_path / "annotations.sqlite"
    with AnnotationStore(path) as store:
        revision = store.add_model_revision("ann", "a = 1")
        pose = PoseRecord(np.array([1.0, 2.0]), ("manual", "tracked"), revision, cost_px=1)
        store.commit("place", [PoseChange("ann", 3, pose, (Alternative(pose.values + 1, revision, 2),))])
        store.commit("pin", [PinChange("ann", 3, "left_wrist", "front", (10, 20))])
        store.set_setting("locked", {"ann": []})
        store.set_setting("locked", {"ann": ["left_wrist.twist"]})
        store.undo()
        store.redo()
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("statement", "parameters"),
    [
        ("UPDATE pose_changes SET numbers = ?", [np.array([1.0, 2.5]).tobytes()]),
        ("UPDATE pose_changes SET frame = 4", []),
        ("UPDATE pose_changes SET keyframe = 1", []),
        ("UPDATE pose_changes SET previous = 1", []),
        ("DELETE FROM poses", []),
        ("INSERT INTO poses SELECT person, 9, change, checksum FROM poses", []),
        ("UPDATE alternatives SET cost_px = 2.25", []),
        ("UPDATE model_revisions SET toml = 'a = 3'", []),
        ("UPDATE pin_changes SET u = 11", []),
        ("DELETE FROM pins", []),
        ("UPDATE head SET edit = 1", []),
        ("UPDATE edits SET label = 'b'", []),
        ("UPDATE settings SET value = '{}' WHERE key = 'locked'", []),
        ("UPDATE program_settings SET settings = '[]'", []),
        ("DELETE FROM contents WHERE name = 'poses'", []),
        ("CREATE INDEX other ON pose_changes (frame)", []),
    ],
)
@pytest.mark.parametrize("read_only", [False, True])
def test_a_change_that_the_program_did_not_make_is_found(path, statement, parameters, read_only):
    AnnotationStore(path, read_only=read_only).close()  # as it was written
    altered(path, statement, parameters=parameters)
    with pytest.raises(DamagedStoreError, match=r"annotations .*annotations\.sqlite are damaged: .*written"):
        AnnotationStore(path, read_only=read_only)


def test_the_message_names_the_frames(path):
    altered(path, "UPDATE pose_changes SET numbers = x'00'")
    with pytest.raises(DamagedStoreError, match="'pose_changes' are not as they were written \\(ann, frame 3\\)"):
        AnnotationStore(path)


def test_everything_that_is_written_passes_when_it_is_opened_again(path):
    with AnnotationStore(path) as store:
        pose = store.pose("ann", 3)
        edit = store.commit("drag", [PoseChange("ann", 4, pose)]).edit
        store.amend(edit, [PoseChange("ann", 4, None), PoseChange("bö", 4, pose)])
        store.go_to(None)
        store.go_to(edit)
    for _ in range(2):
        AnnotationStore(path).close()


@pytest.mark.parametrize("read_only", [False, True])
def test_an_empty_file_is_no_new_store(path, read_only):
    path.write_bytes(b"")
    with pytest.raises(DamagedStoreError, match="found an empty file of 0 bytes; put a copy"):
        AnnotationStore(path, read_only=read_only)
    assert path.read_bytes() == b""


@pytest.mark.parametrize("size", [1, 99, 100, 4096, 5000])
def test_a_truncated_file_is_damaged(path, size):
    path.write_bytes(path.read_bytes()[:size])
    with pytest.raises(DamagedStoreError):
        AnnotationStore(path)


def test_definitions_that_are_no_text(path):
    """SQLite quotes them in its message, which Python cannot decode."""
    named = "UPDATE sqlite_master SET name = CAST(x'7FEB16F4' AS TEXT), sql = 'CREATE' WHERE name = 'poses'"
    altered(path, "PRAGMA writable_schema = ON", named)
    with pytest.raises(DamagedStoreError):
        AnnotationStore(path)


def test_a_damaged_pose_of_an_older_version_is_found_before_the_upgrade(tmp_path):
    path = old_store(tmp_path / "annotations.sqlite", 3)
    altered(path, "UPDATE pose_changes SET sources = x'FF00' WHERE frame = 3")
    before = path.read_bytes()
    for read_only in (True, False):
        with pytest.raises(DamagedStoreError, match="the pose of 'ann' in frame 3 cannot be read"):
            AnnotationStore(path, read_only=read_only)
    assert path.read_bytes() == before


def edited(path, frame):
    """Open a store, edit it, and close it."""
    with AnnotationStore(path) as store:
        store.commit("drag", [PoseChange("ann", frame, store.pose("ann", 3))])


def frames_of(path):
    with AnnotationStore(path, read_only=True) as store:
        return [row.frame for row in store.frames("ann")]


def test_the_last_three_states_are_backed_up_at_opening(path):
    assert backups.backups_of(path) == []  # it was new
    for frame in (10, 11, 12, 13):
        edited(path, frame)
    assert [frames_of(b)[-1] for b in backups.backups_of(path)] == [12, 11, 10]
    AnnotationStore(path).close()
    kept = backups.backups_of(path)
    assert [frames_of(b)[-1] for b in kept] == [13, 12, 11]
    AnnotationStore(path).close()  # nothing has changed since
    AnnotationStore(path, read_only=True).close()
    assert backups.backups_of(path) == kept
    assert sorted(p.name for p in (path.parent / "backups").iterdir()) == sorted(p.name for p in kept)


def renamed_as_of_the_future(path, with_counter):
    """Name the backups as a program whose clock is ahead does; older programs had no counter."""
    for backup in backups.backups_of(path):
        counter = backup.stem.split("-")[1]
        stamp = f"29990101T0000{int(counter):02}000Z"
        backup.rename(backup.with_name(f"annotations-{counter + '-' if with_counter else ''}{stamp}.sqlite"))


@pytest.mark.slow
@pytest.mark.parametrize("with_counter", [True, False])
def test_backups_of_a_clock_that_was_ahead_do_not_disable_newer_ones(path, with_counter):
    for frame in (10, 11, 12):
        edited(path, frame)
    AnnotationStore(path).close()
    renamed_as_of_the_future(path, with_counter)
    for frame, kept in ((13, [12, 11]), (14, [13, 12])):
        edited(path, frame)
        AnnotationStore(path).close()
        assert [frames_of(b)[-1] for b in backups.backups_of(path)] == [frame, *kept]
    assert backups.restore(path).backup == backups.backups_of(path)[0]


def test_a_damaged_store_is_not_backed_up_and_its_backup_is_offered(path):
    edited(path, 10)
    before = backups.backups_of(path)
    altered(path, "UPDATE pose_changes SET frame = 8 WHERE frame = 3")
    with pytest.raises(DamagedStoreError, match=r"run 'quadrille restore .*' to go back to the backup of 20"):
        AnnotationStore(path)
    assert backups.backups_of(path) == before


def test_a_missing_store_with_backups_is_no_new_store(path):
    edited(path, 10)
    path.unlink()
    with pytest.raises(DamagedStoreError, match="found no such file; run 'quadrille restore"):
        AnnotationStore(path)
    assert not path.exists()


def test_going_back_takes_the_newest_backup_that_passes_and_keeps_the_damaged_file(path):
    edited(path, 10)
    edited(path, 11)
    AnnotationStore(path).close()
    newest, second, _ = backups.backups_of(path)
    altered(newest, "DELETE FROM poses")
    path.write_bytes(b"")
    path.with_name("annotations.sqlite-journal").write_bytes(b"of the damaged file")
    restored = backups.restore(path)
    assert restored.backup == second
    assert restored.kept.read_bytes() == b""
    assert restored.kept.with_name(restored.kept.name + "-journal").read_bytes() == b"of the damaged file"
    assert frames_of(path) == [3, 10]
    with AnnotationStore(path) as store:
        assert store.undo() == "drag"


def test_going_back_without_a_backup_that_passes(path):
    edited(path, 10)
    backups.backups_of(path)[0].write_bytes(b"")
    before = path.read_bytes()
    with pytest.raises(SessionError, match=r"expected a backup .* that passes its checks, found annotations-"):
        backups.restore(path)
    assert path.read_bytes() == before


def test_a_folder_that_takes_no_backups_can_be_worked_in(path):
    (path.parent / "backups").write_text("a file")
    with AnnotationStore(path) as store:
        assert "no backup of" in store.backup_error
        store.commit("drag", [PoseChange("ann", 7, store.pose("ann", 3))])
    assert frames_of(path) == [3, 7]


@pytest.mark.parametrize(
    "name", ["annotations.sqlite", "annotations.sqlite-journal", "annotations.sqlite-wal", "backups"]
)
def test_links_are_not_written_through(path, tmp_path, name):
    outside = tmp_path / "outside"
    outside.mkdir()
    link = path.parent / name
    target = outside / "target"
    if link.exists():
        link.rename(target)
    else:
        target.mkdir()
    link.symlink_to(target)
    before = sorted(outside.rglob("*")), target.is_file() and target.read_bytes()
    with pytest.raises(SessionError, match=f"{name} is a symbolic link, and nothing is written through links"):
        AnnotationStore(path)
    assert (sorted(outside.rglob("*")), target.is_file() and target.read_bytes()) == before


def test_a_crash_while_a_store_is_made_leaves_no_file(tmp_path, monkeypatch):
    path = tmp_path / "annotations.sqlite"

    def crash(_):
        raise KeyboardInterrupt

    monkeypatch.setattr("tracker.session.store.connection.schema.create", crash)
    with pytest.raises(KeyboardInterrupt):
        AnnotationStore(path)
    assert list(tmp_path.iterdir()) == []


# --- a folder that goes away and comes back ---------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / "session"
    folder.mkdir()
    return folder


def place(store, frame):
    revision = store.add_model_revision("ann", "a = 1")
    store.commit("place", [PoseChange("ann", frame, PoseRecord(np.zeros(2), ("manual",) * 2, revision))])


@pytest.mark.parametrize("way", ["renamed", "copied"])
def test_a_folder_that_comes_back_is_written_again(folder, tmp_path, way):
    away = tmp_path / "away"
    with AnnotationStore(folder / "annotations.sqlite") as store:
        place(store, 1)
        folder.rename(away)
        with pytest.raises(SessionError, match=r"are not there .*bring the session's folder back"):
            place(store, 2)
        assert [row.frame for row in store.frames("ann")] == [1]  # can still be read
        if way == "renamed":
            away.rename(folder)
        else:
            shutil.copytree(away, folder)  # as another drive with the same files
        place(store, 2)
        assert [row.frame for row in store.frames("ann")] == [1, 2]
    assert frames_of(folder / "annotations.sqlite") == [1, 2]


def test_another_store_in_the_place_of_the_one_that_went_away_is_not_written(folder, tmp_path):
    path = folder / "annotations.sqlite"
    with AnnotationStore(path) as store:
        place(store, 1)
        folder.rename(tmp_path / "away")
        folder.mkdir()
        with AnnotationStore(path) as other:
            place(other, 7)
        with pytest.raises(SessionError, match="others than those that were opened"):
            place(store, 2)
        assert [row.frame for row in store.frames("ann")] == [1]
    assert frames_of(path) == [7]
