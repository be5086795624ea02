"""Since when a camera is off, and which frames are used."""

import numpy as np
import pytest
from rig_scenes import FPS

from tracker.calibration.camera_correction import N_CORRECTIONS
from tracker.calibration.diagnosis import prior_sigmas
from tracker.calibration.single_frames import FrameScore, find_change
from tracker.calibration.viewed_frames import spread_poses
from tracker.formats.model_toml import load_model
from tracker.motion.velocity import velocity

SIGMAS = prior_sigmas(FPS)


def scores(since, n=20, shift=0.01, sharpness=1e6, seed=0):
    """Scores of frames with one camera, turned by an angle from a frame on, as its contours would show with noise."""
    random, out = np.random.default_rng(seed), []
    for k in range(n):
        true = np.zeros(N_CORRECTIONS)
        true[1] = shift * (k >= since)
        H = np.eye(N_CORRECTIONS) * sharpness
        out.append(FrameScore(k, 0.0, -H @ (true + random.normal(scale=sharpness**-0.5, size=N_CORRECTIONS)), H))
    return out


@pytest.mark.parametrize("since", [3, 10, 17])
def test_the_frame_since_when_a_camera_is_off_is_found(since):
    assert find_change(scores(since), 0, np.arange(3), SIGMAS).first == since


@pytest.mark.parametrize("since", [0, 20])
def test_a_camera_that_never_changes_has_no_such_frame(since):
    found = [find_change(scores(since, seed=seed), 0, np.arange(3), SIGMAS).first for seed in range(20)]
    assert found.count(0) >= 18


def test_poses_are_as_different_as_possible():
    joints = np.zeros((12, 5, 3))
    joints[3], joints[7], joints[9] = 1.0, -1.0, [0, 2.0, 0]
    assert {3, 7, 9} < set(spread_poses(joints, 4))
    assert spread_poses(joints, 50) == [*range(12)]
    assert len(spread_poses(joints, 50, apart_m=0.1)) == 4
    assert len(spread_poses(joints, 50, apart_m=0.1, fewest=6)) == 6


def test_a_velocity_is_that_of_an_even_motion():
    model = load_model("gavrila22", 1.7)
    step = np.random.default_rng(0).normal(scale=0.02, size=model.n_dofs)
    poses = {i: model.retract(model.neutral(), i * step) for i in range(5)}
    np.testing.assert_allclose(25.0 * velocity(model, poses, 2), 25.0 * step, atol=1e-2)
