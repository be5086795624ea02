import cv2
import numpy as np
import pytest

from tracker.evidence.images.background_subtraction import smooth_image
from tracker.evidence.images.edges import Levels, detect_edges
from tracker.evidence.images.silhouette_contour import contour_trust, trace_silhouette

BOUNDS = Levels(60.0, 30.0)


def disc(radius=30.0, middle=(80, 60)):
    v, u = np.mgrid[:120, :160]
    return np.hypot(u - middle[0], v - middle[1]) < radius


def picture(inside):
    image = np.where(inside[..., None], 180, 60).astype(np.uint8).repeat(3, axis=-1)
    return cv2.GaussianBlur(image, (3, 3), 0)


def trusted(silhouette, image):
    return contour_trust(trace_silhouette(silhouette), silhouette, detect_edges(smooth_image(image), BOUNDS))


def test_points_lie_on_the_contour_and_normals_point_out():
    outline = trace_silhouette(disc())
    out = outline.points_px - np.array([80, 60], np.float32)
    radii = np.linalg.norm(out, axis=1)
    assert len(out) > 150
    assert radii.min() > 28.5
    assert radii.max() < 30
    assert np.sum(outline.normals * out / radii[:, None], axis=1).min() > 0.95
    np.testing.assert_allclose(np.linalg.norm(outline.normals, axis=1), 1, rtol=1e-5)


def test_normals_are_against_the_slope_of_the_softened_silhouette():
    blots = cv2.GaussianBlur(np.random.default_rng(3).normal(size=(120, 160)), (0, 0), 5) > 0
    outline = trace_silhouette(blots)
    assert len(outline.points_px) > 500
    u, v = outline.points_px.T.astype(int)
    soft = cv2.blur(blots.view(np.uint8) * np.uint8(255), (7, 7))
    inward = np.stack([np.asarray(g)[v, u] for g in cv2.spatialGradient(soft)], axis=-1).astype(np.float32)
    expected = -inward / np.linalg.norm(inward, axis=-1, keepdims=True)
    np.testing.assert_array_equal(outline.normals, expected)


def test_trust_is_the_share_of_the_outline_with_an_edge_along_it():
    rng = np.random.default_rng(4)
    blots = cv2.GaussianBlur(rng.normal(size=(120, 160)), (0, 0), 9) > 0.02
    seen = blots & (cv2.GaussianBlur(rng.normal(size=(120, 160)), (0, 0), 6) > -0.04)
    edges, outline = detect_edges(smooth_image(picture(seen)), BOUNDS), trace_silhouette(blots)
    u, v = outline.points_px.T.astype(int)
    near = cv2.dilate(edges.found, np.ones((5, 5), np.uint8))[v, u] > 0
    gradients = edges.gradients[:, v, u].T.astype(np.float32)
    across = np.abs(np.sum(gradients * outline.normals, axis=-1))
    share = np.mean(near & (across > 0.7 * np.linalg.norm(gradients, axis=-1)))
    assert 0.6 < share < 0.85
    assert np.mean(blots) < 0.5  # else it would count against the silhouette
    assert contour_trust(outline, blots, edges) == pytest.approx((share - 0.5) / 0.4)


def test_holes_have_a_contour_too_and_specks_do_not():
    ring = disc(40) & ~disc(20)
    inner = np.linalg.norm(trace_silhouette(ring).points_px - (80, 60), axis=1) < 25
    assert inner.sum() > 80
    towards_middle = -(trace_silhouette(ring).points_px[inner] - (80, 60))
    assert np.all(np.sum(trace_silhouette(ring).normals[inner] * towards_middle, axis=1) > 0)
    specks = disc(40)
    specks[60:62, 80:83] = False
    specks[5, 5:9] = True
    np.testing.assert_array_equal(trace_silhouette(specks).points_px, trace_silhouette(disc(40)).points_px)


def test_no_contour_where_the_silhouette_leaves_the_image():
    points = trace_silhouette(disc(30, (5, 60))).points_px
    assert len(points) > 50
    assert points.min() > 0
    assert trace_silhouette(np.ones((40, 50), dtype=bool)).points_px.shape == (0, 2)
    assert trace_silhouette(np.zeros((40, 50), dtype=bool)).normals.shape == (0, 2)


def test_a_silhouette_that_the_image_shows_is_trusted():
    assert trusted(disc(), picture(disc())) == 1
    assert trusted(disc(31), picture(disc(30))) > 0.9  # smoothing makes silhouettes a little wider


def test_a_silhouette_that_ends_where_the_image_shows_nothing_is_not():
    ghost = disc(30) | disc(28, (115, 50))
    assert trusted(ghost, picture(disc())) < 0.3
    assert trusted(disc(20), picture(disc(30))) == 0
    half = disc(30)
    half[:, 80:] = False
    assert 0.05 < trusted(half, picture(disc())) < trusted(disc(), picture(disc())) - 0.2


def test_a_silhouette_that_is_everywhere_is_not():
    nearly_all = ~disc(30)
    assert trusted(nearly_all, picture(disc())) < 0.1
    assert trusted(np.zeros((120, 160), dtype=bool), picture(disc())) == 0


@pytest.mark.parametrize("turn", [0, 90])
def test_edges_across_the_contour_do_not_speak_for_it(turn):
    stripes = np.zeros((120, 160, 3), np.uint8)
    stripes[(np.arange(120) // 4) % 2 == 1] = 150
    square = np.zeros((120, 160), dtype=bool)
    square[20:100, 75:85] = True  # long sides across the stripes
    if turn:
        stripes, square = np.rot90(stripes).copy(), np.rot90(square).copy()
    assert trusted(square, stripes) < 0.2
