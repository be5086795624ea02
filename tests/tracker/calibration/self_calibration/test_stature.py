"""Scale and world from the joints of a person."""

import numpy as np
import pytest
import rigs
from filmed_people import NAMES, STATURE_M, dancing
from observed_people import BODY_25

from tracker.calibration.self_calibration.stature import metres_by_person, metres_per_unit, scale_sigma, upright
from tracker.errors import CalibrationError
from tracker.geometry import rigid

POINTS = tuple(BODY_25.counterparts(NAMES)[n][0] for n in NAMES)
CAMERAS = rigs.cameras(rigs.ring(3))


def test_the_unit_follows_from_the_stature():
    joints = dancing(6)
    joints[0, 3] = np.nan
    assert metres_per_unit(joints / 7, POINTS, [STATURE_M]) == pytest.approx(7.0, rel=0.01)
    with pytest.raises(CalibrationError, match="expected the shoulders, hips, knees and ankles"):
        metres_per_unit(joints[:, :4], POINTS[:4], [STATURE_M])


def test_the_unit_is_the_mean_of_those_of_all_people_who_count():
    both = np.concatenate([dancing(6) / 7, dancing(6, seed=1) / 5], axis=1)
    own = metres_by_person(both, POINTS, [STATURE_M, STATURE_M])
    np.testing.assert_allclose(own, [7, 5], rtol=0.03)
    assert metres_per_unit(both, POINTS, [STATURE_M, STATURE_M]) == pytest.approx(np.sqrt(own[0] * own[1]))
    assert metres_per_unit(both, POINTS, [np.nan, STATURE_M]) == pytest.approx(own[1])
    both[:, len(POINTS) :] = np.nan
    assert metres_per_unit(both, POINTS, [STATURE_M, STATURE_M]) == pytest.approx(own[0])


def test_a_scale_without_height_is_as_uncertain_as_statures_are():
    assert 0.025 < scale_sigma(1.7) < 0.035  # lengths differ by 5%, and there are three
    assert scale_sigma(None) == pytest.approx(np.hypot(scale_sigma(1.7), 0.062))
    assert scale_sigma(None, 4) == pytest.approx(scale_sigma(None) / 2)


@pytest.mark.parametrize(("without", "floor_by"), [((), "heels and toes"), (("heel", "toe"), "ankles")])
def test_the_world_stands_on_the_floor_below_the_person(without, floor_by):
    joints, names = dancing(40), ["" if n.endswith(without or ("none",)) else n for n in POINTS]
    T = rigid.transform(rigid.so3_exp(np.array([1.0, -0.5, 2.0])), np.array([3.0, 1.0, -2.0]))
    moved = [c.__class__(c.name, c.size, c.K, c.distortion, T @ c.T_world_camera) for c in CAMERAS]
    world = upright(moved, rigid.apply(T, joints), names, STATURE_M)
    assert world.floor_by == floor_by
    np.testing.assert_allclose([c.center_world[2] for c in world.cameras], 1.5, atol=0.3)
    assert abs(np.median(world.joints_world[..., 2]) - np.median(joints[..., 2])) < 0.1
    forward = world.cameras[0].T_world_camera[:3, 2]
    assert forward[1] > 0.8
    assert abs(forward[0]) < 1e-9
    # Nothing but the world has changed.
    for before, after in zip(moved, world.cameras, strict=True):
        px = before.project(rigid.apply(T, joints[0]))
        np.testing.assert_allclose(after.project(world.joints_world[0]), px, atol=1e-6)


def test_a_person_without_ankles_is_refused():
    joints = dancing(3)
    names = ["" if "ankle" in n else n for n in POINTS]
    with pytest.raises(CalibrationError, match="expected ankles and shoulders in one frame, found none"):
        upright(CAMERAS, joints, names, STATURE_M)
