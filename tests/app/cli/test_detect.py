"""`quadrille detect`, with a detector that knows the truth."""

import json
from contextlib import nullcontext

import pytest
from command_line import assert_refused
from fake_detector import FakeDetector
from observed_people import make_session, seen, walking

from tracker.interchange.detection.detector import DetectorKind
from tracker.interchange.detection.detectors import DETECTORS, MODEL_FILES

N = 8


@pytest.fixture
def session(tmp_path, monkeypatch):
    session = make_session(tmp_path / "s", N)
    detector = FakeDetector(seen(session, [walking(N)]))
    monkeypatch.setattr("tracker.footage.recording.Recording", lambda cameras: nullcontext(detector))
    for name, models in (("fake", ()), ("blazepose", ("heavy",))):
        kind = DetectorKind(name, "knows the truth", models, lambda *_: detector)
        monkeypatch.setitem(DETECTORS.own, name, kind)
    return session.folder


@pytest.fixture
def plans(monkeypatch):
    """The plans by which people would be tracked."""
    found = []

    def track(session, plan, progress):
        found.append(plan)
        return {"stopped_at": None}

    monkeypatch.setattr("app.cli.track.track", track)
    monkeypatch.setattr("app.cli.track_report.format_summary", str)
    return found


def test_detected_people_are_shown_stored_and_known_to_other_commands(run, session):
    words = "detect", session, "--as", "net", "--detector", "fake", "--model", "own"
    status, out, _ = run(*words)
    assert (status, out.splitlines()) == (0, [
        "net: fake own, frames 0 to 7", "  people at once: 1",
        *(f"  cam{v}: people in 8 of 8 pictures" for v in range(4)), "stored as net",
    ])  # fmt: skip
    assert_refused(run(*words), ["expected a free name, found 'net', which is complete"])
    info = json.loads(run("info", session, "--json")[1])
    assert "net" in json.dumps(info)
    assert_refused(run("export", session, "--like", "net", "--out", session / "out"), ["detected", "--format"])


@pytest.mark.parametrize(("more", "expected"), [
    (["--detector", "magic"], ["expected a detector of blazepose, onnx, fake, found 'magic'"]),
    (["--model", "huge"], ["expected as the model of blazepose one of heavy, found 'huge'"]),
    (["--detector", "fake"], ["expected as the model of fake a file"]),
    (["--frames", "5:50"], ["expected --frames as A:B within 0:8"]),
])  # fmt: skip
def test_wrong_options(run, session, more, expected):
    assert_refused(run("detect", session, *more), expected)


def test_people_are_detected_and_tracked_by_one_command(run, session, plans):
    words = "track", session, "--init", "auto", "--acquire", "--detect", "--json"
    for _ in range(2):  # the second time uses what is there
        assert run(*words)[0] == 0
    assert run(*words, "--of", "net", "--frames", "2:6")[0] == 0
    assert [(p.track.keypoints, p.find.keypoints, p.acquire) for p in plans] == [
        (name, name, (0,)) for name in ("detected", "detected", "net")
    ]
    stored = json.loads(run("info", session, "--json")[1])["observations"]
    assert sorted(o["name"] for o in stored) == ["detected", "net"]


def test_a_network_is_offered_where_only_what_moves_shows_the_people(run, session, plans):
    _, _, errors = run("track", session, "--init", "auto")
    assert "no camera has a background or masks" in errors
    assert "--detect" in errors
    (plan,) = plans
    assert (plan.find.keypoints, plan.track.keypoints) == (None, None)
    assert_refused(run("track", session, "--detect"), ["expected --detect with --init auto"])


def test_missing_and_foreign_networks_are_refused(run, tmp_path):
    pytest.importorskip("ai_edge_litert")
    session = make_session(tmp_path / "s", N).folder
    words = "detect", session, "--model", "lite", "--models", tmp_path
    assert_refused(run(*words), ["expected the network pose_detection.tflite", "--get-models"])
    for name in MODEL_FILES:
        (tmp_path / name).write_bytes(b"TFL3")
    assert_refused(run(*words), ["as its makers published it, found another file"])


def test_a_command_without_a_session_is_refused(run):
    assert_refused(run("detect"), ["expected a session folder, or --get-models, found neither"])
