"""The motion of one body on another, whose degrees of freedom may differ."""

import numpy as np
import pytest
from staging import posed

from tracker.formats.model_toml import load_model
from tracker.posing.retarget import drive_pose


@pytest.mark.parametrize(("source", "target"), [
    ("gavrila34", "gavrila22"), ("gavrila22", "gavrila34"), ("gavrila34", "knossow54"), ("knossow54", "gavrila22"),
])  # fmt: skip
def test_another_body_follows_the_joints(source, target):
    moved, driven = load_model(source, 1.75), load_model(target, 1.75)
    pose = posed(moved, 3)
    found = drive_pose(pose, moved, driven)
    np.testing.assert_array_equal(driven.clip(found), found)
    places = dict(zip(moved.point_names, moved.points_world(pose), strict=True))
    off = [
        np.linalg.norm(p - places[n])
        for n, p in zip(driven.point_names, driven.points_world(found), strict=True)
        if n.endswith(("elbow", "wrist", "knee", "ankle"))
    ]
    still = [
        np.linalg.norm(p - places[n])
        for n, p in zip(driven.point_names, driven.points_world(driven.neutral()), strict=True)
        if n.endswith(("elbow", "wrist", "knee", "ankle"))
    ]
    assert len(off) == 8
    assert np.mean(off) < 0.05
    assert np.mean(still) > 3 * np.mean(off)


def test_a_taller_character_keeps_the_angles_as_far_as_it_can():
    person, giant = load_model("gavrila22", 1.6), load_model("gavrila22", 1.9)
    found = drive_pose(posed(person, 1), person, giant)
    np.testing.assert_array_equal(giant.clip(found), found)
    assert np.abs(giant.difference(found, posed(person, 1)))[~giant.dof_is_length].mean() < np.radians(20)
