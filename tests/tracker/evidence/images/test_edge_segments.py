import cv2
import numpy as np
import pytest

from tracker.evidence.images.background_subtraction import smooth_image
from tracker.evidence.images.edge_segments import MAX_LENGTH, EdgeSegments, accept_segments, link_edges, sample_segments
from tracker.evidence.images.edges import Levels, detect_edges


def linked(image):
    edges = detect_edges(smooth_image(image), Levels(60.0, 30.0))
    return edges, link_edges(edges.found, edges.gradients)


def box_picture(size=(160, 120), left=40, right=110, top=30, bottom=90):
    image = np.full((size[1], size[0], 3), 60, np.uint8)
    image[top:bottom, left:right] = 180
    return image


def disc_picture(radius=40.0):
    v, u = np.mgrid[:120, :160]
    return np.where(np.hypot(u - 80, v - 60)[..., None] < radius, 180, 60).astype(np.uint8).repeat(3, axis=-1)


def of_points(points, normals, firsts):
    return EdgeSegments(np.array(points, np.float32), np.array(normals, np.float32), np.array(firsts, np.int64))


def test_every_edge_pixel_is_in_one_segment():
    image = np.random.default_rng(0).integers(0, 255, (30, 40, 3)).astype(np.uint8)
    image = cv2.resize(image, (160, 120), interpolation=cv2.INTER_CUBIC)
    edges, segments = linked(image)
    u, v = segments.points_px.astype(int).T
    there = set(zip(v.tolist(), u.tolist(), strict=True))
    assert len(there) == len(u) == np.count_nonzero(edges.found) > 1000
    assert all(edges.found[p] for p in there)
    assert segments.firsts[0] == 0
    assert segments.firsts[-1] == len(u)
    lengths = np.diff(segments.firsts)
    assert lengths.min() > 0
    assert lengths.max() <= MAX_LENGTH
    assert lengths.mean() > 2.5


def test_pixels_of_a_segment_follow_each_other():
    _, segments = linked(disc_picture())
    steps = np.abs(np.diff(segments.points_px, axis=0)).max(axis=-1)
    within = np.ones(len(steps), dtype=bool)
    within[segments.firsts[1:-1] - 1] = False
    assert (steps[within] == 1).all()


def test_a_box_is_cut_at_its_corners():
    _, segments = linked(box_picture())
    corners = np.array([[40, 30], [109, 30], [40, 89], [109, 89]])
    for first, last in zip(segments.firsts[:-1], segments.firsts[1:], strict=True):
        if last - first < 8:
            continue
        points = segments.points_px[first:last]
        # Smoothing rounds the corners by some 3 px; beyond that a segment lies along one side.
        inner = points[np.linalg.norm(points[:, None] - corners, axis=-1).min(axis=1) > 4]
        if len(inner):
            assert np.ptp(inner, axis=0).min() <= 1


def test_a_circle_is_cut_only_where_segments_become_too_long():
    _, segments = linked(disc_picture())
    lengths = np.diff(segments.firsts)
    around = lengths.sum()
    assert around > 200
    assert np.sum(lengths == MAX_LENGTH) >= 7
    # Smoothness of the direction: few are short.
    assert lengths[lengths < 8].sum() < 0.2 * around


@pytest.mark.parametrize("flip", [2, 13])
def test_a_segment_ends_where_the_other_side_becomes_the_darker_one(flip):
    rows = np.arange(32)
    points = np.stack([np.full(32, 20), rows], axis=1)
    normals = np.where(rows[:, None] < flip, (1.0, 0.0), (-1.0, 0.0))
    gradients = np.zeros((2, 60, 60), np.int16)
    found = np.zeros((60, 60), np.uint8)
    for (u, v), normal in zip(points, normals, strict=True):
        found[v, u], gradients[:, v, u] = 255, 100 * normal
    assert link_edges(found, gradients).firsts.tolist() == [0, flip, 32]


def test_normals_point_from_dark_to_light():
    _, segments = linked(disc_picture())
    from_middle = segments.points_px - np.array([80, 60], np.float32)
    inward = np.sum(segments.normals * from_middle, axis=1) / np.linalg.norm(from_middle, axis=1)
    assert inward.max() < -0.95
    np.testing.assert_allclose(np.linalg.norm(segments.normals, axis=1), 1, rtol=1e-5)


def test_no_edges_no_segments():
    empty = link_edges(np.zeros((20, 30), np.uint8), np.zeros((2, 20, 30), np.int16))
    assert empty.points_px.shape == (0, 2)
    assert empty.firsts.tolist() == [0]
    assert accept_segments(sample_segments(empty), np.zeros((3, 4), np.float32), 5.0).shape == (0,)


def line(u, v, along, n=20):
    """Pixels of a straight edge from (u, v) and its normals."""
    along = np.array(along)
    return np.array([u, v]) + np.arange(n)[:, None] * along, np.tile((-along[1], along[0]), (n, 1))


PIECES = np.array([[u, 50, u + 4, 50] for u in range(10, 30, 4)], np.float32)


def test_segments_are_taken_or_left_as_a_whole():
    near, near_normals = line(10, 53, (1, 0))
    slanting, slanting_normals = line(10, 48, (np.cos(0.6), np.sin(0.6)))
    far, far_normals = line(10, 61, (1, 0))
    segments = of_points(
        np.concatenate([near, slanting, far]),
        np.concatenate([near_normals, slanting_normals, far_normals]),
        [0, 20, 40, 60],
    )
    assert accept_segments(sample_segments(segments), PIECES, 5.0).tolist() == [True, True, False]
    assert accept_segments(sample_segments(segments), PIECES, 3.5).tolist() == [True, False, False]
    assert accept_segments(sample_segments(segments), PIECES, 11.5).tolist() == [True, True, True]


def test_segments_without_a_limit_are_as_long_as_the_edge_turns_evenly():
    edges, cut = linked(disc_picture())
    whole = link_edges(edges.found, edges.gradients, None)
    assert np.diff(whole.firsts).max() > 100
    assert len(whole.firsts) < len(cut.firsts)
    np.testing.assert_array_equal(whole.points_px, cut.points_px)


def test_the_distance_is_the_mean_over_the_segment():
    points, normals = line(10, 54, (1, 0), n=10)
    further, _ = line(20, 57, (1, 0), n=10)
    segments = of_points(np.concatenate([points, further]), np.tile(normals, (2, 1)), [0, 20])
    assert accept_segments(sample_segments(segments), PIECES, 5.6).all()
    assert not accept_segments(sample_segments(segments), PIECES, 5.4).any()


def test_an_edge_across_the_contour_does_not_belong_to_it():
    points, normals = line(20, 45, (0, 1), n=10)
    assert not accept_segments(sample_segments(of_points(points, normals, [0, 10])), PIECES, 5.0).any()
    assert accept_segments(sample_segments(of_points(points, normals, [0, 10])), PIECES, 5.0, np.pi / 2).all()
    turned = of_points(points, np.tile((0.0, 1.0), (10, 1)), [0, 10])
    assert accept_segments(sample_segments(turned), PIECES, 5.0).all()
    # Which side is darker does not matter.
    assert accept_segments(sample_segments(turned._replace(normals=-turned.normals)), PIECES, 5.0).all()


@pytest.mark.parametrize("threshold", [3.0, 8.0, 20.0])
def test_distances_are_those_of_brute_force(threshold):
    rng = np.random.default_rng(3)
    starts = rng.uniform(-30, 190, (150, 2))
    pieces = np.concatenate([starts, starts + rng.normal(0, 2, (150, 2))], axis=1).astype(np.float32)
    points = rng.uniform(0, 160, (400, 2)).astype(np.float32)
    turns = rng.uniform(0, 2 * np.pi, 400)
    normals = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    segments = of_points(points, normals, np.arange(401))
    step = pieces[:, 2:] - pieces[:, :2]
    t = np.sum((points[:, None] - pieces[:, :2]) * step, axis=-1) / np.sum(step**2, axis=-1)
    off = points[:, None] - pieces[:, :2] - np.clip(t, 0, 1)[..., None] * step
    along = np.abs(normals @ (step / np.linalg.norm(step, axis=1, keepdims=True)).T)
    distances = np.where(along <= np.sin(np.radians(45)), np.linalg.norm(off, axis=-1), np.inf).min(axis=1)
    clear = np.abs(distances - threshold) > 1e-3
    np.testing.assert_array_equal(
        accept_segments(sample_segments(segments), pieces, threshold)[clear], (distances <= threshold)[clear]
    )
    assert 10 < np.sum(distances <= threshold) < 390


def test_nothing_predicted_accepts_nothing():
    points, normals = line(10, 50, (1, 0))
    assert not accept_segments(
        sample_segments(of_points(points, normals, [0, 20])), np.zeros((0, 4), np.float32), 5.0
    ).any()
