"""How a detector sees a body, learnt from key points with known offsets, noise and gross errors."""

import numpy as np
import pytest
from rigs import cameras, ring
from staging import posed

from tracker.body.model import PosedBody
from tracker.estimation.acquisition.from_keypoints import PersonObservations, fit_to_keypoints, learn_seen_body
from tracker.formats.joint_maps import LIMB_JOINTS
from tracker.formats.model_toml import load_model

CAMERAS, N, FEW, SIGMA = cameras(ring(4)), 30, 8, 0.004
MODEL, OTHER = load_model("gavrila38", 1.7), load_model("gavrila38", 1.78)
NAMES = tuple(sorted(LIMB_JOINTS))
POINTS = np.array([MODEL.point_names.index(n) for n in NAMES])
OFFSETS = {"left_hip": (0.02, 0.01, -0.04), "right_shoulder": (-0.01, 0.03, 0.02)}


@pytest.fixture(scope="module")
def recording():
    """Poses of a body, and what a detector says: offsets at two joints, noise, a tenth of the wrists elsewhere."""
    rng, start = np.random.default_rng(0), posed(MODEL, 5)
    bodies = {
        k: PosedBody(MODEL, MODEL.clip(MODEL.retract(start, rng.normal(0, 0.15, MODEL.n_dofs)))) for k in range(N)
    }
    offsets = np.array([OFFSETS.get(n, (0.0, 0.0, 0.0)) for n in NAMES])
    joints, seen = np.empty((N, len(NAMES), 3)), np.empty((N, len(CAMERAS), len(NAMES), 2))
    for k, body in bodies.items():
        R = body.kinematics.Ts_world_part[MODEL.proximal_parts[POINTS], :3, :3]
        joints[k] = body.joint_centers_world[POINTS] + np.einsum("nij,nj->ni", R, offsets)
        for v, camera in enumerate(CAMERAS):
            eye = joints[k] @ camera.T_camera_world[:3, :3].T + camera.T_camera_world[:3, 3]
            seen[k, v] = eye[:, :2] / eye[:, 2:] + rng.normal(0, SIGMA, (len(NAMES), 2))
    joints += rng.normal(0, 0.01, joints.shape)
    seen[::10, :, NAMES.index("left_wrist")] += 0.2
    return bodies, PersonObservations(NAMES, joints, seen, np.full(seen.shape[:3], 0.8))


def first_frames(points):
    return PersonObservations(NAMES, points.joints_world[:FEW], points.seen[:FEW], points.confidence[:FEW])


def test_offsets_and_noise_are_those_of_the_detector(recording):
    bodies, points = recording
    found = learn_seen_body(bodies, points, CAMERAS)
    for name, offset in zip(found.names, found.offsets_part, strict=True):
        np.testing.assert_allclose(offset, OFFSETS.get(name, (0, 0, 0)), atol=0.008, err_msg=name)
    # The noise is that of confidence 1; points were seen at 0.8.
    np.testing.assert_allclose(found.sigmas, SIGMA * np.sqrt(0.8), rtol=0.2)


def test_a_point_on_which_the_views_of_a_frame_disagree_is_less_certain_there(recording):
    bodies, points = recording
    learnt = learn_seen_body(bodies, points, CAMERAS)
    seen, knee = points.seen.copy(), NAMES.index("left_knee")
    seen[5, :3, knee] += [[0.05, 0.0], [0.0, -0.05], [-0.05, 0.0]]  # saturated: each view is as sure as ever
    seen[7, 0, knee] += 0.05  # one view alone contradicts: robust fits leave it out
    usual, found = (
        learnt.keypoints(MODEL, PersonObservations(NAMES, points.joints_world, s, points.confidence), CAMERAS).sigmas
        for s in (points.seen, seen)
    )
    assert (found[5, :, knee] > 0.03).all()
    assert (found[7, :, knee] < 0.02).all()
    np.testing.assert_array_equal(np.delete(found, [5, 7], axis=0), np.delete(usual, [5, 7], axis=0))
    np.testing.assert_array_equal(learnt.keypoints(MODEL, points, ()).sigmas[0, 0], learnt.sigmas / np.sqrt(0.8))


def test_a_frame_with_gross_errors_costs_more(recording):
    bodies, points = recording
    costs = learn_seen_body(bodies, points, CAMERAS).costs(bodies, points, CAMERAS)
    assert min(costs[k] for k in range(0, N, 10)) > max(costs[k] for k in range(N) if k % 10)


@pytest.mark.slow
def test_a_body_of_another_shape_follows_the_key_points(recording):
    bodies, points = recording
    fitted = fit_to_keypoints(OTHER, first_frames(points))
    off = [np.linalg.norm(fitted[k].joint_centers_world[POINTS] - b.joint_centers_world[POINTS], axis=1)
           for k, b in bodies.items() if k < FEW]  # fmt: skip
    assert set(fitted) == set(range(FEW))
    assert np.median(off) < 0.03  # bodies of 1.70 and 1.78 m, offsets of 45 mm


@pytest.mark.slow
def test_sparse_points_leave_frames_out(recording):
    _, points = recording
    joints = points.joints_world[:2].copy()
    joints[1, 3:] = np.nan
    few = PersonObservations(NAMES, joints, points.seen[:2], points.confidence[:2])
    assert set(fit_to_keypoints(MODEL, few)) == {0}
