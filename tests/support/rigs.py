"""Cameras that look at a point, for tests of calibrations."""

import numpy as np

from tracker.geometry import rigid
from tracker.geometry.cameras import Camera

K = np.array([[500.0, 0.0, 319.5], [0.0, 500.0, 239.5], [0.0, 0.0, 1.0]])


def looking(center, target=(0.0, 0.0, 1.0), roll=0.0, up=(0.0, 0.0, 1.0)):
    """Pose of a camera at a place that looks at a target, its picture upright but for a roll, radians."""
    center, z = np.asarray(center, float), np.asarray(target, float) - center
    z /= np.linalg.norm(z)
    x = np.cross(z, up)
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z], axis=1) @ rigid.so3_exp(np.array([0.0, 0.0, roll]))
    return rigid.transform(R, center)


def on_circle(angle, radius=4.0, height=1.5):
    return np.array([radius * np.cos(angle), radius * np.sin(angle), height])


def ring(n, radius=4.0, height=1.5, arc=2 * np.pi, target=(0.0, 0.0, 1.0)):
    """Poses of cameras on a circle, or on a part of it."""
    angles = 0.3 + arc * np.arange(n) / (n if arc > 6.28 else max(n - 1, 1))
    return [looking(on_circle(a, radius, height), target) for a in angles]


def cameras(Ts, distortion=(), size=(640, 480)):
    return [Camera(f"cam{i}", size, K, np.array(distortion, float), T) for i, T in enumerate(Ts)]
