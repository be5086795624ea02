import numpy as np
import pytest
from figures import STANDING, child, figure, parts_of

from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.estimation.initialization.generators.head_template import find_head
from tracker.estimation.initialization.generators.torso_template import find_torso
from tracker.estimation.initialization.generators.voxel_start import start_pose, turned_round
from tracker.evidence.voxels.geodesic_distance import neighbor_graph
from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import PRESETS, load_model

POSES = [pose | {"noise": 0.1} for pose in STANDING]


def errors_mm(model: BodyModel, pose, joints):
    own = model.named_points_world(pose)
    return {n: 1000 * float(np.linalg.norm(own[n] - joints[n])) for n in LIMB_JOINTS}


@pytest.mark.slow
@pytest.mark.parametrize("pose", POSES)
def test_all_parts_are_found(pose):
    voxels, joints = figure(**pose)
    parts = parts_of(voxels)
    assert parts.unresolved == ()
    left = joints["left_shoulder"] - joints["right_shoulder"]
    if parts.torso.axes[:, 1] @ left < 0:  # voxels do not tell left from right
        parts = turned_round(parts)
    assert parts.torso.axes[:, 1] @ left / np.linalg.norm(left) > 0.95
    model = load_model("gavrila34").with_height(joints["head"][2] + 0.125 - (joints["left_ankle"][2] - 0.07))
    errors = errors_mm(model, start_pose(model, parts), joints)
    assert np.mean(list(errors.values())) < 80


@pytest.mark.slow
@pytest.mark.parametrize("name", PRESETS)
def test_any_body_takes_the_start(name):
    voxels, joints = figure(turn_deg=40)
    model, parts = load_model(name), parts_of(voxels)
    both = [errors_mm(model, start_pose(model, p), joints) for p in (parts, turned_round(parts))]
    assert min(np.mean(list(errors.values())) for errors in both) < 80


@pytest.mark.slow
def test_the_head_and_the_neck():
    voxels, joints = figure()
    head = find_head(voxels, neighbor_graph(voxels))
    assert np.linalg.norm(head.center - joints["head"]) < 0.05
    # The neck is where the sphere around the head meets the body.
    assert np.linalg.norm(head.neck[:2] - joints["neck"][:2]) < 0.02
    assert joints["neck"][2] < head.neck[2] < joints["head"][2]


@pytest.mark.slow
def test_arms_on_the_body_and_closed_legs_are_not_guessed():
    parts = parts_of(figure(arms_deg=2, legs_deg=-6)[0])
    assert {"left_leg", "right_leg"} <= set(parts.unresolved)
    model = load_model("gavrila34")
    assert np.all(np.isfinite(start_pose(model, parts)))


def test_a_child_is_found():
    """The head is nearly as large as an adult's, all else is not."""
    voxels, joints = child(arms_deg=45)
    parts = parts_of(voxels)
    assert np.linalg.norm(parts.head.center - joints["head"]) < 0.05
    assert parts.head.scale == pytest.approx(0.6, rel=0.1)
    assert parts.unresolved == ()
    for name, limb in parts.limbs.items():
        side, kind = name.split("_")
        assert np.linalg.norm(limb.distal - joints[f"{side}_{'wrist' if kind == 'arm' else 'ankle'}"]) < 0.10


@pytest.mark.slow
def test_coarse_voxels_of_a_small_child_give_a_start():
    """Enlarged to an adult, a voxel is wider than the slices in which limbs are measured."""
    parts = parts_of(child(share=0.4, size_m=0.03, arms_deg=25, legs_deg=4)[0])
    assert np.all(np.isfinite(start_pose(load_model("gavrila34", 0.7), parts)))


def test_a_figure_without_a_trunk():
    """A head that lies far above the rest of the figure."""
    voxels, joints = figure()
    is_head = np.zeros(len(voxels.indices), bool)
    with pytest.raises(TrackerError, match="expected a trunk below the head"):
        find_torso(voxels, joints["head"] + (0.0, 0.0, 0.6), 0.0, is_head)


@pytest.mark.slow
def test_turning_round_exchanges_left_and_right():
    parts = parts_of(figure()[0])
    other = turned_round(parts)
    assert other.limbs["left_arm"] is parts.limbs["right_arm"]
    np.testing.assert_allclose(other.torso.axes[:, 1], -parts.torso.axes[:, 1])
    assert turned_round(other).limbs == parts.limbs


@pytest.mark.slow
def test_a_figure_without_a_head():
    voxels, _ = figure()
    occupied = voxels.occupied.copy()
    occupied[:, :, voxels.grid.centers(np.array([[0, 0, k] for k in range(occupied.shape[2])]))[:, 2] > 1.40] = False
    with pytest.raises(TrackerError, match="expected a head that stands out"):
        parts_of(Voxels(voxels.grid, occupied).cropped())
