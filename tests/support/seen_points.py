"""Simulated points that cameras see, with noise and gross errors, and cameras that were moved since."""

import numpy as np
import rigs

from tracker.calibration.check.rig_adjustment import Observations
from tracker.geometry.camera_derivatives import POSE, moved_camera, n_camera_parameters

DISTORTION = (-0.2, 0.05, 0.001, -0.001, 0.01)


def cloud(n, seed=0, size=(0.8, 0.8, 0.9)):
    """Points around the middle of a rig, (n, 3), metres."""
    return np.array([0.0, 0.0, 1.0]) + np.random.default_rng(seed).uniform(-1, 1, (n, 3)) * size


def seen_points(cameras, points, sigma_px=0.5, gross=0.0, seed=0):
    """Observations of points: all that lie in their pictures; a share of the places is grossly wrong."""
    random, of_gross = np.random.default_rng(seed), np.random.default_rng((seed, 1))
    rows = []
    for i, camera in enumerate(cameras):
        px = camera.project(points)
        inside = np.flatnonzero(np.all((px >= 0) & (px < np.array(camera.size)), axis=1))
        px = px[inside] + sigma_px * random.normal(size=(len(inside), 2))
        wrong = of_gross.random(len(inside)) < gross
        px[wrong] += of_gross.normal(scale=60, size=(int(wrong.sum()), 2))
        rows.append((np.full(len(inside), i), inside, px))
    return Observations(*(np.concatenate(column) for column in zip(*rows, strict=True)))


def moved_rig(cameras, seed=0, degrees=0.5, metres=0.02):
    """The same cameras, each moved a little in a random direction."""
    random = np.random.default_rng(seed)
    out = []
    for camera in cameras:
        step = np.zeros(n_camera_parameters(camera))
        step[POSE] = random.normal(size=6) * ([np.radians(degrees)] * 3 + [metres] * 3)
        out.append(moved_camera(camera, step))
    return out


def ring_of(n=4):
    """Cameras on a circle, with distortion."""
    return rigs.cameras(rigs.ring(n), DISTORTION)
