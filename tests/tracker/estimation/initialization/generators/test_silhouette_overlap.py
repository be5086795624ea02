"""Bodies against silhouettes: what they fill, leave empty and cover beside, in the view's own cells."""

import numpy as np
import pytest
from figures import cameras_about_a_figure

from tracker.body.model import PosedBody
from tracker.estimation.initialization.generators.silhouette_overlap import SilhouetteOverlap
from tracker.evidence.contours.body_silhouette import body_silhouette
from tracker.formats.model_toml import load_model
from tracker.geometry.arrays import intersection_over_union

MODEL = load_model("gavrila34")
POSE = MODEL.neutral() + np.eye(len(MODEL.neutral()))[2] * 1.3
CAMERAS = cameras_about_a_figure()
PARTS = np.arange(len(MODEL.parts))


@pytest.fixture(scope="module")
def overlap():
    masks = [body_silhouette([PosedBody(MODEL, POSE)], camera) for camera in CAMERAS]
    return SilhouetteOverlap(MODEL, masks, CAMERAS, POSE[:3])


def poses_of(pose):
    return MODEL.kinematics(pose).Ts_world_part


def view_costs(overlap, pose):
    return 1 + overlap.added(poses_of(pose)[None], PARTS, overlap.nothing())[0]


def moved(by_m):
    return POSE + np.eye(len(POSE))[1] * by_m


def test_the_same_body_fills_its_silhouettes(overlap):
    assert view_costs(overlap, POSE).max() < 0.04
    assert overlap.total(np.ones(4)) == pytest.approx(1 / 1.3)


def test_the_cost_grows_with_the_distance(overlap):
    costs = [overlap.total(view_costs(overlap, moved(d))) for d in (0.0, 0.02, 0.05, 0.1, 0.2, 0.4)]
    assert np.all(np.diff(costs) > 0)
    assert view_costs(overlap, moved(50.0)) == pytest.approx(np.ones(4))


def test_covered_cells_are_those_of_the_body(overlap):
    whole = overlap.nothing()
    overlap.cover(poses_of(POSE), PARTS, whole)
    views = []
    for camera in CAMERAS:
        mask = body_silhouette([PosedBody(MODEL, POSE)], camera)
        alone = SilhouetteOverlap(MODEL, [mask], [camera], POSE[:3])
        covered = alone.nothing()
        alone.cover(poses_of(POSE), PARTS, covered)
        reduced = camera.pinhole.scaled(np.sqrt(covered.size / mask.size))
        own = body_silhouette([PosedBody(MODEL, POSE)], reduced)
        assert intersection_over_union(covered.reshape(own.shape), own) > 0.9
        views.append(covered)
    np.testing.assert_array_equal(whole, np.concatenate(views))


def test_covered_cells_cost_nothing_again(overlap):
    covered, arm = overlap.nothing(), MODEL.part_index["left_forearm"]
    Ts, rest = poses_of(POSE), np.setdiff1d(PARTS, [arm])
    alone = 1 + overlap.added(Ts[None, rest], rest, covered)[0]
    np.testing.assert_array_equal(1 + overlap.cover(Ts[rest], rest, covered), alone)
    arms = overlap.added(np.stack([Ts[[arm]]] * 5), np.array([arm]), covered)
    np.testing.assert_allclose(alone + arms, np.stack([view_costs(overlap, POSE)] * 5), atol=1e-6)
    overlap.cover(Ts[[arm]], np.array([arm]), covered)
    np.testing.assert_array_equal(overlap.added(Ts[None, [arm]], np.array([arm]), covered), 0.0)


def test_a_broken_silhouette_counts_less():
    right, wrong = np.array([0.1, 0.1, 0.1, 0.9]), np.array([0.3, 0.3, 0.3, 0.3])
    assert right.mean() == pytest.approx(wrong.mean())
    assert SilhouetteOverlap.total(right) < SilhouetteOverlap.total(wrong)


def test_views_without_the_person_do_not_count():
    masks = [body_silhouette([PosedBody(MODEL, POSE)], camera) for camera in CAMERAS]
    masks[1] = np.zeros_like(masks[1])
    assert len(view_costs(SilhouetteOverlap(MODEL, masks, CAMERAS, POSE[:3]), POSE)) == 3


def test_parts_behind_a_camera_cover_nothing(overlap):
    behind = CAMERAS[0].center_world - POSE[:3]
    pose = POSE.copy()
    pose[:3] += 1.5 * behind
    assert view_costs(overlap, pose)[0] == pytest.approx(1.0)
