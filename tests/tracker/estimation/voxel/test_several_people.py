"""The voxel tracker with two people, whose shapes no body model has."""

from types import SimpleNamespace

import numpy as np
import pytest
from moving_figure import ADULT, FIGURE, cameras, joints_at, pose_at
from solids import ellipsoid, silhouettes_of

from tracker.estimation.fitting.gauss_newton import fit_to_points
from tracker.estimation.tracking.tracker import Subjects, TrackingRun
from tracker.estimation.voxel.assessment import unexplained_voxels
from tracker.estimation.voxel.body_pose import state_of
from tracker.estimation.voxel.figure import chain_centers
from tracker.estimation.voxel.frame_estimator import VoxelEstimator
from tracker.estimation.voxel.settings import VoxelSettings
from tracker.evidence.voxels.voxel_grid import VoxelGrid, Voxels
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import load_model

FPS = 30.0
BODY = load_model("gavrila34", 1.72)


def places(gap_m):
    return np.array([[0.0, -gap_m / 2, 0.0], [0.0, gap_m / 2, 0.0]])


def views_of(seconds, offsets):
    """Silhouettes of people who move alike at some offsets, (n, 3), metres."""
    R, center = pose_at(seconds)
    solids = []
    for offset in offsets:
        centers = chain_centers(FIGURE, ADULT, R, center + offset)
        solids += [ellipsoid(c, s, r) for c, s, r in zip(centers, ADULT, R, strict=True)]
    return silhouettes_of(solids, cameras())


def joints_of(seconds, offset):
    return {n: p + offset for n, p in joints_at(seconds).items()}


def tracked(gap_m, n, seen=lambda k, offsets: offsets):
    """Estimates of two people, and their mean errors of the limb joints on the last frame, metres."""
    offsets = places(gap_m)
    starts = [fit_to_points(BODY, joints_of(0.0, o)).pose for o in offsets]
    observer = SimpleNamespace(cameras=cameras(), recording=None)
    estimator = VoxelEstimator(TrackingRun(observer, Subjects.of([BODY, BODY]), starts, range(n), FPS), VoxelSettings())
    found = [estimator.estimate(k, views_of(k / FPS, seen(k, offsets))) for k in range(n)]
    errors = []
    for pose, offset in zip(found[-1].poses, offsets, strict=True):
        own, truth = BODY.named_points_world(pose), joints_of((n - 1) / FPS, offset)
        errors.append(np.mean([np.linalg.norm(own[j] - truth[j]) for j in LIMB_JOINTS]))
    return found, errors


@pytest.mark.slow
def test_people_who_stand_apart_are_followed():
    found, errors = tracked(1.4, 4)
    assert max(errors) < 0.06
    assert "lost" not in found[-1].statuses


@pytest.mark.slow
def test_a_person_who_has_gone_is_lost_and_the_other_one_not_good():
    found, errors = tracked(1.4, 4, lambda k, offsets: offsets[:1] if k > 1 else offsets)
    assert found[-1].statuses == ("doubtful", "lost")
    assert found[-1].notes[0] == "another person is lost: their voxels cannot be separated"
    assert errors[0] < 0.06


@pytest.fixture
def states():
    bodies = [fit_to_points(BODY, joints_of(0.0, o)).pose for o in places(1.4)]
    return [state_of(BODY, [b], 1 / FPS, VoxelSettings()) for b in bodies]


def occupied(states, *boxes):
    """Voxels of 5 cm: a ball at the centre of each part, and some boxes of lowest and highest corners."""
    grid = VoxelGrid.over(np.array([-1.5, -2.0, -1.5]), np.array([1.5, 2.0, 1.5]), 0.05)
    points = grid.centers(np.argwhere(np.ones(grid.shape, bool)))
    inside = np.zeros(len(points), bool)
    for center in np.concatenate([s.centers for s in states]):
        inside |= np.linalg.norm(points - center, axis=1) < 0.04
    for low, high in boxes:
        inside |= ((points >= low) & (points <= high)).all(axis=1)
    return Voxels(grid, inside.reshape(grid.shape))


@pytest.mark.slow
def test_voxels_count_for_the_person_whom_they_are_connected_with(states):
    torso = states[1].centers[0]
    limb = (torso - 0.06, torso + np.array([0.9, 0.06, 0.06]))
    ghost = (np.array([-1.2, -0.2, -1.2]), np.array([-0.9, 0.2, -0.8]))
    first, second = unexplained_voxels(occupied(states, limb, ghost), states)
    assert len(first.points) == 0
    assert len(second.points) > 20
    assert second.points[:, 0].min() > torso[0]
    assert not first.touches
    assert not second.touches


@pytest.mark.slow
def test_people_who_touch_are_told(states):
    low, high = states[0].centers[0] - 0.03, states[1].centers[0] + 0.03
    assert all(f.touches for f in unexplained_voxels(occupied(states, (low, high)), states))
