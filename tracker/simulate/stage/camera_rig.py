"""The cameras of a simulated recording."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tracker.errors import TrackerError
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera
from tracker.simulate.stage.furniture import HALF_WIDTH_M

CORNER_NAMES = ("FRONT", "RIGHT", "BACK", "LEFT")
"""Four cameras in the corners, named for the side of the person that each sees."""
CORNER_DEGREES = (45.0, -45.0, -135.0, 135.0)
FIELD_OF_VIEW_DEGREES = 67.0
"""Field of view along the longer side: a camera turned upright keeps its lens."""
CORNER_HEIGHT_M = 2.2
WALL_HEIGHT_M = 2.5
"""Cameras along the walls look over the racks."""
WALL_GAP_M = 0.2
FISHEYE_FIELD_OF_VIEW_DEGREES = 120.0
"""As `FIELD_OF_VIEW_DEGREES`; that of wide action cameras."""
FISHEYE_COEFFICIENTS = (-0.01, 0.006, -0.004, 0.0005)
"""k1 to k4: some px off the ideal equidistant lens at the border of a picture of 640x480."""
ALL = "all"
TARGET_WORLD = (0.0, 0.0, 1.0)


def make_cameras(n_cameras: int, size: tuple[int, int], seed: int, fisheyes: Sequence[str] = ()) -> tuple[Camera, ...]:
    """Mount cameras along the walls of the room, looking at its middle.

    They are alike but not equal: aim, focal length, principal point and lens distortion differ a little.

    Args:
        n_cameras: 4 stand in the corners; other numbers are spread evenly around and named cam1, cam2, ...
        size: image width and height, px.
        seed: of the small differences.
        fisheyes: names of the cameras with a fisheye lens; `all` for all. They see wider than the others.

    Raises:
        TrackerError: no camera, an image too small to show a person, or a fisheye lens for no camera.
    """
    if n_cameras < 1:
        raise TrackerError(f"expected at least one camera to simulate, found {n_cameras}")
    if min(size) < 32 or size[0] % 2 or size[1] % 2:
        raise TrackerError(f"expected an even image width and height of at least 32 px, found {size[0]}x{size[1]}")
    rng = np.random.default_rng([seed, 2])
    degrees = CORNER_DEGREES if n_cameras == 4 else tuple(45.0 - 360.0 * i / n_cameras for i in range(n_cameras))
    names = CORNER_NAMES if n_cameras == 4 else tuple(f"cam{i + 1}" for i in range(n_cameras))
    height = CORNER_HEIGHT_M if n_cameras == 4 else WALL_HEIGHT_M
    unknown = sorted(set(fisheyes) - {*names, ALL})
    if unknown:
        raise TrackerError(
            f"expected a fisheye lens for {', '.join(names)} or {ALL}, found '{unknown[0]}'; name one of these"
        )
    mounted = [_mounted(name, np.radians(d), height, size, rng) for name, d in zip(names, degrees, strict=True)]
    return tuple(_with_fisheye(c) if {c.name, ALL} & set(fisheyes) else c for c in mounted)


def _with_fisheye(camera: Camera) -> Camera:
    """Return a camera with a fisheye lens instead of its own, and all else as it was."""
    K = camera.K.copy()
    K[[0, 1], [0, 1]] *= np.tan(np.radians(FIELD_OF_VIEW_DEGREES) / 2) / np.radians(FISHEYE_FIELD_OF_VIEW_DEGREES / 2)
    return replace(camera, K=K, distortion=np.array(FISHEYE_COEFFICIENTS), fisheye=True)


def _mounted(name: str, direction: float, height_m: float, size: tuple[int, int], rng: np.random.Generator) -> Camera:
    """Mount one camera where a direction from the middle of the room meets the walls."""
    out = np.array([np.cos(direction), np.sin(direction)])
    on_wall = out * (HALF_WIDTH_M - WALL_GAP_M) / np.max(np.abs(out))
    center = np.array([*on_wall, height_m + rng.uniform(-0.05, 0.05)])
    width, height = size
    focal = max(size) / 2 / np.tan(np.radians(FIELD_OF_VIEW_DEGREES) / 2) * rng.uniform(0.98, 1.02)
    middle = np.array([(width - 1) / 2, (height - 1) / 2]) + rng.uniform(-0.01, 0.01, 2) * width
    K = np.array([[focal, 0.0, middle[0]], [0.0, focal, middle[1]], [0.0, 0.0, 1.0]])
    distortion = np.array([rng.uniform(-0.06, -0.03), rng.uniform(0.0, 0.01), *rng.uniform(-3e-4, 3e-4, 2)])
    T_world_camera = _looking(center, np.array(TARGET_WORLD) + rng.uniform(-0.05, 0.05, 3), rng.uniform(-0.02, 0.02))
    return Camera(name, size, K, distortion, T_world_camera)


def _looking(center: Array, target: Array, roll: float) -> Array:
    """Return `T_world_camera` of a camera that looks at a target, turned by a small roll about its axis, rad."""
    z = (target - center) / np.linalg.norm(target - center)
    level = np.cross(z, (0.0, 0.0, 1.0))
    level /= np.linalg.norm(level)
    x = np.cos(roll) * level + np.sin(roll) * np.cross(z, level)
    T = np.eye(4)
    T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    T[:3, 3] = center
    return T
