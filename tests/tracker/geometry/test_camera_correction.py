"""Corrections of cameras: their meaning, and their derivatives against differences."""

import numpy as np
import pytest
from rig_oracle import columns
from staging import camera_at

from tracker.geometry.camera_correction import (
    FOCAL,
    N_CORRECTIONS,
    POSITION,
    ROTATION,
    TIME,
    corrected,
    in_units,
    with_step,
)
from tracker.geometry.rigid import so3_exp

CAMERA = camera_at("A", (4.0, 0.5, 1.0))
POINTS = np.random.default_rng(0).normal(scale=0.5, size=(20, 3))
CORRECTION = np.array([0.01, -0.02, 0.015, 0.03, -0.01, 0.02, 0.04, 0.0, 0.0])


def test_a_camera_turns_moves_and_zooms_as_its_correction_says():
    found = corrected(CAMERA, CORRECTION)
    R, C = CAMERA.T_camera_world[:3, :3], CAMERA.center_world
    np.testing.assert_allclose(found.T_camera_world[:3, :3], so3_exp(CORRECTION[ROTATION]) @ R, atol=1e-12)
    np.testing.assert_allclose(found.center_world, C + R.T @ CORRECTION[POSITION], atol=1e-12)
    assert found.K[0, 0] == pytest.approx(np.exp(CORRECTION[FOCAL]) * CAMERA.K[0, 0])
    np.testing.assert_array_equal(found.K[:2, 2], CAMERA.K[:2, 2])


def test_nothing_is_corrected_by_nothing():
    assert corrected(CAMERA, np.zeros(N_CORRECTIONS)) is CAMERA
    np.testing.assert_array_equal(with_step(CORRECTION, np.zeros(N_CORRECTIONS)), CORRECTION)


def test_columns_are_the_differences_of_a_further_step():
    camera = corrected(CAMERA, CORRECTION)
    found = columns(camera, CORRECTION, POINTS)
    for i, step in enumerate(1e-6 * np.eye(N_CORRECTIONS)[:TIME]):
        after, before = (corrected(CAMERA, with_step(CORRECTION, s * step)).project(POINTS) for s in (1, -1))
        np.testing.assert_allclose(found[:, :, i], (after - before) / 2e-6, rtol=1e-4, atol=1e-3)


def test_units_are_those_of_people():
    found = in_units(np.array([np.radians(1.0), 0, 0, 0.02, 0, 0, np.log(1.05), 0.01, 0.002]))
    np.testing.assert_allclose(found["rotation_deg"], [1, 0, 0])
    np.testing.assert_allclose(found["position_mm"], [20, 0, 0])
    assert found["focal_percent"] == pytest.approx(5)
    assert found["time_ms"] == pytest.approx(10)
    assert found["drift_ms_per_s"] == pytest.approx(2)
