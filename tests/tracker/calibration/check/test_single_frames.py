"""Since when a camera is off."""

import numpy as np
import pytest
from rig_scenes import FPS

from tracker.calibration.check.fault_search import prior_sigmas
from tracker.calibration.check.single_frames import FrameScore, find_change
from tracker.geometry.camera_correction import N_CORRECTIONS

SIGMAS = prior_sigmas(FPS)


def changes(since, n=20, shift=0.01, sharpness=1e6, seed=0):
    """The change that frames show with one camera, turned by an angle from a frame on, with noise of the contours."""
    random, H = np.random.default_rng(seed), np.eye(N_CORRECTIONS) * sharpness
    best = random.normal(scale=sharpness**-0.5, size=(n, N_CORRECTIONS))
    best[since:, 1] += shift
    correction = best.mean(axis=0)

    def score(k, c):
        off = c - best[k]
        return FrameScore(k, 0.5 * off @ H @ off, H @ off, H)

    scores = [(score(k, np.zeros(N_CORRECTIONS)), score(k, correction)) for k in range(n)]
    return find_change(scores, 0, np.arange(3), correction, SIGMAS)


@pytest.mark.parametrize("since", [3, 10, 17])
def test_the_frame_since_when_a_camera_is_off_is_found(since):
    found = changes(since)
    assert found.first == since
    assert found.gain_nats > 20
    assert found.is_confirmed == (since == 10)  # three frames at an end may be bad ones


@pytest.mark.parametrize("since", [0, 20])
def test_a_camera_that_never_changes_has_no_such_frame(since):
    found = [changes(since, seed=seed).first for seed in range(20)]
    assert found.count(0) >= 18


def test_a_camera_that_is_far_off_on_all_frames_never_changed():
    """Contours that are out of reach say nothing where the camera would have to be, by their slope."""
    correction, H = np.full(N_CORRECTIONS, 0.1), np.eye(N_CORRECTIONS) * 1e6
    random = np.random.default_rng(0)
    scores = []
    for k in range(20):
        slope = 1e3 * random.normal(size=N_CORRECTIONS)
        near = H @ random.normal(scale=1e-3, size=N_CORRECTIONS)
        scores.append((FrameScore(k, 100.0, slope, 1e-3 * H), FrameScore(k, 10.0, near, H)))
    assert find_change(scores, 0, np.arange(3), correction, SIGMAS).first == 0
