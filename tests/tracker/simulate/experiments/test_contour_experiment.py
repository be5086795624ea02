"""The simulated experiment of KRH08: its motion, its evidence, its figures, and its report."""

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.chamfer.settings import TrackSettings
from tracker.estimation.contour.settings import ContourSettings
from tracker.formats.model_toml import load_model
from tracker.simulate.experiments.contour_experiment import (
    ACTORS,
    ContourExperiment,
    make_scene,
    run_contour_experiment,
)
from tracker.simulate.experiments.contour_report import Line, line_chart, write_contour_report
from tracker.simulate.experiments.contour_run import RunResult, contour_rms_px, observable_angles, track_scene
from tracker.simulate.experiments.smooth_motion import smooth_motion
from tracker.simulate.experiments.staged_views import StagedObserver

SMALL = ContourExperiment(n_frames=3, n_cameras=3, camera_counts=(2,))
QUICK = TrackSettings(recover=None, whole_run=False)


@pytest.mark.parametrize("name", ["knossow54", "gavrila22_cones"])
def test_every_degree_of_freedom_moves_smoothly_within_its_limits(name):
    model = load_model(name)
    poses = smooth_motion(model, 120, 30.0, seed=1)
    np.testing.assert_array_equal(model.clip(poses), poses)
    spans = np.ptp(poses, axis=0)
    assert np.all(spans > np.where(model.dof_is_length, 0.02, np.radians(3)))
    steps = np.abs(np.diff(poses, axis=0)).max(axis=0)
    assert np.all(steps < np.where(model.dof_is_length, 0.03, np.radians(6)))
    assert not np.allclose(poses, smooth_motion(model, 120, 30.0, seed=2))


@pytest.mark.parametrize("actor", ["own shape", "skinned person"])
def test_the_true_pose_lies_on_the_contours(actor):
    """The model's own contours to the pixel; a person of other bones and another shape only roughly."""
    scene = make_scene(SMALL, actor, 3)
    views = StagedObserver(scene.actor, scene.truth, scene.cameras).evidence(1)
    assert all(len(v.points_px) > 100 and v.silhouette is not None for v in views)
    true = contour_rms_px(views, PosedBody(scene.model, scene.truth[1]))
    off = scene.truth[1].copy()
    off[0] += 0.05
    assert true < (0.3 if actor == "own shape" else 6.0)
    assert contour_rms_px(views, PosedBody(scene.model, off)) > true + 1.0


def test_noise_is_that_of_the_parameter():
    scene = make_scene(SMALL, "own shape", 2)
    seen = [StagedObserver(scene.actor, scene.truth, scene.cameras, noise).evidence(0)[0] for noise in (0.0, 2.0)]
    at = np.rint(seen[1].points_px).astype(int)
    assert 0.7 < seen[0].distance[at[:, 1], at[:, 0]].mean() < 2.0  # mean of |normal| is 0.8 sigma, next contour nearer


def test_more_cameras_make_more_angles_observable():
    shares = [observable_angles(make_scene(SMALL, "own shape", n)).mean() for n in (1, 2, 6)]
    assert shares[0] < shares[1] < shares[2]


def test_errors_count_observable_angles_only():
    errors = np.radians([[1.0, 5.0, 20.0], [2.0, 8.0, 0.0]])
    observable = np.array([[True, True, False], [False, False, False]])
    px = np.zeros(2)
    result = RunResult(np.zeros((2, 3)), errors, observable, px, px, px)
    assert np.degrees(result.mean_error) == pytest.approx(3.0)
    np.testing.assert_allclose(np.degrees(result.frame_errors), [3.0, np.nan])
    assert result.lost_frames == 0
    assert result._replace(errors=2 * errors).lost_frames == 1


def test_a_tracker_follows_the_own_shape():
    scene = make_scene(SMALL, "own shape", 3)
    result = track_scene(scene, QUICK)
    assert np.degrees(result.mean_error) < 1.5
    assert np.all(result.after_px < 0.6)
    assert result.before_px[1:].mean() > 2 * result.after_px.mean()


@pytest.mark.slow
def test_priors_pull_less_where_the_body_fits_well():
    """The own shape fits to a fraction of a pixel; a person of another shape does not, and is tracked as before."""
    on, off = (ContourSettings(recover=None, measure_noise=m) for m in (True, False))
    own, other = (make_scene(SMALL, actor, 3) for actor in ("own shape", "skinned person"))
    assert track_scene(own, on).mean_error < 0.6 * track_scene(own, off).mean_error
    np.testing.assert_array_equal(track_scene(other, on).poses, track_scene(other, off).poses)


@pytest.fixture(scope="module")
def found():
    """The smallest experiment, and the numbers of runs that were done."""
    ticks = []
    tiny = ContourExperiment(n_frames=2, n_cameras=2, camera_counts=(1,))
    return run_contour_experiment(tiny, {"a": QUICK}, lambda done, total: ticks.append((done, total))), ticks


@pytest.mark.slow
def test_the_report_and_its_figures(found, tmp_path):
    report = write_contour_report(tmp_path / "r", found[0])
    assert found[1] == [(i + 1, 10) for i in range(10)]
    text = report.read_text("utf-8")
    figures = re.findall(r"\]\(([^)]+)\)", text)
    assert {"fig5a_a.svg", "fig5b_a.svg", "fig6_left_elbow_extension.svg", "fig7_right_shoulder_abduction.svg"} <= set(
        figures
    )
    assert {"cameras.svg", *figures} == {p.name for p in (tmp_path / "r").glob("*.svg")}
    for name in figures:
        ElementTree.parse(tmp_path / "r" / name)
    assert "| a | " in text
    assert "| | 1 | 2 |" in text
    for actor in ACTORS:
        assert f"| {actor}, a | " in text
        assert f"| {actor}, contour, paper | " in text
    assert "fig13.svg" in figures


def test_a_chart_has_gaps_and_escaped_names():
    svg = line_chart("a < b", np.arange(5.0), [Line("x & y", np.array([1, np.nan, 2, 3, np.nan]))], "frame", "px")
    root = ElementTree.fromstring(svg)
    lines = root.findall("{http://www.w3.org/2000/svg}polyline")
    assert [len(line.get("points").split()) for line in lines] == [1, 2]
    flat = line_chart("t", np.array([2.0]), [Line("n", np.array([np.nan]))], "x", "y")
    ElementTree.fromstring(flat)


def test_names_of_many_curves_stand_apart_and_above_the_curves():
    names = [f"a person of another shape, method {i}" for i in range(7)]
    root = ElementTree.fromstring(line_chart("t", np.arange(2.0), [Line(n, np.ones(2)) for n in names], "x", "y"))
    texts = [t for t in root.findall("{http://www.w3.org/2000/svg}text") if t.text in names]
    at = np.array([[float(t.get("x")), float(t.get("y"))] for t in texts])
    lines = root.findall("{http://www.w3.org/2000/svg}polyline")
    assert at[:, 1].max() < min(float(p.split(",")[1]) for line in lines for p in line.get("points").split())
    for i in range(7):
        beside = np.delete(at, i, axis=0) - at[i]
        assert np.all((np.abs(beside[:, 1]) >= 12) | (np.abs(beside[:, 0]) >= 200))


@pytest.mark.parametrize("change", [{"n_frames": 1}, {"n_cameras": 0}, {"camera_counts": (2, 99)}, {"noise_px": -1.0}])
def test_impossible_parameters(change):
    with pytest.raises(TrackerError, match="expected at least 2 frames, 1 to 32 cameras"):
        run_contour_experiment(replace(SMALL, **change), {"a": QUICK})


@pytest.mark.slow
def test_a_folder_that_cannot_be_written(found, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(TrackerError, match=r"cannot write the report .*choose a folder"):
        write_contour_report(tmp_path / "file", found[0])
