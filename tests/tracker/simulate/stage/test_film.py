import cv2
import numpy as np
import pytest

from tracker.formats.model_toml import load_model
from tracker.simulate.motion.postures import solve_posture
from tracker.simulate.motion.scenes import cast_of
from tracker.simulate.people.model_figure import ModelFigure
from tracker.simulate.stage.camera_rig import make_cameras
from tracker.simulate.stage.film import exposed, film, freeze
from tracker.simulate.stage.rasterizer import cast, pixel_means
from tracker.simulate.stage.room import see_room

SIZE = (320, 240)


@pytest.fixture(scope="module")
def backdrops():
    return [see_room(camera, 0) for camera in make_cameras(2, SIZE, 0)]


def standing(model, x=0.0, y=0.0):
    values = solve_posture(cast_of("elbow_rotation")[0], model, 1, 25.0)[0]
    values[:2] += (x, y)
    return values


@pytest.mark.slow
def test_the_person_stands_out_and_the_room_stays(backdrops, skin):
    moment = freeze([skin], [standing(skin.model)])
    for backdrop in backdrops:
        image, mask = film(backdrop, moment)
        assert image.shape == (SIZE[1], SIZE[0], 3)
        assert set(np.unique(mask)) == {0, 1}
        covered = cast(backdrop.sample_camera, moment.vertices_world, moment.faces).faces >= 0
        assert np.array_equal(mask == 1, pixel_means(covered.astype(np.float32)) >= 0.5)
        change = np.abs(image - backdrop.image).max(axis=-1)
        assert np.mean(change[mask == 1] > 0.02) > 0.9
        # Elsewhere nothing changes but for the shadow on the floor.
        around = cv2.dilate(mask, np.ones((5, 5), np.uint8)) == 1
        assert np.all(image[~around] <= backdrop.image[~around] + 1e-6)
        assert change[: np.nonzero(mask)[0].min() - 2].max() == 0.0


@pytest.mark.slow
def test_the_floor_darkens_beside_the_feet(backdrops, skin):
    image, mask = film(backdrops[0], freeze([skin], [standing(skin.model)]))
    ratio = image.mean(axis=-1) / backdrops[0].image.mean(axis=-1)
    assert np.sum((ratio < 0.85) & (mask == 0)) > 100


@pytest.mark.slow
def test_masks_tell_people_apart_and_the_nearer_hides_the_other(backdrops):
    figure = ModelFigure(load_model("gavrila22", 1.7))
    camera = backdrops[0].camera
    away = camera.center_world[:2] / np.linalg.norm(camera.center_world[:2])
    near, far = standing(figure.model, *(0.4 * away)), standing(figure.model, *(-0.4 * away))
    _, both = film(backdrops[0], freeze([figure, figure], [far, near]))
    _, alone = film(backdrops[0], freeze([figure], [near]))
    assert set(np.unique(both)) == {0, 1, 2}
    # Pixels that the two share may go to either.
    assert np.sum((both == 2) != (alone == 1)) < 0.03 * np.sum(alone)
    assert np.sum(both == 1) < 0.8 * np.sum(alone)


@pytest.mark.slow
def test_the_fitted_bodys_mask_is_that_of_its_inside_test(backdrops):
    model = load_model("gavrila22", 1.7)
    values = standing(model)
    _, mask = film(backdrops[0], freeze([ModelFigure(model)], [values]))
    camera = backdrops[0].camera
    v, u = np.indices(mask.shape).reshape(2, -1)[:, ::7]
    rays = camera.rays(np.stack([u, v], axis=1).astype(float))
    points = camera.center_world + np.linspace(2.0, 5.0, 300)[:, None, None] * rays
    inside = np.zeros(len(u), dtype=bool)
    Ts = model.kinematics(values).Ts_world_part
    for T, shape, center in zip(Ts, model.shapes, model.centers_part, strict=True):
        local = (points - T[:3, 3]) @ T[:3, :3] - center
        inside |= (shape.inside_outside(local) <= 1).any(axis=0)
    assert np.mean(inside != (mask[v, u] == 1)) < 0.002


def test_noise_grows_with_brightness_and_follows_its_seed():
    image = np.repeat(np.linspace(0.1, 0.9, 2, dtype=np.float32), 20000).reshape(2, -1, 1) * np.ones(3, np.float32)
    noisy = exposed(image, np.random.default_rng(1))
    assert np.array_equal(noisy, exposed(image, np.random.default_rng(1)))
    assert not np.array_equal(noisy, exposed(image, np.random.default_rng(2)))
    dark, bright = noisy.std(axis=(1, 2))
    assert 1.5 < dark < bright < 6
