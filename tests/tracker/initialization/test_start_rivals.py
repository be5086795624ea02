"""Limbs that are elsewhere in starts that cost about as much."""

import numpy as np

from tracker.body.model import PosedBody
from tracker.formats.model_toml import load_model
from tracker.initialization.start_rivals import ABOUT_EQUAL, limbs_elsewhere, rivals_note

MODEL = load_model("gavrila34")


def bent(name, angle):
    pose = MODEL.neutral()
    pose[MODEL.value_names.index(name)] += angle
    return PosedBody(MODEL, pose)


HERE, KNEE, ELBOW = bent("left_knee.extension", 0), bent("left_knee.extension", 0.6), bent("right_elbow.extension", 1)


def test_a_limb_that_is_bent_is_elsewhere():
    points = HERE.points_world
    assert limbs_elsewhere(MODEL, points, KNEE.points_world) == ("left_calf",)
    assert limbs_elsewhere(MODEL, points, bent("left_knee.extension", 0.2).points_world) == ()
    assert limbs_elsewhere(MODEL, points, bent("left_knee.extension", 0.2).points_world, 0.05) == ("left_calf",)


def test_limbs_of_starts_that_cost_about_as_much_are_named():
    note = rivals_note([(HERE, 2.0), (ELBOW, 2.0), (KNEE, 2.0 * ABOUT_EQUAL - 0.01)])
    assert note.startswith("another start costs about as much, with ")
    assert "left leg" in note
    assert "right arm" in note
    assert "right leg" not in note


def test_a_start_that_costs_more_is_no_rival():
    assert rivals_note([(HERE, 2.0), (KNEE, 2.0 * ABOUT_EQUAL + 0.01)]) == ""
    assert rivals_note([(HERE, 2.0), (HERE, 2.0)]) == ""
    assert rivals_note([(HERE, np.inf)]) == ""
