"""The axis of a body in space, and its head along it."""

from dataclasses import replace

import numpy as np
import pytest
from figures import UP, cameras_about_a_figure, figure, silhouettes_of_figure

from tracker.errors import TrackerError
from tracker.estimation.initialization.generators.body_axis import find_body_axes, major_axis
from tracker.estimation.initialization.generators.standing_body import ROUNDED, typical_person
from tracker.geometry import rigid

BODY = typical_person(preset=ROUNDED)
CAMERAS = cameras_about_a_figure()
TOP_M = 1.62 + 0.125


def axes_of(voxels, cameras=CAMERAS):
    return [major_axis(s.mask, s.camera) for s in silhouettes_of_figure(voxels, cameras)]


@pytest.mark.slow
@pytest.mark.parametrize("arms_deg", [5, 35, 70])
def test_the_axis_is_upright_and_ends_at_the_head(arms_deg):
    axes = find_body_axes(axes_of(figure(arms_deg=arms_deg, turn_deg=20)[0]), UP, BODY)
    assert axes[0].up @ UP > np.cos(np.radians(4))
    assert axes[0].top[2] == pytest.approx(TOP_M, abs=0.05)
    np.testing.assert_allclose(axes[0].top[:2], 0, atol=0.05)
    assert axes[0].left_out == ()


def test_a_person_upside_down_has_the_head_below():
    voxels = figure(arms_deg=35)[0]
    down = rigid.transform(rigid.so3_exp(np.array([np.pi, 0.0, 0.0])), np.array([0.0, 0.0, 1.8]))
    cameras = [replace(c, T_world_camera=down @ c.T_world_camera) for c in CAMERAS]
    axes = find_body_axes([major_axis(s.mask, s.camera) for s in moved(voxels, cameras)], UP, BODY)
    assert axes[0].up @ UP < -0.99
    assert axes[0].top[2] == pytest.approx(1.8 - TOP_M, abs=0.05)


def moved(voxels, cameras):
    """The silhouettes of a figure with cameras that have moved with it."""
    pairs = zip(silhouettes_of_figure(voxels, CAMERAS), cameras, strict=True)
    return [s._replace(camera=c) for s, c in pairs]


@pytest.mark.slow
def test_a_view_that_contradicts_the_others_is_left_out():
    voxels = figure()[0]
    turned = CAMERAS[1].T_world_camera @ rigid.transform(rigid.so3_exp(np.array([0.0, 0.0, 0.7])))
    cameras = [CAMERAS[0], replace(CAMERAS[1], T_world_camera=turned), *CAMERAS[2:]]
    axes = find_body_axes([major_axis(s.mask, s.camera) for s in moved(voxels, cameras)], UP, BODY)
    assert axes[0].left_out == ("c1",)
    assert axes[0].up @ UP > 0.99


@pytest.mark.slow
def test_views_from_one_side_are_refused():
    one = axes_of(figure()[0])[0]
    with pytest.raises(TrackerError, match="at least 2 views from different sides"):
        find_body_axes([one, one], UP, BODY)
    with pytest.raises(TrackerError, match="at least 2 views from different sides"):
        find_body_axes([one], UP, BODY)


@pytest.mark.slow
def test_no_head_is_invented():
    """A pillar is as wide at its end as everywhere."""
    voxels = figure()[0]
    pillar = np.zeros_like(voxels.occupied)
    i, j = (n // 2 for n in pillar.shape[:2])
    pillar[i - 6 : i + 6, j - 6 : j + 6] = True
    with pytest.raises(TrackerError, match="expected a head along the silhouettes' axis"):
        find_body_axes(axes_of(type(voxels)(voxels.grid, pillar)), UP, BODY)
