"""Silhouettes of solids of known size, seen from cameras all around."""

import numpy as np

from tracker.evidence.silhouettes import ViewSilhouette
from tracker.geometry import rigid
from tracker.geometry.cameras import Camera

SIZE = (320, 240)
DISTANCE_M = 4.0
UPRIGHT = np.eye(3)


def cameras_around(n, lens=(), middle=(0.0, 0.0, 0.0), focal=900.0, size=SIZE):
    """Cameras spread over a sphere about a point, looking at it."""
    found = []
    for i in range(n):
        z = 1 - 2 * (i + 0.5) / n
        turn = i * np.pi * (3 - np.sqrt(5))
        out = np.array([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z])
        right = np.cross([0.0, 0.0, 1.0], out)
        right /= np.linalg.norm(right)
        R = np.column_stack([right, np.cross(-out, right), -out])
        K = np.array([[focal, 0, (size[0] - 1) / 2], [0, focal, (size[1] - 1) / 2], [0, 0, 1]])
        T = rigid.transform(R, np.asarray(middle) + DISTANCE_M * out)
        found.append(Camera(f"c{i}", size, K, np.array(lens), T))
    return found


def silhouettes_of(solids, cameras):
    """Silhouettes of a union of solids: functions from origins and directions of rays, (N, 3), to hits, (N,)."""
    found = []
    for camera in cameras:
        u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
        rays = camera.rays(np.stack([u, v], axis=-1).reshape(-1, 2).astype(float))
        origins = np.broadcast_to(camera.center_world, rays.shape)
        mask = np.any([solid(origins, rays) for solid in solids], axis=0).reshape(camera.height, camera.width)
        found.append(ViewSilhouette(mask, camera, 1.0, "mask"))
    return found


def ellipsoid(center, half_axes, R=UPRIGHT):
    def hit(origins, rays):
        o, d = ((x @ R) / half_axes for x in (origins - np.asarray(center), rays))
        a, b, c = (d * d).sum(1), (o * d).sum(1), (o * o).sum(1) - 1
        return b * b - a * c > 0

    return hit


def cylinder(center, half_axes, R=UPRIGHT):
    """An elliptical cylinder along the z axis of its frame."""

    def hit(origins, rays):
        o, d = ((x @ R) / half_axes for x in (origins - np.asarray(center), rays))
        a, b, c = (d[:, :2] ** 2).sum(1), (o[:, :2] * d[:, :2]).sum(1), (o[:, :2] ** 2).sum(1) - 1
        root = b * b - a * c
        reach = np.sqrt(np.maximum(root, 0))
        across = np.sort(np.stack([(-1 - o[:, 2]) / d[:, 2], (1 - o[:, 2]) / d[:, 2]]), axis=0)
        first, last = np.maximum((-b - reach) / a, across[0]), np.minimum((-b + reach) / a, across[1])
        return (root > 0) & (first < last)

    return hit
