"""`quadrille check`: a camera that is off is named, corrected and can be undone; what it refuses."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import WITH_POSE, assert_refused

from app.cli.calibration.check import clock_notes
from app.cli.track_report import format_summary
from tracker.footage.start_times import StartTime, time_code_frames
from tracker.formats.anipose import read_calibration, write_calibration
from tracker.geometry.camera_correction import N_CORRECTIONS, TIME, corrected
from tracker.session import footage_clocks, synchronize
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import MarkChange

FRAMES = range(10, 34)


@pytest.fixture
def posed(run, session):
    """The sample with known poses on some frames."""
    assert run("init", session, *WITH_POSE, "--frame", "10", "--json")[0] == 0
    assert run("track", session, "--frames", f"{FRAMES.start}:{FRAMES.stop}", "--no-whole-run", "--json")[0] == 0
    return session


def turn(session, name, yaw_deg):
    """Turn a camera in the calibration, as if it had been knocked since."""
    path = session / "calibration.toml"
    off = np.radians([0, yaw_deg, 0, 0, 0, 0, 0, 0, 0])
    cameras = read_calibration(path)
    assert name in [c.name for c in cameras]
    write_calibration(path, [corrected(c, off) if c.name == name else c for c in cameras])


@pytest.mark.slow
def test_a_turned_camera_is_named_corrected_and_undone(run, posed):
    status, out, _ = run("check", posed, "--json")
    assert (status, json.loads(out)["named"]) == (0, [])
    turn(posed, "LEFT", 1.0)
    wrong = (posed / "calibration.toml").read_text()
    status, out, _ = run("check", posed, "--json", "--apply", "--max-frames", "8")
    report = json.loads(out)
    assert (status, report["named"], report["applied"], report["outdated_sizes"]) == (0, ["LEFT"], ["LEFT"], [])
    left = next(c for c in report["cameras"] if c["name"] == "LEFT")
    # Somebody who stays in one place looks the same from a camera that was turned and from one that was moved.
    assert left["kind"] in ("rotation", "position")
    assert left["misfit_px"] > 5
    assert left["sigma"]["rotation_deg"][1] > 0
    assert left["since_frame"] is None
    assert report["explained"]["held_out_better"] > 0.8 * report["explained"]["held_out_frames"]
    assert (posed / "calibration.toml").read_text() != wrong
    with AnnotationStore(posed / "annotations.sqlite") as store:
        assert store.history(1)[0].label == "calibration of LEFT corrected"
    assert json.loads(run("check", posed, "--json")[1])["named"] == []


@pytest.mark.slow
def test_the_end_of_a_run_says_that_a_camera_is_off_and_nothing_of_healthy_ones(run, posed):
    words = ("track", posed, "--frames", "10:44", "--no-whole-run", "--json")
    assert json.loads(run(*words)[1])["contradiction"] is None
    turn(posed, "LEFT", 1.5)
    summary = json.loads(run(*words)[1])
    assert "camera LEFT is" in summary["contradiction"]
    assert "or the body has other sizes" in format_summary(summary)
    assert "run quadrille check to measure it" in format_summary(summary)
    few = (*words[:3], "10:30", *words[4:])  # not 20 frames with two on both sides
    assert json.loads(run(*few)[1])["contradiction"] is None


@pytest.mark.slow
def test_a_healthy_calibration_stays(run, posed):
    before = (posed / "calibration.toml").read_bytes()
    status, out, _ = run("check", posed, "--apply", "--max-frames", "5")
    assert (status, out) == (0, "no camera is off: the contours agree with the calibration\n")
    assert (posed / "calibration.toml").read_bytes() == before


def test_without_poses_it_says_what_to_do(run, session):
    assert_refused(run("check", session), ["expected at least 3 frames with poses", "track the recording first"])
    assert_refused(run("check", session, "--max-frames", "2"), ["--max-frames", "from 3", "found 2"])


def test_frames_outside_of_the_poses_are_refused(run, session):
    with AnnotationStore(session / "annotations.sqlite") as store:
        store.commit("nothing", [MarkChange("person", 0, False, False)])
    assert_refused(run("check", session, "--frames", "0:10"), ["expected at least 3 frames", "found 0"])


def test_motion_against_time_codes(session, monkeypatch):
    """The time codes agree with the session; the motion says that a camera is three frames late."""
    codes = dict.fromkeys((c.camera.name for c in load_session(session).cameras), "10:00:00:12")

    def read(path, where):
        return (StartTime("time code", codes[path.stem], time_code_frames(codes[path.stem], 25.0) / 25, 1 / 25),)

    for module in (footage_clocks, synchronize):
        monkeypatch.setattr(module, "read_start_times", read)
    corrections = np.zeros((len(codes), N_CORRECTIONS))
    found = SimpleNamespace(corrections=corrections, middle_s=0.0, lost={})
    assert clock_notes(load_session(session), found) == []
    corrections[1, TIME] = 3 / 25  # s later
    (note,) = clock_notes(load_session(session), found)
    assert note.startswith("the motion and the time code disagree by up to 3.0 frames: offsets FRONT=0 RIGHT=-3")
