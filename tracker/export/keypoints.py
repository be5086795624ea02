"""Keypoints of the people in a view, in the pixels of the footage, with occlusion by all bodies."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.contours.label_image import part_labels
from tracker.contours.part_edges import points_occluded
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera

ABSENT, OCCLUDED, VISIBLE = 0, 1, 2
"""COCO's visibility flags."""
_RINGS, _SECTORS = 12, 16
_SILHOUETTE_PX = 320
"""Longer side of the image in which the area of a silhouette is counted, px."""
_FOLD_PX = 1.0


class Keypoints(NamedTuple):
    """A body in a view."""

    points_px: Array
    """Its points in the order of `BodyModel.point_names`, (n, 2), original px; NaN where the lens shows none."""
    visibility: NDArray[np.int64]
    """ABSENT, OCCLUDED or VISIBLE, (n,). A point outside the image is absent."""
    box_px: tuple[float, float, float, float] | None
    """x, y, width, height of the body within the image; None if it is outside."""
    area_px: float
    """Area of its silhouette within the image, px^2."""


def keypoints_in_views(bodies: Sequence[PosedBody], cameras: Sequence[Camera]) -> list[list[Keypoints]]:
    """Return the keypoints of each body in each view, by view.

    Args:
        bodies: all bodies in the scene.
        cameras: the views, with their lens distortion.
    """
    points = np.concatenate([b.points_world for b in bodies])
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
    """Project world points, (n, 3), to original pixels, (n, 2); NaN behind the camera and beyond the lens.

    The polynomial of the distortion holds within the image only. Far outside it bends back, and would show points
    inside the image that no lens shows there.
    """
    ideal_px = camera.pinhole.project(points_world)
    points_px = camera.project(points_world)
    if camera.is_pinhole:
        return points_px
    known = np.isfinite(points_px).all(axis=-1)
    back_px = np.full_like(points_px, np.inf)
    back_px[known] = camera.undistort_points(points_px[known])
    with np.errstate(invalid="ignore"):
        folded = ~np.asarray((np.abs(back_px - ideal_px) < _FOLD_PX).all(axis=-1))
    return np.where(folded[:, None], np.nan, points_px)


def _keypoints(body: PosedBody, camera: Camera, points_px: Array, occluded: NDArray[np.bool_]) -> Keypoints:
    visibility = np.where(occluded, OCCLUDED, VISIBLE)
    visibility[~_within(points_px, camera)] = ABSENT
    surface_px = project_through_lens(camera, _surface_world(body))
    surface_px = surface_px[np.isfinite(surface_px).all(axis=-1)]
    if not len(surface_px) or not _within(surface_px, camera).any():
        return Keypoints(points_px, visibility, None, 0.0)
    low = np.maximum(surface_px.min(axis=0), -0.5)
    high = np.minimum(surface_px.max(axis=0), np.array(camera.size) - 0.5)
    box = (float(low[0]), float(low[1]), float(high[0] - low[0]), float(high[1] - low[1]))
    small = camera.pinhole.scaled(min(1.0, _SILHOUETTE_PX / max(camera.size)))
    share = np.count_nonzero(part_labels([body], small)) / (small.width * small.height)
    return Keypoints(points_px, visibility, box, max(1.0, float(share * camera.width * camera.height)))


def _within(points_px: Array, camera: Camera) -> NDArray[np.bool_]:
    """Return whether points, (n, 2), are within the image, whose pixels reach half a pixel beyond their centres."""
    with np.errstate(invalid="ignore"):
        return np.asarray(((points_px >= -0.5) & (points_px < np.array(camera.size) - 0.5)).all(axis=-1))


def _surface_world(body: PosedBody) -> Array:
    """Return points of the surface of a body, (n, 3), metres."""
    Ts = body.kinematics.Ts_world_part
    return np.concatenate([rigid.apply(T, p) for T, p in zip(Ts, _surface_parts(body.model), strict=True)])


@lru_cache(maxsize=8)
def _surface_parts(model: BodyModel) -> tuple[Array, ...]:
    """Return points of the surface of each part in the part's frame, (n, 3) each, metres."""
    shapes = zip(model.shapes, model.centers_part, strict=True)
    return tuple(shape.triangles(_RINGS, _SECTORS)[0] + center for shape, center in shapes)
