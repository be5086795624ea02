import numpy as np
import pytest
from figures import UP, cameras_about_a_figure, figure, hide_legs, legs, silhouettes_of_figure

from tracker.evidence.voxels.figure_masks import paint
from tracker.evidence.voxels.shadows import is_changed_at, recover_from_shadows, recover_standing
from tracker.geometry.arrays import intersection_over_union
from tracker.geometry.ground_plane import GroundPlane

SIZE_M = 0.025
FLOOR = GroundPlane(UP, 0.0)


@pytest.fixture(scope="module")
def whole():
    return silhouettes_of_figure(figure(SIZE_M)[0], cameras_about_a_figure(4))


def on_floor(silhouette, x_m, y_m):
    """A rectangle of the floor in a view, from and to x and y."""
    spans = [np.arange(*span, 0.02) for span in (x_m, y_m)]
    points = np.array([(x, y, 0.0) for x in spans[0] for y in spans[1]])
    return paint(points, SIZE_M, silhouette) & ~silhouette.mask


@pytest.mark.slow
def test_legs_before_a_floor_that_others_see_unchanged_come_back(whole):
    seen = hide_legs(whole, {0, 1}, [np.zeros_like(s.mask) for s in whole])
    for own, true in zip(recover_standing(seen, FLOOR), whole, strict=True):
        assert np.count_nonzero(legs(true) & ~own.mask) < 0.3 * np.count_nonzero(legs(true))
        assert intersection_over_union(own.mask, true.mask) > 0.9
        assert not np.any(own.shadow & own.mask)


@pytest.mark.slow
def test_legs_in_the_midst_of_a_shadow_come_back_where_other_views_show_them(whole):
    shadows = [on_floor(s, (-0.9, 0.9), (-0.9, 0.9)) for s in whole]
    seen = hide_legs(whole, {2}, shadows)
    lost = np.count_nonzero(legs(whole[2]))
    standing = recover_standing(seen, FLOOR)[2]
    assert np.count_nonzero(legs(whole[2]) & ~standing.mask) > 0.5 * lost
    found = recover_from_shadows(seen, FLOOR, SIZE_M)[2]
    assert np.count_nonzero(legs(whole[2]) & ~found.mask) < 0.3 * lost
    assert np.count_nonzero(found.mask & ~whole[2].mask) < 0.1 * np.count_nonzero(whole[2].mask)


@pytest.mark.slow
def test_a_shadow_on_the_floor_stays_one(whole):
    seen = [s._replace(shadow=on_floor(s, (0.3, 0.9), (-0.3, 0.3))) for s in whole]
    assert all(s.shadow.sum() > 0.1 * s.mask.sum() for s in seen)
    for own, true in zip(recover_from_shadows(seen, FLOOR, SIZE_M), whole, strict=True):
        assert np.count_nonzero(own.mask & ~true.mask) < 0.02 * np.count_nonzero(true.mask)


def test_a_change_in_one_view_stays_a_shadow(whole):
    """The sky has no floor behind it, and nothing contradicts what lies there."""
    above = np.zeros_like(whole[0].mask)
    above[2:20, 5:30] = True
    seen = [whole[0]._replace(shadow=above), *(s._replace(shadow=np.zeros_like(s.mask)) for s in whole[1:])]
    assert not np.any(recover_from_shadows(seen, FLOOR, SIZE_M)[0].mask & above)


def test_masks_of_the_user_stay_as_they_are(whole):
    assert all(a is b for a, b in zip(recover_from_shadows(whole, FLOOR, SIZE_M), whole, strict=True))


def test_an_empty_scene_stays_empty(whole):
    empty = [s._replace(mask=np.zeros_like(s.mask), shadow=np.zeros_like(s.mask)) for s in whole]
    assert all(s.is_empty for s in recover_from_shadows(empty, FLOOR, SIZE_M))


def test_changed_places(whole):
    view = whole[0]._replace(shadow=on_floor(whole[0], (0.3, 0.9), (-0.3, 0.3)))
    beside_image = view.camera.center_world - 2 * view.camera.T_world_camera[:3, 2]
    points = np.array([(0.0, 0.0, 1.2), (0.6, 0.0, 0.0), (0.0, 1.0, 1.2), beside_image])
    assert is_changed_at(view, points).tolist() == [True, True, False, True]
