"""Depth that placements by hand show, on rings of cameras."""

import numpy as np
import pytest
from staging import cameras_around

from tracker.estimation.posing.placed_depth import undetermined_depth

AT = np.array([0.1, -0.05, 0.3])


@pytest.mark.parametrize(
    ("n", "views", "across"),
    [
        (4, [0], {1, 3}),
        (4, [0, 2], {1, 3}),  # opposite
        (12, [0, 1], {3, 4, 9, 10}),  # neighbouring, 30 degrees apart
        (12, [0, 1, 6, 7], {3, 4, 9, 10}),
        (4, [0, 1], None),
        (8, [0, 1], {2, 3, 6, 7}),
        (8, [0, 2], None),
    ],
)
def test_opposite_and_neighbouring_views_miss_the_depth(n, views, across):
    depth_m = undetermined_depth({"wrist": AT}, {"wrist": views}, cameras_around(n), "wrist")
    assert (depth_m is None) == (across is None)
    if depth_m is not None:
        assert depth_m.points == ("wrist",)
        assert depth_m.camera in across


def test_others_are_named_after_the_point_asked_for():
    places, views = dict.fromkeys(("ankle", "knee", "wrist"), AT), {"ankle": [0, 2], "knee": [0, 1], "wrist": [2]}
    depth_m = undetermined_depth(places, views, cameras_around(4), "wrist")
    assert depth_m is not None
    assert depth_m.points == ("wrist", "ankle")
    assert undetermined_depth(places, views, cameras_around(4), "knee") is None


def test_a_view_that_does_not_see_the_point_is_not_named():
    cameras, far = cameras_around(4), np.array([0.0, 3.0, 0.3])
    seeing = [i for i, c in enumerate(cameras) if np.all((c.project(far) >= 0) & (c.project(far) < c.size))]
    depth_m = undetermined_depth({"wrist": far}, {"wrist": [0]}, cameras, "wrist")
    assert depth_m is None or depth_m.camera in seeing
    # Nothing looks across where all cameras stand on one line.
    assert undetermined_depth({"wrist": AT}, {"wrist": [0]}, [cameras[0], cameras[2]], "wrist") is None
