"""Silhouettes of fisheye lenses far from the axis, where a person is half as large as in the middle."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from fisheye import with_fisheye
from plain_voxels import carve_plainly, project_plainly
from solids import ellipsoid, silhouettes_of
from staging import camera_at

from tracker.body.model import PosedBody
from tracker.estimation.initialization.generators.body_axis import major_axis
from tracker.evidence.contours.body_silhouette import body_silhouette
from tracker.evidence.voxels.bounding_volume import bounding_volume
from tracker.evidence.voxels.carving import Carver, CarveSettings
from tracker.evidence.voxels.figure_masks import _px_per_m, paint
from tracker.evidence.voxels.shadows import is_changed_at, recover_standing
from tracker.evidence.voxels.voxel_grid import VoxelGrid
from tracker.geometry.ground_plane import GroundPlane

AXES = np.array([0.16, 0.22, 0.4])
BOX = np.array([0.5, 0.5, 0.6])
SIZE_M = 0.03


def cameras(field_deg=150.0):
    """Four cameras about the origin, each turned aside by 30 to 60 degrees."""
    found = []
    for turn, aside in ((0.0, 2.4), (1.3, -3.0), (2.6, 3.8), (4.4, -1.8)):
        place = 2.5 * np.array([np.cos(turn), np.sin(turn), 0.2])
        target = aside * np.array([-np.sin(turn), np.cos(turn), 0.1])
        found.append(with_fisheye(camera_at(f"c{turn}", place, target, size=(400, 300)), field_deg))
    return found


@cache
def views():
    return silhouettes_of([ellipsoid((0, 0, 0), AXES)], cameras())


def off_axis_deg(camera):
    return np.degrees(np.arccos(camera.depths(np.zeros(3)) / np.linalg.norm(camera.center_world)))


@pytest.mark.slow
def test_the_solid_is_far_from_the_axes():
    assert [30 < off_axis_deg(c) < 65 for c in cameras()] == [True] * 4
    assert all(v.mask.any() for v in views())


@pytest.mark.slow
def test_voxels_are_where_the_silhouettes_are():
    grid, seen = VoxelGrid.over(-BOX, BOX, SIZE_M), views()
    carver = Carver(seen)
    voxels = carver.carve(grid)
    assert np.array_equal(voxels.occupied, carve_plainly(carver, grid, CarveSettings()))
    points = grid.centers(np.argwhere(np.ones_like(voxels.occupied)))
    expected, margin = project_plainly(seen, points)
    assert expected.sum() > 500
    assert np.array_equal(voxels.occupied.ravel()[~margin], expected[~margin])


def test_the_bounding_volume_holds_the_solid_closely():
    box = bounding_volume(views())
    np.testing.assert_array_less(box.low, -AXES)
    np.testing.assert_array_less(AXES, box.high)
    assert np.all(box.high - box.low < 4 * AXES)


@pytest.mark.slow
def test_a_view_that_sees_somebody_beside_itself_bounds_nobody():
    """Beyond 90 degrees slopes have no meaning; the others bound the person."""
    beside = with_fisheye(camera_at("beside", (0.5, 2.0, 0.0), (8.0, 2.5, 0.0), size=(450, 450)), 220.0)
    (seen,) = silhouettes_of([ellipsoid((0, 0, 0), AXES)], [beside])
    assert seen.mask.any()
    assert off_axis_deg(beside) > 90
    box = bounding_volume([*views(), seen])
    np.testing.assert_array_less(box.low, -AXES)
    np.testing.assert_array_less(AXES, box.high)
    assert Carver([*views(), seen]).carve(VoxelGrid.over(-BOX, BOX, SIZE_M)).occupied.any()


@pytest.mark.slow
def test_painted_voxels_are_as_large_as_the_lens_shows_them():
    voxels = Carver(views()).carve(VoxelGrid.over(-BOX, BOX, SIZE_M))
    points = voxels.points_world[voxels.is_surface]
    for view in views():
        camera = view.camera
        step = 0.005 * camera.T_world_camera[:3, 1]
        true = np.linalg.norm(camera.project(points + step) - camera.project(points - step), axis=1) / 0.01
        assert _px_per_m(camera, points, camera.depths(points)) == pytest.approx(np.median(true), rel=0.05)
        painted = paint(points, SIZE_M, view)
        assert np.count_nonzero(view.mask & ~painted) < 0.02 * np.count_nonzero(view.mask)
        assert np.count_nonzero(painted & ~view.mask) < 0.7 * np.count_nonzero(view.mask)


def test_a_change_is_found_where_the_lens_shows_it():
    seen = views()[2]
    assert is_changed_at(seen, np.zeros((1, 3))).all()
    assert not is_changed_at(seen, np.array([[0.0, 0.0, 0.7]])).any()


def test_the_floor_behind_a_shadow_is_found_through_the_lens():
    """The lower half of a person in one view was taken for a shadow; the other views see the floor unchanged."""
    whole = views()
    low = np.arange(300)[:, None] > np.median(np.nonzero(whole[0].mask)[0])
    hidden = whole[0]._replace(mask=whole[0].mask & ~low, shadow=whole[0].mask & low)
    others = [v._replace(shadow=np.zeros_like(v.mask)) for v in whole[1:]]
    found = recover_standing([hidden, *others], GroundPlane(np.array([0.0, 0.0, 1.0]), -0.45))[0]
    assert np.count_nonzero(found.mask & whole[0].mask) > 0.9 * np.count_nonzero(whole[0].mask)


def test_a_body_is_painted_where_the_footage_shows_it(gavrila):
    body = PosedBody(gavrila, gavrila.neutral())
    points = body.points_world
    for camera in cameras():
        mask = body_silhouette([body], camera)
        assert mask.shape == (300, 400)
        columns, rows = np.round(camera.project(points)).astype(int).T
        assert mask[rows, columns].mean() > 0.9
        straight = replace(camera, distortion=np.zeros(0), fisheye=False)
        assert not body_silhouette([body], straight)[rows, columns].all()


def test_the_axis_of_a_silhouette_runs_through_the_person(gavrila):
    body = PosedBody(gavrila, gavrila.neutral())
    for camera in cameras():
        axis = major_axis(body_silhouette([body], camera), camera)
        upright = np.diff(camera.pinhole.project(np.array([[0.0, 0.0, -0.5], [0.0, 0.0, 0.5]])), axis=0)[0]
        line = axis.lines_px[-1][1] - axis.lines_px[-1][0]
        assert abs(line @ upright) > 0.95 * np.linalg.norm(line) * np.linalg.norm(upright)


def test_pixels_beyond_the_undistorted_picture_do_not_turn_an_axis(gavrila):
    camera = cameras(170.0)[1]
    mask = body_silhouette([PosedBody(gavrila, gavrila.neutral())], camera)
    noisy = mask.copy()
    noisy[140:150, :3] = True
    axis, alone = major_axis(noisy, camera), major_axis(mask, camera)
    np.testing.assert_allclose(axis.lines_px[-1], alone.lines_px[-1], atol=5)
