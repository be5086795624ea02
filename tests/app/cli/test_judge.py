"""`quadrille judge`: its JSON, text and report, and what it refuses. The tracking is that of known poses."""

import json

import numpy as np
import pytest
from command_line import SAMPLE, assert_refused, output_of
from observed_people import BODY_25

from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.evaluation.judging import judge
from tracker.evaluation.references import read_joints
from tracker.formats.model_toml import format_model
from tracker.formats.trc import write_trc
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange, PoseRecord
from tracker.session.store.stored_poses import read_stored_poses

FRAMES, EXCHANGED = range(10, 22), (14, 15)


@pytest.fixture
def imported(run, session, tmp_path, monkeypatch, film_once):
    """The sample with imported true joints, whose legs are exchanged on two frames."""
    loaded = load_session(session)
    truth, model = read_joints(SAMPLE / "truth.trc", loaded.fps), loaded.people[0].model
    names = list(BODY_25.points)
    where = BODY_25.counterparts(names)
    points = np.full((loaded.n_frames, len(names), 3), np.nan)
    for i, name in enumerate(names):
        if where[name] and all(j in truth.names for j in where[name]):
            points[:, i] = np.mean([truth.points[:, truth.names.index(j)] for j in where[name]], axis=0)
    for joint in ("Hip", "Knee", "Ankle"):
        a, b = names.index(f"L{joint}"), names.index(f"R{joint}")
        for k in EXCHANGED:
            points[k, [a, b]] = points[k, [b, a]]
    write_trc(tmp_path / "net.trc", names, points, loaded.fps)
    assert run("import", session, tmp_path / "net.trc", "--as", "net")[0] == 0

    def best_motion(session, observer, name, people, settings, sink):
        with AnnotationStore(session.annotations_path) as store:
            revision = store.add_model_revision("person", format_model(model))
            errors = np.broadcast_to(0.02**2 * np.eye(3), (len(model.point_names), 3, 3))
            changes, pose = [], None
            for k in FRAMES:
                pose = fit_to_points(model, dict(zip(truth.names, truth.points[k], strict=True)), pose).pose
                changes.append(
                    PoseChange("person", k, PoseRecord(pose, ("tracked",) * len(pose), revision, errors=errors))
                )
            store.commit("known", changes)
        return {0: read_stored_poses(session.annotations_path, "person", model, FRAMES)}

    monkeypatch.setattr(judge, "best_motion", best_motion)
    return session


@pytest.mark.slow
def test_exchanged_legs_come_first(run, imported):
    report = json.loads(output_of(run("judge", imported, "--of", "net", "--json")))
    assert [f["frame"] for f in report["frames"]] == list(FRAMES)
    assert {(d["frame"], d["limb"]) for d in report["worst"][:4]} == {
        (k, f"{side} leg") for k in EXCHANGED for side in ("left", "right")
    }
    assert all(d["reason"] == "legs exchanged" and d["probability_off"] > 0.99 for d in report["worst"][:4])
    assert report["worst"][4]["probability_off"] < 0.5
    assert report["people"]["person"]["share_in_order"] == pytest.approx(1 - 2 / len(FRAMES))
    arm = next(f for f in report["frames"] if f["frame"] == 14)["limbs"]["left arm"]
    assert set(arm) == {"probability_off", "distance_mm", "reason"}


@pytest.mark.slow
def test_the_report_is_one_file_with_pictures(run, imported, tmp_path):
    path = tmp_path / "judged.html"
    out = output_of(run("judge", imported, "--of", "net", "--report", path))
    assert "person: 83% of 12 frames in order" in out
    assert "frame 14: legs exchanged (100%)" in out
    text = path.read_text("utf-8")
    assert text.count("<figure>") == 2  # left and right leg; frames close together are one entry
    assert text.count("data:image/jpeg;base64,") == 2 * 4
    assert "http" not in text
    assert_refused(run("judge", imported, "--of", "net", "--report", path), ["a path that is free", "--overwrite"])
    nowhere = tmp_path / "nothing" / "judged.html"
    assert_refused(run("judge", imported, "--of", "net", "--report", nowhere), ["--report at a file in a folder"])
    assert path.read_text("utf-8") == text


@pytest.mark.slow
def test_unknown_observations_are_refused(run, imported):
    assert_refused(run("judge", imported, "--of", "other"), ["other", "net"])
