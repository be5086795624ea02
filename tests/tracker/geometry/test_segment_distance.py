import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tracker.geometry.segment_distance import (
    LANES,
    STRIP_PX,
    Segments,
    nearest_segment,
    sort_points,
    stack_rows,
    within_reach,
)

WIDTH, HEIGHT = 3 * STRIP_PX - 50, 200


def distances(points, segments):
    """Distance of each point to the nearest segment the obvious way, (n,)."""
    starts, steps = segments[:, None, :2], segments[:, None, 2:]
    t = np.clip(np.sum((points - starts) * steps, -1) / np.maximum(np.sum(steps**2, -1), 1e-12), 0, 1)
    return np.linalg.norm(points - starts - t[..., None] * steps, axis=-1).min(axis=0)


def run(points, segments, reach):
    order = sort_points(points.astype(np.float32), (WIDTH, HEIGHT))
    out = np.empty(order.points.shape[1], np.float32)
    nearest_segment(
        *order.points, order.rows, Segments(*segments.T.astype(np.float32).copy()), len(segments), reach, out
    )
    return order, out


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 70), st.integers(0, 12), st.sampled_from([1.0, 8.0, 500.0]))
def test_as_by_brute_force_within_reach(seed, n_points, n_segments, reach):
    rng = np.random.default_rng(seed)
    size = np.array([WIDTH, HEIGHT])
    points = rng.uniform(-20, size + 20, (n_points, 2))  # some beside the image
    segments = np.column_stack([rng.uniform(-60, size + 60, (n_segments, 2)), rng.normal(0, 30, (n_segments, 2))])
    segments[: n_segments // 3, 2:] = 0  # points are segments too
    found, out = run(points, segments, reach)
    sorted_points = found.points[:, : found.n_points].T
    assert sorted(map(tuple, sorted_points)) == sorted(map(tuple, points.astype(np.float32)))
    expected = distances(sorted_points, segments) if n_segments else np.full(n_points, np.inf)
    near = expected <= reach
    np.testing.assert_allclose(out[: found.n_points][near], expected[near], atol=2e-3)
    assert np.all(out[: found.n_points][~near] >= reach - 2e-3)


def test_filled_up_by_points_that_are_nowhere():
    points = np.array([[10.0, 10.0], [STRIP_PX, 9.0], [10.0, 9.5]])
    found, out = run(points, np.array([[10.0, 12.0, 5.0, 0.0]]), 20.0)
    assert found.points.shape == (2, 2 * LANES)  # whole vectors may begin at any point
    assert out[:2] == pytest.approx([2.5, 2.0])
    assert out[3:].min() > 1e5
    assert found.rows[:, [9, 10, 11, HEIGHT]].tolist() == [[0, 1, 2, 2], [2, 3, 3, 3], [3, 3, 3, 3]]


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.integers(0, 70), st.integers(0, 12), st.sampled_from([1.0, 20.0, 500.0]))
def test_segments_near_visible_pieces_stay_sorted(seed, n_points, n_pieces, reach):
    rng = np.random.default_rng(seed)
    size = np.array([WIDTH, HEIGHT])
    points = rng.uniform(0, size, (n_points, 2)).astype(np.float32)
    starts, steps = rng.uniform(0, size, (n_pieces, 2)), rng.normal(0, 30, (n_pieces, 2))
    pieces, hidden = np.column_stack([starts, starts + steps]).astype(np.float32), rng.random(n_pieces) < 0.4
    everything = sort_points(points, (WIDTH, HEIGHT))
    before = everything.points.copy()
    kept = within_reach(everything, pieces, hidden, reach)
    visible = np.column_stack([starts, steps])[~hidden]
    off = distances(points, visible) if len(visible) else np.full(n_points, np.inf)
    if np.any(np.abs(off - reach) < 1e-2):
        return  # either is right
    expected = sort_points(points[off <= reach], (WIDTH, HEIGHT))
    np.testing.assert_array_equal(kept.points, expected.points)
    np.testing.assert_array_equal(kept.rows, expected.rows)
    np.testing.assert_array_equal(everything.points, before)


def test_images_of_several_sizes_in_one_array():
    """Their own points are found as alone, whatever is filled up."""
    rng = np.random.default_rng(2)
    sizes = [(3 * STRIP_PX, 90), (STRIP_PX, 150), (2 * STRIP_PX - 9, 70)]
    found = [sort_points(rng.uniform(0, s, (40, 2)).astype(np.float32), s) for s in sizes]
    rows = stack_rows([f.rows for f in found])
    assert rows.shape == (3, 3, 151)
    segments = np.column_stack([rng.uniform(-20, (400, 160), (60, 2)), rng.normal(0, 20, (60, 2))]).T.astype(np.float32)
    for one, filled in zip(found, rows, strict=True):
        alone, together = np.empty((2, one.points.shape[1]), np.float32)
        nearest_segment(*one.points, one.rows, Segments(*segments), 60, 15.0, alone)
        nearest_segment(*one.points, filled, Segments(*segments), 60, 15.0, together)
        near = alone < 15
        assert near.sum() > 10
        np.testing.assert_array_equal(together[near], alone[near])
        assert np.all(together[~near] >= 15)
