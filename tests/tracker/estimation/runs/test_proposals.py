"""Proposals of a pose by known ones: other sides, the other way round, motion that goes on, limbs combined."""

import numpy as np
import pytest
from bodies import MODELS
from staging import in_posture

from tracker.body.dimensions import mirror_part
from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.estimation.fitting.limb_exchange import turned_round
from tracker.estimation.runs.path_search import combined, continued, other_sides


def posture(model):
    """A pose of a person whose limbs can lie where those of the other side do, facing away from x."""
    pose = in_posture(model)
    for name in ("left_knee.extension", "right_knee.extension", "left_hip.flexion", "left_hip.elevation"):
        if name in model.value_names:
            pose[model.value_names.index(name)] = model.neutral()[model.value_names.index(name)]
    return model.clip(pose)


def mirrored_m(model, one, other, parts):
    """Largest distance of a point of some parts from where its counterpart lies in another pose, metres."""
    names, here, there = list(model.point_names), model.points_world(one), model.points_world(other)
    pairs = [(i, names.index(mirror_part(n))) for i, n in enumerate(names) if mirror_part(n) in names]
    return max(np.linalg.norm(here[i] - there[k]) for i, k in pairs if model.point_parts[i] in parts)


@pytest.mark.parametrize("name", ["gavrila22", "gavrila34"])
def test_exchanged_limbs_lie_where_those_of_the_other_side_did(name):
    model = MODELS[name]
    body = PosedBody(model, posture(model))
    found = [p for p in other_sides(body) if p.source == "exchange"]
    assert len(found) == 2  # arms and legs, but not the head
    before = body.points_world
    for proposal in found:
        np.testing.assert_array_equal(model.clip(proposal.pose), proposal.pose)
        gaps = np.linalg.norm(model.points_world(proposal.pose) - before, axis=1)
        moved = {x.name for x in limbs(model) if gaps[np.isin(model.point_parts, x.parts)].max() > 1e-6}
        assert len(moved) <= 2
        assert {x.split("_")[1] for x in moved} in ({"forearm"}, {"calf"})
        ends = [i for i, n in enumerate(model.point_names) if n.split("_")[-1] in ("wrist", "ankle")]
        own = [i for i in ends if gaps[i] > 0.02]
        for i in own:
            other = model.point_names.index(mirror_part(model.point_names[i]))
            reached = np.linalg.norm(model.points_world(proposal.pose)[i] - before[other])
            assert reached < 0.5 * np.linalg.norm(before[i] - before[other])


@pytest.mark.parametrize("name", ["gavrila22", "gavrila34"])
@pytest.mark.parametrize(("is_bent", "apart_m"), [(False, 0.01), (True, 0.1)])
def test_turned_round_the_limbs_lie_where_those_of_the_other_side_did(name, is_bent, apart_m):
    """But for elbows, which bend to one side alone."""
    model = MODELS[name]
    body = PosedBody(model, posture(model) if is_bent else model.neutral())
    pose = turned_round(body)
    np.testing.assert_array_equal(model.clip(pose), pose)
    forward = PosedBody(model, pose).kinematics.Ts_world_part[0, :3, 0]
    assert forward @ body.kinematics.Ts_world_part[0, :3, 0] < -0.9
    assert mirrored_m(model, pose, body.values, range(len(model.parts))) < apart_m


def test_a_body_without_sides_has_no_limbs_to_exchange():
    model = MODELS["balls"]
    (turn,) = other_sides(PosedBody(model, model.neutral()))
    assert turn.source == "turn"
    assert np.isfinite(turn.pose).all()


def test_a_pose_goes_on_as_it_moved(gavrila):
    here, step = posture(gavrila), np.full(gavrila.n_dofs, 0.01)
    before = gavrila.retract(here, -step)
    assert [p.source for p in continued(gavrila, None, here)] == ["neighbour"]
    still, moved = continued(gavrila, before, here)
    np.testing.assert_array_equal(still.pose, here)
    np.testing.assert_allclose(gavrila.difference(moved.pose, here), step, atol=1e-9)
    far = gavrila.clip(gavrila.retract(here, 100 * step))
    (_, clipped) = continued(gavrila, here, far)
    np.testing.assert_array_equal(gavrila.clip(clipped.pose), clipped.pose)


def test_other_angles_of_the_same_rotation_are_no_motion(gavrila):
    here = posture(gavrila)
    root = gavrila.dof_value[np.flatnonzero((gavrila.dof_joint == 0) & ~gavrila.dof_is_length)]
    before = here.copy()
    before[root] = here[root] * (1, -1, 1) + np.pi
    np.testing.assert_allclose(gavrila.points_world(before), gavrila.points_world(here), atol=1e-9)
    (_, moved) = continued(gavrila, before, here)
    np.testing.assert_allclose(moved.pose, here, atol=1e-9)


def test_limbs_that_lie_elsewhere_are_combined_one_by_one(gavrila):
    here = posture(gavrila)
    dofs = {x.name: x.dofs for x in limbs(gavrila)}
    arm, leg = (0.8 * dofs[name] for name in ("left_forearm", "right_calf"))
    other = gavrila.clip(gavrila.retract(here, arm + leg))
    near = gavrila.clip(gavrila.retract(here, 0.01 * arm))
    found = list(combined(gavrila, here, [near, other]))
    assert [p.source for p in found] == ["combination", "combination", "neighbour"]
    np.testing.assert_array_equal(found[2].pose, other)
    for proposal, name in zip(found, ("left_forearm", "right_calf"), strict=False):
        step = gavrila.difference(proposal.pose, here)
        np.testing.assert_allclose(step, np.where(dofs[name], gavrila.difference(other, here), 0.0), atol=1e-9)
