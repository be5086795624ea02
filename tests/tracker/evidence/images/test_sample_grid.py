import cv2
import numpy as np
import pytest

from tracker.evidence.images.background_subtraction import smooth_image
from tracker.evidence.images.edges import SPACING_PX, Levels, SampleGrid, detect_edges


def picture(size, blur=1.5, seed=0):
    noise = np.random.default_rng(seed).integers(0, 255, (size[1], size[0], 3)).astype(np.uint8)
    return cv2.GaussianBlur(noise, (0, 0), blur)


def test_probes_read_what_the_whole_image_holds_there():
    size = (320, 240)  # multiples of the spacing
    image = picture(size)
    statistics = SampleGrid(size, 1.0).measure(image)
    smooth = smooth_image(image)
    gradients = np.abs(detect_edges(smooth, Levels(60, 30)).gradients.astype(int)).sum(axis=0)
    places = np.meshgrid(np.arange(SPACING_PX // 2, 240, SPACING_PX), np.arange(SPACING_PX // 2, 320, SPACING_PX))
    v, u = (p.T.ravel() for p in places)
    np.testing.assert_allclose(statistics.colors, smooth[v, u], atol=0.6)
    # The image is rounded after smoothing, and derivatives add up eight such errors.
    np.testing.assert_allclose(statistics.strengths, gradients[v, u], atol=5)


def test_the_share_of_strong_gradients_is_that_of_the_image():
    size = (640, 480)
    image = picture(size, blur=2.0)
    image[:, 320:] = 100
    strengths = SampleGrid(size, 1.0).measure(image).strengths
    everywhere = np.abs(detect_edges(smooth_image(image), Levels(60, 30)).gradients.astype(int)).sum(axis=0)
    for share in (0.6, 0.8, 0.92):
        assert np.quantile(strengths, share) == pytest.approx(np.quantile(everywhere, share), rel=0.1)


def test_larger_footage_is_read_at_the_scale_of_matching():
    small, large = (320, 240), (960, 720)
    image = picture(small, blur=2.0)
    enlarged = cv2.resize(image, large, interpolation=cv2.INTER_CUBIC)
    a, b = SampleGrid(small, 1.0).measure(image), SampleGrid(large, 1 / 3).measure(enlarged)
    np.testing.assert_allclose(a.colors, b.colors, atol=4)
    assert np.quantile(b.strengths, 0.8) == pytest.approx(np.quantile(a.strengths, 0.8), rel=0.1)


def test_small_images_have_probes_too():
    statistics = SampleGrid((32, 20), 1.0).measure(np.full((20, 32, 3), 77, np.uint8))
    np.testing.assert_allclose(statistics.colors, 77, rtol=1e-5)
    np.testing.assert_allclose(statistics.strengths, 0, atol=1e-3)
