"""The programs of docs/examples run, and packages that extend the program are found by their entry points."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import cv2
import pytest
from bodies import MODELS
from command_line import SAMPLE
from installed_packages import install
from stored_motions import store_motion

import quadrille
from tracker.compute.extensions import GROUPS
from tracker.evaluation.references import read_joints
from tracker.pipeline.given_pose import set_pose_at_joints

EXAMPLES = Path(__file__).resolve().parents[2] / "docs" / "examples"


def run(*words, path=()):
    """Run Python with folders on its path; return the output."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, path)), "COLUMNS": "200"}
    done = subprocess.run([sys.executable, *map(str, words)], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture
def sample(tmp_path):
    """A copy of the bundled sample with a pose on its first frame."""
    folder = shutil.copytree(SAMPLE, tmp_path / "sample")
    session = quadrille.open_session(folder)
    set_pose_at_joints(session, 0, 0, read_joints(SAMPLE / "truth.trc", session.fps), fit_sizes=False)
    return folder


@pytest.fixture
def packages(tmp_path):
    """A folder with the packages of docs/examples, installed as pip does."""
    folder = tmp_path / "site"
    for project in EXAMPLES.glob("*/pyproject.toml"):
        described = tomllib.loads(project.read_text())["project"]
        for module in project.parent.glob("*.py"):
            folder.mkdir(exist_ok=True)
            shutil.copy(module, folder)
        info = folder / f"{described['name'].replace('-', '_')}-{described['version']}.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Name: {described['name']}\nVersion: {described['version']}\n")
        points = [
            f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in own.items())
            for group, own in described["entry-points"].items()
        ]
        (info / "entry_points.txt").write_text("\n".join(points))
    return folder


@pytest.mark.slow
def test_a_recording_is_tracked(sample, tmp_path):
    out = run(EXAMPLES / "track_recording.py", sample, tmp_path / "a.trc")
    assert "50 frames tracked" in out or "49 frames tracked" in out
    assert (tmp_path / "a.trc").is_file()


@pytest.mark.slow
def test_poses_are_drawn(tmp_path):
    session, _ = store_motion(tmp_path / "s", [MODELS["gavrila38"]], n_frames=5)
    assert "5 frames" in run(EXAMPLES / "plot_poses.py", session.folder, "left_elbow", tmp_path / "a.png")
    assert cv2.imread(str(tmp_path / "a.png")).std() > 5


@pytest.mark.slow
def test_the_notebook_draws_its_figures(tmp_path, monkeypatch):
    """Its cells run one after the other, in a folder with a session."""
    store_motion(tmp_path / "walk", [MODELS["gavrila38"]], n_frames=8)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    names = {}
    for cell in json.loads((EXAMPLES / "figures.ipynb").read_text("utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    assert all(cv2.imread(str(tmp_path / name)).std() > 5 for name in ("wrists.png", "speeds.png"))


@pytest.mark.slow
def test_a_recording_of_rerun_has_all_cameras_and_joints(packages, tmp_path):
    session, _ = store_motion(tmp_path / "s", [MODELS["gavrila38"]], n_frames=5, gaps={(0, 2)})
    words = ("export", session.folder, "--format", "rerun", "--out", tmp_path / "a.rrd")
    run("-m", "quadrille", *words, path=[packages])
    shown = run("-m", "rerun", "rrd", "print", tmp_path / "a.rrd")
    assert all(f"/world/{name}" in shown for name in (*session.camera_names, "ann/joints", "ann/bones"))


@pytest.mark.slow
def test_the_page_is_driven_from_a_program(sample, tmp_path):
    before = quadrille.read_poses(sample).joint("left_elbow")[0]
    out = run(EXAMPLES / "drive_page.py", sample, tmp_path / "a.png")
    assert "http://127.0.0.1:" in out or "http://localhost:" in out
    poses = quadrille.read_poses(sample)
    assert poses.keyframes[0]
    assert abs(poses.joint("left_elbow")[0] - before).max() > 0.02
    assert cv2.imread(str(tmp_path / "a.png")).shape[2] == 3


@pytest.mark.slow
def test_a_strangers_metric_and_exporter_are_in_help_results_and_menu(packages, tmp_path):
    session, _ = store_motion(tmp_path / "s", [MODELS["gavrila38"]], n_frames=5)
    quadrille.export(session, tmp_path / "truth.trc")
    app = ("-m", "quadrille")
    assert "roots: positions of the roots" in " ".join(run(*app, "export", "--help", path=[packages]).split())
    assert "jerk: mean jerk" in run(*app, "evaluate", "--help", path=[packages])
    out = run(*app, "evaluate", session.folder, "--reference", tmp_path / "truth.trc", path=[packages])
    assert "mean jerk" in out
    assert "m/s^3" in out
    run(*app, "export", session.folder, "--format", "roots", "--out", tmp_path / "a.txt", path=[packages])
    assert len((tmp_path / "a.txt").read_text().splitlines()) == 5
    menu = "from app.server.export_routes import FORMATS; print(*FORMATS)"
    assert "roots" in run("-c", menu, path=[packages]).split()
    assert "jerk-metric 1.0" in run(*app, "doctor", path=[packages])


@pytest.mark.slow
def test_packages_that_break_a_program_are_lines_of_the_doctor(tmp_path):
    points = "".join(f"[{group}]\nodd = odd:thing\n" for group in GROUPS)
    install(tmp_path, "odd", "print('odd text')\nraise SystemExit(3)", points)
    install(tmp_path, "broken", "", "[a]\nno equals sign\n")
    found = {f["name"]: f for f in json.loads(run("-m", "quadrille", "doctor", "--json", path=[tmp_path]))["findings"]}
    odd = [found[f"{group.removeprefix('quadrille.')} odd"] for group in GROUPS]
    assert {(f["state"], f["text"]) for f in odd} == {("warning", "of odd 1.0: SystemExit: 3")}
    assert found["entry points"]["text"].startswith("those of broken 1.0 cannot be read: TypeError")


@pytest.mark.slow
def test_a_command_loads_no_extension_that_it_does_not_use(tmp_path):
    points = "".join(f"[{group}]\nodd = odd:thing\n" for group in GROUPS)
    install(tmp_path, "odd", "print('odd text')\nraise SystemExit(3)", points)
    install(tmp_path, "broken", "", "[a]\nno equals sign\n")
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    words = [sys.executable, "-m", "quadrille", "info", str(SAMPLE), "--json"]
    done = subprocess.run(words, capture_output=True, text=True, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout)["frames"] == 50


def test_an_extension_that_fails_is_left_out_and_named(packages, tmp_path):
    (packages / "jerk_metric.py").write_text("raise ValueError('of another age')")
    environment = {**os.environ, "PYTHONPATH": str(packages)}
    words = [sys.executable, "-m", "quadrille", "evaluate", "--help"]
    done = subprocess.run(words, capture_output=True, text=True, env=environment)
    assert done.returncode == 0
    assert "'jerk' of jerk-metric 1.0 is left out: ValueError: of another age" in done.stderr
