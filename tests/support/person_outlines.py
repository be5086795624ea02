"""A person of spheres before cameras: exact convex hulls of silhouettes, with crown and feet."""

import cv2
import numpy as np
from filmed_people import NAMES, dancing

from tracker.calibration.self_calibration.person_silhouettes import PersonSilhouette

RADIUS_M = 0.08
_FEET = [i for i, n in enumerate(NAMES) if n.endswith("Ankle")]
_NECK, _HEAD_M = NAMES.index("Neck"), 0.2
"""The head is one more sphere above the neck, metres."""


def sphere_contour(camera, center, n=48):
    """Points of a sphere whose rays touch it, (n, 3)."""
    to_camera = camera.center_world - center
    distance = np.linalg.norm(to_camera)
    axis = to_camera / distance
    across = np.linalg.svd(axis[None])[2][1:]
    share = RADIUS_M / distance
    angles = 2 * np.pi * np.arange(n) / n
    ring = np.cos(angles)[:, None] * across[0] + np.sin(angles)[:, None] * across[1]
    return center + RADIUS_M * (share * axis + np.sqrt(1 - share**2) * ring)


def outlined(cameras, n_frames, seed=0, noise_px=0.0, reach=1.0):
    """Silhouettes of a person who walks and dances, by frame and camera, and the points of the body, (F, N, 3)."""
    points, random = dancing(n_frames, seed, reach), np.random.default_rng((seed, 11))
    up = np.array([0.0, 0.0, 1.0])
    points = np.concatenate([points, points[:, [_NECK]] + _HEAD_M * up], axis=1) + RADIUS_M * up
    rows = []
    for body in points:
        crown = body[-1] + [0, 0, RADIUS_M]
        feet = body[_FEET].mean(axis=0) * [1, 1, 0]
        row = []
        for camera in cameras:
            px = np.concatenate([camera.project(sphere_contour(camera, p)) for p in body])
            noisy = px + noise_px * random.normal(size=px.shape)
            hull = cv2.convexHull(noisy.astype(np.float32))[:, 0].astype(np.float64)
            ends = camera.project(np.stack([crown, feet])) + 4 * noise_px * random.normal(size=(2, 2))
            row.append(PersonSilhouette(hull, ends))
        rows.append(row)
    return rows, points
