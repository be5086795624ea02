"""Driving a character: bones keep their directions on a body of other joints and sizes."""

import numpy as np
import pytest
from bodies import MODELS
from staging import posed

from tracker.estimation.posing.character import drive_character
from tracker.formats.model_toml import load_model
from tracker.geometry.ground_plane import GroundPlane

FLOOR = GroundPlane(np.array([0.0, 0.0, 1.0]), -0.9)
LIMBS = ("elbow", "wrist", "knee", "ankle")


def directions(model, pose):
    places = model.named_points_world(pose)
    return {
        b: (places[b] - places[a]) / np.linalg.norm(places[b] - places[a]) for a, b in model.bones if b.endswith(LIMBS)
    }


@pytest.mark.parametrize("body", ["gavrila22", "gavrila34", "knossow54"])
def test_limbs_keep_their_directions(body):
    source, character = MODELS["gavrila34"], load_model(body, 1.2)
    pose = posed(source, 3)
    driven = drive_character(pose, source, character, FLOOR)
    before, after = directions(source, pose), directions(character, driven)
    common = before.keys() & after.keys()
    assert len(common) == 8
    off = [np.degrees(np.arccos(np.clip(before[n] @ after[n], -1, 1))) for n in common]
    assert np.mean(off) < 6
    np.testing.assert_array_equal(character.clip(driven), driven)


def test_the_same_body_has_the_same_pose():
    source = MODELS["gavrila34"]
    pose = posed(source, 1)
    driven = drive_character(pose, source, source, FLOOR)
    np.testing.assert_allclose(source.points_world(driven), source.points_world(pose), atol=0.002)


def test_the_character_stands_on_the_floor_where_the_person_does():
    source, character = MODELS["gavrila34"], load_model("gavrila34", 0.9)
    pose = posed(source, 2)
    person = source.points_world(pose)
    floor = GroundPlane(FLOOR.normal, float(person[:, 2].min()))
    points = character.points_world(drive_character(pose, source, character, floor))
    assert points[:, 2].min() == pytest.approx(floor.offset_m, abs=1e-6)
    assert np.linalg.norm(points[0, :2] - person[0, :2]) < 0.05
