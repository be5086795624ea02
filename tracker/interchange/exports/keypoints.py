"""Keypoints of the people in a view, in the pixels of the footage, with occlusion by all bodies."""

from collections.abc import Sequence
from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody, ahead
from tracker.evidence.contours.part_edges import points_occluded
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import Camera

_SILHOUETTE_PX = 400
"""Longer side of the mask in which the area of a silhouette is counted, px."""


class KeypointFlag(IntEnum):
    """COCO's visibility flags."""

    ABSENT = 0
    OCCLUDED = 1
    VISIBLE = 2


class Keypoints(NamedTuple):
    """A body in a view."""

    points_px: Array
    """Its joint centres in the order of `BodyModel.point_names`, (n, 2), original px; NaN where the lens shows none."""
    visibility: NDArray[np.int64]
    """A `KeypointFlag` for each, (n,). A point outside the image is absent."""
    box_px: tuple[float, float, float, float] | None
    """x, y, width, height of the body within the image; None if it is outside."""
    area_px: float
    """Area of its silhouette within the image, px^2."""


def keypoints_in_views(
    bodies: Sequence[PosedBody], cameras: Sequence[Camera], times: Sequence[float] = ()
) -> list[list[Keypoints]]:
    """Return the keypoints of each body in each view, by view.

    Args:
        bodies: all bodies in the scene.
        cameras: the views, with their lens distortion.
        times: frames by which the picture of each view was taken later than the frame; 0 by default. The bodies are
            where their velocities bring them by then.
    """
    out: dict[int, list[Keypoints]] = {}
    for time in dict.fromkeys(times or [0.0]):
        group = [i for i in range(len(cameras)) if not times or times[i] == time]
        found = _at_one_time(ahead(bodies, time), [cameras[i] for i in group])
        out |= dict(zip(group, found, strict=True))
    return [out[i] for i in range(len(cameras))]


def _at_one_time(bodies: Sequence[PosedBody], cameras: Sequence[Camera]) -> list[list[Keypoints]]:
    points = np.concatenate([b.joint_centers_world for b in bodies])
    occluded = points_occluded(bodies, [c.pinhole for c in cameras], points)
    ends = np.cumsum([len(b.points_world) for b in bodies])[:-1]
    out = []
    for camera, hidden in zip(cameras, occluded, strict=True):
        of_bodies = zip(
            bodies, np.split(project_through_lens(camera, points), ends), np.split(hidden, ends), strict=True
        )
        out.append([_keypoints(body, camera, px, behind) for body, px, behind in of_bodies])
    return out


def project_through_lens(camera: Camera, points_world: Array) -> Array:
    """Project world points, (n, 3), to original pixels, (n, 2); NaN behind the camera and where no lens shows them."""
    ideal_px = camera.pinhole.project(points_world)
    return np.where(camera.within_lens(ideal_px)[:, None], camera.distort_points(ideal_px), np.nan)


def _keypoints(body: PosedBody, camera: Camera, points_px: Array, occluded: NDArray[np.bool_]) -> Keypoints:
    visibility = np.where(occluded, KeypointFlag.OCCLUDED, KeypointFlag.VISIBLE)
    visibility[~_within(points_px, camera)] = KeypointFlag.ABSENT
    surface, ends = _surface_world(body)
    surface_px = project_through_lens(camera, surface)
    known = np.isfinite(surface_px).all(axis=-1)
    if not _within(surface_px, camera).any():
        return Keypoints(points_px, visibility, None, 0.0)
    low = np.maximum(surface_px[known].min(axis=0), -0.5)
    high = np.minimum(surface_px[known].max(axis=0), np.array(camera.size) - 0.5)
    box = (float(low[0]), float(low[1]), float(high[0] - low[0]), float(high[1] - low[1]))
    parts = zip(np.split(surface_px, ends), np.split(known, ends), strict=True)
    return Keypoints(points_px, visibility, box, _area([px[shown] for px, shown in parts], box))


def _area(part_points_px: Sequence[Array], box: tuple[float, float, float, float]) -> float:
    """Return the area of parts within a box, px^2. Parts are convex, so each covers the hull of its points, (n, 2)."""
    x, y, width, height = box
    scale = _SILHOUETTE_PX / max(width, height, 1.0)
    mask = np.zeros((max(1, round(height * scale)), max(1, round(width * scale))), np.uint8)
    for points in part_points_px:
        if len(points):
            at = (points - (x, y)) * scale - 0.5
            cv2.fillConvexPoly(mask, cv2.convexHull(np.round(16 * at).astype(np.int32)), (1,), shift=4)
    return max(1.0, float(cv2.countNonZero(mask)) / mask.size * width * height)


def _within(points_px: Array, camera: Camera) -> NDArray[np.bool_]:
    """Return whether points, (n, 2), are within the image, whose pixels reach half a pixel beyond their centres."""
    with np.errstate(invalid="ignore"):
        return np.asarray(((points_px >= -0.5) & (points_px < np.array(camera.size) - 0.5)).all(axis=-1))


def _surface_world(body: PosedBody) -> tuple[Array, IntArray]:
    """Return points of the surface of a body, (n, 3), metres, and where those of each part but the last end."""
    points_part, owners, ends = _surface(body.model)
    Ts = body.kinematics.Ts_world_part[owners]
    return np.einsum("nij,nj->ni", Ts[:, :3, :3], points_part) + Ts[:, :3, 3], ends


@lru_cache(maxsize=8)
def _surface(model: BodyModel) -> tuple[Array, IntArray, IntArray]:
    """Return points of the surface of a body in their parts' frames, (n, 3), metres, their parts, and these ends."""
    shapes = zip(model.shapes, model.centers_part, strict=True)
    parts = [shape.triangles().vertices + center for shape, center in shapes]
    counts = [len(points) for points in parts]
    return np.concatenate(parts), np.repeat(np.arange(len(parts)), counts), np.cumsum(counts)[:-1]
