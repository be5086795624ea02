"""What the contour tracker does with evidence that tells little or nothing: a clear status, and always numbers."""

import numpy as np
import pytest
from staging import Shown, camera_at, cameras_around, in_posture, own_evidence
from tracking_runs import track

from tracker.body.model import PosedBody
from tracker.errors import TrackerError
from tracker.estimation.contour.paper import paper_settings
from tracker.estimation.contour.settings import ContourSettings
from tracker.evidence.images.distance_transform import distance_image
from tracker.evidence.images.silhouette_contour import trace_silhouette
from tracker.evidence.view_evidence import Silhouette, ViewEvidence
from tracker.formats.model_toml import load_model

pytestmark = pytest.mark.filterwarnings("error:invalid value")

MODES = [ContourSettings(), paper_settings("edges"), paper_settings()]
mode = pytest.mark.parametrize("settings", MODES, ids=["default", "paper, edges", "paper, silhouettes"])


@pytest.fixture(scope="module")
def body():
    model = load_model("gavrila22_cones")
    return PosedBody(model, in_posture(model))


def unseen(camera):
    """Evidence without a single edge, whose silhouette is empty."""
    nothing = np.zeros((camera.height, camera.width), np.uint8)
    far_px = 2 * 0.03 * max(camera.size)
    contour = trace_silhouette(nothing > 0)
    silhouette = Silhouette(nothing > 0, contour.points_px, contour.normals, 1.0, contour, far_px)
    return ViewEvidence(
        camera, 1.0, np.empty((0, 2), np.float32), distance_image(nothing, far_px), silhouette=silhouette
    )


def tracked(body, views, settings, n=3):
    """The estimates of some frames that all look the same, from a start 3 cm beside the person."""
    start = body.values + np.where(body.model.dof_is_length, 0.03, 0.0)
    found = list(track(Shown([views] * n), [body.model], [start], range(n), settings))
    for estimate in found:
        assert np.all(np.isfinite(estimate.poses[0]))
        assert np.all(np.isfinite(estimate.covariances[0]))
        assert np.isfinite(estimate.cost_px)
    return found


def off_m(body, pose):
    return float(np.linalg.norm(body.model.points_world(pose) - body.points_world, axis=1).mean())


@mode
def test_fewer_residuals_than_degrees_of_freedom(body, settings):
    """Two cameras in which the person is some pixels tall: one pixel of contour is one residual."""
    cameras = [camera_at(f"cam{i}", at, size=(64, 48), focal=5.0) for i, at in enumerate([(40, 0, 1), (0, 40, 1)])]
    for estimate in tracked(body, own_evidence([body], cameras), settings):
        assert estimate.statuses == ("lost",)
        assert "fewer than the 22 degrees of freedom" in estimate.notes[0]


@pytest.mark.slow
@mode
def test_a_camera_that_sees_nothing_takes_no_part(body, settings):
    good = own_evidence([body], cameras_around(3))
    away = camera_at("away", (4.0, 0.0, 0.6), (8.0, 0.0, 0.6))
    alone, beside = (tracked(body, views, settings)[-1] for views in (good, (*good, unseen(away))))
    assert beside.statuses == alone.statuses
    assert off_m(body, beside.poses[0]) < 0.02
    assert np.isnan(beside.view_costs_px[-1])


@mode
def test_cameras_that_all_see_nothing_lose_the_person(body, settings):
    away = [camera_at(f"away{i}", (4.0, i, 0.6), (8.0, i, 0.6)) for i in range(2)]
    for estimate in tracked(body, tuple(map(unseen, away)), settings):
        assert estimate.statuses == ("lost",)
        assert estimate.notes[0].startswith("0 px of contour are visible")


@mode
def test_empty_silhouettes_lose_the_person(body, settings):
    for estimate in tracked(body, tuple(map(unseen, cameras_around(3))), settings):
        assert estimate.statuses == ("lost",)


@pytest.mark.slow
@mode
def test_parts_behind_a_camera_take_no_part(body, settings):
    """A camera between the person's arms: some parts are before it, some behind, and some around it."""
    within = camera_at("within", body.points_world.mean(axis=0) + np.array([0.05, 0.0, 0.2]), (3.0, 0.0, 0.5))
    views = (*own_evidence([body], cameras_around(3)), *own_evidence([body], [within]))
    depths = (body.points_world - within.center_world) @ within.T_world_camera[:3, 2]
    assert depths.min() < -0.1
    assert depths.max() > 0.1
    assert off_m(body, tracked(body, views, settings)[-1].poses[0]) < 0.05


@pytest.mark.parametrize("settings", MODES[:2], ids=["default", "paper"])
def test_a_pose_that_is_no_number_is_refused(body, settings):
    views, wrong = own_evidence([body], cameras_around(2)), body.values.copy()
    wrong[5] = np.nan
    with pytest.raises(TrackerError, match="expected numbers in the start pose of person 1"):
        track(Shown([views]), [body.model], [wrong], range(1), settings)
    with pytest.raises(TrackerError, match="expected numbers in the keyframe of person 1 at frame 1"):
        track(Shown([views] * 2), [body.model], [body.values], range(2), settings, keyframes={1: {0: wrong}})


def test_the_rank_of_the_normal_matrix_is_told(body):
    """One camera does not determine a body: KRH08 Sect. 5.4."""
    (estimate,) = tracked(body, own_evidence([body], cameras_around(1)), paper_settings("edges"), 1)
    (matrix,) = estimate.normal_matrices
    assert matrix.n_dofs == 22
    assert matrix.condition > 1e3
    (better,) = tracked(body, own_evidence([body], cameras_around(4)), paper_settings("edges"), 1)
    assert better.normal_matrices[0].condition < 0.1 * matrix.condition
