"""`quadrille export`: files by name, wrong input, overwriting."""

import errno
import json
import os
import subprocess

import msgspec
import numpy as np
import pytest
from bodies import MODELS
from command_line import assert_refused, output_of
from full_disks import full_disk
from stored_motions import store_motion

from tracker.errors import TrackerError
from tracker.formats.trc import read_trc
from tracker.interchange.exports.export_files import export
from tracker.interchange.exports.formats import FORMATS
from tracker.interchange.exports.motion import ExportOptions, read_motion
from tracker.session.lock import this_holder
from tracker.session.session import load_session


@pytest.fixture
def couple(tmp_path):
    folder = tmp_path / "s"
    store_motion(folder, [MODELS["gavrila22"]] * 2, gaps={(0, 3), (0, 7)}, lost={(1, 5)})
    return folder


def test_each_person_has_a_file_of_the_name(run, couple, tmp_path):
    report = json.loads(output_of(run("export", couple, "--format", "trc", "--out", tmp_path / "m.trc", "--json")))
    assert report["files"] == [str(tmp_path / f"m_{name}.trc") for name in ("ann", "bob")]
    assert (report["frames"], report["missing"], report["lost"]) == ([0, 8], 2, 1)
    assert report["provenance"] == [str(tmp_path / f"m_{name}.trc.provenance.json") for name in ("ann", "bob")]
    out = output_of(run("export", couple, "--out", tmp_path / "m.mot", "--person", "bob", "--skip-lost"))
    assert (tmp_path / "m.osim").is_file()
    lines = out.splitlines()
    assert lines[3:] == [
        "bob, frames 0:8, axes y-up", "1 poses are missing and left out", "1 poses are lost, treated as missing"
    ]  # fmt: skip
    rows = (tmp_path / "m.mot").read_text().splitlines()
    assert rows[2] == "nRows=7"
    data = ["m.mot", "m.osim", "m_ann.trc", "m_bob.trc"]
    side = [f"{name}.provenance.json" for name in ("m.mot", "m_ann.trc", "m_bob.trc")]
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([*data, *side, "s"])


def test_frames_by_list_and_keyframes_alone(run, couple, tmp_path):
    words = ("export", couple, "--format", "csv", "--no-provenance", "--json")
    status, out, _ = run(*words, "--out", tmp_path / "a.csv", "--frames", "1,2,6")
    assert (status, json.loads(out)["frames"], json.loads(out)["n_frames"]) == (0, [1, 7], 3)
    assert len((tmp_path / "a.csv").read_text().splitlines()) == 1 + 2 * 3
    status, out, _ = run(*words, "--out", tmp_path / "b.csv", "--keyframes-only")
    assert (status, json.loads(out)["frames"], json.loads(out)["missing"]) == (0, [1, 2], 0)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.csv", "a_angles.csv", "b.csv", "b_angles.csv", "s"]
    # A table with a constant rate has a row for each frame between.
    assert run("export", couple, "--out", tmp_path / "m.trc", "--person", "bob", "--frames", "2,4")[0] == 0
    table = read_trc(tmp_path / "m.trc")
    assert np.isnan(table.points[:, 0, 0]).tolist() == [False, True, False]


def test_a_folder_takes_the_name_of_the_session(run, couple, tmp_path):
    assert run("export", couple, "--format", "csv", "--out", tmp_path, "--frames", "2:4")[0] == 0
    assert (tmp_path / "s_angles.csv").is_file()
    assert len((tmp_path / "s.csv").read_text().splitlines()) == 1 + 2 * 2


@pytest.fixture
def lab(tmp_path):
    """Two sessions in folders of one name, of ann and of ann and bob, with files as videos."""
    places = [tmp_path / name / "session" for name in ("walk", "run")]
    for i, place in enumerate(places):
        place.parent.mkdir()
        store_motion(place, [MODELS["gavrila22"]] * (1 + i), n_frames=1 + i, seed=i, gaps={(1, 0)})
        for camera in load_session(place).cameras:
            camera.footage.write_bytes(b"a video")
    return places


def test_a_dataset_of_several_sessions(run, lab, tmp_path):
    out = tmp_path / "d"
    words = ("export", *lab, "--format", "dataset", "--pictures", "video", "--out", out)
    assert_refused(run(*words, "--split", "sit=test"), ["expected splits of the recordings", "sit"])
    assert_refused(run(*words, "--frames", "0:1"), ["expected --frames with one session", "2"])
    assert_refused(run(*words, "--person", "bob"), ["expected --person", "bob"])
    assert_refused(run("export", *lab, "--out", tmp_path / "m.trc"), ["expected one session", "trc", "dataset"])
    assert_refused(run("export", *lab, "--like", "op", "--out", out), ["expected one session with --like"])
    assert_refused(run("export", "--out", out), ["expected the folder of a session"])
    assert not out.exists()
    status, text, _ = run(*words)
    assert (status, text.splitlines()) == (
        0,
        [
            f"wrote {out}",
            "train: walk_session, ann, 1 frame",
            "train: run_session, ann, bob, 2 frames, 1 pose missing",
            "all recordings are in train; --split 70:15:15 or --split NAME=test divides them",
            "ann is in walk_session and run_session, taken as one person; --distinct-people takes them as several",
        ],
    )
    assert (out / "recordings" / "run_session" / "videos" / "cam0.mp4").read_bytes() == b"a video"


@pytest.mark.slow
def test_splits_of_several_sessions(run, lab, tmp_path):
    words = ("export", *lab, "--format", "dataset", "--pictures", "video", "--out", tmp_path / "d")
    split = ("--split", "1:0:1", "run_session=test", "walk_session=train")
    assert "ann is in train and test; --split NAME=SPLIT moves a recording" in run(*words, *split)[1]
    status, text, _ = run(*words, *split, "--overwrite", "--distinct-people", "--json")
    report = json.loads(text)
    assert (status, report["shared_people"]) == (0, [])
    assert report["splits"] == {"train": ["walk_session"], "validation": [], "test": ["run_session"]}
    assert [(r["split"], r["missing"]) for r in report["recordings"]] == [("train", 0), ("test", 1)]


def test_a_file_is_replaced_only_on_request(run, couple, tmp_path):
    path = tmp_path / "m.trc"
    path.write_text("mine")
    words = ("export", couple, "--out", path, "--person", "ann")
    assert_refused(run(*words), ["expected", str(path), "not to exist", "--overwrite"])
    assert path.read_text() == "mine"
    assert run(*words, "--overwrite")[0] == 0
    assert len(read_trc(path).frames) == 7  # from the first pose to the last


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--format", "fbx"], ["a format among trc, csv, mot, coco, bvh, glb", "found 'fbx'", "--format"]),
        (["--format", "trc", "--out", "{}/a.csv"], ["--out to end in .trc", "'a.csv'", "rename it to a.trc"]),
        (["--out", "{}/a"], ["a format among", "no known suffix in 'a'"]),
        (["--out", "{}/none/a.trc"], ["in a folder that exists", "none"]),
        (["--person", "eve"], ["--person to be one of ann, bob, found 'eve'"]),
        (["--frames", "5:99"], ["--frames as A:B within 0:8", "'5:99'"]),
        (["--frames", "1,8"], ["or as a list such as 0,7", "'1,8'"]),
        (["--frames", "2", "--keyframes-only"], ["in frames 2, found none that is a keyframe", "--keyframes-only"]),
        (["--frames", "3:4", "--person", "ann"], ["expected poses of 'ann' in frames 3:4, found none"]),
        (["--frames", "5:6", "--person", "bob", "--skip-lost"], ["found none that is not lost"]),
        (["--blur-faces"], ["expected --blur-faces with pictures, found format trc, which writes none"]),
        (["--view", "cam0"], ["expected no option 'view' with format trc", "it takes axes, units"]),
        (
            ["--format", "mot", "--out", "{}/a.mot", "--units", "mm"],
            ["expected no option 'units' with format mot", "it takes axes"],
        ),
        (["--format", "mp4", "--out", "{}/a.mp4", "--view", "x"], ["--view to be one of cam0, cam1, cam2, found 'x'"]),
        (["--format", "mp4", "--out", "{}/a.mp4"], ["cam0", "not found"]),
    ],
)
def test_wrong_input_is_refused_and_leaves_nothing(run, couple, tmp_path, words, expected):
    found = [str(w).format(tmp_path) for w in words]
    out = [] if "--out" in found else ["--out", str(tmp_path / "a.trc")]
    assert_refused(run("export", couple, *out, *found), expected)
    assert [p.name for p in tmp_path.iterdir()] == ["s"]


def test_a_failed_write_leaves_nothing(run, couple, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("tracker.interchange.exports.export_files.os.replace", full)
    result = run("export", couple, "--out", tmp_path / "a.mot", "--person", "ann")
    assert_refused(result, [f"cannot write {tmp_path / 'a.mot'}: No space left on device", "choose a folder"])
    assert [p.name for p in tmp_path.iterdir()] == ["s"]


def test_a_folder_is_replaced_only_if_an_export_made_it(run, couple, tmp_path):
    words = ("export", couple, "--format", "openpose", "--frames", "1,2", "--json")
    status, out, _ = run(*words, "--out", tmp_path)
    assert (status, json.loads(out)["files"]) == (0, [str(tmp_path / "s_openpose")])
    labels = tmp_path / "s_openpose"
    assert len([*labels.rglob("*_keypoints.json")]) == 3 * 2
    assert_refused(run(*words, "--out", tmp_path), ["s_openpose not to exist, found a folder", "--overwrite"])
    (labels / "old").touch()
    assert run(*words, "--out", labels, "--overwrite")[0] == 0  # the folder itself may be named
    assert not (labels / "old").exists()
    (labels / "provenance.json").unlink()
    (labels / "mine").touch()
    refused = run(*words, "--out", tmp_path, "--overwrite")
    assert_refused(refused, ["s_openpose not to exist, found a folder", "choose another --out"])
    assert (labels / "mine").exists()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["s", "s_openpose"]


@pytest.mark.parametrize("name", ["trc", "openpose", "masks"])
def test_an_interrupted_export_leaves_nothing(couple, tmp_path, name):
    def interrupt():
        raise KeyboardInterrupt

    motion = read_motion(load_session(couple), (0,), range(2))
    with pytest.raises(KeyboardInterrupt):
        export(FORMATS[name], motion, ExportOptions(), tmp_path / f"a{FORMATS[name].suffixes[0]}", tick=interrupt)
    assert [p.name for p in tmp_path.iterdir()] == ["s"]


def test_a_session_without_poses(run, session, tmp_path):
    result = run("export", session, "--out", tmp_path / "a.bvh")
    assert_refused(result, ["expected poses of 'person', found none", "place the body in the page"])


def test_help_lists_every_format(run):
    out = output_of(run("export", "--help"))
    text = " ".join(out.replace("│", " ").split())
    for one in FORMATS.values():
        assert f"{one.name}: {one.title}" in text


@pytest.mark.parametrize(("character", "expected"), [
    ("nobody", "body model 'nobody' not found"), ("gavrila34:9", "expected a height of 0.3 to 3 metres"),
])  # fmt: skip
def test_a_character_that_is_none(run, couple, tmp_path, character, expected):
    refused = run("export", couple, "--out", tmp_path / "m.mp4", "--character", character)
    assert_refused(refused, [expected])
    assert not (tmp_path / "m.mp4").exists()


def exported(couple, out, name, tick=lambda: None, overwrite=False):
    session = load_session(couple)
    options = ExportOptions(provenance=True)
    return export(FORMATS[name], read_motion(session, (0,), None, False), options, out, overwrite, tick)


@pytest.mark.parametrize("name", ["trc", "csv", "npz", "openpose"])
def test_of_two_exports_to_one_place_at_the_same_time_one_succeeds(couple, tmp_path, name):
    out, contents = tmp_path / f"m{FORMATS[name].suffixes[0]}", []

    def other():
        if not contents:
            contents.append(None)
            paths = exported(couple, out, name)
            contents[0] = {path: stamp(path) for path in paths}

    def stamp(path):
        return {p: (p.stat().st_ino, p.stat().st_mtime_ns) for p in [path, *path.rglob("*")]}

    with pytest.raises(TrackerError, match=r"expected .* not to exist, found a f"):
        exported(couple, out, name, other)
    assert {path: stamp(path) for path in contents[0]} == contents[0]
    assert {p.name for p in tmp_path.iterdir()} == {"s", *(p.name for p in contents[0])}


def test_of_several_files_none_is_left_where_another_program_made_one(couple, tmp_path):
    def other():
        (tmp_path / "m_angles.csv").write_text("of another program")

    with pytest.raises(TrackerError, match=r"expected .*m_angles.csv not to exist, found a file"):
        exported(couple, tmp_path / "m.csv", "csv", other)
    assert {p.name for p in tmp_path.iterdir()} == {"s", "m_angles.csv"}


def test_a_drive_without_hard_links_has_exports_too(couple, tmp_path, monkeypatch):
    def link(*_):
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", link)
    assert exported(couple, tmp_path / "m.trc", "trc")[0].is_file()
    with pytest.raises(TrackerError, match="not to exist, found a file"):
        exported(couple, tmp_path / "n.trc", "trc", lambda: (tmp_path / "n.trc").write_text("of another program"))
    assert (tmp_path / "n.trc").read_text() == "of another program"


def test_files_of_a_killed_export_are_removed_by_the_next(couple, tmp_path):
    child = subprocess.Popen(["true"])
    child.wait()
    dead = msgspec.structs.replace(this_holder(), process=child.pid, started="1")
    for name, holder in (("dead", dead), ("alive", this_holder()), ("elsewhere", None)):
        left = tmp_path / f".m.trc.{name}.tmp"
        left.mkdir()
        (left / "m.trc").write_text("half")
        if holder is not None:
            (left / ".holder").write_bytes(msgspec.json.encode(holder))
    (tmp_path / ".m.trc.dead.tmp" / "labels_openpose.before").mkdir()
    exported(couple, tmp_path / "other.npz", "npz")
    assert sorted(p.name for p in tmp_path.iterdir() if p.name != "s") == [
        ".m.trc.alive.tmp", ".m.trc.elsewhere.tmp", "labels_openpose", "other.npz"
    ]  # fmt: skip


@pytest.mark.parametrize("words", [("export", "S", "--format", "csv", "--out"), ("batch",)])
def test_a_name_that_no_file_can_have_is_a_sentence(run, couple, tmp_path, words):
    words = [couple if word == "S" else word for word in words]
    assert_refused(run(*words, tmp_path / f"{'m' * 300}.csv"), ["File name too long"])


def test_a_name_whose_side_file_would_be_too_long_is_a_sentence(run, couple, tmp_path):
    words = ("export", couple, "--person", "ann", "--out", tmp_path / f"{'m' * 245}.trc")
    assert_refused(run(*words), ["File name too long", "choose a shorter name"])


@pytest.mark.parametrize("name", ["trc", "csv", "mot", "coco", "bvh", "glb", "openpose", "npz"])
def test_a_full_disk_is_a_sentence_and_nothing_is_left(run, couple, tmp_path, name):
    out = tmp_path / f"m{FORMATS[name].suffixes[0]}"
    with full_disk(1000):
        refused = run("export", couple, "--person", "ann", "--format", name, "--out", out, "--json")
    assert_refused(refused, [f"cannot write {out}: File too large; choose a folder that you may write to, with room"])
    assert {p.name for p in tmp_path.iterdir() if "state" not in p.name} == {"s"}
