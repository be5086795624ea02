import numpy as np
import pytest

from tracker.shapes import TaperedSuperquadric

SHAPES = {
    "sphere": TaperedSuperquadric((0.3, 0.3, 0.3), (1.0, 1.0)),
    "ellipsoid": TaperedSuperquadric((0.1, 0.2, 0.4), (1.0, 1.0)),
    "limb": TaperedSuperquadric((0.05, 0.05, 0.2), (0.35, 1.0), (0.22, 0.22)),
    "trunk": TaperedSuperquadric((0.12, 0.17, 0.31), (0.5, 0.8), (0.0, 0.04)),
    "box": TaperedSuperquadric((0.1, 0.2, 0.3), (0.2, 0.2), (-0.3, 0.4)),
}
each = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)


def samples(n=300):
    rng = np.random.default_rng(0)
    # Short of the poles and of the ridges, where normals of blunt shapes turn at once.
    eta = rng.uniform(-1.4, 1.4, n)
    omega = rng.uniform(-np.pi, np.pi, n)
    return eta, omega


@each
def test_surface_is_where_the_implicit_function_is_one(shape):
    points, _ = shape.surface(*samples())
    np.testing.assert_allclose(shape.inside_outside(points), 1, atol=1e-9)
    assert (shape.inside_outside(points * 0.999) < 1).all()
    assert (shape.inside_outside(points * 1.001) > 1).all()


@each
def test_beyond_the_ends_is_outside(shape):
    a3 = shape.half_axes[2]
    assert shape.inside_outside(np.array([[0, 0, 1.01 * a3], [0, 0, -1.01 * a3], [0, 0, 50 * a3]])).min() > 1
    assert shape.inside_outside(np.zeros(3)) < 1


@each
def test_normals_are_those_of_the_surface(shape):
    eta, omega = samples()
    # Finite differences of the surface; where a superquadric is flat they vanish, so look at those that do not.
    h = 1e-6
    points, normals = shape.surface(eta, omega)
    for tangents in (
        shape.surface(eta + h, omega)[0] - shape.surface(eta - h, omega)[0],
        shape.surface(eta, omega + h)[0] - shape.surface(eta, omega - h)[0],
    ):
        lengths = np.linalg.norm(tangents, axis=-1)
        clear = lengths > 1e-3 * 2 * h
        assert clear.mean() > 0.6
        slopes = np.sum(tangents * normals, axis=-1)[clear] / lengths[clear]
        np.testing.assert_allclose(slopes, 0, atol=1e-4)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1)
    outside = shape.inside_outside(points + 1e-5 * normals) - shape.inside_outside(points - 1e-5 * normals)
    assert (outside > 0).all()


@each
def test_mesh_is_closed_and_turned_outward(shape):
    mesh = shape.mesh()
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    np.testing.assert_allclose(shape.inside_outside(mesh.vertices), 1, atol=1e-9)


def test_volume_of_an_ellipsoid():
    mesh = SHAPES["ellipsoid"].mesh(64, 64)
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.1 * 0.2 * 0.4, rel=0.01)


def test_taper_by_hand():
    # Nearly a cylinder of half-axis 0.1, that is 20% wider along x at the top and 50% narrower along y.
    shape = TaperedSuperquadric((0.1, 0.1, 1.0), (0.02, 1.0), (0.2, -0.5))
    for point in ([0.118, 0, 0.95], [0, 0.052, 0.95], [0.080, 0, -0.95], [0, 0.147, -0.95]):
        assert shape.inside_outside(np.array(point)) < 1, point
    for point in ([0.12, 0, 0.95], [0, 0.054, 0.95], [0.082, 0, -0.95], [0, 0.149, -0.95]):
        assert shape.inside_outside(np.array(point)) > 1, point


@each
def test_grid_goes_up_and_around(shape):
    points, normals = shape.grid(9, 12)
    assert points.shape == normals.shape == (9, 12, 3)
    assert (np.diff(points[:, 0, 2]) >= 0).all()
    a1, a2, a3 = shape.half_axes
    angles = np.unwrap(np.arctan2(points[4, :, 1] / a2, points[4, :, 0] / a1))
    assert (np.diff(angles) > 0).all()
    assert abs(points[..., 2]).max() < a3


@each
def test_girth_bound_encloses(shape):
    a1, a2, _ = shape.half_axes
    points, _ = shape.surface(np.zeros(400), np.linspace(-np.pi, np.pi, 400))
    radii = np.hypot(points[:, 0] / a1, points[:, 1] / a2)
    assert radii.max() <= shape.girth_bound + 1e-12
    assert radii.max() > shape.girth_bound - 1e-2  # and is no larger than it must be
