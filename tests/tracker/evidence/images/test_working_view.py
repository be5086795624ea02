from dataclasses import replace

import cv2
import numpy as np
import pytest
from fisheye import with_fisheye
from hypothesis import given
from hypothesis import strategies as st
from staging import camera_at

from tracker.evidence.images.working_view import MIN_REGION_PX, WorkingView, fit_region, region_around

LENS = np.array([-0.1, 0.02, 0.001, -0.001])
lenses = pytest.mark.parametrize("lens", ["pinhole", "lens", "fisheye"])


def with_lens(camera, lens):
    return with_fisheye(camera) if lens == "fisheye" else replace(camera, distortion=LENS[: 4 * (lens == "lens")])


def smooth_picture(size, seed=0):
    """A picture without detail finer than 12 px of the footage, (H, W, 3)."""
    coarse = np.random.default_rng(seed).integers(0, 255, (size[1] // 12 + 1, size[0] // 12 + 1, 3)).astype(np.uint8)
    return cv2.resize(coarse, size, interpolation=cv2.INTER_CUBIC)


@pytest.mark.slow
@pytest.mark.parametrize("size", [(640, 480), (1088, 1920), (1280, 960), (700, 500)])
@lenses
def test_regions_are_parts_of_the_whole(size, lens):
    view = WorkingView(with_lens(camera_at("c", (4, 0, 0), size=size), lens))
    frame = smooth_picture(size)
    whole = view.image(frame, view.whole)
    assert whole.shape == (view.camera.height, view.camera.width, 3)
    for region in ((40, 60, 200, 310), (0, 0, 30, 20), (view.camera.width - 33, 100, *view.camera.size)):
        u0, v0, u1, v1 = region
        np.testing.assert_array_equal(view.image(frame, region), whole[v0:v1, u0:u1])


@pytest.mark.slow
@pytest.mark.parametrize("size", [(640, 480), (1088, 1920)])
@lenses
def test_matched_pixels_show_what_the_matched_camera_sees(size, lens):
    source = with_lens(camera_at("c", (2.5, 0.7, 0.3), size=size, focal=0.8 * size[0]), lens)
    view = WorkingView(source)
    # The colour of a pixel of the footage encodes its position.
    u, v = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    frame = np.stack([255 * u / size[0], 255 * v / size[1], 0 * u], axis=-1).astype(np.uint8)
    seen = view.image(frame, view.whole)
    for place in ((0.0, 0.0, 0.0), (0.0, 0.6, 0.3), (0.3, -0.5, -0.4)):
        there = np.array(place)
        mu, mv = np.round(view.camera.project(there)).astype(int)
        expected = 255 * source.project(there) / size
        np.testing.assert_allclose(seen[mv, mu, :2], expected, atol=2)


@pytest.mark.slow
@lenses
def test_a_mask_keeps_its_place(lens):
    source = with_lens(camera_at("c", (4, 0, 0), size=(1280, 960)), lens)
    view = WorkingView(source)
    mask = np.zeros((960, 1280), np.uint8)
    mask[300:500, 500:900] = 2
    inside = view.mask(mask, view.whole)
    assert inside.dtype == bool
    shown = view.image(np.where(mask[..., None], 255, 0).astype(np.uint8).repeat(3, axis=-1), view.whole)[..., 0]
    assert np.mean(inside != (shown > 127)) < 0.0005
    np.testing.assert_array_equal(view.mask(mask, (150, 100, 300, 200)), inside[100:200, 150:300])


def test_no_black_frame_where_the_lens_leaves_the_picture():
    source = replace(camera_at("c", (4, 0, 0), focal=700.0), distortion=np.array([0.2, 0.0, 0.0, 0.0]))
    view = WorkingView(source)
    seen = view.image(np.full((480, 640, 3), 200, np.uint8), view.whole)
    assert (seen == 200).all()


@pytest.mark.slow
@lenses
@pytest.mark.parametrize("scale", [1.0, 0.61, 0.5, 0.23])
def test_another_scale_shows_the_undistorted_image_reduced(lens, scale):
    source = with_lens(camera_at("c", (4, 0, 0)), lens)
    view = WorkingView(source, scale, cv2.BORDER_CONSTANT)
    frame = smooth_picture((640, 480))
    seen = view.image(frame, view.whole).astype(float)
    simple = cv2.resize(source.undistort_image(frame), view.camera.size, interpolation=cv2.INTER_AREA)
    assert view.scale == scale
    assert np.abs(seen - simple).mean() < 3
    assert np.abs(seen[:, 8:] - simple[:, :-8]).mean() > 10  # a shift would show


boxes = st.tuples(*[st.integers(-900, 900)] * 4)


@given(boxes)
def test_any_region_fits(box):
    u0, v0, u1, v1 = fit_region(box, (640, 480))
    assert 0 <= u0 <= u1 - MIN_REGION_PX
    assert u1 <= 640
    assert 0 <= v0 <= v1 - MIN_REGION_PX
    assert v1 <= 480


def test_a_region_inside_stays_as_it_is():
    assert fit_region((10, 20, 300, 400), (640, 480)) == (10, 20, 300, 400)


def test_a_region_holds_its_points_and_the_margin():
    points = np.array([[100.0, 120.0], [211.0, 130.0], [150.0, 333.0]])
    assert region_around(points, 20.0, (640, 480)) == (80, 96, 232, 360)
    assert region_around(points + np.array([300, 200]), 20.0, (640, 480)) == (376, 296, 536, 480)
    far = np.array([[1e12, -1e12], [300.0, 200.0]])
    assert region_around(far, 20.0, (640, 480)) == (280, 0, 640, 224)
