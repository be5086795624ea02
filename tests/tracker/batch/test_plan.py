"""The plan of a batch: recordings by pattern and table, settings of folders and recordings, wrong plans."""

import msgspec
import pytest
from bodies import MODELS
from stored_motions import store_motion

from tracker import files
from tracker.batch.checks import problems
from tracker.batch.manifest import Manifest
from tracker.batch.plan import FOLDER_FILE, PlannedRecording, plain, read_plan
from tracker.errors import TrackerError


@pytest.fixture
def lab(tmp_path):
    """Sessions lab/a, lab/b and lab/old/c, each of one person called ann."""
    for name in ("a", "b", "old/c"):
        folder = tmp_path / "lab" / name
        folder.parent.mkdir(parents=True, exist_ok=True)
        store_motion(folder, [MODELS["gavrila22"]], n_frames=2)
    return tmp_path


def read(folder, text):
    path = folder / "plan.toml"
    path.write_text(text)
    return read_plan(path, folder / "out")


def test_settings_are_inherited_from_folder_to_folder_and_overridden_for_a_recording(lab):
    (lab / "lab" / FOLDER_FILE).write_text("[settings]\nstride = 2\noptions = {whole_run = false}\n")
    (lab / "lab" / "old" / FOLDER_FILE).write_text('[settings]\nframes = "0:1"\n')
    text = """
    sessions = ["lab/*", "lab/old/c"]
    settings = {stride = 5, acquire = false, options = {recover = false, whole_run = true}}
    [recordings."lab/a"]
    stride = 3
    [recordings."lab/old"]
    skip = true
    """
    found = {r.name: r.settings for r in read(lab, text).recordings}
    assert sorted(found) == ["lab/a", "lab/b", "lab/old/c"]
    assert (found["lab/a"].stride, found["lab/b"].stride, found["lab/old/c"].stride) == (3, 2, 2)
    assert found["lab/b"].options == {"recover": False, "whole_run": False}
    assert found["lab/old/c"].frames == "0:1"
    assert found["lab/b"].frames is None
    assert found["lab/a"].acquire is False


def test_a_table_names_recordings_without_sessions(tmp_path):
    (tmp_path / "t.csv").write_text(
        "name,calibration,videos,people,height,fps\nday1,cal.toml,a.mp4;b.mp4,ann;bob,1.8,50\n\n"
    )
    (one,) = read(tmp_path, 'table = "t.csv"').recordings
    assert (one.name, one.session) == ("day1", str(tmp_path / "out" / "sessions" / "day1"))
    assert one.footage is not None
    assert one.footage.videos == (str(tmp_path / "a.mp4"), str(tmp_path / "b.mp4"))
    assert (one.footage.people, one.footage.height_m, one.footage.fps) == (("ann", "bob"), 1.8, 50.0)
    assert msgspec.convert(plain(one), PlannedRecording) == one


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "found none; 'sessions' takes paths"),
        ('sessions = ["lab/a"]\nspeed = 3', "speed"),
        ('sessions = ["lab/a"]\nsettings = {stride = 0}', "stride"),
        ('sessions = ["lab/a"]\nsettings = {frames = "3"}', "frames as A:B"),
        ('table = "none.csv"', "none.csv not found"),
        ('table = "bad.csv"', "expected columns name"),
    ],
)
def test_a_wrong_plan_is_a_sentence(lab, text, words):
    (lab / "bad.csv").write_text("who,what\n")
    with pytest.raises(TrackerError, match=words):
        read(lab, text)


def test_people_with_frozen_bodies_wait_for_the_recording_that_acquires_them(lab):
    plan = read(lab, 'sessions = ["lab/a", "lab/b"]\nfreeze_bodies = true')
    first, second = Manifest.create(plan, lab / "out").tasks
    assert (first.after, first.bodies) == ((), ("ann",))
    assert (second.after, second.bodies) == ((0,), ("ann",))
    assert Manifest.load(lab / "out").tasks == (first, second)


def test_another_plan_is_refused_in_the_folder_of_a_batch(lab):
    Manifest.create(read(lab, 'sessions = ["lab/a"]'), lab / "out")
    with pytest.raises(TrackerError, match="choose another folder"):
        Manifest.create(read(lab, 'sessions = ["lab/a", "lab/b"]'), lab / "out")
    with pytest.raises(TrackerError, match="found no tasks"):
        Manifest.load(lab / "lab")


def test_all_faults_of_a_plan_and_its_recordings_are_found_at_once(lab):
    (lab / "lab" / "old" / FOLDER_FILE).write_text("[settings]\nspeed = 3\n")
    plan = read(
        lab,
        """
        sessions = ["lab/a", "x*", "y", "lab/old/c", "lab/b"]
        settings.options = {speed = 3}
        recordings."lab/a" = {people = ["nobody"], frames = "0:99", keypoints = "k", export = ["e"]}
        recordings."lab/b" = {skip = true}
    """,
    )
    found = [(p.name.removeprefix(f"plan {lab}/"), str(p.error)) for p in problems(plan)]
    expected = {
        "plan.toml": ["session folders at 'x*', found none", "session folders at 'y', found none"],
        "lab/old/c": ["speed", "not found"],
        "lab/a": ["formats among", "not found"],
    }
    for name, words in expected.items():
        own = [error for place, error in found if place == name]
        assert all(any(w in error for error in own) for w in words), (name, own)
    assert {name for name, _ in found} == expected.keys()


def test_settings_of_recordings_that_are_not_there_are_all_named(lab):
    plan = read(lab, 'sessions = ["lab/a"]\nrecordings = {b = {stride = 2}, c = {skip = true}}')
    assert [str(p.error)[-40:] for p in plan.problems] == [f"among lab/a, found '{n}'; correct the name" for n in "bc"]


def test_patterns_look_through_folders_within_bounds(lab, monkeypatch):
    (lab / "lab" / "old" / "loop").symlink_to(lab / "lab")
    (lab / "file").touch()
    assert [r.name for r in read(lab, 'sessions = ["lab/**/c", "**/b"]').recordings] == ["lab/b", "lab/old/c"]
    assert read(lab, 'sessions = ["lab/old/../?"]').problems == ()
    assert len(read(lab, 'sessions = ["file/*", "\\u0000"]').problems) == 2
    monkeypatch.setattr(files, "LIMITS", files.WalkLimits(entries=5))
    assert "expected at most 5 files and folders" in str(read(lab, 'sessions = ["**/c"]').problems[0].error)
