import numpy as np
import pytest
from plain_voxels import carve_plainly, project_plainly
from solids import cameras_around, cylinder, ellipsoid, silhouettes_of

from tracker.errors import TrackerError
from tracker.evidence.voxels.bounding_volume import bounding_volume
from tracker.evidence.voxels.carving import Carver, CarveSettings
from tracker.evidence.voxels.part_size import CYLINDER, ELLIPSOID, principal_axes
from tracker.evidence.voxels.voxel_grid import VoxelGrid
from tracker.geometry import rigid

TURNED = rigid.so3_exp(np.array([0.4, -0.7, 0.2]))
AXES = np.array([0.06, 0.1, 0.16])
LENS = (-0.25, 0.08, 0.001, -0.002, 0.0)
BOX = np.array([0.25, 0.25, 0.25])


def carved(silhouettes, size_m, **settings):
    grid = VoxelGrid.over(-BOX, BOX, size_m)
    return Carver(silhouettes).carve(grid, CarveSettings(**settings))


@pytest.mark.slow
@pytest.mark.parametrize("lens", [(), LENS])
@pytest.mark.parametrize("size_m", [0.02, 0.01])
def test_sizes_of_solids_within_half_a_voxel(size_m, lens):
    cameras = cameras_around(30, lens)
    for solid, half_axes, expected in (
        (ellipsoid((0.01, 0, 0), np.full(3, 0.12)), ELLIPSOID, np.full(3, 0.12)),
        (ellipsoid((0, 0.02, 0), AXES, TURNED), ELLIPSOID, AXES),
        (cylinder((0, 0, -0.01), AXES, TURNED), CYLINDER, AXES),
    ):
        voxels = carved(silhouettes_of([solid], cameras), size_m)
        found = half_axes * principal_axes(voxels.points_world, size_m).sigmas
        np.testing.assert_allclose(found, expected, atol=size_m / 2)


@pytest.mark.slow
def test_axes_point_along_the_solid():
    voxels = carved(silhouettes_of([ellipsoid((0, 0, 0), AXES, TURNED)], cameras_around(30)), 0.01)
    found = principal_axes(voxels.points_world, 0.01)
    assert np.all(np.abs((found.axes * TURNED).sum(axis=0)) > 0.99)
    assert np.linalg.det(found.axes) == pytest.approx(1.0)
    np.testing.assert_allclose(found.center, 0, atol=0.005)


@pytest.mark.slow
@pytest.mark.parametrize(("lens", "settings"), [((), {}), (LENS, {}), (LENS, {"missing": 1}), ((), {"min_views": 4})])
def test_blocks_and_single_voxels_agree(lens, settings):
    # Some solids are cut off by images.
    solids = [ellipsoid((0.05, 0, 0), AXES, TURNED), cylinder((-0.2, 0.3, 0.1), AXES)]
    views = silhouettes_of(solids, cameras_around(5, lens, focal=1100.0))
    rule = CarveSettings(**settings)
    for size_m in (0.03, 0.007):
        grid = VoxelGrid.over(np.array([-0.4, -0.3, -0.3]), np.array([0.3, 0.5, 0.4]), size_m)
        carver = Carver(views)
        found, expected = carver.carve(grid, rule).occupied, carve_plainly(carver, grid, rule)
        assert expected.any()
        assert np.array_equal(found, expected)
    assert carver._carve_blocks(grid, rule)[1] < found.size / 4


@pytest.mark.slow
def test_voxels_are_where_the_silhouettes_are():
    """The oracle against plain projection."""
    views = silhouettes_of([ellipsoid((0.05, 0, 0), AXES, TURNED)], cameras_around(4, LENS))
    voxels = carved(views, 0.015)
    points = voxels.grid.centers(np.argwhere(np.ones_like(voxels.occupied)))
    expected, margin = project_plainly(views, points)
    assert np.array_equal(voxels.occupied.ravel()[~margin], expected[~margin])
    assert margin.mean() < 0.2


@pytest.mark.slow
def test_a_broken_view_is_outvoted():
    cameras = cameras_around(12)
    views = silhouettes_of([ellipsoid((0, 0, 0), AXES)], cameras)
    views[3] = views[3]._replace(mask=np.zeros_like(views[3].mask))
    assert not carved(views, 0.02).occupied.any()
    found = carved(views, 0.02, missing=1)
    whole = carved([v for i, v in enumerate(views) if i != 3], 0.02)
    assert whole.occupied.sum() <= found.occupied.sum() < 1.3 * whole.occupied.sum()


@pytest.mark.slow
def test_surface_voxels():
    voxels = carved(silhouettes_of([ellipsoid((0, 0, 0), np.full(3, 0.15))], cameras_around(20)), 0.02)
    radii = np.linalg.norm(voxels.points_world, axis=1)
    assert radii[voxels.is_surface].min() > 0.1
    assert radii[~voxels.is_surface].max() < 0.15
    assert 0 < voxels.is_surface.sum() < len(radii) / 1.3
    full = voxels.cropped()
    np.testing.assert_allclose(full.points_world, voxels.points_world, atol=1e-12)
    assert np.array_equal(full.is_surface, voxels.is_surface)


@pytest.mark.slow
def test_the_bounding_volume_holds_the_solid_closely():
    for lens in ((), LENS):
        views = silhouettes_of([ellipsoid((0.1, 0, 0.05), AXES)], cameras_around(20, lens))
        box = bounding_volume(views)
        np.testing.assert_array_less(box.low, np.array([0.1, 0, 0.05]) - AXES)
        np.testing.assert_array_less(np.array([0.1, 0, 0.05]) + AXES, box.high)
        assert np.all(box.high - box.low < 2 * AXES + 0.06)


@pytest.mark.slow
def test_a_person_cut_off_by_an_image_is_not_cut_off_in_space():
    views = silhouettes_of([ellipsoid((0, 0, 0), AXES)], cameras_around(10))
    cut = views[0]
    camera = cut.camera.cropped((0, 0, 160, 240))
    views[0] = cut._replace(mask=np.ascontiguousarray(cut.mask[:, :160]), camera=camera)
    box = bounding_volume(views)
    np.testing.assert_array_less(box.low, -AXES)
    np.testing.assert_array_less(AXES, box.high)
    found = carved(views, 0.02).occupied.sum()
    assert found >= carved(silhouettes_of([ellipsoid((0, 0, 0), AXES)], cameras_around(10)), 0.02).occupied.sum()


@pytest.mark.slow
def test_nobody_and_nothing_in_common():
    views = silhouettes_of([ellipsoid((0, 0, 0), AXES)], cameras_around(4))
    empty = [v._replace(mask=np.zeros_like(v.mask)) for v in views]
    with pytest.raises(TrackerError, match="at least 2 views, found nobody in c1, c2, c3") as error:
        bounding_volume(views[:1] + empty[1:])
    assert error.value.camera == "c1"
    aside = silhouettes_of([ellipsoid((0.3, 0.3, 0.3), np.full(3, 0.03))], cameras_around(4))
    with pytest.raises(TrackerError, match="none in common"):
        bounding_volume(views[:2] + aside[2:])


def test_voxel_sizes_that_cannot_be():
    with pytest.raises(TrackerError, match="positive voxel size"):
        VoxelGrid.over(-BOX, BOX, 0.0)
    with pytest.raises(TrackerError, match="use larger voxels"):
        VoxelGrid.over(-BOX, BOX, 1e-4)
