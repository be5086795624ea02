"""Limbs that moved without having been touched, on poses whose changes are known."""

import numpy as np
import pytest

from tracker.estimation.posing.limb_moves import untouched_moves
from tracker.formats.model_toml import load_model


@pytest.fixture(scope="module", params=["gavrila22", "gavrila34"])
def model(request):
    return load_model(request.param)


def turned(model, **angles_rad):
    pose = model.neutral()
    for joint, angle in angles_rad.items():
        pose[next(i for i, n in enumerate(model.value_names) if n == f"{joint}.abduction")] += angle
    return pose


def test_limbs_are_named_farthest_first_with_their_distance(model):
    before = turned(model, right_shoulder=0.1, left_hip=0.1, left_shoulder=0.1, right_hip=0.1)
    after = turned(model, right_shoulder=0.4, left_hip=0.6, left_shoulder=0.7, right_hip=0.1)
    moves = untouched_moves(model, before, after, {"left_elbow"})
    names = [move.limb.name.rsplit("_", 1) for move in moves]
    assert [side for side, _ in names] == ["left", "right"]
    assert "left" not in [side for side, part in names if part in ("forearm", "hand")]
    far = np.linalg.norm(model.points_world(after) - model.points_world(before), axis=1)
    for move in moves:
        side = move.limb.name.split("_")[0]
        of_limb = [i for i, n in enumerate(model.point_names) if n.startswith(side)]
        kinds = ("hip", "knee", "ankle", "foot", "toe") if side == "left" else ("shoulder", "elbow", "wrist", "hand")
        of_kind = [i for i in of_limb if any(kind in model.point_names[i] for kind in kinds)]
        assert move.distance_m == pytest.approx(far[of_kind].max(), abs=1e-9)


def test_small_moves_and_moves_of_the_whole_body_are_none(model):
    before, after = (turned(model, right_shoulder=angle, left_shoulder=0.1) for angle in (0.1, 0.12))
    after[0] += 0.5
    assert untouched_moves(model, before, after, ()) == []


def test_a_limb_that_nothing_had_placed_yet_is_none(model):
    before, after = turned(model, left_shoulder=0.1), turned(model, left_shoulder=0.6, right_shoulder=0.6)
    (move,) = untouched_moves(model, before, after, ())
    assert move.limb.name.startswith("left")
