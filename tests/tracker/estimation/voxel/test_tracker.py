"""The voxel tracker on simulated silhouettes of people whose shapes no body model has."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from figures import hide_legs
from moving_figure import ADULT, CHILD, cameras, joints_at, views_at

from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.tracking.tracker import Subjects, TrackingRun
from tracker.estimation.voxel import tracker
from tracker.estimation.voxel.frame_estimator import VoxelEstimator
from tracker.estimation.voxel.paper import paper_settings
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.estimation.voxel.tracker import VoxelTracker
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import load_model
from tracker.geometry.ground_plane import GroundPlane

FPS = 30.0


def tracked(
    sizes=ADULT, n=12, stride=1, model="gavrila34", height_m=1.72, settings=None, change=lambda k, views: views
):
    """Estimates and errors of all limb joints, (n, 12), metres, of a person tracked from the true joints."""
    body = load_model(model, height_m)
    start = fit_to_points(body, joints_at(0.0, sizes)).pose
    frames = range(0, n * stride, stride)
    observer = SimpleNamespace(cameras=cameras(), recording=None)
    run = TrackingRun(observer, Subjects.of([body]), [start], frames, FPS)
    estimator = VoxelEstimator(run, settings or VoxelSettings())
    estimates, errors, seen = [], [], cameras()
    for k in frames:
        estimate = estimator.estimate(k, change(k, views_at(k / FPS, sizes, seen)))
        own = body.named_points_world(estimate.poses[0])
        truth = joints_at(k / FPS, sizes)
        estimates.append(estimate)
        errors.append([np.linalg.norm(own[j] - truth[j]) for j in LIMB_JOINTS])
    return estimates, np.array(errors)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["gavrila34", "mikic10"])
def test_a_person_of_another_shape_is_followed(model):
    estimates, errors = tracked(model=model)
    assert errors.mean() < 0.05
    assert all(e.statuses[0] != "lost" for e in estimates)
    assert np.all(np.linalg.eigvalsh(estimates[-1].covariances[0]) > 0)


@pytest.mark.slow
def test_legs_that_look_like_shadows_are_followed(monkeypatch):
    """One view takes the legs for a shadow, the others show them."""
    body, frames = load_model("gavrila34", 1.72), range(3)
    start, seen = fit_to_points(body, joints_at(0.0)).pose, cameras()

    def silhouettes(frame):
        whole = views_at(frame / FPS, ADULT, seen)
        return hide_legs(whole, {0}, [np.zeros_like(s.mask) for s in whole])

    finder = SimpleNamespace(silhouettes=silhouettes, close=lambda: None)
    monkeypatch.setattr(tracker, "SilhouetteFinder", lambda cameras, recording, recording_views: finder)

    def leg_errors(floor):
        observer = SimpleNamespace(cameras=seen, recording=None, recording_views=range(len(seen)))
        run = TrackingRun(observer, Subjects.of([body]), [start], frames, FPS, floor)
        *_, last = VoxelTracker().estimates(run)
        own, truth = body.named_points_world(last.poses[0]), joints_at(frames[-1] / FPS)
        return [np.linalg.norm(own[j] - truth[j]) for j in LIMB_JOINTS if "knee" in j or "ankle" in j]

    soles_m = float(joints_at(0.0)["left_ankle"][2]) - 0.10
    assert np.mean(leg_errors(GroundPlane(np.array([0.0, 0.0, 1.0]), soles_m))) < 0.06
    assert np.mean(leg_errors(None)) > 0.15


@pytest.mark.slow
def test_with_every_third_frame():
    assert tracked(stride=3)[1].mean() < 0.06


@pytest.mark.slow
def test_the_papers_version_runs():
    estimates, errors = tracked(model="mikic10", settings=paper_settings(), n=6)
    assert errors.mean() < 0.15
    assert estimates[0].method == "voxel"


@pytest.mark.slow
@pytest.mark.parametrize("stride", [1, 3])
def test_a_limb_of_a_child_that_is_off_is_called_lost(stride):
    """A large head and short limbs, tracked with the proportions of an adult of the same height."""
    estimates, errors = tracked(CHILD, 12, stride, height_m=1.15)
    for found, error in zip(estimates, errors, strict=True):
        assert error.max() <= 0.30 or found.statuses[0] == "lost"


def without_person(k, views):
    return [v._replace(mask=np.zeros_like(v.mask)) for v in views] if k > 3 else views


@pytest.mark.slow
def test_empty_silhouettes_are_reported_and_the_body_stays():
    estimates, errors = tracked(n=8, change=without_person)
    assert [e.statuses[0] for e in estimates[4:]] == ["lost"] * 4
    assert "fewer than two views show anybody" in estimates[-1].notes[0]
    assert np.all(np.isfinite(estimates[-1].poses[0]))
    assert errors[-1].max() < 0.6  # it does not run away


@pytest.mark.slow
def test_a_person_who_has_gone_is_lost():
    """Silhouettes of somebody elsewhere, out of reach."""
    far = [v._replace(mask=np.roll(v.mask, 70, axis=1)) for v in views_at(0.0)]
    estimates, _ = tracked(n=3, change=lambda k, views: far if k else views)
    assert estimates[-1].statuses[0] == "lost"
    assert "check that no camera has moved" in estimates[-1].notes[0] or "outside" in estimates[-1].notes[0]


@pytest.mark.slow
def test_a_camera_that_moved_is_left_out():
    def moved(k, views):
        return [views[0]._replace(mask=np.roll(views[0].mask, 45, axis=1)), *views[1:]] if k > 2 else views

    estimates, errors = tracked(n=6, change=moved)
    assert errors[-1].mean() < 0.05
    assert "view c0 left out" in estimates[-1].notes[0]
    assert estimates[-1].statuses[0] == "doubtful"


@pytest.mark.slow
def test_a_person_who_is_cut_off_is_named():
    def cut(k, views):
        return [v._replace(mask=np.where(np.arange(v.mask.shape[0])[:, None] > 60, False, v.mask)) for v in views]

    estimates, _ = tracked(n=3, change=cut)
    assert estimates[-1].statuses[0] == "lost"
    assert estimates[-1].notes[0]


@pytest.mark.slow
def test_keyframes_stay():
    body = load_model("gavrila34", 1.72)
    key = fit_to_points(body, joints_at(2 / FPS)).pose
    observer = SimpleNamespace(cameras=cameras(), recording=None)
    start = fit_to_points(body, joints_at(0.0)).pose
    run = TrackingRun(observer, Subjects.of([body], keyframes={2: {0: key}}), [start], range(4), FPS)
    estimator = VoxelEstimator(run, VoxelSettings())
    found = [estimator.estimate(k, views_at(k / FPS)) for k in range(4)]
    np.testing.assert_array_equal(found[2].poses[0], key)
    assert found[3].statuses[0] != "lost"


def test_locked_dofs_stay():
    body = load_model("gavrila34", 1.72)
    start = fit_to_points(body, joints_at(0.0)).pose
    active = np.ones(body.n_dofs, dtype=bool)
    active[-1] = False
    observer = SimpleNamespace(cameras=cameras(), recording=None)
    run = TrackingRun(observer, Subjects.of([body], active_dofs=[active]), [start], range(2), FPS)
    estimator = VoxelEstimator(run, replace(VoxelSettings(), iterations=1))
    for k in range(2):
        estimate = estimator.estimate(k, views_at(k / FPS))
    assert estimate.poses[0][-1] == start[-1]
