"""Pins: their pull against finite differences, and where they meet against known truth."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import ARM
from finite_differences import normal, slopes
from fisheye import with_fisheye
from staging import camera_at, cameras_around, posed, seen, shaken

from tracker.body.model import PosedBody
from tracker.estimation.fitting.gauss_newton import PosePrior, solve
from tracker.estimation.fitting.pins import pin_block
from tracker.formats.model_toml import load_model
from tracker.geometry.triangulation import PointObservation, sigma_px, triangulate

GAVRILA = load_model("gavrila34")
CAMERAS = [
    with_fisheye(c) if i == 3 else replace(c, distortion=np.array([-0.2, 0.05, 0.001, -0.001]))
    for i, c in enumerate(cameras_around(4))
]


@pytest.mark.parametrize("model", [GAVRILA, ARM], ids=lambda m: m.name)
@pytest.mark.parametrize("seed", range(3))
def test_the_pull_of_pins_against_finite_differences(model, seed):
    """Of ball joints too; with distances of some 20 px left over."""
    rng = np.random.default_rng(seed)
    values = shaken(model, model.neutral(), rng, 0.4, 0.3)
    names = rng.choice(model.point_names, 3, replace=False)
    block = pin_block(model, CAMERAS, seen(model, values, names, CAMERAS, noise_px=20.0, seed=seed))
    body = PosedBody(model, values)
    gradient = slopes(lambda b: normal(block, b).cost, body)
    np.testing.assert_allclose(normal(block, body).gradient, gradient, rtol=1e-5, atol=1e-3)
    # Without anything left over, Gauss-Newton's second derivative is the second derivative.
    block = pin_block(model, CAMERAS, seen(model, values, names, CAMERAS))
    hessian, exact = slopes(lambda b: normal(block, b).gradient, body), normal(block, body)
    np.testing.assert_allclose(exact.hessian, hessian, rtol=1e-5, atol=1e-3 * np.abs(hessian).max())
    assert exact.cost == pytest.approx(0, abs=1e-15)


def test_a_pin_counts_by_the_pixels_it_is_off():
    """Half the square of 3 and 4 px in standard deviations of 0.1% of the width."""
    values = posed(GAVRILA, 0)
    (pin, *_) = seen(GAVRILA, values, ["left_wrist"], CAMERAS)
    moved = pin._replace(position_px=(pin.position_px[0] + 3, pin.position_px[1] - 4))
    found = pin_block(GAVRILA, CAMERAS, [moved]).linearize(GAVRILA, values, GAVRILA.kinematics(values))
    assert found.cost == pytest.approx(0.5 * 25 / 0.64**2)
    assert sigma_px(replace(CAMERAS[0], size=(1920, 1080))) == pytest.approx(1.92)


def test_behind_a_camera_pins_stay_finite_and_exact():
    values = GAVRILA.neutral()
    values[0] = 12.0
    block = pin_block(GAVRILA, CAMERAS, [PointObservation("head", i, (300.0, 200.0)) for i in range(4)])
    body = PosedBody(GAVRILA, values)
    gradient, equations = slopes(lambda b: normal(block, b).cost, body), normal(block, body)
    assert np.isfinite(equations.cost)
    np.testing.assert_allclose(equations.gradient, gradient, rtol=1e-4, atol=1e-3 * np.abs(gradient).max())


@pytest.mark.parametrize("model", [GAVRILA, ARM], ids=lambda m: m.name)
def test_a_body_is_found_by_its_pins(model):
    truth = posed(model, 3)
    start = shaken(model, truth, np.random.default_rng(5), 0.3, 0.2)
    names = model.point_names
    block = pin_block(model, CAMERAS, seen(model, truth, names, CAMERAS))
    fit = solve(model, start, [block, PosePrior(start, np.full(model.n_dofs, 1e-3))], max_iterations=100)
    off = np.linalg.norm(model.points_world(fit.pose) - model.points_world(truth), axis=1)
    assert off.max() < 1e-3


# --- triangulation -----------------------------------------------------------------------------------------------


def test_exact_views_meet_in_the_point():
    truth = np.array([0.3, -0.2, 0.4])
    views = [c.pinhole for c in CAMERAS]
    triangulation = triangulate(CAMERAS, np.stack([c.project(truth) for c in views]))
    np.testing.assert_allclose(triangulation.point_world, truth, atol=1e-9)
    np.testing.assert_allclose(triangulation.errors_px, 0, atol=1e-6)
    assert triangulation.why == ""


@pytest.mark.slow
@pytest.mark.parametrize("n", [2, 3, 4])
def test_noisy_views_scatter_as_their_geometry_says(n):
    """The mean squared error of 400 triangulations against the covariance of the linearized problem, to 15%."""
    rng, truth, noise_px = np.random.default_rng(n), np.array([0.2, 0.1, -0.3]), 2.0
    views = [c.pinhole for c in CAMERAS[:n]]
    exact = np.stack([c.project(truth) for c in views])
    h = 1e-6
    J = np.concatenate([(c.project(truth + h * np.eye(3)) - c.project(truth - h * np.eye(3))).T for c in views]) / 2 / h
    expected = noise_px**2 * np.trace(np.linalg.inv(J.T @ J))
    found = [triangulate(views, exact + rng.normal(0, noise_px, exact.shape)) for _ in range(400)]
    squares = [np.sum((f.point_world - truth) ** 2) for f in found]
    assert np.mean(squares) == pytest.approx(expected, rel=0.15)
    # What is left over in the images: of 2n coordinates three are used up.
    left = np.mean([np.sum(f.errors_px**2) for f in found])
    assert left == pytest.approx(noise_px**2 * (2 * n - 3), rel=0.15)


def test_no_other_point_is_nearer_in_the_images():
    """Two views at very different distances: there the linear start is not the answer."""
    views = [camera_at("near", (0.6, 0.0, 0.2)), camera_at("far", (0.0, 9.0, 1.0))]
    places = np.stack([c.project(np.array([0.05, 0.1, 0.0])) for c in views])
    places += [[12.0, -9.0], [-6.0, 8.0]]
    triangulation = triangulate(views, places)

    def squares(point):
        return sum(np.sum((c.project(point) - p) ** 2) for c, p in zip(views, places, strict=True))

    here = squares(triangulation.point_world)
    assert np.sum(triangulation.errors_px**2) == pytest.approx(here)
    for step in 0.001 * np.concatenate([np.eye(3), -np.eye(3)]):
        assert squares(triangulation.point_world + step) > here


def test_one_view_is_not_enough():
    triangulation = triangulate(CAMERAS[:1], np.array([[100.0, 100.0]]))
    assert triangulation.point_world is None
    assert np.isnan(triangulation.errors_px).tolist() == [True]
    assert "another view" in triangulation.why


def test_parallel_lines_of_sight_tell_no_depth():
    """Side by side, and face to face with the point between them."""
    left, right = camera_at("left", (4.0, 0.0, 0.0)), camera_at("right", (4.0, 0.02, 0.0), (0.0, 0.02, 0.0))
    opposite = camera_at("opposite", (-4.0, 0.0, 0.0))
    for pair in ([left, right], [left, opposite]):
        triangulation = triangulate(pair, np.stack([c.project(np.zeros(3)) for c in pair]))
        assert triangulation.point_world is None
        assert "parallel" in triangulation.why


def test_lines_of_sight_that_meet_behind_a_camera_are_a_mistake():
    views = [
        camera_at("left", (4.0, 0.5, 0.0), (0.0, 0.5, 0.0)),
        camera_at("right", (4.0, -0.5, 0.0), (0.0, -0.5, 0.0)),
    ]
    triangulation = triangulate(views, np.array([[600.0, 240.0], [40.0, 240.0]]))  # they part
    assert triangulation.point_world is None
    assert "behind left and right" in triangulation.why
