"""Places for another camera: candidate positions around a person, judged by the standard deviations."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from tracker.body.model import PosedBody
from tracker.estimation.fitting.observability import ContourNoise, Observability, observe_pose, view_information
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera

N_DIRECTIONS = 16
"""Directions around the person in which cameras are tried."""
ELEVATIONS_RAD = tuple(float(np.radians(d)) for d in (0.0, 30.0, 60.0))
"""Their elevations above the horizon of the person's middle."""


class AddedCamera(NamedTuple):
    """Information that one more camera would add on a person."""

    camera: Camera
    """The camera, which looks at the person."""
    direction_rad: float
    """Its direction around the vertical, from the first horizontal axis of the world."""
    elevation_rad: float
    """Its elevation above the person's middle."""
    mean_before: float
    """Mean standard deviation of the angles with the present views, rad."""
    mean_after: float
    """The same with this camera."""
    largest_before: float
    """Largest standard deviation of an angle with the present views, rad."""
    largest_after: float
    """The same with this camera."""
    gains: Array
    """Drop of the standard deviation of each degree of freedom, mean over the frames, (n_dofs,), rad or metres."""


def rank_added_cameras(
    frames: Sequence[Sequence[PosedBody]],
    cameras: Sequence[Camera],
    up: Array,
    person: int = 0,
    noise: ContourNoise | None = None,
) -> list[AddedCamera]:
    """Rank positions of one more camera by the mean standard deviation of the angles, the best one first.

    Candidates stand on a dome around the person at the mean distance of the present cameras, with the image and the
    focal length of the first one.

    Args:
        frames: the bodies of each frame, in their poses.
        cameras: the present views, in working pixels.
        up: unit vector of the world that points up, (3,).
        person: index of the person.
        noise: of the contours.
    """
    middle = np.mean([f[person].points_world.mean(axis=0) for f in frames], axis=0)
    distance_m = float(np.mean([np.linalg.norm(c.center_world - middle) for c in cameras]))
    before = [observe_pose(f, cameras, person, noise) for f in frames]
    out = []
    for elevation in ELEVATIONS_RAD:
        for direction in np.arange(N_DIRECTIONS) * (2 * np.pi / N_DIRECTIONS):
            camera = _camera_at(cameras[0], middle, distance_m, up, float(direction), elevation)
            after = [_with(o, f, camera, person, noise) for o, f in zip(before, frames, strict=True)]
            out.append(_compared(camera, float(direction), elevation, before, after))
    return sorted(out, key=lambda c: c.mean_after)


def _with(
    found: Observability, bodies: Sequence[PosedBody], camera: Camera, person: int, noise: ContourNoise | None
) -> Observability:
    """Return the observability with one more view."""
    own, more = found.information, view_information(bodies, [camera], person, noise or ContourNoise())
    both = own._replace(
        cameras=own.cameras + more.cameras,
        matrices=np.concatenate([own.matrices, more.matrices]),
        lengths_px=np.concatenate([own.lengths_px, more.lengths_px]),
    )
    return replace(found, information=both)


def _compared(
    camera: Camera, direction: float, elevation: float, before: Sequence[Observability], after: Sequence[Observability]
) -> AddedCamera:
    angles = ~before[0].model.dof_is_length
    old, new = (np.array([o.sigmas for o in found]) for found in (before, after))
    return AddedCamera(
        camera, direction, elevation, float(old[:, angles].mean()), float(new[:, angles].mean()),
        float(old[:, angles].max(axis=1).mean()), float(new[:, angles].max(axis=1).mean()), (old - new).mean(axis=0),
    )  # fmt: skip


def _camera_at(like: Camera, middle: Array, distance_m: float, up: Array, direction: float, elevation: float) -> Camera:
    """Return a camera like another one on a dome around a point, upright and looking at it."""
    first = np.eye(3)[int(np.argmin(np.abs(up)))]
    if abs(up[0]) < 0.5:
        first = np.array([1.0, 0.0, 0.0])
    first = first - (first @ up) * up
    first /= np.linalg.norm(first)
    second = np.cross(up, first)
    level = np.cos(direction) * first + np.sin(direction) * second
    outward = np.cos(elevation) * level + np.sin(elevation) * up
    z = -outward
    x = np.cross(z, up)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.stack([x, np.cross(z, x), z], axis=1), middle + distance_m * outward
    return replace(like.pinhole, name="added", T_world_camera=T)
