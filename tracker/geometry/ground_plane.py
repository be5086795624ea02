"""The ground plane in the calibration's world, and the up direction."""

from dataclasses import dataclass

import numpy as np

from tracker.errors import TrackerError
from tracker.geometry.arrays import TINY, Array
from tracker.geometry.rigid import so3_exp

MIN_HEIGHT_M = 0.2
"""Three points whose triangle is flatter do not determine a plane: a click a few cm off would tilt it."""


@dataclass(frozen=True, eq=False)
class GroundPlane:
    """A plane: the points x with `normal . x = offset_m`."""

    normal: Array
    """Unit vector that points up, (3,), world."""
    offset_m: float
    """Distance of the plane from the world's origin along the normal, metres."""

    @property
    def origin_world(self) -> Array:
        """The point of the plane nearest to the world's origin, (3,), metres."""
        return self.offset_m * self.normal

    def turned(self, R_world_up: Array) -> Array:
        """Rotate a rotation whose z axis points roughly up, (3, 3), by the smallest angle that makes it point up."""
        axis = np.cross(R_world_up[:, 2], self.normal)
        sine, cosine = float(np.linalg.norm(axis)), float(R_world_up[:, 2] @ self.normal)
        # Upside down, all axes across are equally good.
        direction = axis / sine if sine > TINY else R_world_up[:, 0]
        return np.asarray(so3_exp(np.arctan2(sine, cosine) * direction) @ R_world_up)


def floor_through(points_world: Array, centers_world: Array) -> GroundPlane:
    """Fit a plane to three points, with its upper side towards the cameras.

    Args:
        points_world: (3, 3), metres.
        centers_world: centres of the cameras, (N, 3), metres; their mean lies above the floor.

    Raises:
        TrackerError: the points lie almost on a line.
    """
    a, b, c = points_world
    sides = np.linalg.norm([b - a, c - b, a - c], axis=1)
    across = np.cross(b - a, c - a)
    height_m = float(np.linalg.norm(across) / max(sides.max(), TINY))
    if height_m < MIN_HEIGHT_M:
        raise TrackerError(
            f"expected three points of the floor that span a wide triangle, found them within {100 * height_m:.0f} cm "
            "of a line; choose one farther to the side"
        )
    normal = across / np.linalg.norm(across)
    if np.mean(centers_world @ normal) < float(normal @ a):
        normal = -normal
    return GroundPlane(normal, float(normal @ np.mean(points_world, axis=0)))


def nearest_axis(normal: Array) -> str:
    """Return the world axis nearest to a direction: x, y or z, with a minus sign for the opposite direction."""
    index = int(np.argmax(np.abs(normal)))
    return ("-" if normal[index] < 0 else "") + "xyz"[index]


UP_ROTATIONS = {
    "z": np.diag([1.0, 1.0, 1.0]),
    "-z": np.diag([1.0, -1.0, -1.0]),
    "y": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "-y": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
    "x": np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]]),
    "-x": np.array([[0, 0, -1.0], [0, 1, 0], [1, 0, 0]]),
}
"""Rotations from the body's z axis to the world axis that points up."""


def up_rotation(up: str, floor: GroundPlane | None) -> Array:
    """Return a rotation whose z axis points up from the floor, (3, 3).

    Args:
        up: world axis that points up, or is nearest to it.
        floor: the plane set by a person; None for the plane through the world's origin.
    """
    return UP_ROTATIONS[up] if floor is None else floor.turned(UP_ROTATIONS[up])


def floor_plane(up: str, floor: GroundPlane | None) -> GroundPlane:
    """Return the floor of a session.

    Args:
        up: world axis that points up, or is nearest to it.
        floor: the plane set by a person; None for the plane through the world's origin.
    """
    return GroundPlane(UP_ROTATIONS[up][:, 2], 0.0) if floor is None else floor
