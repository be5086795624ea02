import cv2
import numpy as np
import pytest

from tracker.evidence.images.background_subtraction import smooth_image
from tracker.evidence.images.edges import Levels, SampleGrid, detect_edges, levels

COLUMN = 30


def found(image, foreground=None):
    """Edges of a whole image, (H, W) bool, with the thresholds that follow from it."""
    strengths = SampleGrid(image.shape[1::-1], 1.0).measure(image).strengths
    edges = detect_edges(smooth_image(image), levels(strengths, restricted=foreground is not None), foreground)
    assert edges.found.dtype == np.uint8
    return edges.found > 0


def halves(left, right):
    """An image whose left half has one colour and whose right half another, (60, 60, 3); the border is at 29.5."""
    image = np.empty((60, 60, 3), np.uint8)
    image[:, :COLUMN], image[:, COLUMN:] = left, right
    return image


def columns(edges):
    """Columns in which edges lie, away from the image's own border."""
    return set(np.nonzero(edges[5:-5])[1].tolist())


def test_a_step_gives_one_thin_edge_where_it_is():
    edges = found(halves((40, 40, 40), (200, 200, 200)))
    assert edges.shape == (60, 60)
    assert columns(edges) <= {COLUMN - 1, COLUMN}
    assert edges[5:-5].sum(axis=1).tolist() == [1] * 50


@pytest.mark.parametrize(("left", "right"), [((200, 60, 80), (80, 121, 80)), ((200, 90, 10), (191, 90, 89))])
def test_equal_brightness_and_different_hue_have_an_edge(left, right):
    gray = np.array([0.299, 0.587, 0.114])
    assert abs(gray @ left - gray @ right) < 7  # no edge in a gray image
    assert not found(halves([gray @ left] * 3, [gray @ right] * 3)).any()
    edges = found(halves(left, right))
    assert columns(edges) <= {COLUMN - 1, COLUMN}
    assert edges[5:-5].sum() == 50


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_one_channel_is_enough(channel):
    left = right = np.array([100, 100, 100])
    edges = found(halves(left, right + 60 * np.eye(3, dtype=int)[channel]))
    assert columns(edges) <= {COLUMN - 1, COLUMN}
    assert edges[5:-5].sum() == 50


def test_flat_and_noisy_images_have_no_edges():
    assert not found(halves((90, 90, 90), (90, 90, 90))).any()
    noise = np.random.default_rng(0).normal(90, 3, (60, 60, 3)).astype(np.uint8)
    assert not found(noise).any()


def test_edges_only_within_the_foreground():
    image = halves((40, 40, 40), (200, 200, 200))
    foreground = np.zeros((60, 60), dtype=bool)
    foreground[20:40] = True
    edges = found(image, foreground)
    rows = set(np.nonzero(edges)[0].tolist())
    assert rows == set(range(20, 40))
    assert not found(image, np.zeros((60, 60), dtype=bool)).any()


def test_a_foreground_shows_what_a_textured_room_outshouts():
    rng = np.random.default_rng(0)
    image = rng.integers(0, 2, (120, 160, 1)).repeat(3, axis=2).astype(np.uint8) * 255  # all of it strong texture
    image[30:90, 40:120] = 90
    image[30:90, 80:120] = 125  # a weak edge on a calm person
    foreground = np.zeros((120, 160), dtype=bool)
    foreground[35:85, 45:115] = True
    assert not found(image)[40:80, 70:90].any()
    weak = found(image, foreground)[40:80]
    assert set(np.nonzero(weak)[1].tolist()) <= {79, 80}
    assert weak.sum() == 40


def test_the_image_is_left_as_it_was():
    image = halves((40, 40, 40), (200, 200, 200))
    before = image.copy()
    found(image, np.ones((60, 60), dtype=bool))
    np.testing.assert_array_equal(image, before)


def test_edges_inside_a_region_are_those_of_the_whole_image():
    rng = np.random.default_rng(2)
    smooth = cv2.GaussianBlur(rng.integers(0, 255, (120, 160, 3)).astype(np.uint8), (0, 0), 3)
    bounds = Levels(60.0, 30.0)
    whole, part = detect_edges(smooth, bounds), detect_edges(smooth[20:100, 30:140], bounds)
    inner = (slice(24, 96), slice(34, 136))
    there = (slice(4, 76), slice(4, 106))
    np.testing.assert_array_equal(part.gradients[:, *there], whole.gradients[:, *inner])
    # A weak edge may have its strong beginning outside the region.
    assert np.mean(part.found[there] != whole.found[inner]) < 0.003
    assert not np.any(part.found[there] & ~whole.found[inner])
    assert whole.found[inner].any()


def test_gradients_are_those_of_the_strongest_channel():
    smooth = smooth_image(np.random.default_rng(1).integers(0, 255, (20, 30, 3)).astype(np.uint8))
    gradients = detect_edges(smooth, Levels(60.0, 30.0)).gradients
    for v, u in ((4, 7), (11, 2), (15, 26)):
        around = smooth[v - 1 : v + 2, u - 1 : u + 2].astype(int)
        gx = (around[:, 2] - around[:, 0]).T @ (1, 2, 1)
        gy = (around[2] - around[0]).T @ (1, 2, 1)
        strongest = np.argmax(abs(gx) + abs(gy))
        assert gradients[:, v, u].tolist() == [gx[strongest], gy[strongest]]


@pytest.mark.parametrize("shape", [(20, 30), (17, 16), (2, 40), (40, 2)])
def test_gradients_are_those_of_opencv_up_to_the_border(shape):
    smooth = np.random.default_rng(4).integers(0, 255, (*shape, 3)).astype(np.uint8)
    derived = np.array([cv2.spatialGradient(channel) for channel in cv2.split(smooth)], dtype=int)  # (3, 2, H, W)
    strongest = np.argmax(np.abs(derived).sum(axis=1), axis=0)  # the first of equals
    expected = np.take_along_axis(derived, strongest[None, None], axis=0)[0]
    np.testing.assert_array_equal(detect_edges(smooth, Levels(60.0, 30.0)).gradients, expected)


def test_levels_follow_the_picture_unless_a_foreground_restricts_it():
    calm, busy = np.linspace(0, 40, 101, dtype=np.float32), np.linspace(0, 400, 101, dtype=np.float32)
    assert levels(calm, restricted=False) == (48, pytest.approx(32))
    assert levels(busy, restricted=False) == (pytest.approx(368), pytest.approx(320))
    assert levels(busy, restricted=True) == (96, 48)
