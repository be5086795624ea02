"""The command line from end to end: what it prints, its exit status, and what it leaves on disk."""

import json
import shutil
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest
from command_line import SAMPLE, WITH_POSE, assert_refused, output_of, stored
from gestures import wait_for
from run_poses import Estimate, doubted

from app.cli.track import TrackArguments, settings_of
from app.server import address
from tracker.compute.kernel_cache import compiled_mark
from tracker.estimation.chamfer.tracker import ChamferTracker
from tracker.estimation.runs.run_estimate import Progress
from tracker.estimation.trajectory import solve
from tracker.formats.model_toml import load_model
from tracker.formats.pose_csv import read_pose_table, write_pose_table
from tracker.formats.trc import axes_matrix, read_trc, write_trc
from tracker.pipeline import track_session
from tracker.pipeline.methods import METHODS
from tracker.session.session import load_session
from tracker.session.store.annotation_store import AnnotationStore
from tracker.session.store.records import PoseChange


def test_new_info_init_track_evaluate(run, tmp_path):
    s = tmp_path / "s"
    status, out, _ = run("new", s, "--videos", SAMPLE, "--height", "178", "--people", "ann", "--model", "gavrila22")
    parts, made, rig = out.splitlines()
    assert parts == f"{SAMPLE} with calibration {SAMPLE}/calibration.toml, background {SAMPLE}/background"
    assert (status, made) == (0, f"made {s}: 4 cameras, 50 frames at 25 per second")
    assert "3.58 to 3.63 m from the point at which they look" in rig
    assert "heights over the floor (origin, z up) are 2.16 to 2.21 m" in rig

    status, out, err = run("info", s, "--json")
    summary = json.loads(out)
    assert (status, err) == (0, "")
    assert (summary["frames"], summary["fps"], summary["up"]) == (50, 25.0, "z")
    assert [c["name"] for c in summary["cameras"]] == ["FRONT", "RIGHT", "BACK", "LEFT"]
    assert all(c["background"] and not c["masks"] for c in summary["cameras"])
    assert summary["people"] == [
        {"name": "ann", "model": "gavrila22", "height_m": 1.78, "dofs": 22, "poses": 0, "keyframes": 0,
        "earlier_calibration": 0}
    ]  # fmt: skip

    status, out, _ = run("init", s, "--joints", SAMPLE / "truth.trc", "--frame", "20", "--json")
    summary = json.loads(out)
    assert status == 0
    assert (summary["person"], summary["frame"], len(summary["residual_mm"])) == ("ann", 20, 12)
    assert summary["mean_mm"] == pytest.approx(np.mean(list(summary["residual_mm"].values())))
    assert 1 < summary["mean_mm"] < 40

    status, out, err = run("track", s, "--frames", "20:23", "--json")
    summary = json.loads(out)  # one JSON object and nothing else
    assert (status, err) == (0, "")
    assert (summary["frames"], summary["people"]) == (3, ["ann"])
    assert 0 < summary["mean_cost_px"] < 19.2

    status, out, _ = run("evaluate", s, "--reference", SAMPLE / "truth.trc", "--json")
    summary = json.loads(out)
    assert status == 0
    assert (summary["frames"], summary["missing_frames"], summary["lost_frames"]) == (3, 0, 0)
    assert summary["mpjpe_mm"] < 60
    assert run("evaluate", s, "--reference", SAMPLE / "truth.trc", "--frames", "18:23", "--json")[0] == 0

    _, out, _ = run("info", s)
    assert "person ann: gavrila22 of 1.78 m, 22 degrees of freedom, 3 poses, 1 keyframes" in out
    with_angles = json.loads(run("evaluate", s, "--reference", SAMPLE / "truth.csv", "--json")[1])
    assert with_angles["axis_error_deg"] < 15
    _, out, _ = run("evaluate", s, "--reference", SAMPLE / "truth.csv")
    assert "MPJPE" in out
    assert "part axes" in out
    assert sorted(p.name for p in s.iterdir()) == [
        "annotations.sqlite", "backups", "calibration.toml", "identity.txt", "models", "session.toml",
    ]  # fmt: skip


def test_version(run):
    assert run("--version") == (0, f"quadrille {metadata.version('quadrille-mocap')}\n", "")


@pytest.mark.slow
def test_init_says_where_the_body_is_and_refuses_what_is_nowhere(run, session, tmp_path):
    status, out, _ = run("init", session, "--joints", SAMPLE / "truth.trc", "--json")
    views = json.loads(out)["views"]
    assert (status, list(views)) == (0, ["FRONT", "RIGHT", "BACK", "LEFT"])
    assert all(2 < view["distance_m"] < 7 and view["n_inside"] == view["n_points"] for view in views.values())
    out = run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", "1")[1]
    assert out.splitlines()[1] == f"  view FRONT: {views['FRONT']['distance_m']:.2f} m, in the picture"

    joints = read_trc(SAMPLE / "truth.trc")
    write_trc(tmp_path / "far.trc", joints.names, joints.points + np.array([0.0, 40.0, 30.0]), 25.0)
    expected = [
        "expected 'person' in the picture",
        "'FRONT' 4",
        "m, behind the camera",
        "px beside the picture",
        "--axes",
    ]
    far = ["init", session, "--joints", tmp_path / "far.trc", "--frame", "2"]
    assert_refused(run(*far), ["expected people that two cameras show", ", 40.01,", "--axes"])
    assert_refused(run(*far, "--unusual"), expected)
    assert sorted(stored(session)) == [0, 1]

    write_trc(tmp_path / "small.trc", joints.names, joints.points / 1000, 25.0)
    small = ["init", session, "--joints", tmp_path / "small.trc", "--frame", "2"]
    assert_refused(run(*small), ["found one 0.0017", "times 1000 the points fit one of 1.7", "--unusual"])
    assert "note: these joints fit no body of 1.78 m: check the Units" in run(*small, "--unusual")[1]


def test_evaluate_notes_a_reference_that_is_of_something_else(run, session, tmp_path):
    run("init", session, *WITH_POSE)
    same = json.loads(run("evaluate", session, "--reference", SAMPLE / "truth.trc", "--json")[1])
    assert same["notes"] == []
    joints = read_trc(SAMPLE / "truth.trc")
    write_trc(tmp_path / "y_up.trc", joints.names, joints.points[:40] @ axes_matrix("x,-z,y"), 25.0)
    out = run("evaluate", session, "--reference", tmp_path / "y_up.trc")[1]
    length, apart = [line for line in out.splitlines() if line.startswith("note: ")]
    assert "the session has 50 frames and the reference 40" in length
    assert "with --axes x,-z,y it would be 0.0" in apart
    assert "--axes" not in run("evaluate", session, "--reference", tmp_path / "y_up.trc", "--axes", "x,-z,y")[1]


@pytest.mark.slow
def test_tracking_leaves_keyframes_and_can_be_undone(run, session):
    run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", "0")
    run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", "2")
    before = stored(session)
    status, out, err = run("track", session, "--frames", "0:4")
    assert status == 0
    assert out.startswith("tracked person over 4 frames, mean cost ")
    assert "tracking: 4 of 4" in err  # plain lines where there is no terminal
    after = stored(session)
    assert sorted(after) == [0, 1, 2, 3]
    for k in (0, 2):
        np.testing.assert_array_equal(after[k].values, before[k].values)
        assert after[k].keyframe
        assert after[k].sources[0] == "imported"
    for k in (1, 3):
        assert after[k].sources == ("tracked",) * 22
        assert after[k].settings["method"] == "chamfer"
        assert after[k].cost_px > 0
    with AnnotationStore(session / "annotations.sqlite") as store:
        assert store.undo() == "track frames 0:4"  # one entry, however many frames
        assert [row.frame for row in store.frames("person")] == [0, 2]


@pytest.mark.slow
def test_the_contour_method_reports_its_normal_matrices(run, session):
    run("init", session, *WITH_POSE)
    words = ("track", session, "--frames", "0:2", "--method", "contour", "--paper")
    _, out, _ = run(*words)
    assert "person: normal matrix of rank 22 of 22 or more, condition number " in out
    found = json.loads(run(*words, "--json")[1])["normal_matrices"]["person"]
    assert (found["lowest_rank"], found["n_dofs"]) == (22, 22)
    assert found["median_condition"] > 10
    assert json.loads(run("track", session, "--frames", "0:2", "--json")[1])["normal_matrices"] == {}


def test_every_tracking_method_can_be_named():
    choices = get_args(get_type_hints(TrackArguments)["method"])
    assert set(choices) == METHODS.keys()
    for method in choices:
        arguments = TrackArguments(SAMPLE, method=method)
        assert settings_of(arguments) == METHODS[method].settings()
        assert settings_of(replace(arguments, paper=True)) == METHODS[method].paper.settings()


@pytest.mark.slow
@pytest.mark.parametrize("compiled", [False, True])
def test_tracking_says_that_kernels_may_have_to_be_compiled(run, session, tmp_path, monkeypatch, compiled):
    monkeypatch.setattr("tracker.compute.kernel_cache._folder", lambda: tmp_path)
    if compiled:
        compiled_mark().touch()
    run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", "0")
    assert ("it may take a minute or two" in run("track", session, "--frames", "0:2")[2]) is not compiled


@pytest.mark.slow
def test_tracking_leaves_what_is_locked(run, session):
    run("init", session, *WITH_POSE, "--frame", "0")
    with AnnotationStore(session / "annotations.sqlite") as store:
        store.set_setting("locked", {"person": ["left_elbow.extension", "no_joint.twist"], "nobody": ["torso.x"]})
    names = load_session(session).people[0].model.value_names
    assert run("track", session, "--frames", "0:4")[0] == 0
    elbow = np.array([p.values[names.index("left_elbow.extension")] for p in stored(session).values()])
    knee = np.array([p.values[names.index("left_knee.extension")] for p in stored(session).values()])
    np.testing.assert_array_equal(elbow, elbow[0])
    assert len(np.unique(knee)) == 4


@pytest.mark.slow
def test_interrupted_tracking_keeps_what_is_done(run, session, monkeypatch):
    run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", "0")
    original = ChamferTracker.estimates

    def interrupted(*arguments):
        for estimate in original(*arguments):
            if estimate.frame == 3:
                raise KeyboardInterrupt
            yield estimate

    monkeypatch.setattr(ChamferTracker, "estimates", interrupted)
    monkeypatch.setattr(solve, "_BLOCK_FRAMES", 2)
    monkeypatch.setattr(solve, "FRAMES_AT_ONCE", 2)
    status, out, _ = run("track", session, "--no-whole-run", "--frames", "0:6", "--json")
    assert status == 130
    assert (json.loads(out)["frames"], json.loads(out)["stopped_at"]) == (3, 3)
    assert sorted(stored(session)) == [0, 1, 2]
    assert not (session / "lock.json").exists()
    monkeypatch.setattr(ChamferTracker, "estimates", original)
    done = stored(session)[1].time
    out = output_of(run("track", session, "--no-whole-run", "--frames", "0:6"))  # run again to resume
    assert "tracked person over 4 frames, resumed at frame 2" in out
    found = stored(session)
    assert sorted(found) == [0, 1, 2, 3, 4, 5]
    assert found[1].time == done
    assert {found[k].status for k in range(1, 6)} <= {"good", "doubtful"}
    assert len(found[3].view_costs_px) == 4
    status, out, _ = run("track", session, "--no-whole-run", "--frames", "0:6", "--json")  # a finished run starts over
    assert (json.loads(out)["frames"], json.loads(out)["resumed_at"]) == (6, None)


@pytest.mark.slow
def test_an_estimate_that_is_interrupted_leaves_the_first_pass_and_goes_on(run, session, monkeypatch):
    run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", "0")
    tracked, original, estimate = [], ChamferTracker.estimates, Estimate(0.01, doubted(3))

    def noted(*arguments):
        for found in original(*arguments):
            tracked.append(found)
            yield found

    def interrupted(run):
        yield Progress(0, 5)
        raise KeyboardInterrupt

    monkeypatch.setattr(ChamferTracker, "estimates", noted)
    monkeypatch.setattr(track_session, "estimate_run", interrupted)
    words = ("track", session, "--frames", "0:5", "--json")
    status, out, _ = run(*words)
    summary = json.loads(out)
    assert (status, summary["frames"], summary["moved_by_estimate"]) == (130, 5, 0)
    assert summary["stopped_at"] == tracked[-1].frame
    first, before = tracked[:5], stored(session)
    assert [f.frame for f in first] == [0, 1, 2, 3, 4]
    for k in (1, 2, 3, 4):
        np.testing.assert_array_equal(before[k].values, first[k].poses[0])

    tracked.clear()
    monkeypatch.setattr(track_session, "estimate_run", estimate)
    summary = json.loads(run(*words)[1])  # run again: the backward pass and the estimate
    assert {f.frame for f in tracked[:2]} == {4, 3}
    assert (summary["frames"], summary["stopped_at"], summary["moved_by_estimate"]) == (0, None, 1)
    assert summary["statuses"] == {"person": {"good": 4, "doubtful": 1}}
    for k in (1, 2, 3, 4):
        moved = first[k].poses[0] + 0.01 * (np.arange(len(first[k].poses[0])) == 1)
        np.testing.assert_array_equal(stored(session)[k].values, moved)
    summary = json.loads(run(*words)[1])  # a finished run starts over, as one entry
    assert (summary["frames"], summary["resumed_at"]) == (5, None)
    assert "all frames together moved a limb in 1 pose\n" in run(*words[:-1])[1]
    with AnnotationStore(session / "annotations.sqlite") as store:
        assert [store.undo() for _ in range(4)] == ["track frames 0:5"] * 4
        assert [row.frame for row in store.frames("person")] == [0]
    estimate.asked.clear()
    assert json.loads(run(*words, "--no-whole-run")[1])["moved_by_estimate"] == 0
    assert json.loads(run(*words, "--paper")[1])["moved_by_estimate"] == 0
    assert estimate.asked == []


@pytest.mark.slow
def test_going_on_is_as_if_never_stopped(run, session, monkeypatch):
    run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", "0")
    run("track", session, "--no-whole-run", "--frames", "0:4")
    run("track", session, "--no-whole-run", "--frames", "4:5")  # the motion before is known
    stepwise = stored(session)[4].values
    run("track", session, "--no-whole-run", "--frames", "0:5")
    np.testing.assert_allclose(stored(session)[4].values, stepwise, atol=2e-3)


@pytest.mark.slow
def test_backward_and_paper(run, session):
    run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", "5")
    status, out, _ = run("track", session, "--frames", "3:6", "--backward", "--paper", "--theta", "12", "--json")
    assert (status, json.loads(out)["frames"]) == (0, 3)
    found = stored(session)
    assert sorted(found) == [3, 4, 5]
    assert found[3].settings["outliers"] == "paper"
    assert found[3].settings["theta_px"] == 12.0
    assert tuple(found[3].settings["search"]["passes"]) == (1.0,)


@pytest.mark.slow
def test_several_people(run, tmp_path):
    s = tmp_path / "s"
    words = ("--calibration", SAMPLE / "calibration.toml", "--videos", *sorted(SAMPLE.glob("*.mp4")))
    assert run("new", s, *words, "--people", "ann", "bob", "--height", "ann=1.6")[0] == 0
    assert [p.model.height_m for p in load_session(s).people] == [1.6, 1.75]
    truth = ("--joints", SAMPLE / "truth.trc")
    assert_refused(run("init", s, *truth), ["--person", "ann, bob"])
    assert_refused(run("init", s, *truth, "--person", "eve"), ["ann, bob", "'eve'"])
    assert run("init", s, *truth, "--person", "bob")[0] == 0
    assert_refused(run("track", s, "--frames", "0:2"), ["a pose of 'ann' at frame 0"])
    refused = run("track", s, "--frames", "0:2", "--person", "bob", "--paper")
    assert_refused(refused, ["gavrila22 of 'bob'", "gavrila38 of 38", "--model gavrila22"])
    assert sorted(stored(s, "bob")) == [0]
    assert run("track", s, "--frames", "0:2", "--person", "bob", "--json")[0] == 0
    assert stored(s, "ann") == {}
    assert sorted(stored(s, "bob")) == [0, 1]
    assert_refused(run("evaluate", s, "--reference", SAMPLE / "truth.trc", "--person", "ann"), ["'ann' has no poses"])


def test_simulate(run, tmp_path):
    options = ("--frames", "2", "--cameras", "2", "--size", "160", "120", "--body", "model", "--masks")
    options += ("--fisheye", "cam2")
    status, out, err = run("simulate", tmp_path / "sim", *options)
    assert (status, out) == (0, f"made {tmp_path / 'sim'}\n")
    assert err.splitlines()[-1].startswith("rendering: 4 of 4, ")  # an image of each camera for each frame
    made = load_session(tmp_path / "sim")
    assert (made.n_frames, [c.camera.name for c in made.cameras]) == (2, ["cam1", "cam2"])
    assert {c.camera.size for c in made.cameras} == {(160, 120)}
    assert [c.camera.fisheye for c in made.cameras] == [False, True]
    for name in ("truth.trc", "truth.csv", "truth_model.toml", "masks/cam2/000001.png", "background/cam1.png"):
        assert (tmp_path / "sim" / name).is_file(), name
    assert run("info", tmp_path / "sim")[0] == 0
    assert_refused(run("simulate", tmp_path / "sim"), ["exists already"])
    assert_refused(run("simulate", tmp_path / "no", "--scene", "moonwalk"), ["elbow_rotation"])
    assert_refused(run("simulate", tmp_path / "no", "--fisheye", "cam1"), ["FRONT, RIGHT, BACK, LEFT or all", "cam1"])
    assert [p.name for p in tmp_path.iterdir()] == ["sim"]


@pytest.mark.slow
def test_without_a_command_the_page_is_opened(run, session, monkeypatch):
    asked, samples, browsed = [], [], []
    monkeypatch.setattr(
        "app.server.workbench.serve_until_closed",
        lambda found, doorway, *_: asked.append((found.folder, doorway.serving)),
    )
    monkeypatch.setattr("app.session.samples.sample_copy", lambda *words: samples.append(words) or session)
    monkeypatch.setattr("app.server.startup_server.listen", lambda host, _: address.listen(host, 0))
    monkeypatch.setattr("app.server.startup_server.webbrowser.open", browsed.append)
    assert run()[0] == 0
    assert run(session, "--port", "0", "--no-browser")[0] == 0
    assert run("open", session)[0] == 0
    assert samples == [("tango", False)]
    assert [folder for folder, _ in asked] == [session] * 3
    assert (asked[0][1].host, asked[0][1].port) == ("127.0.0.1", None)
    assert (asked[1][1].port, asked[1][1].browser) == (0, False)
    wait_for(lambda: len(browsed) == 2)


def test_init_takes_a_pose_from_a_table(run, session, tmp_path):
    assert run("init", session, "--method", "poses", "--poses", SAMPLE / "truth.csv", "--frame", "3")[0] == 0
    with AnnotationStore(session / "annotations.sqlite", read_only=True) as store:
        record = store.pose("person", 3)
    assert record.keyframe
    assert set(record.sources) == {"imported"}
    assert np.allclose(record.values, read_pose_table(SAMPLE / "truth.csv").values[3])
    other = load_model("gavrila34", 1.7)
    write_pose_table(tmp_path / "other.csv", other, other.neutral()[None])
    assert_refused(
        run("init", session, "--method", "poses", "--poses", tmp_path / "other.csv"),
        ["'gavrila34'", "without left_hip.elevation, right_hip.elevation, with neck.abduction"],
    )
    assert_refused(run("init", session, "--method", "poses"), ["--poses FILE"])
    few = tmp_path / "few.csv"
    few.write_text("\n".join((SAMPLE / "truth.csv").read_text().splitlines()[:6]) + "\n")
    assert_refused(run("init", session, "--method", "poses", "--poses", few, "--frame", "3"), ["of frame 3", "[0, 1]"])


def test_samples_are_opened_as_working_copies_by_name(run, monkeypatch, tmp_path):
    asked, quiet = [], ("--port", "0", "--no-browser")
    monkeypatch.setattr("app.server.workbench.serve_until_closed", lambda found, *_: asked.append(found.folder))
    monkeypatch.setattr("app.session.samples.user_data_path", lambda *_, **__: tmp_path)
    assert run("--sample", "elbow_rotation", *quiet)[0] == 0
    assert asked == [tmp_path / "samples" / "elbow_rotation"]
    (asked[0] / "mine.txt").write_text("kept")
    assert run("--sample", "elbow_rotation", *quiet)[0] == 0
    assert (asked[0] / "mine.txt").exists()
    assert run("--sample", "elbow_rotation", "--start-again", *quiet)[0] == 0
    assert not (asked[0] / "mine.txt").exists()
    assert_refused(run("--sample", "waltz"), ["elbow_rotation, tango", "waltz"])
    assert_refused(run("some/session", "--sample", "tango"), ["some/session and --sample"])
    assert_refused(run("some/session", "--start-again"), ["some/session and --start-again"])


@pytest.mark.slow
def test_poses_of_a_reference_that_is_a_session(run, session, tmp_path):
    other = Path(shutil.copytree(SAMPLE, tmp_path / "other"))
    for folder in (session, other):
        run("init", folder, "--joints", SAMPLE / "truth.trc")
    with AnnotationStore(other / "annotations.sqlite") as store:
        record = store.pose("person", 0)
        moved = record.values + np.pad([0.03, 0.0, 0.04], (0, 19))
        store.commit("move", [PoseChange("person", 0, type(record)(moved, record.sources, record.model_revision))])
    summary = json.loads(run("evaluate", session, "--reference", other, "--json")[1])
    assert summary["mpjpe_mm"] == pytest.approx(50)
    assert summary["axis_error_deg"] == pytest.approx(0, abs=1e-6)


@pytest.mark.slow
def test_every_second_frame_with_some_cameras(run, session):
    """Frames between get no pose; costs are those of all cameras of the session."""
    run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", "0")
    names = [c.camera.name for c in load_session(session).cameras]
    status, out, _ = run("track", session, "--frames", "0:7", "--stride", "2", "--cameras", *names[1:], "--json")
    assert (status, json.loads(out)["frames"]) == (0, 4)
    found = stored(session)
    assert sorted(found) == [0, 2, 4, 6]
    for k in (2, 4, 6):
        assert (len(found[k].view_costs_px), found[k].status != "") == (len(names), True)
    status, out, _ = run("evaluate", session, "--reference", SAMPLE / "truth.trc", "--json")
    errors = json.loads(out)
    assert (errors["frames"], errors["missing_frames"], errors["fps"]) == (4, 0, load_session(session).fps / 2)
    assert [f["frame"] for f in errors["per_frame"]] == [0, 2, 4, 6]
    assert errors["per_frame"][0]["status"] == "keyframe"
    assert errors["mpjpe_mm"] < 60
    text = run("evaluate", session, "--reference", SAMPLE / "truth.trc")[1]
    assert "acceleration error" in text
    assert "without offset" in text


@pytest.mark.slow
def test_strides_and_cameras_that_are_none(run, session):
    run("init", session, "--joints", SAMPLE / "truth.trc", "--frame", "0")
    assert_refused(run("track", session, "--stride", "0"), ["--stride as a whole number from 1, found 0"])
    assert_refused(run("track", session, "--cameras", "attic"), ["unknown camera 'attic' among --cameras"])
