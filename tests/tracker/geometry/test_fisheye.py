"""Fisheye lenses, with `cv2.fisheye` as the oracle."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tracker.errors import CalibrationError
from tracker.geometry import rigid
from tracker.geometry.cameras import MAX_PINHOLE_ANGLE, MAX_PINHOLE_GROWTH, Camera

SIZE = (640, 480)
LENSES = {
    "mild": (620.0, []),
    "ideal": (305.0, [0.0, 0.0, 0.0, 0.0]),
    "action camera": (300.0, [-0.02, 0.012, -0.008, 0.001]),
    "half a sphere": (204.0, [0.01, -0.002, 0.0005, -0.0001]),
    "ends at 66 degrees": (300.0, [-0.25, 0.0, 0.0, 0.0]),
}
lenses = pytest.mark.parametrize("lens", LENSES)


def fisheye(lens="action camera", size=SIZE, skew=1.5, **changes):
    focal, k = LENSES[lens]
    K = np.array([[focal, skew, 0.49 * size[0]], [0.0, 1.01 * focal, 0.52 * size[1]], [0.0, 0.0, 1.0]])
    T = rigid.transform(rigid.so3_exp(np.array([0.4, -1.1, 0.3])), np.array([1.0, -2.0, 0.7]))
    settings = {"K": K, "distortion": np.array(k), "T_world_camera": T, "fisheye": True}
    return Camera("cam", size, **(settings | changes))


def directions(widest_deg, n=300):
    rng = np.random.default_rng(3)
    angles, around = np.radians(rng.uniform(0, widest_deg, n)), rng.uniform(0, 2 * np.pi, n)
    return np.stack([np.sin(angles) * np.cos(around), np.sin(angles) * np.sin(around), np.cos(angles)], axis=-1)


def in_world(camera, points_camera):
    return rigid.apply(camera.T_world_camera, points_camera)


def oracle_px(camera, points_camera):
    k = np.pad(camera.distortion, (0, 4 - camera.distortion.size))
    found, _ = cv2.fisheye.projectPoints(
        points_camera[:, None], np.zeros(3), np.zeros(3), camera.K, k, alpha=camera.K[0, 1] / camera.K[0, 0]
    )
    return found[:, 0]


def image_rays(camera, n=25):
    """Pixels all over the footage, those beyond the lens left out, and their rays in camera coordinates."""
    u, v = np.linspace(0, camera.width - 1, n), np.linspace(0, camera.height - 1, n)
    px = np.stack(np.meshgrid(u, v), axis=-1).reshape(-1, 2)
    rays = camera.rays(px) @ camera.T_world_camera[:3, :3]
    known = np.isfinite(rays).all(axis=-1)
    return px[known], rays[known]


@lenses
def test_project_as_opencv_does(lens):
    c = fisheye(lens)
    points = directions(60 if lens.startswith("ends") else 85) * np.linspace(0.5, 5, 300)[:, None]
    np.testing.assert_allclose(c.project(in_world(c, points)), oracle_px(c, points), atol=1e-7)


@lenses
def test_rays_are_those_of_opencv(lens):
    c = fisheye(lens, skew=0.0)
    px, rays = image_rays(c)
    ahead = rays[:, 2] > np.cos(np.radians(60 if lens.startswith("ends") else 85))
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-14)
    k = np.pad(c.distortion, (0, 4 - c.distortion.size))
    expected = cv2.fisheye.undistortPoints(px[ahead][:, None], c.K, k, criteria=criteria)[:, 0]
    np.testing.assert_allclose(rays[ahead, :2] / rays[ahead, 2:], expected, rtol=1e-6, atol=1e-8)


@pytest.mark.slow
@given(
    st.floats(150, 2000),
    st.floats(-0.05, 0.1),
    st.floats(-0.02, 0.02),
    st.floats(-5, 5),
    st.tuples(st.floats(-400, 400), st.floats(-300, 300)),
)
def test_projected_points_come_back(focal, k1, k2, skew, offset_px):
    K = np.array([[focal, skew, 320.0], [0.0, focal, 240.0], [0.0, 0.0, 1.0]])
    c = fisheye(K=K, distortion=np.array([k1, k2, 0.0, 0.0]))
    px = np.array([320.0, 240.0]) + offset_px
    ray = c.rays(px)
    if np.isnan(ray).any():  # beyond the lens
        return
    np.testing.assert_allclose(c.project(c.center_world + 2.5 * ray), px, atol=1e-5)
    depth = c.depths(c.center_world + 2.5 * ray)
    if abs(depth) > 1e-6:
        np.testing.assert_allclose(c.back_project(px, depth), c.center_world + 2.5 * ray, rtol=1e-5, atol=1e-6)
        assert np.isnan(c.back_project(px, -depth)).all() or depth > 0
    undistorted = c.undistort_points(px)
    if np.isfinite(undistorted).all():
        np.testing.assert_allclose(c.distort_points(undistorted), px, atol=1e-5)
        np.testing.assert_allclose(c.pinhole.rays(undistorted), ray, atol=1e-6)
        assert c.within_lens(undistorted)
    else:
        assert depth <= 1e-6


def test_a_wide_lens_sees_what_is_beside_and_behind_it():
    c = fisheye("half a sphere", size=(900, 900))
    points = np.array([[1.0, 0.0, 0.0], [0.0, -1.0, -0.2], [0.0, 0.0, 1.0]])
    px = c.project(in_world(c, points))
    assert np.isfinite(px).all()
    expected = points / np.linalg.norm(points, axis=1)[:, None]
    np.testing.assert_allclose(c.rays(px) @ c.T_world_camera[:3, :3], expected, atol=1e-9)
    assert np.isnan(c.undistort_points(px)).all(axis=-1).tolist() == [True, True, False]
    assert np.isnan(c.pinhole.project(in_world(c, points))).all(axis=-1).tolist() == [True, True, False]


@pytest.mark.slow
def test_no_pixel_shows_what_lies_beyond_the_lens():
    c = fisheye("ends at 66 degrees")
    beyond = in_world(c, directions(40) @ np.diag([1.0, 1.0, -1.0]))
    assert np.isnan(c.project(beyond)).all()
    aside = c.pinhole.project(in_world(c, np.array([[np.tan(np.radians(70)), 0.0, 1.0]])))
    assert not c.within_lens(aside).any()
    assert np.isnan(c.distort_points(aside)).all()
    assert not c.undistort_image(np.full((480, 640), 255, np.uint8))[[0, 0, -1, -1], [0, -1, 0, -1]].any()


@lenses
def test_the_undistorted_picture_holds_the_footage_up_to_its_angle(lens):
    c = fisheye(lens)
    px, rays = image_rays(c)
    held = rays[:, 2] > np.cos(MAX_PINHOLE_ANGLE)
    undistorted = c.undistort_points(px[held])
    assert (undistorted > -1).all()
    assert (undistorted < np.array(c.pinhole.size)).all()
    assert c.pinhole.width * c.pinhole.height <= 1.01 * MAX_PINHOLE_GROWTH * c.width * c.height
    assert c.pinhole.is_pinhole
    # The middle keeps its resolution, but where the whole picture would be too large.
    kept = c.pinhole.K[0, 0] / c.K[0, 0]
    assert kept == 1.0 or c.pinhole.width * c.pinhole.height > 0.99 * MAX_PINHOLE_GROWTH * c.width * c.height
    assert kept > 0.6


@pytest.mark.slow
@lenses
def test_undistorted_image_shows_each_point_where_the_pinhole_sees_it(lens):
    c = fisheye(lens, skew=4.0)
    px, rays = image_rays(c)
    inside = (rays[:, 2] > np.cos(np.radians(60))) & (px > 5).all(axis=-1) & (px < np.array(SIZE) - 6).all(axis=-1)
    at = np.round(c.undistort_points(px[inside])).astype(int)
    source = c.distort_points(at.astype(float))
    for axis, step in ((0, 0.3), (1, 0.4)):
        ramp = np.arange(SIZE[axis]) * step
        image = np.broadcast_to(ramp if axis == 0 else ramp[:, None], (480, 640)).astype(np.uint8)
        shown = c.undistort_image(np.ascontiguousarray(image))
        assert shown.shape == (c.pinhole.height, c.pinhole.width)
        assert np.abs(shown[at[:, 1], at[:, 0]] - source[:, axis] * step).max() < 1.5


@pytest.mark.parametrize("scale", [0.37, 2.0])
def test_scaled_and_cropped_fisheyes_see_the_same(scale):
    c = fisheye()
    points = in_world(c, directions(50))
    small = c.scaled(scale)
    share = np.array(small.size) / c.size
    np.testing.assert_allclose(small.project(points) + 0.5, (c.project(points) + 0.5) * share, atol=1e-9)
    np.testing.assert_allclose(c.cropped((40, 30, 400, 300)).project(points), c.project(points) - (40, 30), atol=1e-9)


@pytest.mark.parametrize("count", [1, 3, 5, 8])
def test_odd_numbers_of_coefficients(count):
    with pytest.raises(CalibrationError, match=f"expected 0 or 4 fisheye distortion coefficients, found {count}"):
        fisheye(distortion=np.zeros(count))


def test_the_principal_point_on_the_border_has_a_pinhole():
    K = np.array([[500.0, 0.0, -0.5], [0.0, 500.0, -0.5], [0.0, 0.0, 1.0]])
    pinhole = fisheye(K=K, distortion=np.zeros(4)).pinhole
    assert np.isfinite(pinhole.K).all()
