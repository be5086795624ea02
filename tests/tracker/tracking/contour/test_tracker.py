"""The contour tracker in both of its modes, and what it makes of wrong input."""

from dataclasses import replace

import numpy as np
import pytest
from staging import SUIT, Shown, camera_at, cameras_around, dressed, in_posture, shaken
from tracking_runs import track

from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.evidence.view_evidence import Silhouette
from tracker.fitting.gauss_newton import NormalEquations
from tracker.formats.model_toml import load_model
from tracker.images.silhouette_contour import trace_silhouette
from tracker.tracking.contour.frame_estimator import conditioning
from tracker.tracking.contour.paper import paper_settings
from tracker.tracking.contour.settings import ContourSettings

MODES = {"default": ContourSettings(backward_pass=False), "paper": paper_settings()}


@pytest.fixture(scope="module")
def gavrila_cones():
    return load_model("gavrila22_cones", 1.75)


@pytest.fixture(scope="module")
def truth(gavrila_cones):
    return in_posture(gavrila_cones)


@pytest.fixture(params=list(MODES))
def settings(request):
    return MODES[request.param]


def shown(model, pose, cameras):
    return dressed([PosedBody(model, pose)], cameras, SUIT)


def run(model, start, views, settings, n_frames=2):
    found = list(track(Shown([views] * n_frames), [model], [start], range(n_frames), settings))
    for f in found:  # what is written to the store
        assert np.all(np.isfinite(f.poses[0]))
        assert np.all(np.isfinite(f.covariances[0]))
    return found


def off_m(model, pose, truth):
    return np.linalg.norm(model.points_world(pose) - model.points_world(truth), axis=1).max()


def test_a_body_beside_its_contours_is_found(gavrila_cones, truth, settings):
    start = shaken(gavrila_cones, truth, np.random.default_rng(1), np.radians(2), 0.01)
    found = run(gavrila_cones, start, shown(gavrila_cones, truth, cameras_around(4)), settings)
    assert off_m(gavrila_cones, found[-1].poses[0], truth) < 0.5 * off_m(gavrila_cones, start, truth)
    matrix = found[-1].normal_matrices[0]
    if not settings.paper:
        assert matrix is None
        return
    assert (matrix.rank, matrix.n_dofs) == (gavrila_cones.n_dofs, gavrila_cones.n_dofs)
    assert 1 < matrix.condition < np.inf


def test_a_camera_that_sees_nothing_changes_nothing(gavrila_cones, truth, settings):
    away = camera_at("away", (0.0, 4.0, 0.6), (0.0, 9.0, 0.6))
    seen = shown(gavrila_cones, truth, cameras_around(3))
    blind = shown(gavrila_cones, truth, [*cameras_around(3), away])
    assert not len(blind[3].points_px)
    start = shaken(gavrila_cones, truth, np.random.default_rng(1), np.radians(2), 0.01)
    with_blind, without = (run(gavrila_cones, start, views, settings) for views in (blind, seen))
    np.testing.assert_allclose(with_blind[-1].poses[0], without[-1].poses[0], atol=0.02)


def test_nothing_seen_is_lost(gavrila_cones, truth, settings):
    away = [camera_at(f"away{i}", (i, 4.0, 0.6), (i, 9.0, 0.6)) for i in range(2)]
    found = run(gavrila_cones, truth, shown(gavrila_cones, truth, away), settings)
    assert [f.statuses[0] for f in found] == ["lost", "lost"]
    assert f"fewer than the {gavrila_cones.n_dofs} degrees of freedom" in found[-1].notes[0]
    if settings.paper:
        assert found[-1].normal_matrices[0].rank == 0


def test_fewer_residuals_than_degrees_of_freedom_are_lost(gavrila_cones, truth, settings):
    """From 400 m the body is a few pixels high."""
    far = [camera_at("far", (0.0, -400.0, 0.6))]
    found = run(gavrila_cones, truth, shown(gavrila_cones, truth, far), settings)
    assert found[-1].statuses[0] == "lost"
    assert "px of contour are visible, fewer than" in found[-1].notes[0]


def test_parts_behind_a_camera(gavrila_cones, truth, settings):
    """A camera within arm's reach, with an arm behind it, beside three that see all of the body."""
    hand = gavrila_cones.points_world(truth)[list(gavrila_cones.point_names).index("left_wrist")]
    close = camera_at("close", 0.8 * hand)
    views = shown(gavrila_cones, truth, [*cameras_around(3), close])
    assert close.depths(hand[None])[0] < 0
    start = shaken(gavrila_cones, truth, np.random.default_rng(1), np.radians(2), 0.01)
    found = run(gavrila_cones, start, views, settings)
    assert found[-1].statuses[0] != "lost"
    assert off_m(gavrila_cones, found[-1].poses[0], truth) < 0.1


def test_an_empty_silhouette(gavrila_cones, truth, settings):
    """In one view nothing was found: the other views decide. In all views: lost."""
    views = shown(gavrila_cones, truth, cameras_around(4))
    empty = [without_silhouette(v) for v in views]
    one = run(gavrila_cones, truth, (empty[0], *views[1:]), settings)
    assert one[-1].statuses[0] != "lost"
    assert off_m(gavrila_cones, one[-1].poses[0], truth) < 0.1
    wanted = replace(settings, image_contours="silhouettes")
    assert run(gavrila_cones, truth, tuple(empty), wanted)[-1].statuses[0] == "lost"


def without_silhouette(view):
    """The view with a silhouette in which nobody is found."""
    mask = np.zeros((view.camera.height, view.camera.width), bool)
    contour = trace_silhouette(mask)
    nobody = Silhouette(mask, contour.points_px, contour.normals, 1.0, contour, 2 * view.theta_px)
    return replace(view, silhouette=nobody)


def test_a_start_that_is_no_number(gavrila_cones, truth, settings):
    start = truth.copy()
    start[3] = np.nan
    with pytest.raises(TrackerError, match="expected numbers in the start pose of person 1"):
        run(gavrila_cones, start, shown(gavrila_cones, truth, cameras_around(3)), settings)


def test_rank_and_condition_of_a_normal_matrix():
    full = conditioning(NormalEquations(0.0, np.zeros(3), np.diag([4.0, 1.0, 2.0])), None)
    assert tuple(full) == (3, 3, 4.0)
    singular = NormalEquations(0.0, np.zeros(3), np.diag([4.0, 0.0, 2.0]))
    assert tuple(conditioning(singular, None)) == (2, 3, np.inf)
    assert tuple(conditioning(singular, np.array([True, False, True]))) == (2, 2, 2.0)
    assert tuple(conditioning(singular, np.zeros(3, bool))) == (0, 0, np.inf)
