"""The silhouette of one of several figures, and figures where nobody is."""

import numpy as np
import pytest
from solids import ellipsoid, silhouettes_of
from staging import camera_at

from tracker.evidence.voxels.figure_masks import figure_masks
from tracker.evidence.voxels.visual_hull import carve_people

HALF = np.array([0.15, 0.15, 0.45])
SIZE_M = 0.03


def cameras(n, step=0.5 * np.pi):
    places = [(4 * np.cos(i * step), 4 * np.sin(i * step), 0.0) for i in range(n)]
    return [camera_at(f"c{i}", place, size=(320, 240), focal=260.0) for i, place in enumerate(places)]


def test_lines_of_sight_that_meet_are_nobody():
    """Two cameras at a right angle see two people; the hull holds two more where their lines of sight meet."""
    people = [ellipsoid((-0.5, -0.5, 0.0), HALF), ellipsoid((0.5, 0.5, 0.0), HALF)]
    views = silhouettes_of(people, cameras(3, step=np.pi / 3))
    hull = carve_people(views, SIZE_M)
    middles = sorted(f.points_world.mean(axis=0)[0] for f in hull.figures)
    np.testing.assert_allclose(middles, [-0.5, 0.5], atol=0.1)


@pytest.mark.slow
def test_a_figure_has_its_own_silhouette():
    people = [ellipsoid((0.0, -0.5, 0.0), HALF), ellipsoid((0.0, 0.5, 0.0), HALF)]
    views = silhouettes_of(people, cameras(4, step=0.7))
    alone = silhouettes_of(people[:1], cameras(4, step=0.7))
    hull = carve_people(views, SIZE_M)
    left, right = sorted(hull.figures, key=lambda f: f.points_world[:, 1].mean())
    found = figure_masks(views, left, [right])
    for own, truth in zip(found, alone, strict=True):
        if own.is_apart:
            assert np.count_nonzero(own.mask ^ truth.mask) < 0.12 * np.count_nonzero(truth.mask)
    assert found[0].is_apart


@pytest.mark.slow
def test_a_view_in_which_another_person_covers_the_figure_is_marked():
    people = [ellipsoid((0.0, 0.0, 0.0), HALF), ellipsoid((1.0, 0.0, 0.0), HALF)]
    views = silhouettes_of(people, cameras(4))
    hull = carve_people(views, SIZE_M)
    own, other = sorted(hull.figures, key=lambda f: f.points_world[:, 0].mean())
    assert [m.is_apart for m in figure_masks(views, own, [other])] == [False, True, False, True]
    assert all(m.is_apart for m in figure_masks(views, own))


def test_a_mask_never_exceeds_the_silhouette():
    views = silhouettes_of([ellipsoid((0.0, 0.0, 0.0), HALF)], cameras(4))
    hull = carve_people(views, SIZE_M)
    for own, view in zip(figure_masks(views, hull.figures[0]), views, strict=True):
        assert not (own.mask & ~view.mask).any()
