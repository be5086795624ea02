import cv2
import numpy as np
import pytest
import trimesh

from tracker.geometry import rigid
from tracker.geometry.cameras import Camera
from tracker.simulate.motion.postures import solve_posture
from tracker.simulate.motion.scenes import cast_of
from tracker.simulate.stage.camera_rig import make_cameras
from tracker.simulate.stage.rasterizer import SAMPLES, cast, pixel_means, vertex_normals


def coverage(camera, vertices, faces):
    """How much of each pixel a mesh covers, 0 to 1."""
    return pixel_means((cast(camera.scaled(SAMPLES), vertices, faces).faces >= 0).astype(np.float32))


@pytest.mark.slow
@pytest.mark.parametrize("center", [(0.0, 0.0, 1.0), (0.6, -0.4, 0.3), (-0.5, 0.7, 1.6)])
def test_a_ball_appears_where_it_projects(center):
    radius, center = 0.3, np.array(center)
    for camera in make_cameras(4, (640, 480), 5):
        ball = trimesh.creation.icosphere(subdivisions=6, radius=radius)
        image = coverage(camera, ball.vertices + center, ball.faces)
        # The contour generator of a ball is a circle; its outline is drawn at 64 times the resolution.
        to_ball = center - camera.center_world
        distance = np.linalg.norm(to_ball)
        axis = to_ball / distance
        across = np.linalg.svd(axis[None])[2][1:]
        angles = np.linspace(0, 2 * np.pi, 720, endpoint=False)
        ring = np.stack([np.cos(angles), np.sin(angles)], axis=1) @ across
        sine = radius / distance
        outline = camera.project(center - radius * sine * axis + radius * np.sqrt(1 - sine**2) * ring)
        x, y = outline.T
        area = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
        assert np.isclose(image.sum(), area, rtol=0.005)
        rows, columns = np.indices(image.shape)
        found = np.array([(columns * image).sum(), (rows * image).sum()]) / image.sum()
        moments = cv2.moments(outline.astype(np.float32)[:, None])
        assert np.allclose(found, (moments["m10"] / moments["m00"], moments["m01"] / moments["m00"]), atol=0.03)


@pytest.mark.slow
def test_the_skins_edges_lie_where_its_vertices_project(skin):
    values = solve_posture(cast_of("elbow_rotation")[0], skin.model, 30, 25.0)[-1]
    vertices = skin.posed(values)
    for camera in make_cameras(4, (640, 480), 0):
        image = coverage(camera, vertices, skin.faces)
        rows, columns = np.nonzero(image)
        low, high = camera.project(vertices).min(axis=0), camera.project(vertices).max(axis=0)
        assert np.all(np.abs(np.array([columns.min(), rows.min()]) - low) <= 1.0)
        assert np.all(np.abs(np.array([columns.max(), rows.max()]) - high) <= 1.0)


@pytest.fixture
def straight_camera():
    K = np.array([[100.0, 0, 31.5], [0, 100, 23.5], [0, 0, 1]])
    return Camera("c", (64, 48), K, np.zeros(0), np.eye(4))


def test_pixel_centres_lie_at_integers(straight_camera):
    # At depth 1 a step of 0.01 is one pixel: the square reaches from u, v = 10, 12 to 20, 22.
    corners = [((u - 31.5) / 100, (v - 23.5) / 100, 1.0) for u, v in ((10, 12), (20, 12), (20, 22), (10, 22))]
    image = coverage(straight_camera, np.array(corners), np.array([[0, 1, 2], [0, 2, 3]]))
    row, column = image[17], image[:, 15]
    assert np.allclose(row[8:13], (0, 0, 0.5, 1, 1))
    assert np.allclose(row[18:23], (1, 1, 0.5, 0, 0))
    assert np.allclose(column[[11, 12, 13, 21, 22, 23]], (0, 0.5, 1, 1, 0.5, 0))


def test_the_nearest_triangle_wins_and_weights_are_perspective_correct(straight_camera):
    near = [(-0.2, -0.2, 1.0), (0.3, -0.2, 1.0), (-0.2, 0.3, 3.0)]
    far = [(x, y, 5.0) for x, y, _ in near]
    vertices = np.array(far + near)
    hits = cast(straight_camera, vertices, np.array([[3, 4, 5], [0, 1, 2]]))
    seen = hits.faces == 0
    assert seen.any()
    assert not (hits.faces == 1)[seen].any()
    v, u = np.nonzero(seen)
    points = hits.weights[v, u].astype(float) @ vertices[3:]
    assert np.allclose(straight_camera.project(points), np.stack([u, v], axis=1), atol=1e-3)
    assert np.allclose(1 / hits.inverse_depths[v, u], points[:, 2], rtol=1e-5)


def test_an_occluder_before_the_mesh_hides_it(straight_camera):
    triangle = np.array([(-0.2, -0.2, 2.0), (0.3, -0.2, 2.0), (-0.2, 0.3, 2.0)])
    wall = np.zeros((48, 64), dtype=np.float32)
    wall[:, :32] = 1.0  # a wall at 1 m
    hits = cast(straight_camera, triangle, np.array([[0, 1, 2]]), wall)
    assert not (hits.faces[:, :32] >= 0).any()
    assert (hits.faces[:, 32:] >= 0).any()


def test_normals_point_outward():
    ball = trimesh.creation.icosphere(subdivisions=3)
    assert np.allclose(vertex_normals(ball.vertices, ball.faces), ball.vertices, atol=0.02)


def test_parts_behind_the_camera_are_not_drawn(straight_camera):
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    behind = rigid.apply(rigid.transform(t=np.array([0, 0, -2.0])), ball.vertices)
    assert not (cast(straight_camera, behind, ball.faces).faces >= 0).any()
    across = np.array([(-0.2, -0.2, 1.0), (0.3, -0.2, 1.0), (-0.2, 0.3, -1.0)])
    assert not (cast(straight_camera, across, np.array([[0, 1, 2]])).faces >= 0).any()
