"""Meshes of people: sides differ in brightness, heads have noses."""

import numpy as np
import pytest
from color_vision import MACHADO_2009, difference

from app.drawing.facing import face_part, nose
from app.scene3d.meshes import shaded
from tracker.formats.model_toml import load_model
from tracker.session.session import PALETTE


@pytest.mark.parametrize("color", PALETTE)
def test_left_is_lighter_and_right_darker_than_the_middle_of_the_same_colour(color):
    left, middle, right = (np.array(shaded(color, side)) for side in ("left", "", "right"))
    assert left.mean() - 15 > middle.mean() > right.mean() + 40
    assert all(difference(left / 255, right / 255, vision) > 20 for vision in MACHADO_2009)
    assert np.argmax(left) == np.argmax(middle) == np.argmax(right)


@pytest.mark.parametrize("name", ["gavrila22", "gavrila34"])
def test_only_the_head_has_a_nose_in_front_of_its_face(name):
    model = load_model(name)
    for part, vertices in ((i, nose(model, i)[0]) for i in range(len(model.parts))):
        assert (len(vertices) > 0) == (model.parts[part].name == "head")
    vertices, faces = nose(model, model.part_index["head"])
    assert vertices[:, 0].max() > face_part(model)[0] + 0.03
    assert np.all(faces < len(vertices))
