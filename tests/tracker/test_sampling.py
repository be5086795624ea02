import numpy as np
import pytest
from match_oracle import bilinear as obvious

from tracker.sampling import bilinear

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
