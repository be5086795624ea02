"""Thumbnails: the view that shows a limb best, the square around its person, what is drawn."""

import cv2
import numpy as np
import pytest
from staging import cameras_around

from app.drawing import thumbnails
from tracker.body.limbs import limbs
from tracker.body.model import PosedBody

ORANGE = "#ff8000"


@pytest.fixture
def body(gavrila):
    values = gavrila.neutral()
    values[2] = 1.0
    return PosedBody(gavrila, values)


def limb_index(body, name):
    return [limb.name for limb in limbs(body.model)].index(name)


def test_the_view_is_the_one_that_shows_the_limb(body):
    cameras = cameras_around(4)
    for side in ("left", "right"):
        limb = limb_index(body, f"{side}_forearm")
        crop = thumbnails.choose_crop([body], 0, limb, cameras)
        elbow = body.points_world[body.model.point_names.index(f"{side}_elbow")]
        other = body.points_world[body.model.point_names.index(f"{'right' if side == 'left' else 'left'}_elbow")]
        nearest = np.linalg.norm(cameras[crop.camera].center_world - elbow)
        assert nearest < np.linalg.norm(cameras[crop.camera].center_world - other) + 0.05  # not behind the trunk
        u0, v0, u1, v1 = crop.region
        assert u1 - u0 == v1 - v0
        px = cameras[crop.camera].project(body.points_world)
        assert np.all((px > (u0, v0)) & (px < (u1, v1)))


def test_a_person_that_no_view_shows_has_none(body):
    away = PosedBody(body.model, body.model.retract(body.values, 50.0 * (np.arange(body.model.n_dofs) == 0)))
    assert thumbnails.choose_crop([away], 0, None, cameras_around(1)) is None


@pytest.mark.parametrize("damaged", [False, True])
def test_the_limb_stands_out_and_the_size_is_bounded(body, damaged):
    (camera,) = cameras_around(1)
    crop = thumbnails.choose_crop([body], 0, None, [camera])
    limb = thumbnails.limb_parts([body], 0, limb_index(body, "left_calf"))
    image = None if damaged else np.zeros((camera.height, camera.width, 3), np.uint8)
    data = thumbnails.thumbnail(image, camera, crop.region, [body], [ORANGE], limb)
    drawn = cv2.cvtColor(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB).astype(int)
    assert drawn.shape == (thumbnails.SIZE_PX, thumbnails.SIZE_PX, 3)
    assert len(data) < 20_000
    if not damaged:
        white = np.argwhere(drawn.min(axis=2) > 180)
        orange = np.argwhere((drawn[..., 0] > 130) & (drawn[..., 2] < 60))
        assert len(white) > 30
        assert len(orange) > 60
        assert white[:, 0].mean() > orange[:, 0].mean() + 20  # the calf is below the rest


def test_a_square_beyond_the_image_is_filled_with_black(body):
    (camera,) = cameras_around(1)
    image = np.full((camera.height, camera.width, 3), 200, np.uint8)
    none = thumbnails.limb_parts([body], 0, None)
    data = thumbnails.thumbnail(image, camera, (-100, -100, 60, 60), [body], [ORANGE], none)
    drawn = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    assert drawn[:90].max() < 30
    assert drawn[120:, 120:].mean() > 150
