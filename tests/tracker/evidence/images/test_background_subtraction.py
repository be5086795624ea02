import numpy as np
import pytest

from tracker.evidence.images.background_subtraction import (
    apply_gain,
    change_threshold,
    dilate,
    exposure_gain,
    has_usable_exposure,
    smooth_image,
    subtract_background,
)
from tracker.evidence.images.change import MIN_DIFFERENCE


def room(seed=0, noise=0.0):
    """A textured room, (80, 100, 3), with the noise of one image."""
    texture = np.random.default_rng(0).integers(60, 190, (80, 100, 3)).astype(float)
    return np.clip(texture + np.random.default_rng(seed).normal(0, noise, texture.shape), 0, 255).astype(np.uint8)


def changed(image, background):
    """Silhouette of an image before a background, both as filmed, with the threshold that follows from them."""
    pair = smooth_image(image), smooth_image(background)
    differences = np.abs(np.subtract(*pair, dtype=np.float32)).max(axis=-1)
    return subtract_background(*pair, change_threshold(differences.ravel())).inside


def test_finds_what_is_new():
    background, image = room(), room()
    image[20:50, 30:60] = (250, 20, 20)
    found = changed(image, background)
    assert found.dtype == bool
    assert found[23:47, 33:57].all()
    # Smoothing spreads a difference by some 2 px.
    outside = np.ones_like(found)
    outside[17:53, 27:63] = False
    assert not found[outside].any()


def test_one_channel_is_enough():
    background = np.full((40, 40, 3), 100, np.uint8)
    for channel in range(3):
        image = background.copy()
        image[10:30, 10:30, channel] += 40
        assert changed(image, background)[12:28, 12:28].all()


def test_noise_is_no_person_even_where_it_is_strong():
    for noise in (2.0, 12.0):
        found = changed(room(1, noise), room(2, noise))
        assert found.mean() < 0.002, noise


def test_single_pixels_and_small_changes_do_not_count():
    background = np.full((40, 40, 3), 100, np.uint8)
    image = background.copy()
    image[20, 20] = 180  # over the threshold even when smooth_image, but alone
    image[:, 30:] = 100 + int(MIN_DIFFERENCE) - 2
    found = changed(image, background)
    assert not found.any()
    assert not changed(background, background).any()


@pytest.mark.parametrize("radius", [1.0, 4.0, 7.5])
def test_growing_by_a_radius(radius):
    mask = np.zeros((60, 60), dtype=bool)
    mask[30, 25] = True
    v, u = np.mgrid[:60, :60]
    distance = np.hypot(u - 25, v - 30)
    grown = dilate(mask, radius)
    # The disc is an octagon of a whole radius.
    assert grown[distance <= 0.9 * radius].all()
    assert not grown[distance > 1.1 * radius + 0.5].any()
    assert not grown.all()


def test_nothing_to_grow():
    mask = np.zeros((10, 10), dtype=bool)
    assert not dilate(mask, 5).any()
    mask[5, 5] = True
    assert dilate(mask, 0.5).sum() == 1


def test_a_shadow_is_no_silhouette_and_dark_clothes_are():
    background = np.full((60, 80, 3), (150, 120, 90), np.uint8)
    image = background.copy()
    image[10:50, 10:30] = (105, 84, 63)  # 0.7 of the light
    image[10:50, 50:70] = (40, 45, 60)
    found = changed(image, background)
    assert not found[:, :40].any()
    assert found[12:48, 52:68].all()
    # Deep black is no shadow of a lit room, and what is brighter is none either.
    for color in ((30, 24, 18), (195, 156, 117)):
        image[10:50, 50:70] = color
        assert changed(image, background)[12:48, 52:68].all()
    # Both are where edges may lie.
    anything = subtract_background(smooth_image(image), smooth_image(background), MIN_DIFFERENCE).anything
    assert anything[12:48, 12:28].all()
    assert anything[12:48, 52:68].all()
    assert not anything[:, 34:46].any()


def test_exposure_is_found_although_a_person_stands_there():
    rng = np.random.default_rng(0)
    empty = rng.uniform(30, 180, (1000, 3)).astype(np.float32)
    seen = empty * (1.2, 1.1, 0.9)
    seen[:300] = rng.uniform(0, 255, (300, 3))
    np.testing.assert_allclose(exposure_gain(seen.astype(np.float32), empty), (1.2, 1.1, 0.9), atol=0.03)
    # Black or white images do not measure exposure.
    empty[:500], empty[500:960] = 5, 250
    usable = has_usable_exposure(empty)
    assert usable.sum() == 40
    np.testing.assert_array_equal(exposure_gain(seen[usable].astype(np.float32), empty[usable]), 1)


def test_a_background_follows_the_exposure():
    image = np.array([[[100, 100, 100], [250, 0, 20]]], np.uint8)
    gain = np.array([1.1, 1.0, 0.5], np.float32)
    assert apply_gain(image, gain).tolist() == [[[110, 100, 50], [255, 0, 10]]]
    np.testing.assert_array_equal(apply_gain(image, np.ones(3, np.float32)), image)
