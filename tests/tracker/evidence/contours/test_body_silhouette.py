"""Silhouettes of bodies in raw pixels: where points of the body are seen through the lens."""

import numpy as np
import pytest
from solids import cameras_around

from tracker.body.model import PosedBody
from tracker.evidence.contours.body_silhouette import body_silhouette
from tracker.evidence.contours.label_image import part_labels
from tracker.formats.model_toml import load_model


@pytest.mark.parametrize("lens", [(), (-0.25, 0.08, 0.001, -0.001)])
def test_joints_lie_in_the_silhouette_as_the_lens_shows_them(lens):
    model = load_model("gavrila22", 1.7)
    body = PosedBody(model, model.neutral())
    limbs = [model.point_names.index(n) for n in ("left_knee", "right_knee", "left_elbow", "right_elbow", "head")]
    middle = tuple(body.points_world.mean(axis=0))
    (camera,) = cameras_around(1, lens, middle, focal=330.0)
    mask = body_silhouette([body], camera)
    columns, rows = np.round(camera.project(body.points_world[limbs])).astype(int).T
    assert mask[rows, columns].all()
    assert 0.01 < mask.mean() < 0.3
    same = np.array_equal(mask, part_labels([body], camera.pinhole) > 0)
    assert same == (not lens)


def test_nobody_is_an_empty_silhouette():
    (camera,) = cameras_around(1, (-0.2, 0.0, 0.0, 0.0))
    assert not body_silhouette([], camera).any()
