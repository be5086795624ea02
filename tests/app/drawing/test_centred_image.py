"""A camera's image with its optical axis in the middle, measured against the camera's own projection."""

import numpy as np
import pytest

from app.drawing.centred_image import aspect_around, centred, field_of_view
from tracker.geometry.cameras import Camera

K = np.array([[610.0, 3.0, 250.0], [0.0, 590.0, 291.0], [0.0, 0.0, 1.0]])
"""Off the middle by 70 and 51 px, with oblong and slanted pixels."""


@pytest.fixture
def camera():
    return Camera("off", (640, 480), K, np.zeros(0), np.eye(4))


def dot_at(u, v):
    """A bright blob of 3 px about a place, (480, 640, 3)."""
    y, x = np.mgrid[:480, :640]
    blob = 255 * np.exp(-((x - u) ** 2 + (y - v) ** 2) / 18)
    return np.repeat(blob[..., None], 3, axis=-1).astype(np.uint8)


def middle_of(image):
    weights = np.clip(image[..., 0].astype(float) - 60, 0, None)
    y, x = np.mgrid[: image.shape[0], : image.shape[1]]
    return np.array([(x * weights).sum(), (y * weights).sum()]) / weights.sum()


@pytest.mark.slow
@pytest.mark.parametrize("size", [(480, 560), (900, 300), (640, 480), (1600, 1200), (160, 120)])
@pytest.mark.parametrize("point", [(0.0, 0.0, 2.0), (0.4, 0.2, 2.0), (-0.6, -0.7, 2.5)])
def test_points_lie_where_a_viewer_without_a_principal_point_draws_them(camera, size, point):
    u, v = camera.project(np.array(point))
    found = middle_of(centred(dot_at(u, v), camera, size))
    focal_px = size[1] / 2 / np.tan(field_of_view(camera, size[0] / size[1]) / 2)
    x, y, z = point
    expected = (focal_px * x / z + (size[0] - 1) / 2, focal_px * y / z + (size[1] - 1) / 2)
    assert found == pytest.approx(expected, abs=0.1)


@pytest.mark.parametrize("aspect", [0.4, 1.0, 16 / 9, 4.0])
def test_all_of_the_image_is_seen_and_no_more_than_needed(camera, aspect):
    half_height = np.tan(field_of_view(camera, aspect) / 2)
    edges = np.array([[-0.5, -0.5], [639.5, -0.5], [-0.5, 479.5], [639.5, 479.5]])
    rays = camera.rays(edges)
    across, down = np.abs(rays[:, 0] / rays[:, 2]).max(), np.abs(rays[:, 1] / rays[:, 2]).max()
    assert max(across / (aspect * half_height), down / half_height) == pytest.approx(1.0)


def test_the_smallest_canvas_around_it_touches_both_ways(camera):
    aspect = aspect_around(camera)
    assert field_of_view(camera, aspect) == pytest.approx(field_of_view(camera, 2 * aspect))
    assert field_of_view(camera, 0.9 * aspect) > field_of_view(camera, aspect) + 0.01
