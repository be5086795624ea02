"""Jumps between neighbouring frames, on motions whose jumps are known."""

import numpy as np
import pytest

from tracker.body.motion.keyframe_doubts import inconsistent_frames, motion_residuals_m, threshold_m

FPS = 30.0
N = 40


@pytest.fixture
def walk(gavrila):
    """A body that walks along x at 1.5 m/s and swings an arm by 40 degrees once a second, with a tracker's noise."""
    rng = np.random.default_rng(11)
    t = np.arange(N) / FPS
    values = np.tile(gavrila.neutral(), (N, 1))
    values[:, 0] += 1.5 * t
    swing = gavrila.value_names.index("left_shoulder.elevation")
    values[:, swing] += np.radians(40) * np.sin(2 * np.pi * t)
    return values + 0.003 * rng.standard_normal(values.shape)


def test_a_steady_motion_agrees_with_itself(gavrila, walk):
    assert inconsistent_frames([gavrila] * N, range(N), walk, frozenset(), FPS) == []


def test_a_seam_is_named_once_by_the_frame_after_it(gavrila, walk):
    walk[20:, 0] += 0.2
    assert inconsistent_frames([gavrila] * N, range(N), walk, frozenset(), FPS) == [20]


def test_a_tracked_frame_that_misses_the_keyframe_after_it_is_named_before_it(gavrila, walk):
    walk[20:, 0] += 0.2
    assert inconsistent_frames([gavrila] * N, range(N), walk, {20}, FPS) == [19]
    assert inconsistent_frames([gavrila] * N, range(N), walk, {19, 20}, FPS) == [20]


def test_a_limb_alone_that_jumps_is_found(gavrila, walk):
    walk[25:, gavrila.value_names.index("left_shoulder.abduction")] += np.radians(30)
    assert inconsistent_frames([gavrila] * N, range(N), walk, frozenset(), FPS) == [25]


def test_a_single_wrong_frame_is_found(gavrila, walk):
    walk[10, 1] += 0.3
    assert set(inconsistent_frames([gavrila] * N, range(N), walk, frozenset(), FPS)) <= {10, 11}
    assert inconsistent_frames([gavrila] * N, range(N), walk, frozenset(), FPS)


def test_frames_without_a_pose_between_are_no_jump(gavrila, walk):
    frames = [*range(20), *range(25, 45)]
    walk[20:, 0] += 0.5
    assert inconsistent_frames([gavrila] * len(frames), frames, walk, frozenset(), FPS) == []


def test_few_frames_say_nothing(gavrila, walk):
    for n in range(3):
        walk[n:, 0] += 3.0
        assert inconsistent_frames([gavrila] * n, range(n), walk[:n], frozenset(), FPS) == []


def test_a_step_is_off_by_the_jump_itself():
    points = np.cumsum(np.full((9, 2, 3), 0.01), axis=0)
    points[5:, 1, 2] += 0.5
    off = motion_residuals_m(points)
    np.testing.assert_allclose(off[[0, 1, 6, 7]], 0.0, atol=1e-12)
    np.testing.assert_allclose(off[3:6], [0.25, 0.5, 0.25])


def test_a_quicker_camera_allows_smaller_jumps():
    assert threshold_m(30.0) == pytest.approx(0.1)
    assert threshold_m(200.0) == 0.05
    assert threshold_m(5.0) == 0.25
