import numpy as np
import pytest
from staging import view_evidence

from tracker.evidence.images.edge_segments import EdgeSegments
from tracker.evidence.images.edges import StaticEdgeModel
from tracker.evidence.view_evidence import with_all_segments
from tracker.geometry.cameras import Camera

SIZE = (80, 60)
NOBODY = np.empty((0, 4), np.float32)


def line(u, low=10, high=40, direction=(1.0, 0.0)):
    """One upright edge, dark on its left."""
    points = np.column_stack([np.full(high - low, u), np.arange(low, high)]).astype(np.float32)
    normals = np.tile(np.array(direction, np.float32), (len(points), 1))
    return EdgeSegments(points, normals, np.array([0, len(points)]))


def several(*segments):
    counts = [len(s.points_px) for s in segments]
    points, normals = (np.concatenate([getattr(s, x) for s in segments]) for x in ("points_px", "normals"))
    return EdgeSegments(points, normals, np.cumsum([0, *counts]))


NOTHING = EdgeSegments(np.empty((0, 2), np.float32), np.empty((0, 2), np.float32), np.zeros(1, np.int64))


@pytest.fixture
def model():
    return StaticEdgeModel(SIZE)


def learn(model, segments, pieces=NOBODY, corner=(0, 0), size=SIZE):
    model.update(segments, corner, size, pieces, 6.0)


def knows(model, segments, corner=(0, 0)):
    return model.contains(segments, corner).tolist()


def test_nothing_is_known_at_first(model):
    assert knows(model, line(20)) == [False]
    assert knows(model, NOTHING) == []


def test_an_edge_away_from_everybody_is_known_at_first_sight(model):
    learn(model, line(20))
    assert knows(model, several(line(20), line(21), line(30))) == [True, True, False]


def test_an_edge_near_a_body_is_not_learnt(model):
    piece = np.array([[24.0, y, 24.0, y + 2.0] for y in range(8, 42, 2)], np.float32)
    learn(model, several(line(20), line(40)), piece)
    assert knows(model, several(line(20), line(40))) == [False, True]


def test_contours_beyond_the_region_are_near_to_what_they_reach(model):
    beyond = np.array([[u, y, u, y + 2.0] for u in (-30.0, -4.0) for y in range(-30, 90, 2)], np.float32)
    learn(model, several(line(1), line(40), line(70)), beyond)
    assert knows(model, several(line(1), line(40), line(70))) == [False, True, True]


@pytest.mark.parametrize("direction", [(-1.0, 0.0), (0.0, 1.0), (0.4, 0.9)])
def test_an_edge_that_runs_otherwise_is_another(model, direction):
    learn(model, line(20))
    assert knows(model, line(20, direction=direction)) == [False]


def test_a_segment_is_known_as_a_whole(model):
    learn(model, line(20, 10, 30))
    assert knows(model, several(line(20, 10, 42), line(20, 22, 54))) == [True, False]


def test_a_later_pixel_is_known_after_three_frames(model):
    for _ in range(10):
        learn(model, NOTHING)
    known = []
    for _ in range(3):
        learn(model, line(20))
        known += knows(model, line(20))
    assert known == [False, False, True]


def test_a_vanished_edge_is_forgotten_after_three_frames(model):
    for _ in range(10):
        learn(model, line(20))
    known = []
    for _ in range(3):
        learn(model, NOTHING)
        known += knows(model, line(20))
    assert known == [True, True, False]


def test_an_edge_that_moves_is_not_known(model):
    for u in range(10, 40, 3):
        learn(model, line(u))
        assert knows(model, line(u + 3)) == [False]


def test_regions_lie_where_their_corner_says(model):
    learn(model, line(5), corner=(15, 10), size=(20, 45))
    assert knows(model, several(line(20, 20, 50), line(5, 20, 50))) == [True, False]
    assert knows(model, line(12, 15, 45), corner=(8, 5)) == [True]


def test_edges_of_the_room_are_no_evidence(model):
    """Even where the prediction accepts them, and even for a search among all edges."""
    camera = Camera("cam", SIZE, np.array([[80.0, 0, 40], [0, 80.0, 30], [0, 0, 1]]), np.zeros(5), np.eye(4))
    edges, gradients = np.zeros((60, 80), np.uint8), np.zeros((2, 60, 80), np.int16)
    edges[10:40, [20, 50, 70]] = 1
    gradients[0] = 100
    learn(model, line(20))
    pieces = np.array([[u, y, u, y + 2] for u in (21, 49) for y in range(10, 40, 2)], np.float32)
    view = view_evidence(camera, edges, gradients, predicted_px=pieces, static_edges=model)
    assert set(view.points_px[:, 0]) == {50.0}
    assert view.distance[20, 20] == view.distance.max()
    everything = with_all_segments(view)
    assert set(everything.points_px[:, 0]) == {50.0, 70.0}
    assert everything.distance[20, 20] == everything.distance.max()
