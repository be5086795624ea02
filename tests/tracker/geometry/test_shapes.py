import numpy as np
import pytest
import trimesh

from tracker.geometry.shapes import Ellipsoid, EllipticalCone, TaperedSuperquadric

SHAPES = {
    "sphere": TaperedSuperquadric((0.3, 0.3, 0.3), (1.0, 1.0)),
    "ellipsoid": TaperedSuperquadric((0.1, 0.2, 0.4), (1.0, 1.0)),
    "limb": TaperedSuperquadric((0.05, 0.05, 0.2), (0.35, 1.0), (0.22, 0.22)),
    "trunk": TaperedSuperquadric((0.12, 0.17, 0.31), (0.5, 0.8), (0.0, 0.04)),
    "box": TaperedSuperquadric((0.1, 0.2, 0.3), (0.2, 0.2), (-0.3, 0.4)),
}
OTHERS = {
    "cone": EllipticalCone((0.06, 0.1, 0.25), 0.5),
    "cylinder": EllipticalCone((0.1, 0.1, 0.2)),
    "true ellipsoid": Ellipsoid((0.1, 0.2, 0.4)),
}
each_kind = pytest.mark.parametrize("shape", [*SHAPES.values(), *OTHERS.values()], ids=[*SHAPES, *OTHERS])
each = pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)


def mesh_of(shape, n_rings, n_sectors):
    return trimesh.Trimesh(*shape.triangles(n_rings, n_sectors), process=False)


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


@each_kind
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


@each_kind
def test_mesh_is_closed_and_turned_outward(shape):
    mesh = mesh_of(shape, 24, 32)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0
    np.testing.assert_allclose(shape.inside_outside(mesh.vertices), 1, atol=1e-9)


@each_kind
def test_normals_of_the_grid_lead_outside(shape):
    points, normals = shape.grid(15, 20)
    np.testing.assert_allclose(shape.inside_outside(points), 1, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1)
    # Just within the surface: corners belong to two faces.
    assert (shape.inside_outside(0.999 * points + 0.01 * normals) > 1).all()
    assert (shape.inside_outside(0.999 * points - 0.001 * normals) < 1).all()


@each_kind
def test_degree_is_how_the_implicit_function_grows(shape):
    straight = isinstance(shape, EllipticalCone) or (isinstance(shape, TaperedSuperquadric) and any(shape.taper))
    point = np.array([0.01, 0.02, 0.0 if straight else 0.03])
    grown = shape.inside_outside(2 * point) / shape.inside_outside(point)
    assert grown == pytest.approx(2**shape.degree)


def test_volumes_of_cone_and_ellipsoid():
    a, b, c, k = 0.06, 0.1, 0.25, 0.5
    # The section's area is pi a b (1 + k z)^2.
    assert mesh_of(OTHERS["cone"], 64, 128).volume == pytest.approx(np.pi * a * b * 2 * c * (1 + k**2 / 3), rel=0.01)
    assert mesh_of(OTHERS["true ellipsoid"], 64, 64).volume == pytest.approx(4 / 3 * np.pi * 0.1 * 0.2 * 0.4, rel=0.01)


@pytest.mark.parametrize("shape", [SHAPES["sphere"], SHAPES["limb"], *OTHERS.values()])
def test_profile_runs_along_the_surface_within_the_tolerance(shape):
    profile = shape.profile(5e-4)
    assert (profile.heights[0], profile.heights[-1]) == pytest.approx((-1, 1), abs=1e-3)
    np.testing.assert_allclose(np.hypot(profile.outward, profile.along), 1, atol=1e-6)
    unit = np.stack([profile.radii, 0 * profile.radii, profile.heights], axis=1)
    np.testing.assert_allclose(shape.inside_outside(unit * shape.half_axes), 1, atol=1e-9)
    outward = np.stack([profile.outward, 0 * profile.outward, profile.along], axis=1)
    assert (shape.inside_outside((unit * 0.999 + 1e-2 * outward) * shape.half_axes) > 1).all()
    # Normals are at right angles to the profile: on average over a chord to that chord.
    chords = np.diff(unit[1:-1, [0, 2]], axis=0)
    normals = np.stack([profile.outward, profile.along], axis=1)[1:-1]
    slopes = np.sum(chords * (normals[1:] + normals[:-1]), axis=1) / 2 / np.linalg.norm(chords, axis=1)
    assert np.abs(slopes).max() < 0.15
    # Everything of the surface lies within the tolerance of the polygon.
    points = (shape.grid(300, 4)[0] / shape.half_axes).reshape(-1, 3)
    metric = np.stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]], 1) * (
        max(shape.half_axes[:2]),
        shape.half_axes[2],
    )
    corners = np.stack([profile.radii * max(shape.half_axes[:2]), profile.heights * shape.half_axes[2]], axis=1)
    corners = np.concatenate([[(0.0, corners[0, 1])], corners, [(0.0, corners[-1, 1])]])
    starts, steps = corners[:-1, None], np.diff(corners, axis=0)[:, None]
    t = np.clip(np.sum((metric - starts) * steps, -1) / np.maximum(np.sum(steps**2, -1), 1e-12), 0, 1)
    assert np.linalg.norm(metric - starts - t[..., None] * steps, axis=-1).min(axis=0).max() < 6e-4


def test_only_solids_of_revolution_have_profiles():
    assert SHAPES["trunk"].profile(1e-3) is None
    assert SHAPES["box"].profile(1e-3) is None


@each_kind
def test_enclosure_encloses(shape):
    around = shape.enclosure
    x, y, z = np.moveaxis(shape.grid(60, 80)[0] / shape.half_axes, -1, 0)
    filled = (
        (x / around.girths[0]) ** 2 + (y / around.girths[1]) ** 2 + around.bulge * z**2 - (1 + around.taper * z) ** 2
    )
    assert filled.max() <= 1e-9
    if around.exact:
        np.testing.assert_allclose(filled[np.abs(z) < 1], 0, atol=1e-9)


def test_volume_of_an_ellipsoid():
    mesh = mesh_of(SHAPES["ellipsoid"], 64, 64)
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
