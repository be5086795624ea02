"""Joint files of other programs at the command line: where their rows go, and what is asked."""

import json

import numpy as np
import pytest
from command_line import SAMPLE, assert_refused, stored

from app.cli.evaluate import _format, evaluate
from app.cli.target import load_target
from tracker.evaluation.references import read_reference
from tracker.formats.trc import read_trc, write_trc

TRUTH = SAMPLE / "truth.trc"
"""50 frames at 25 per second, from frame 0."""


def written(path, frames, *, number=0, stamp=0, rate=25.0, origin=None, units="m"):
    """The truth of some frames: Frame# and Time are those of the session plus `number` and `stamp` frames."""
    truth = read_trc(TRUTH)
    write_trc(path, truth.names, truth.points[list(frames)], 25.0, frames=frames, units="m")
    lines = path.read_text().splitlines()
    fields = lines[2].split("\t")
    fields[0], fields[4], fields[6] = f"{rate:g}", units, str(frames[0] + number if origin is None else origin)
    lines[2] = "\t".join(fields)
    for i, frame in enumerate(frames, 6):
        cells = lines[i].split("\t")
        lines[i] = "\t".join([str(frame + number), f"{(frame + stamp) / 25:.6f}", *cells[2:]])
    path.write_text("\n".join(lines) + "\n")
    return path


def joints_of_frame(session, frame):
    return stored(session)[frame].settings["joints"]["left_wrist"]


def true_wrist(frame):
    truth = read_trc(TRUTH)
    return truth.points[frame, truth.names.index("left_wrist")].tolist()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "stamp", "frames"),
    [(1, 0, range(20, 40)), (0, 0, range(20, 40)), (1, 1, range(50)), (1, 0, [*range(10), *range(20, 50)])],
)
def test_init_takes_the_row_of_its_frame(run, session, tmp_path, number, stamp, frames):
    path = written(tmp_path / "a.trc", list(frames), number=number, stamp=stamp)
    for frame in (frames[0], frames[-1]):
        assert run("init", session, "--joints", path, "--frame", frame)[0] == 0
        assert joints_of_frame(session, frame) == pytest.approx(true_wrist(frame), abs=1e-6)


@pytest.mark.slow
def test_init_says_where_the_file_begins(run, session, tmp_path):
    path = written(tmp_path / "a.trc", list(range(20, 40)))
    _, out, _ = run("init", session, "--joints", path, "--frame", "25")
    assert "note: the first row of the file, Frame# 20 at 0.800 s, is frame 20" in out
    report = json.loads(run("init", session, "--joints", path, "--frame", "25", "--json")[1])
    assert report["notes"] == ["the first row of the file, Frame# 20 at 0.800 s, is frame 20"]
    expected = ["expected a row of frame 45", "frames 20 to 39", "Frame# 20 at 0.800 s, is frame 20"]
    assert_refused(run("init", session, "--joints", path, "--frame", "45"), expected)


def test_a_frame_in_a_gap(run, session, tmp_path):
    path = written(tmp_path / "a.trc", [*range(10), *range(20, 50)], number=1)
    expected = ["no row for frame 15", "lacks frames 10 to 19"]
    assert_refused(run("init", session, "--joints", path, "--frame", "15"), expected)


@pytest.mark.slow
def test_a_contradiction_is_asked_about_and_decided(run, session, tmp_path):
    path = written(tmp_path / "a.trc", list(range(20, 40)), stamp=-20)  # Frame# 20 at 0 s
    expected = ["a.trc", "Frame# 20", "Time 0 s", "--first-frame 20 or 0"]
    for words in (["init", session, "--joints", path, "--frame", 25], ["evaluate", session, "--reference", path]):
        run("init", session, "--joints", TRUTH, "--frame", 25)
        assert_refused(run(*words), expected)
    assert run("init", session, "--joints", path, "--frame", 25, "--first-frame", 20)[0] == 0
    assert joints_of_frame(session, 25) == pytest.approx(true_wrist(25), abs=1e-6)
    report = json.loads(run("evaluate", session, "--reference", path, "--first-frame", 20, "--json")[1])
    assert report["mpjpe_mm"] < 60
    shifted = json.loads(run("evaluate", session, "--reference", path, "--first-frame", 10, "--json")[1])
    assert shifted["mpjpe_mm"] > report["mpjpe_mm"]


@pytest.mark.slow
def test_a_rate_that_contradicts_the_stamps(run, session, tmp_path):
    path = written(tmp_path / "a.trc", list(range(50)), number=1, rate=50.0)
    assert_refused(run("init", session, "--joints", path, "--frame", 30), ["DataRate 50", "Time", "--clock frames"])
    assert run("init", session, "--joints", path, "--frame", 30, "--clock", "frames")[0] == 0
    assert joints_of_frame(session, 30) == pytest.approx(true_wrist(30), abs=1e-6)
    expected = ["--first-frame and --clock with joints, found poses", "truth.csv"]
    assert_refused(run("evaluate", session, "--reference", SAMPLE / "truth.csv", "--clock", "time"), expected)


@pytest.mark.slow
def test_both_say_that_a_file_was_resampled(run, session, tmp_path):
    truth = read_trc(TRUTH)
    twice = np.repeat(truth.points, 2, axis=0)[:-1]
    twice[1::2] = (truth.points[1:] + truth.points[:-1]) / 2
    write_trc(tmp_path / "a.trc", truth.names, twice, 50.0)
    note = "note: the file was resampled from 50 to 25 frames per second"
    assert note in run("init", session, "--joints", tmp_path / "a.trc", "--frame", 30)[1]
    assert joints_of_frame(session, 30) == pytest.approx(true_wrist(30), abs=1e-6)
    assert note in run("evaluate", session, "--reference", tmp_path / "a.trc")[1]


@pytest.mark.slow
def test_an_exported_range_comes_back_to_its_frames(run, session, tmp_path):
    for frame in range(20, 23):
        assert run("init", session, "--joints", TRUTH, "--frame", frame)[0] == 0
    out = run("export", session, "--format", "trc", "--out", tmp_path / "a.trc", "--frames", "20:23")[1]
    assert "Frame# counts from 1: frame 20 of the session is Frame# 21" in out
    status, out, _ = run("evaluate", session, "--reference", tmp_path / "a.trc", "--json")
    report = json.loads(out)
    assert (status, report["frames"], report["missing_reference_values"]) == (0, 3, 0)
    assert report["mpjpe_mm"] < 1e-3
    assert report["notes"] == ["the first row of the file, Frame# 21 at 0.800 s, is frame 20"]


@pytest.mark.slow
def test_evaluate_lists_lost_frames(run, session, tmp_path):
    truth = read_trc(TRUTH)
    points = truth.points.copy()
    points[[3, 4, 5], truth.names.index("left_wrist")] += 0.5
    write_trc(tmp_path / "a.trc", truth.names, points, 25.0)
    for frame in (2, 3, 4, 5, 8):
        run("init", session, "--joints", TRUTH, "--frame", frame)
    _, out, _ = run("evaluate", session, "--reference", tmp_path / "a.trc", "--stride", 1)
    assert "7 frames, 2 missing, 5 lost" in out
    assert "lost: frames 3 to 7; the worst is " in out
    assert "where the left wrist is off by " in out
    report = json.loads(run("evaluate", session, "--reference", tmp_path / "a.trc", "--stride", 1, "--json")[1])
    assert report["lost_frame_numbers"] == [3, 4, 5, 6, 7]
    assert "lost: frames" not in run("evaluate", session, "--reference", TRUTH, "--frames", "2:6")[1]


@pytest.mark.slow
def test_lost_frames_without_any_pose(run, session):
    run("init", session, "--joints", TRUTH, "--frame", 8)
    at = load_target(session, None, several=False)
    evaluation = evaluate(at, read_reference(TRUTH, at.session, 0), "6:9", "none", stride=1)
    assert "lost: frames 6 to 7, none of which has a pose" in _format(evaluation)
