"""Cameras fitted to frontier points whose borders and lenses are not quite known."""

from dataclasses import replace

import numpy as np
import pytest
from filmed_people import aligned, blanks, rig
from person_outlines import outlined

from tracker.calibration.self_calibration.frontier_adjustment import FrontierEquations, adjust_frontier
from tracker.calibration.self_calibration.joint_adjustment import Gauge, UnknownLenses
from tracker.calibration.self_calibration.person_calibration import volume_error
from tracker.errors import CalibrationError

CAMERAS = rig(3)
N_FRAMES = 8


def hulls_of(rim_px=(0.0, 0.0, 0.0), noise_px=0.1):
    """Hulls that a camera sees larger than they are by a rim, by frame and camera."""
    rows, _ = outlined(CAMERAS, N_FRAMES, noise_px=noise_px)
    return [[rimmed(s.hull_px, px) for s, px in zip(row, rim_px, strict=True)] for row in rows]


def rimmed(hull_px, rim_px):
    """A convex hull whose edges all lie farther out."""
    edges = np.roll(hull_px, -1, axis=0) - hull_px
    normals = np.stack([edges[:, 1], -edges[:, 0]], axis=1) / np.linalg.norm(edges, axis=1, keepdims=True)
    normals *= np.sign(np.sum(normals * (hull_px - hull_px.mean(axis=0)), axis=1, keepdims=True))
    corner = normals + np.roll(normals, 1, axis=0)
    return hull_px + rim_px * 2 * corner / np.sum(corner**2, axis=1, keepdims=True)


def adjusted(hulls, lenses=None, cameras=CAMERAS):
    return adjust_frontier(cameras, hulls, Gauge(0, 1), lenses, 3)[0]


def center_error_m(cameras):
    a, b = (np.array([c.center_world for c in each]) for each in (cameras, CAMERAS))
    scale, R, t = aligned(a, b)
    return np.linalg.norm(scale * a @ R.T + t - b, axis=1).max()


@pytest.mark.slow
def test_a_rim_about_the_person_does_not_move_cameras():
    exact, rim = (center_error_m(adjusted(hulls_of(px)).cameras) for px in ((0, 0, 0), (2, -1, 0)))
    assert exact < 0.02
    assert rim < 0.02


@pytest.mark.parametrize("agreement", [0.25, 1.0, 4.0])
def test_errors_that_agree_within_stretches_are_found(agreement):
    n_stretches, n = 20, 30
    gradients = np.sqrt(agreement) * np.random.default_rng(0).normal(size=(n_stretches, n))
    equations = FrontierEquations(np.stack(n_stretches * [np.eye(n)]), gradients, np.zeros((n, 2)))
    assert equations.agreement(np.zeros((n, n))) == pytest.approx(max(agreement, 1.0), rel=0.2)


@pytest.mark.slow
def test_unknown_lenses_add_to_the_error():
    known = adjusted(hulls_of())
    means = tuple(replace(b, T_world_camera=c.T_world_camera) for b, c in zip(blanks(CAMERAS), CAMERAS, strict=True))
    started = [replace(m, K=c.K) for m, c in zip(means, CAMERAS, strict=True)]
    unknown = adjusted(hulls_of(), UnknownLenses(means, ((0, 1, 2),)), started)
    assert volume_error(unknown, 1.0).expected_m > 2 * volume_error(known, 1.0).expected_m
    assert np.all(unknown.fit.focal_sigmas > 0)
    assert max(abs(c.distortion[0]) for c in unknown.cameras) > 0


def test_silhouettes_that_contradict_each_other_are_refused():
    with pytest.raises(
        CalibrationError, match=r"that agree to 4 px, found .* by \d+ px; check that they show the whole"
    ):
        adjusted(hulls_of(noise_px=12.0))
