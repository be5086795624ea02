"""Degrees of freedom over time: steps to the limits, and the filter."""

import numpy as np
import pytest

from tracker.errors import TrackerError
from tracker.estimation.posing.dof_series import move_dofs, smooth_dofs
from tracker.formats.model_toml import load_model

FPS, CUTOFF_HZ = 100.0, 6.0
MODEL = load_model("gavrila22")
TWIST, ELBOW, X = (MODEL.dof_names.index(n) for n in ("torso.twist", "left_elbow.extension", "torso.x"))
TIMES_S = np.arange(2000) / FPS


def poses_with(dof, curve):
    poses = np.tile(MODEL.neutral(), (len(curve), 1))
    poses[:, dof] = curve
    return poses


def test_steps_end_at_the_limits_and_leave_the_others():
    poses = poses_with(ELBOW, [0.2, 1.0])
    moved = move_dofs(MODEL, poses, [ELBOW, X], np.array([10.0, 0.5]))
    np.testing.assert_allclose(moved[:, ELBOW], MODEL.limits[ELBOW, 1])
    np.testing.assert_allclose(moved[:, X], poses[:, X] + 0.5)
    np.testing.assert_array_equal(np.delete(moved, [ELBOW, X], axis=1), np.delete(poses, [ELBOW, X], axis=1))


@pytest.mark.parametrize(("hz", "gain"), [(CUTOFF_HZ, np.sqrt(0.5)), (0.5, 1.0), (25.0, 0.0)])
def test_the_filter_halves_the_power_at_its_cutoff_without_lag(hz, gain):
    wave = 0.1 * np.sin(2 * np.pi * hz * TIMES_S)
    smooth = smooth_dofs(MODEL, poses_with(TWIST, wave), [TWIST], FPS, CUTOFF_HZ)[200:-200, TWIST]
    np.testing.assert_allclose(smooth, gain * wave[200:-200], atol=1e-3)


def test_turns_beyond_half_a_turn_are_smooth():
    wrapped = (3.0 * TIMES_S[:300] + np.pi) % (2 * np.pi) - np.pi
    smooth = smooth_dofs(MODEL, poses_with(TWIST, wrapped), [TWIST], FPS, CUTOFF_HZ)
    np.testing.assert_allclose(smooth[:, TWIST], wrapped, atol=1e-3)


@pytest.mark.parametrize("cutoff_hz", [0.0, -1.0, 50.0])
def test_a_cutoff_is_below_half_the_frame_rate(cutoff_hz):
    with pytest.raises(TrackerError, match="above 0 and below 50 Hz, half the frame rate"):
        smooth_dofs(MODEL, poses_with(X, [0.0, 1.0]), [X], FPS, cutoff_hz)
