"""`quadrille import`, what `info` shows of it, and `quadrille export --like`."""

import json

import numpy as np
import pytest
from command_line import assert_refused, output_of
from mask_files import SIZE, person_masks, write_masks
from observed_people import BODY_25, make_session, seen, walking, write_openpose

from tracker.formats.trc import write_trc

N = 6
TRUTH = walking(N)


@pytest.fixture
def session(tmp_path):
    return make_session(tmp_path / "s", N)


@pytest.fixture
def keypoints(session, tmp_path):
    return write_openpose(tmp_path / "k", session.camera_names, seen(session, [TRUTH]))


def test_import_shows_what_it_found(run, session, keypoints):
    out = output_of(run("import", session.folder, keypoints, "--as", "mp", "--dry-run"))
    lines = out.splitlines()
    assert lines[0] == "mp: openpose, of ann"
    assert lines[1] == f"  cam0: {keypoints}/cam0, 6 rows, points in frames 0 to 5, median confidence 0.90"
    assert "MidHip = left_hip and right_hip" in out
    assert "  points without a joint of the body: Nose, REye," in out
    assert lines[-1] == "nothing was stored"
    assert not (session.folder / "observations").exists()


def test_import_and_info_and_back(run, session, keypoints, tmp_path):
    report = json.loads(output_of(run("import", session.folder, keypoints, "--as", "mp", "--json")))
    assert (report["stored"], report["skeleton"], report["matched"], report["problems"]) == (True, "BODY_25", 18, [])
    assert report["views"][1]["frames"] == [0, 5]
    status, out, _ = run("info", session.folder, "--no-check")
    assert "  observations mp: 25 key points of ann in 6 frames, openpose" in out
    status, out, _ = run("export", session.folder, "--like", "mp", "--out", tmp_path / "back")
    assert (status, out) == (0, f"wrote {tmp_path / 'back'} like mp, 24 files\nall as imported\n")
    files = sorted(p.relative_to(keypoints) for p in keypoints.rglob("*.json"))
    assert all((keypoints / p).read_bytes() == (tmp_path / "back" / p).read_bytes() for p in files)


def test_a_contradiction_is_shown_with_the_preview_and_nothing_is_stored(run, session, tmp_path):
    folder = write_openpose(tmp_path / "k", session.camera_names, seen(session, [TRUTH])[:-1])
    status, out, err = run("import", session.folder, folder, "--as", "mp")
    assert status == 1
    assert "  cam0: " in out
    assert out.count("  problem: ") == 3  # of the other cameras
    assert "found numbers 0 to 4 (5 pictures); if they are of this footage, say --first-frame N" in err
    assert err.count("\n") == 1
    assert not (session.folder / "observations").exists()
    assert run("import", session.folder, folder, "--as", "mp", "--first-frame", "0")[0] == 0


def test_late_key_points_of_a_view_are_named_with_the_option(run, tmp_path):
    session = make_session(tmp_path / "long", 48)
    points = seen(session, [walking(48)])
    points[:, 1] = np.roll(points[:, 1], 3, axis=0)
    folder = write_openpose(tmp_path / "k", session.camera_names, points)
    words = ("import", session.folder, folder, "--as", "mp")
    status, _, err = run(*words)
    assert status == 1
    assert "camera 'cam1'" in err
    assert "those of 3 frames later fit the other views best; say --offset cam1=3 to take that off, or cam1=0" in err
    assert_refused(run(*words, "--offset", "cam1=x"), ["expected --offset as NAME=VALUE"])
    assert not (session.folder / "observations").exists()
    status, out, _ = run(*words, "--offset", "cam1=3")
    assert (status, out.splitlines()[-1]) == (0, "stored as mp")
    assert "  note: camera 'cam1': 3 frames were taken off, as chosen" in out


def test_exchanged_sides_are_counted_when_they_go_back(run, session, tmp_path):
    points = seen(session, [TRUTH])
    for left, right in (("LHip", "RHip"), ("LKnee", "RKnee"), ("LAnkle", "RAnkle")):
        pair = [BODY_25.points.index(left), BODY_25.points.index(right)]
        points[3, 2][:, pair] = points[3, 2][:, pair[::-1]]
    folder = write_openpose(tmp_path / "k", session.camera_names, points)
    assert run("import", session.folder, folder, "--as", "mp")[0] == 0
    words = ("export", session.folder, "--like", "mp", "--exchange-sides")
    status, out, _ = run(*words, "--out", tmp_path / "back")
    last = "left and right were exchanged in 1 view of 1 frame, in 1 file; all else is as imported"
    assert (status, out.splitlines()[-1]) == (0, last)
    status, out, _ = run(*words, "--out", tmp_path / "again", "--json")
    assert json.loads(out)["exchanged"] == [{"frame": 3, "person": "ann", "view": "cam2"}]
    assert_refused(
        run("export", session.folder, "--out", tmp_path / "m.trc", "--exchange-sides"),
        ["with --like NAME, found no --like"],
    )


def test_damaged_observations_are_listed_with_the_reason(run, session, keypoints):
    run("import", session.folder, keypoints, "--as", "mp")
    (session.folder / "observations" / "mp" / "points.npz").write_bytes(b"x")
    out = output_of(run("info", session.folder, "--no-check"))
    assert "warning: observations mp: " in out


def test_masks_are_used_and_left(run, tmp_path):
    session = make_session(tmp_path / "s", N, size=SIZE)
    for source in session.cameras:
        source.footage.touch()
    folder = write_masks(tmp_path / "m", session.camera_names, person_masks(N, 4))
    out = output_of(run("import", session.folder, folder, "--as", "net", "--dry-run"))
    lines = out.splitlines()
    assert lines[0] == "net: masks, of anyone"
    assert lines[1] == f"  cam0: {folder}/cam0, 6 masks, people in frames 0 to 5, 6.2% of the picture"
    assert lines[-1] == "nothing was stored"
    assert not (session.folder / "observations").exists()
    out = output_of(run("import", session.folder, folder, "--as", "net", "--values", "ann=1"))
    assert out.startswith("net: masks, of ann\n")
    assert out.endswith("stored as net; the cameras use these masks as silhouettes\n")
    used = "  masks net: 24 pictures of cam0, cam1, cam2, cam3, masks, used by cam0, cam1, cam2, cam3"
    assert used in run("info", session.folder, "--no-check")[1]
    status, out, _ = run("relink", session.folder, "--no-masks")
    assert (status, out.count(" are left")) == (0, 4)
    assert "cam3, masks, not used" in run("info", session.folder, "--no-check")[1]
    own = session.folder / "observations" / "net" / "masks"
    status, out, _ = run("relink", session.folder, "--masks", own, "--json")
    assert (status, json.loads(out)["relinked"][0]["old"]) == (0, None)
    assert used in run("info", session.folder, "--no-check")[1]
    (session.folder / "observations" / "net" / "masks.toml").write_text("x")
    assert "warning: masks net: " in run("info", session.folder, "--no-check")[1]


def test_masks_of_the_wrong_size_name_the_option(run, tmp_path):
    session = make_session(tmp_path / "s", N, size=SIZE)
    folder = write_masks(tmp_path / "m", session.camera_names, person_masks(N, 4, (40, 30)))
    status, _, err = run("import", session.folder, folder, "--as", "net")
    assert (status, err.count("\n")) == (1, 1)
    assert "a mask of 80x60 pixels, found 40x30; export them from this footage, or say --picture-size 40x30" in err


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--person", "bob"], "unknown person 'bob'"),
        (["--person", "ann", "ann"], "each person of --person once"),
        (["--confidence", "2"], "--confidence above 0 and at most 1, found 2"),
        (["--picture-size", "640"], "--picture-size as WIDTHxHEIGHT"),
        (["--cameras", "cam0"], "--cameras as NAME=VALUE"),
        (["--joint-map", "nothing.toml"], "joint map nothing.toml not found"),
        (["--values", "ann"], "--values as NAME=VALUE"),
        (["--values", "ann=1"], "masks, whose values tell people apart, found key points or joints"),
        (["--axes", "x,z,y"], "expected joints, which have axes, found key points or masks; give no axes"),
        (["--masks"], "expected masks among the files, found OpenPose JSON"),
        (["--cameras", "cam9=x"], "unknown camera 'cam9'"),
    ],
)
def test_wrong_words(run, session, keypoints, words, expected):
    assert_refused(run("import", session.folder, keypoints, "--as", "mp", *words), [expected])


def test_no_files(run, session):
    assert_refused(run("import", session.folder, "--as", "mp"), ["a folder or files to import after the session"])


def test_export_like_refuses_options_of_formats(run, session, tmp_path):
    write_trc(tmp_path / "a.trc", BODY_25.points, TRUTH, 30.0)
    assert run("import", session.folder, tmp_path / "a.trc", "--as", "trc")[0] == 0
    like = ["export", session.folder, "--out", tmp_path / "b.trc", "--like", "trc"]
    assert_refused(run(*like, "--units", "mm"), ["--like without --units: the files stay as they came; leave it out"])
    assert_refused(run(*like, "--keyframes-only"), ["--like without --keyframes-only"])
    assert_refused(run(*like, "--overwrite"), ["--like without --overwrite"])
    shifted = ["import", session.folder, tmp_path / "a.trc", "--as", "late", "--offset", "cam0=2"]
    assert_refused(run(*shifted), ["key points or masks, whose views may be late, found joints; give no offsets"])
    assert_refused(run(*like[:-2], "--poses", "all"), ["--poses, --plain-joints and --exchange-sides with --like NAME"])
    assert_refused(run(*like[:-1], "no"), ["found 'no'; the session has trc"])
    assert run(*like)[0] == 0
    assert np.array_equal((tmp_path / "b.trc").read_bytes(), (tmp_path / "a.trc").read_bytes())
