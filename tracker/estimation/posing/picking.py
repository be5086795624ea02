"""Pick body parts with the pointer: their convex hulls in a view, and the touched point on their surface."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array, FloatArray
from tracker.geometry.cameras import NEAR_PLANE_M, Camera
from tracker.geometry.shapes import Shape


class PartHull(NamedTuple):
    """Convex hull of a part in a view, whatever occludes it."""

    body: int
    """Index of the body."""
    part: int
    """Index of the part."""
    depth_m: float
    """Depth of the part's centre along the optical axis, metres; of overlapping parts the nearest is picked."""
    polygon_px: FloatArray
    """Convex polygon, (n, 2), undistorted px."""


def part_hulls(bodies: Sequence[PosedBody], cameras: Sequence[Camera]) -> list[list[PartHull]]:
    """Return the hulls of all parts in some views, without parts before the near plane.

    All kinds of parts are practically convex, so the hull of the surface is their outline.
    """
    found: list[list[PartHull]] = [[] for _ in cameras]
    for b, body in enumerate(bodies):
        Ts = body.kinematics.Ts_world_part
        points = _surfaces(body.model) @ np.swapaxes(Ts[:, :3, :3], 1, 2) + Ts[:, None, :3, 3]
        for camera, out in zip(cameras, found, strict=True):
            depths, px = camera.depths(points), camera.project(points[:, 1:]).astype(np.float32)
            for part in np.flatnonzero(depths[:, 1:].min(axis=1) >= NEAR_PLANE_M):
                hull = cv2.convexHull(px[part]).reshape(-1, 2)
                out.append(PartHull(b, int(part), float(depths[part, 0]), hull))
    return found


def point_on_part(body: PosedBody, camera: Camera, part: int, pointer_px: Array) -> Array:
    """Return the point of a part that the pointer touches, (3,), in the part's frame, metres.

    If the line of sight just misses the part, this is the surface point nearest to the line.

    Args:
        body: the posed body.
        camera: the view.
        part: index of the part.
        pointer_px: undistorted px, (2,).
    """
    T_part_world = rigid.inverse(body.kinematics.Ts_world_part[part])
    start = rigid.apply(T_part_world, camera.center_world)
    ray = rigid.apply(T_part_world, camera.pinhole.back_project(np.asarray(pointer_px, dtype=np.float64), 1.0)) - start
    ray /= np.linalg.norm(ray)
    corners = _triangles(body.model.shapes[part]) + body.model.centers_part[part]  # (n, 3 corners, 3)
    # Intersection of the line with each triangle's plane, in barycentric coordinates (Moeller & Trumbore 1997).
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(ray, ac)
    det = np.einsum("ij,ij->i", ab, across)
    det = np.where(np.abs(det) < TINY**2, np.inf, det)
    from_a = start - corners[:, 0]
    turned = np.cross(from_a, ab)
    s, t = np.einsum("ij,ij->i", from_a, across) / det, turned @ ray / det
    far = np.einsum("ij,ij->i", ac, turned) / det
    hit = (s >= -TINY) & (t >= -TINY) & (s + t <= 1 + TINY) & (far > 0) & np.isfinite(det)
    if np.any(hit):
        return np.asarray(start + far[hit].min() * ray)
    points = corners[:, 0]
    along = (points - start) @ ray
    return np.asarray(points[np.argmin(np.linalg.norm(points - start - along[:, None] * ray, axis=1))])


@lru_cache(maxsize=32)
def _surfaces(model: BodyModel) -> Array:
    """Return the centre of each part, then points on its surface, (n_parts, 1 + n, 3), in the part's frame, metres."""
    surfaces = [shape.triangles().vertices for shape in model.shapes]
    return np.stack([np.vstack([c, s + c]) for s, c in zip(surfaces, model.centers_part, strict=True)])


@lru_cache(maxsize=256)
def _triangles(shape: Shape) -> Array:
    """Return the corners of a shape's triangles, (n, 3, 3), in its frame, metres."""
    vertices, faces = shape.triangles()
    return vertices[faces]
