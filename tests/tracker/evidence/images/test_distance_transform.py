import cv2
import numpy as np
import pytest
from contour_oracle import bilinear as obvious

from tracker.evidence.images.distance_transform import bilinear, distance_image

RNG = np.random.default_rng(4)
IMAGE = RNG.uniform(0, 30, (12, 17)).astype(np.float32)


def sampled(u, v):
    height, width = IMAGE.shape
    return bilinear(IMAGE.ravel(), width, height, np.float32(u), np.float32(v))


@pytest.mark.parametrize("seed", range(50))
def test_value_and_slopes_within_the_image(seed):
    at = np.random.default_rng(seed).uniform(0, (16, 11)).astype(np.float32)
    value, slope = obvious(IMAGE, at[None].astype(float))
    assert sampled(*at) == pytest.approx((value[0], *slope[0]), abs=1e-4)


def test_pixels_and_the_border():
    for v, u in np.ndindex(*IMAGE.shape):
        assert sampled(u, v)[0] == pytest.approx(IMAGE[v, u], abs=1e-5)


def test_outside_it_is_as_at_the_nearest_border_pixel():
    for (u, v), (nearest_u, nearest_v) in {
        (-3.5, 4.25): (0, 4.25), (16.01, 4.25): (16, 4.25), (5.5, -1e6): (5.5, 0), (5.5, 40.0): (5.5, 11),
        (-9.0, 99.0): (0, 11), (17.0, -1.0): (16, 0),
    }.items():  # fmt: skip
        assert sampled(u, v) == pytest.approx(sampled(nearest_u, nearest_v), abs=1e-5)


def test_distance_image():
    edges = np.zeros((40, 60), dtype=bool)
    edges[20, 10] = True
    v, u = np.mgrid[:40, :60]
    distance = distance_image(edges, 30.0)
    assert distance.dtype == np.float32
    np.testing.assert_allclose(distance, np.minimum(np.hypot(u - 10, v - 20), 30), rtol=0.03)
    assert distance[20, 10] == 0
    assert distance.max() == 30
    assert (distance_image(np.zeros((4, 5), dtype=bool), 7.0) == 7).all()


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (7, 5), (3, 200), (200, 3), (120, 173)])
@pytest.mark.parametrize(("share", "limit_px"), [(0.3, 20.0), (0.01, 38.4), (0.001, 150.0)])
def test_distance_images_are_those_of_opencv(size, share, limit_px):
    """With few edges and many, in images narrower than a step, with limits larger than the image."""
    rng = np.random.default_rng(size[0] + size[1])
    edges = rng.random(size) < share
    edges[rng.integers(size[0]), rng.integers(size[1])] = True
    expected = cv2.distanceTransform((~edges).view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    np.testing.assert_allclose(distance_image(edges, limit_px), np.minimum(expected, limit_px), atol=1e-3)
