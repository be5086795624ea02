import numpy as np
import pytest

from tracker.edges import detect_edges

COLUMN = 30


def halves(left, right):
    """An image whose left half has one colour and whose right half another, (60, 60, 3); the border is at 29.5."""
    image = np.empty((60, 60, 3), np.uint8)
    image[:, :COLUMN], image[:, COLUMN:] = left, right
    return image


def columns(edges):
    """Columns in which edges lie, away from the image's own border."""
    return set(np.nonzero(edges[5:-5])[1].tolist())


def test_a_step_gives_one_thin_edge_where_it_is():
    edges = detect_edges(halves((40, 40, 40), (200, 200, 200)))
    assert edges.dtype == bool
    assert edges.shape == (60, 60)
    assert columns(edges) <= {COLUMN - 1, COLUMN}
    assert edges[5:-5].sum(axis=1).tolist() == [1] * 50


@pytest.mark.parametrize(("left", "right"), [((200, 60, 80), (80, 121, 80)), ((200, 90, 10), (191, 90, 89))])
def test_equal_brightness_and_different_hue_have_an_edge(left, right):
    gray = np.array([0.299, 0.587, 0.114])
    assert abs(gray @ left - gray @ right) < 7  # no edge in a gray image
    assert not detect_edges(halves([gray @ left] * 3, [gray @ right] * 3)).any()
    edges = detect_edges(halves(left, right))
    assert columns(edges) <= {COLUMN - 1, COLUMN}
    assert edges[5:-5].sum() == 50


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_one_channel_is_enough(channel):
    left = right = np.array([100, 100, 100])
    edges = detect_edges(halves(left, right + 60 * np.eye(3, dtype=int)[channel]))
    assert columns(edges) <= {COLUMN - 1, COLUMN}
    assert edges[5:-5].sum() == 50


def test_flat_and_noisy_images_have_no_edges():
    assert not detect_edges(halves((90, 90, 90), (90, 90, 90))).any()
    noise = np.random.default_rng(0).normal(90, 3, (60, 60, 3)).astype(np.uint8)
    assert not detect_edges(noise).any()


def test_edges_only_within_the_foreground():
    image = halves((40, 40, 40), (200, 200, 200))
    foreground = np.zeros((60, 60), dtype=bool)
    foreground[20:40] = True
    edges = detect_edges(image, foreground)
    rows = set(np.nonzero(edges)[0].tolist())
    assert rows == set(range(20, 40))
    assert not detect_edges(image, np.zeros((60, 60), dtype=bool)).any()


def test_a_foreground_shows_what_a_textured_room_outshouts():
    rng = np.random.default_rng(0)
    image = rng.integers(0, 2, (120, 160, 1)).repeat(3, axis=2).astype(np.uint8) * 255  # all of it strong texture
    image[30:90, 40:120] = 90
    image[30:90, 80:120] = 125  # a weak edge on a calm person
    foreground = np.zeros((120, 160), dtype=bool)
    foreground[35:85, 45:115] = True
    assert not detect_edges(image)[40:80, 70:90].any()
    found = detect_edges(image, foreground)[40:80]
    assert set(np.nonzero(found)[1].tolist()) <= {79, 80}
    assert found.sum() == 40


def test_the_image_is_left_as_it_was():
    image = halves((40, 40, 40), (200, 200, 200))
    before = image.copy()
    detect_edges(image, np.ones((60, 60), dtype=bool))
    np.testing.assert_array_equal(image, before)
