"""`quadrille info` on poses of a calibration that was corrected since."""

import json

import numpy as np
import pytest
from command_line import WITH_POSE, output_of

from tracker.footage.start_times import StartTime, time_code_frames
from tracker.geometry.camera_correction import N_CORRECTIONS
from tracker.pipeline.calibration_revisions import change_calibration, with_corrections
from tracker.session import footage_clocks, synchronize
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore


@pytest.mark.slow
def test_poses_of_an_earlier_calibration_are_counted(run, session):
    for frame in (3, 4):
        assert run("init", session, *WITH_POSE, "--frame", frame)[0] == 0
    loaded = load_session(session)
    corrections = np.zeros((len(loaded.cameras), N_CORRECTIONS))
    corrections[0, 1] = 0.01  # radians
    with AnnotationStore(loaded.annotations_path) as store:
        change_calibration(loaded, store, with_corrections(loaded, corrections), "corrected")
    assert run("init", session, *WITH_POSE, "--frame", 5)[0] == 0
    out = output_of(run("info", session, "--no-check"))
    assert "3 poses, 3 keyframes, 2 of an earlier calibration\n" in out
    out = output_of(run("info", session, "--no-check", "--json"))
    assert json.loads(out)["people"][0]["earlier_calibration"] == 2


def test_clocks_of_the_footage(run, session, monkeypatch):
    codes = {c.camera.name: "10:00:00:12" for c in load_session(session).cameras}
    name = list(codes)[1]

    def read(path, where):
        return (StartTime("time code", codes[path.stem], time_code_frames(codes[path.stem], 25.0) / 25, 1 / 25),)

    monkeypatch.setattr("app.session.camera_check.exchange_note", lambda loaded: None)
    for module in (footage_clocks, synchronize):
        monkeypatch.setattr(module, "read_start_times", read)
    status, out, _ = run("info", session)
    assert (status, out.count(", time code 10:00:00:12\n"), out.count("note:")) == (0, 4, 0)
    codes[name] = "10:00:00:07"
    _, out, _ = run("info", session, "--json")
    summary = json.loads(out)
    assert next(c["clock"] for c in summary["cameras"] if c["name"] == name) == "time code 10:00:00:07"
    assert summary["notes"][0].startswith("the session and the time code disagree by up to 5.0 frames: offsets FRONT=0")
    assert "note: the session and the time code" in run("info", session)[1]
    monkeypatch.setattr(footage_clocks, "read_start_times", lambda path, where: ())
    monkeypatch.setattr(synchronize, "read_start_times", lambda path, where: ())
    _, out, _ = run("info", session, "--json")
    assert [c["clock"] for c in json.loads(out)["cameras"]] == [None] * 4
