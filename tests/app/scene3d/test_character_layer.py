"""Characters in the 3-D view: beside each person, with the person's bones, on the person's ground."""

import numpy as np
import pytest
from staging import cameras_around, posed

from app.scene3d.character_layer import driven
from app.state.floor_picking import FloorState
from tracker.formats.model_toml import load_model
from tracker.geometry.ground_plane import GroundPlane

PERSON, CHARACTER = load_model("gavrila34", 1.7), load_model("knossow54", 1.7)
CAMERAS = cameras_around(3)


def bone(model, values, parent, child):
    points = model.named_points_world(values)
    along = points[child] - points[parent]
    return along / np.linalg.norm(along)


@pytest.mark.parametrize("plane", [None, GroundPlane(np.array([0.0, 0.0, 1.0]), -1.0)])
def test_a_character_stands_beside_the_person_and_bends_alike(plane):
    pose = posed(PERSON, 4)
    (values,) = driven([PERSON], [pose], [CHARACTER], FloorState("z", plane), CAMERAS)
    for side in ("left", "right"):
        for parent, child in (("elbow", "wrist"), ("knee", "ankle")):
            names = f"{side}_{parent}", f"{side}_{child}"
            assert bone(PERSON, pose, *names) @ bone(CHARACTER, values, *names) > np.cos(np.radians(3))
    person, character = PERSON.points_world(pose), CHARACTER.points_world(values)
    assert character[:, 2].min() == pytest.approx(person[:, 2].min(), abs=1e-6)
    moved = character[0] - person[0]
    assert np.linalg.norm(moved[:2]) == pytest.approx(0.8, abs=0.1)
    camera = CAMERAS[0].pinhole
    assert camera.project(character[:1])[0, 0] > camera.project(person[:1])[0, 0] + 50  # to the right


def test_two_people_move_twice_as_far_and_one_without_a_pose_has_no_character():
    pose = posed(PERSON, 4)
    values, none = driven([PERSON, PERSON], [pose, None], [CHARACTER, CHARACTER], FloorState("z", None), CAMERAS)
    assert none is None
    moved = CHARACTER.points_world(values)[0] - PERSON.points_world(pose)[0]
    assert np.linalg.norm(moved[:2]) == pytest.approx(1.6, abs=0.1)
