"""Derivatives of projections by point and camera, against finite differences of `Camera.project`."""

import numpy as np
import pytest
import rigs

from tracker.geometry.camera_derivatives import (
    camera_difference,
    moved_camera,
    n_camera_parameters,
    project_with_columns,
)
from tracker.geometry.cameras import Camera

LENSES = [
    ((), False),
    ((-0.3, 0.1, 0.002, -0.003), False),
    ((0.19, -0.28, -0.0024, 0.0028, 0.147), False),
    ((0.2, -0.1, 0.001, 0.002, 0.05, 0.1, -0.05, 0.02), False),
    ((), True),
    ((0.02, -0.01, 0.004, -0.001), True),
]


def camera_with(distortion, fisheye):
    K = np.array([[600.0, 2.0, 330.0], [0.0, 590.0, 250.0], [0.0, 0.0, 1.0]])
    return Camera("cam", (640, 480), K, np.array(distortion), rigs.looking((2.0, -3.0, 1.5)), fisheye)


def points(fisheye):
    random = np.random.default_rng(3)
    near = np.array([0.0, 0.0, 1.0]) + random.normal(scale=0.6, size=(40, 3))
    return np.concatenate([near, np.array([2.0, -3.0, 1.5]) + random.normal(size=(40, 3))]) if fisheye else near


@pytest.mark.parametrize(("distortion", "fisheye"), LENSES)
def test_the_columns_are_the_derivatives(distortion, fisheye):
    camera, X = camera_with(distortion, fisheye), points(fisheye)
    projected = project_with_columns(camera, X)
    np.testing.assert_allclose(projected.px, camera.project(X), atol=1e-9)
    shown = np.isfinite(projected.px).all(axis=1)
    assert shown.sum() >= 30
    h = 1e-6
    for i in range(3):
        by = (camera.project(X + h * np.eye(3)[i]) - camera.project(X - h * np.eye(3)[i])) / (2 * h)
        np.testing.assert_allclose(projected.by_point[shown, :, i], by[shown], rtol=1e-5, atol=2e-3)
    for step in np.eye(n_camera_parameters(camera)):
        by = (moved_camera(camera, h * step).project(X) - moved_camera(camera, -h * step).project(X)) / (2 * h)
        np.testing.assert_allclose(projected.by_camera[shown] @ step, by[shown], rtol=1e-5, atol=2e-3)


@pytest.mark.parametrize("fisheye", [False, True])
def test_a_point_on_the_axis_has_finite_derivatives(fisheye):
    camera = camera_with((0.02, -0.01, 0.004, -0.001), fisheye)
    X = camera.T_world_camera[:3, 3] + 2.0 * camera.T_world_camera[None, :3, 2]
    found, beside = project_with_columns(camera, X), project_with_columns(camera, X + 1e-6)
    np.testing.assert_allclose(found.by_point, beside.by_point, atol=1e-2)


def test_the_difference_undoes_a_move():
    camera = camera_with(*LENSES[2])
    step = np.random.default_rng(0).normal(size=n_camera_parameters(camera)) * 0.01
    np.testing.assert_allclose(camera_difference(camera, moved_camera(camera, step)), step, atol=1e-12)
