"""Error ellipses against samples of the errors that they stand for, and whose they are."""

from dataclasses import replace

import numpy as np
import pytest

from app.drawing.error_ellipses import ellipses, error_ellipses
from app.state.page_view import View
from app.state.people import ShownPose, Visibility
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera

K = np.array([[600.0, 0, 320], [0, 620, 240], [0, 0, 1]])
N_SAMPLES = 20_000
LENSES = {
    "none": {"distortion": np.zeros(0)},
    "barrel": {"distortion": np.array([-0.25, 0.08, 0.001, -0.002])},
    "fisheye": {"distortion": np.array([0.02, -0.01, 0.0, 0.0]), "fisheye": True},
}


def camera_of(distortion, fisheye=False):
    """A camera that looks along x from the left."""
    T_world_camera = np.eye(4)
    T_world_camera[:3, :3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
    T_world_camera[:3, 3] = (-3.0, 0.2, 0.1)
    return Camera("side", (640, 480), K, distortion, T_world_camera, fisheye)


def is_inside(outline_px, points_px):
    """Whether points, (m, 2), lie inside of a closed convex outline, (n, 2)."""
    edges = np.diff(outline_px, axis=0)
    away = points_px[:, None] - outline_px[:-1]
    sides = edges[:, 0] * away[..., 1] - edges[:, 1] * away[..., 0]
    return np.all(sides >= 0, axis=1) | np.all(sides <= 0, axis=1)


@pytest.mark.parametrize("lens", LENSES)
def test_an_ellipse_holds_90_percent_of_the_sampled_errors_in_the_image(lens):
    """Errors of some centimetres at 3 m, longest along one direction, as filmed and then undistorted."""
    rng, camera = np.random.default_rng(5), camera_of(**LENSES[lens])
    points = np.array([(0.0, 0.2, 0.1), (0.2, 0.7, -0.4), (-0.3, -0.5, 0.6)])
    roots = rng.normal(0, 0.01, (3, 3, 3)) + 0.03 * rng.normal(size=(3, 3, 1)) * np.array([1.0, 0, 0])
    outlines = ellipses(camera.pinhole, points, roots @ roots.swapaxes(1, 2))
    assert len(outlines) == 3
    for point, root, outline in zip(points, roots, outlines, strict=True):
        seen_px = camera.undistort_points(camera.project(point + rng.normal(size=(N_SAMPLES, 3)) @ root.T))
        assert is_inside(outline, seen_px).mean() == pytest.approx(0.9, abs=0.01)


def test_an_ellipse_lies_along_the_image_of_the_error():
    camera = camera_of(**LENSES["none"])
    left_camera = np.array([1.0, 0, 0])
    along = rigid.apply(camera.T_world_camera, left_camera) - camera.center_world
    ((outline),) = ellipses(camera, np.array([[0.0, 0.2, 0.1]]), 0.05**2 * np.outer(along, along)[None])
    size = np.ptp(outline, axis=0)
    np.testing.assert_allclose(size, [2 * np.sqrt(4.605) * 0.05 * 600 / 3, 0], atol=0.01)
    np.testing.assert_array_equal(outline[0], outline[-1])


def test_small_ellipses_and_those_behind_the_camera_are_left_out():
    camera = camera_of(**LENSES["none"])
    points = np.array([(0.0, 0, 0), (0.0, 0.5, 0), (-4.0, 0, 0)])
    covariances = np.array([0.004, 0.02, 0.02])[:, None, None] ** 2 * np.eye(3)
    (outline,) = ellipses(camera, points, covariances, 3.0)
    np.testing.assert_allclose(outline[:-1].mean(axis=0), camera.project(points[1]), atol=0.01)
    assert len(ellipses(camera, points, covariances, 100.0)) == 0


SEEN = View(frozenset(("errors",)), (1, 0, 1, 1))


@pytest.fixture
def uncertain(couple):
    """The controller of two people, and a state in which both have errors, ann selected."""
    errors = [np.tile(0.1**2 * np.eye(3), (len(m.point_names), 1, 1)) for m in couple.models]
    people = [ShownPose(p.values, "tracked", errors=e) for p, e in zip(couple.state.people, errors, strict=True)]
    return couple, replace(couple.state, people=tuple(people))


def test_they_are_drawn_for_the_selected_person_in_the_visible_views(uncertain):
    controller, state = uncertain
    for person, info in enumerate(controller.session.people):
        found = error_ellipses(controller.session, replace(state, person=person), SEEN)
        assert [(p.camera, p.person, p.kind, p.color) for p in found] == [
            (camera, person, "error", info.color) for camera in (0, 2, 3)
        ]
        ellipse = ellipses(
            controller.session.cameras[2].camera.pinhole,
            info.model.points_world(state.poses[person]),
            state.people[person].errors,
        )
        assert len(ellipse) == len(info.model.point_names)
        lines = found[1].segments_px.reshape(len(ellipse), -1, 4)
        np.testing.assert_allclose(lines[:, :, :2], ellipse[:, :-1], rtol=1e-5)
        np.testing.assert_array_equal(lines[:, 1:, :2], lines[:, :-1, 2:])  # the page draws them as one line
        np.testing.assert_array_equal(lines[:, 0, :2], lines[:, -1, 2:])


def test_small_means_small_in_the_picture(uncertain):
    controller, state = uncertain
    found = error_ellipses(controller.session, state, replace(SEEN, reductions=(64, 0, 0, 0)))
    assert [len(p.segments_px) for p in found] == [0]


def test_nothing_is_drawn_without_errors_or_the_layer_or_of_a_hidden_person(uncertain):
    controller, state = uncertain
    unknown = replace(state, people=(replace(state.people[0], errors=None), state.people[1]))
    hidden = replace(state, visibility=Visibility(frozenset((0,))))
    assert error_ellipses(controller.session, state, SEEN)
    assert error_ellipses(controller.session, unknown, SEEN) == []
    assert error_ellipses(controller.session, hidden, SEEN) == []
    assert error_ellipses(controller.session, state, replace(SEEN, layers=frozenset(("contours",)))) == []
