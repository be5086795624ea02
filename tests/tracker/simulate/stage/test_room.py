import numpy as np
import pytest

from tracker.errors import TrackerError
from tracker.simulate.stage.camera_rig import make_cameras
from tracker.simulate.stage.furniture import HALF_WIDTH_M, ROOMS, furnished
from tracker.simulate.stage.room import SHADOW_CELL_M, floor_shadow, see_room

SIZE = (160, 120)


@pytest.fixture(scope="module")
def backdrop():
    return see_room(make_cameras(4, SIZE, 0)[0], 0)


def test_floor_cells_and_depths_are_those_of_the_rays(backdrop):
    camera = backdrop.sample_camera
    on_floor = backdrop.floor_cells[0] > -1e3
    assert 0.2 < on_floor.mean() < 0.8
    v, u = np.nonzero(on_floor)
    px = np.stack([u, v], axis=1).astype(float)
    rays = camera.rays(px)
    on_plane = camera.center_world - camera.center_world[2] / rays[:, 2:] * rays
    cells = backdrop.floor_cells[:, v, u].T
    assert np.allclose((cells + 0.5) * SHADOW_CELL_M - HALF_WIDTH_M, on_plane[:, :2], atol=1e-3)
    assert np.allclose(1.0 / backdrop.inverse_depths[v, u], camera.depths(on_plane), rtol=1e-4)


def test_every_ray_ends_within_the_room(backdrop):
    camera = backdrop.sample_camera
    v, u = np.indices(backdrop.inverse_depths.shape).reshape(2, -1)
    px = np.stack([u, v], axis=1).astype(float)
    points = camera.back_project(px, 1.0 / backdrop.inverse_depths[v, u].astype(float))
    assert np.abs(points[:, :2]).max() < HALF_WIDTH_M + 1e-3


@pytest.mark.slow
def test_the_same_seed_furnishes_the_same_room_and_another_another():
    camera = make_cameras(4, SIZE, 0)[1]
    first, again, other = (see_room(camera, seed).image for seed in (0, 0, 1))
    assert np.array_equal(first, again)
    assert np.mean(np.abs(first - other) > 0.05) > 0.05


@pytest.mark.slow
def test_rooms_of_each_kind_look_different():
    camera = make_cameras(4, SIZE, 0)[1]
    images = {kind: see_room(camera, 0, kind).image for kind in ROOMS}
    edges = {kind: np.abs(np.diff(image, axis=1)).mean() for kind, image in images.items()}
    assert edges["laboratory"] > 2 * edges["studio"]
    assert images["theater"].mean() < 0.5 * images["studio"].mean()


def test_a_room_of_another_kind_is_refused():
    with pytest.raises(TrackerError, match="expected one of the rooms laboratory, studio, theater, found 'cave'"):
        furnished(0, "cave")


def test_a_slab_shades_the_floor_away_from_the_lamp():
    slab = np.array([(x, y, 1.0) for x in (-0.3, 0.3) for y in (-0.3, 0.3)])
    shadow = floor_shadow(slab, np.array([[0, 1, 2], [1, 3, 2]]))
    y, x = np.indices(shadow.shape)
    center = np.array([(x * shadow).sum(), (y * shadow).sum()]) / shadow.sum()
    center = (center + 0.5) * SHADOW_CELL_M - HALF_WIDTH_M
    # The lamp hangs at (0.7, -0.5, 2.75): the middle of the slab falls on -lamp / 1.75.
    assert np.allclose(center, (-0.7 / 1.75, 0.5 / 1.75), atol=0.01)
    assert shadow.max() > 0.95
    # Light falls in at the edges, because the lamp has a size.
    assert np.mean((shadow > 0.1) & (shadow < 0.9)) > 0.2 * np.mean(shadow > 0.1)
