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


def random_rig(rng, kind):
    """Poses of cameras that look beside one point by up to 12 degrees, in a world of any orientation."""
    n, radius, height = int(rng.integers(3, 9)), rng.uniform(2, 6), rng.uniform(0.5, 3)
    beside_m = 2.0 * np.tan(np.radians(rng.choice([0, 3, 8, 12])))
    if kind in ("ring", "turned by 90 degrees"):
        places = [
            on_circle(2 * np.pi * i / n + rng.normal() / 10, radius * rng.uniform(0.8, 1.2), height) for i in range(n)
        ]
    elif kind == "arc":
        span = rng.uniform(0.7, 2.5)
        places = [on_circle(span * i / (n - 1) + rng.normal() / 20, radius, height) for i in range(n)]
    elif kind == "corners":
        places = [np.array([x, y, height]) for x in (-radius, radius) for y in (-0.7 * radius, 0.7 * radius)]
    elif kind == "row":
        places = [np.array([x, -radius, height]) for x in np.linspace(-2, 2, n)]
    else:
        places = [on_circle(a, radius * rng.uniform(0.8, 1.2), height) for a in (0.0, rng.uniform(0.3, 2.5))]
    rolls = (
        rng.choice([0, 0.5, 1, 1.5], len(places)) * np.pi
        if kind.startswith("turned")
        else rng.normal(size=len(places)) * 0.03
    )
    world = rigid.transform(rigid.so3_exp(2 * rng.normal(size=3)), rng.normal(size=3))
    return [
        world @ looking(place, np.array([0, 0, 1]) + rng.normal(size=3) * beside_m, roll)
        for place, roll in zip(places, rolls, strict=True)
    ]
