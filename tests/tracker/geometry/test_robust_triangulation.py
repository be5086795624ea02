import numpy as np
import pytest
from observed_people import BODY_25, make_session, seen, walking

from tracker.geometry.robust_triangulation import Views, triangulate_points
from tracker.interchange.observations.identities import match_people
from tracker.interchange.observations.sides import exchanged_sides, with_sides_exchanged

LEGS = [(BODY_25.points.index(f"L{j}"), BODY_25.points.index(f"R{j}")) for j in ("Hip", "Knee", "Ankle", "Heel")]

TRUTH = walking(20)


@pytest.fixture
def rig(tmp_path):
    session = make_session(tmp_path / "s", 20)
    return session, Views([c.camera for c in session.cameras])


def triangulated(views, points):
    return triangulate_points(views, views.undistorted(points[..., :2]), points[..., 2])


def test_exact_points_through_a_lens(rig):
    session, views = rig
    triangulation = triangulated(views, seen(session, [TRUTH])[:, :, 0])
    assert np.abs(triangulation.points_world - TRUTH).max() < 1e-6
    assert triangulation.is_inlier.all()


def test_an_outlier_in_one_view_does_not_pull(rig):
    session, views = rig
    points = seen(session, [TRUTH], noise_px=0.5)[:, :, 0]
    points[5:9, 2, 4, :2] += (90.0, -60.0)
    triangulation = triangulated(views, points)
    assert np.linalg.norm(triangulation.points_world - TRUTH, axis=-1).max() < 0.02
    assert not triangulation.is_inlier[5:9, 2, 4].any()
    assert triangulation.is_inlier[5:9, :2, 4].all()


def test_two_against_two_views_are_decided_by_the_motion(rig):
    session, views = rig
    points = seen(session, [TRUTH])[:, :, 0]
    elsewhere = TRUTH[:, 4] + np.array([0.0, 0.4, 0.3])
    for v in (2, 3):
        points[8:11, v, 4, :2] = session.cameras[v].camera.project(elsewhere[8:11])
    points[8:11, 2:, 4, 2] = 0.95  # the wrong ones are the more confident
    triangulation = triangulated(views, points)
    assert np.linalg.norm(triangulation.points_world - TRUTH, axis=-1)[:, 4].max() < 0.01


def test_one_view_gives_no_point(rig):
    session, views = rig
    points = seen(session, [TRUTH])[:, :, 0]
    points[3, 1:, 7] = (np.nan, np.nan, 0.0)
    triangulation = triangulated(views, points)
    assert np.isnan(triangulation.points_world[3, 7]).all()
    assert np.isnan(triangulation.covariances[3, 7]).all()
    assert np.isfinite(np.delete(triangulation.points_world[3], 7, axis=0)).all()


def test_a_point_that_ends_beside_a_camera_spoils_no_other(tmp_path):
    session = make_session(tmp_path / "s", 20, distortion=np.zeros(5))
    views = Views([c.camera for c in session.cameras])
    points = seen(session, [TRUTH], noise_px=2.0)[:, :, 0]
    points[3, 1::2, 6] = (np.nan, np.nan, 0.0)
    points[3, ::2, 6, :2] = (313.12173629, 180.97096315), (313.01416937, 183.27791755)  # rays along one line
    found = triangulated(views, points).points_world
    assert np.linalg.norm(np.delete(found, 6, axis=1) - np.delete(TRUTH, 6, axis=1), axis=-1).max() < 0.05


def test_covariances_are_as_large_as_the_errors(rig):
    session, views = rig
    errors, variances = [], []
    for seed in range(4):
        triangulation = triangulated(views, seen(session, [TRUTH], 2.0, seed)[:, :, 0])
        errors.append(((triangulation.points_world - TRUTH) ** 2).sum(axis=-1))
        variances.append(np.trace(triangulation.covariances, axis1=-2, axis2=-1))
    assert 0.7 < np.mean(errors) / np.mean(variances) < 1.4


@pytest.mark.parametrize("exchanged", [{6: (1,), 7: (1, 2)}, {k: (3,) for k in range(4, 16)}, {0: (0,)}])
def test_exchanged_legs_are_found(rig, exchanged):
    session, views = rig
    points = seen(session, [TRUTH], noise_px=1.0)[:, :, 0]
    mask = np.zeros((20, 4), bool)
    for k, some in exchanged.items():
        mask[k, list(some)] = True
    wrong = with_sides_exchanged(points, LEGS, mask)
    found = exchanged_sides(views, views.undistorted(wrong[..., :2]), wrong[..., 2], LEGS)
    assert (found == mask).all()
    assert np.array_equal(with_sides_exchanged(wrong, LEGS, found), points)


def test_nothing_is_exchanged_without_a_reason(rig):
    session, views = rig
    points = seen(session, [TRUTH], noise_px=3.0)[:, :, 0]
    assert not exchanged_sides(views, views.undistorted(points[..., :2]), points[..., 2], LEGS).any()


def two_people(session):
    motions = [walking(20, (-0.6, -0.5, 0)), walking(20, (0.5, 0.6, 0), (-0.03, -0.01, 0))]
    points = seen(session, motions, noise_px=1.0)
    order = np.random.default_rng(1).permuted(np.tile([0, 1], (20, 4, 1)), axis=2)
    mixed = np.take_along_axis(points, order[..., None, None], axis=2)
    return motions, mixed, order


def test_people_are_matched_across_views_and_frames(rig):
    session, views = rig
    _, mixed, order = two_people(session)
    matches = match_people(views, views.undistorted(mixed[..., :2]), mixed[..., 2], 2)
    same = matches == order
    assert same.all() or (~same).all()


def test_a_detection_of_nobody_is_left_out(rig):
    session, views = rig
    points = seen(session, [TRUTH], noise_px=1.0)
    both = np.concatenate([points, points], axis=2)
    both[:, :, 0] = (np.nan, np.nan, 0.0)
    both[:, 2, 0] = (100.0, 100.0, 0.9)  # a picture on the wall, seen by one view
    matches = match_people(views, views.undistorted(both[..., :2]), both[..., 2], 1)
    assert (matches[:, :, 1] == 0).all()
    assert (matches[:, :, 0] == -1).all()
