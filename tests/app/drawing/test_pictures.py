"""Pictures for the page: what a browser decodes is what was to be shown."""

import cv2
import numpy as np
import pytest

from app.drawing import pictures


def decoded(picture):
    return cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_UNCHANGED)


@pytest.mark.parametrize("width", [1, 8, 13, 640])
def test_a_mask_is_its_colour_where_it_is_set_and_transparent_elsewhere(width):
    inside = np.random.default_rng(3).random((7, width)) < 0.5
    rgba = cv2.cvtColor(decoded(pictures.mask(inside, "#4ae08c")), cv2.COLOR_BGRA2RGBA)
    assert rgba.shape == (7, width, 4)
    np.testing.assert_array_equal(rgba[..., 3], np.where(inside, 255, 0))
    assert {tuple(c) for c in rgba[inside]} == {(0x4A, 0xE0, 0x8C, 255)}


def test_labels_have_their_colours_and_nothing_is_transparent():
    parts = np.array([[0, 1, 2], [2, 0, 1]], np.uint8)
    rgba = cv2.cvtColor(decoded(pictures.labels(parts, ["#ff0000", "#00ff80"])), cv2.COLOR_BGRA2RGBA)
    assert rgba[0, 1].tolist() == [255, 0, 0, 255]
    assert rgba[1, 0].tolist() == [0, 255, 128, 255]
    np.testing.assert_array_equal(rgba[..., 3] > 0, parts > 0)


def test_masks_are_small():
    inside = np.zeros((480, 640), np.bool_)
    inside[100:400, 250:400] = True
    assert len(pictures.mask(inside, "#ffffff")) < 1000


def test_footage_keeps_its_colours_and_a_damaged_frame_says_so():
    image = np.full((48, 64, 3), (200, 40, 10), np.uint8)
    shown = decoded(pictures.footage(image, (64, 48)))
    assert shown.shape == (48, 64, 3)
    np.testing.assert_allclose(shown[0, 0], (10, 40, 200), atol=4)
    damaged = decoded(pictures.footage(None, (64, 48)))
    assert damaged.shape == (48, 64, 3)
    assert damaged.max() > 100 > np.median(damaged)
