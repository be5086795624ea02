"""How the cameras of a session stand: distances to the point they look at, heights, a shared view, and oddities."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tracker.errors import CalibrationError, Remedy
from tracker.formats.anipose import MAX_OFFSET
from tracker.formats.calibrations.pose_conventions import FITS_DEG
from tracker.formats.model_toml import DEFAULT_HEIGHT_M
from tracker.geometry.arrays import Array
from tracker.geometry.camera_rig import MIN_APART_M, axes_point
from tracker.geometry.cameras import Camera
from tracker.geometry.ground_plane import UP_ROTATIONS
from tracker.geometry.lengths import USUAL_SIZES

_MIN_PERSON_SHARE = 0.04
"""Share of the picture's longer side that a person fills, below which no limb can be seen: 40 of 1000 pixels."""
_UNDER_FLOOR_M = 0.1
"""Depth of a camera below the floor above which it is noted, metres: the error of a floor that was set by hand."""
_AGREEMENT = 0.8
"""Mean cosine of the pictures' up direction and an axis above which the cameras stand upright to it (37 degrees)."""
_MAX_TANGENTIAL = 0.05
"""Largest tangential coefficient: at 45 degrees it moves a point by a seventh of the focal length. Radial ones are
often larger, and stand in its place where programs write k1, k2, k3, p1, p2."""


@dataclass(frozen=True, eq=False)
class RigSummary:
    """How calibrated cameras stand, in the world of their calibration."""

    names: tuple[str, ...]
    """Names of the cameras."""
    centers_world: Array
    """Optical centres, (N, 3), metres."""
    axes_world: Array
    """Optical axes, unit vectors, (N, 3)."""
    viewed_point_world: Array | None
    """The point at which all look, (3,), metres; None if they look at none, or are parallel."""
    distances_m: Array | None
    """Their distances to that point, (N,); None if there is none."""
    heights_m: Array
    """Their heights over the plane through the origin across `up`, (N,), metres."""
    sentence: str
    """Distances and heights in words."""
    doubts: tuple[str, ...]
    """Sentences on what is odd, such as cameras under the floor; usually empty."""


def summarize_rig(cameras: Sequence[Camera], up: str = "z") -> RigSummary:
    """Describe how cameras stand and look.

    Args:
        cameras: at least one.
        up: world axis that points up: x, y, z, -x, -y or -z. The floor is the plane through the origin across it.
    """
    Ts = np.array([c.T_world_camera for c in cameras])
    names = tuple(c.name for c in cameras)
    centers, axes = Ts[:, :3, 3], Ts[:, :3, 2]
    heights = centers @ UP_ROTATIONS[up][:, 2]
    point = axes_point([c.T_world_camera for c in cameras])
    meet = len(cameras) > 1 and point.is_determined and point.angles_rad.max() < np.radians(FITS_DEG)
    distances = point.distances if meet else None
    if distances is None:
        sentence = "The cameras look at no common point"
    else:
        sentence = f"The cameras stand {_interval(distances)} from the point at which they look"
    sentence += f"; their heights over the floor (origin, {up} up) are {_interval(heights)}."
    doubts = _far_doubts(cameras, distances) + _floor_doubts(names, centers, heights, up) + _up_doubts(Ts, up)
    doubts += _place_doubts(names, centers) + _lens_doubts(cameras)
    return RigSummary(
        names, centers, axes, point.position if meet else None, distances, heights, sentence, tuple(doubts)
    )


def check_shared_view(cameras: Sequence[Camera]) -> None:
    """Check that two cameras can see a person together.

    Two cameras, not at one place, must show a ball half as wide as the smallest person is tall, at usual distances.

    Raises:
        CalibrationError: there are several cameras, and no two of them can.
    """
    low, high = USUAL_SIZES["distance"]
    radius_m = USUAL_SIZES["person"].low / 4
    # Steps in depth are as long as a ball is wide where a lens of an unusually long focal length just holds it.
    depths_m = np.geomspace(low, high, 101)[:, None, None]
    corners = radius_m * np.array([*np.eye(3), *-np.eye(3)])
    for i, camera in enumerate(cameras):
        grid = np.stack(np.meshgrid(*(np.linspace(0, n - 1, 9) for n in camera.pinhole.size)), axis=-1)
        places = camera.pinhole.back_project(grid, depths_m).reshape(-1, 3)
        balls = places[_shows(camera, places), None] + corners
        balls = balls[_shows(camera, balls).all(axis=1)]
        for other in cameras[i + 1 :]:
            near = balls[np.linalg.norm(balls[:, 0] - other.center_world, axis=-1) < high]
            is_apart = np.linalg.norm(camera.center_world - other.center_world) >= MIN_APART_M
            if is_apart and _shows(other, near).all(axis=1).any():
                return
    if len(cameras) > 1:
        views = f"none of {len(cameras)}: they stand at one place or look at other ones; check their poses and the unit"
        raise CalibrationError.mismatch(
            "calibration", "two cameras that can see a person together", views, Remedy("any_size")
        )


def _shows(camera: Camera, points_world: Array) -> NDArray[np.bool_]:
    """Return whether the pictures of a camera show points, (..., 3)."""
    return camera.is_filmed(camera.pinhole.project(points_world))


def _interval(values_m: Array) -> str:
    low, high = (f"{round(float(value), 2) + 0.0:.2f}" for value in (values_m.min(), values_m.max()))
    return f"{low} m" if low == high else f"{low} to {high} m"


def _far_doubts(cameras: Sequence[Camera], distances_m: Array | None) -> list[str]:
    """Doubt the unit where a person at the viewed point would be too small to be seen."""
    if distances_m is None:
        return []
    focal_px = np.array([c.K[1, 1] for c in cameras])
    heights_px = float(np.median(focal_px * DEFAULT_HEIGHT_M / distances_m))
    if heights_px >= _MIN_PERSON_SHARE * float(np.median([max(c.size) for c in cameras])):
        return []
    return [
        f"At {np.median(distances_m):.0f} m a person would be {heights_px:.0f} pixels high in the pictures: check the "
        "unit of the calibration. It may count squares of its board, or another unit than metres."
    ]


def _floor_doubts(names: Sequence[str], centers_world: Array, heights_m: Array, up: str) -> list[str]:
    below = [name for name, height in zip(names, heights_m, strict=True) if height < -_UNDER_FLOOR_M]
    # If a camera is the origin, the calibration knows no floor.
    if not below or np.linalg.norm(centers_world, axis=1).min() < _UNDER_FLOOR_M:
        return []
    return [
        f"Under the floor (origin, {up} up): {', '.join(below)}. Another axis may point up, or the origin does not lie "
        "on the floor."
    ]


def _place_doubts(names: Sequence[str], centers_world: Array) -> list[str]:
    """Doubt cameras that stand at one place, as copied poses do."""
    apart = np.linalg.norm(centers_world[:, None] - centers_world, axis=-1)
    if apart.max() < USUAL_SIZES["distance"].low:  # another unit, which is noted, or a stereo pair
        return []
    return [
        f"Cameras '{names[i]}' and '{names[j]}' stand {100 * apart[i, j]:.2g} cm apart: check that the pose of one is "
        "not a copy of the other's."
        for i, j in combinations(range(len(names)), 2)
        if apart[i, j] < MIN_APART_M
    ]


def _lens_doubts(cameras: Sequence[Camera]) -> list[str]:
    """Doubt principal points and tangential distortion that no usual lens has."""
    offsets = [np.abs((c.K[:2, 2] + 0.5) / c.size - 0.5).max() for c in cameras]
    tangential = [0.0 if c.fisheye else np.abs(np.append(c.distortion[2:4], 0.0)).max() for c in cameras]
    aside = [f"'{c.name}'" for c, offset in zip(cameras, offsets, strict=True) if offset > MAX_OFFSET]
    strong = [f"'{c.name}'" for c, size in zip(cameras, tangential, strict=True) if size > _MAX_TANGENTIAL]
    doubts = []
    if aside:
        doubts.append(
            f"The principal point lies far from the middle of the pictures of {', '.join(aside)}: check that the "
            "matrix of the lens is of pictures of this size, in pixels from their corner."
        )
    if strong:
        doubts.append(
            f"The tangential distortion of {', '.join(strong)} is up to {max(tangential):.2g}, that of no usual lens: "
            "check that the coefficients are in OpenCV's order k1, k2, p1, p2, k3."
        )
    return doubts


def _up_doubts(Ts_world_camera: Array, up: str) -> list[str]:
    """Doubt the up axis where the upper sides of all pictures point along another one."""
    cosines = {name: float(np.mean(-Ts_world_camera[:, :3, 1] @ R[:, 2])) for name, R in UP_ROTATIONS.items()}
    best = max(cosines, key=lambda name: cosines[name])
    if best == up or cosines[best] < _AGREEMENT:
        return []
    return [f"The upper sides of the pictures point along {best}, not {up}: check which axis points up."]
