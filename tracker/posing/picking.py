"""Parts of bodies under a pointer: their outlines in a view, and the place on their surface that it touches."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.cameras import NEAR_PLANE_M, Camera
from tracker.geometry.shapes import Shape

_RINGS, _SECTORS = 10, 20
"""Fineness of an outline: it is within some 1% of the part's girth."""


class PartHull(NamedTuple):
    """Where a view shows a part, whatever hides it."""

    body: int
    """Index of the body."""
    part: int
    """Index of the part."""
    depth_m: float
    """Distance of the part's centre along the optical axis: of parts that overlap the nearest is meant."""
    polygon_px: FloatArray
    """Convex outline, (n, 2), undistorted px."""


def part_hulls(bodies: Sequence[PosedBody], cameras: Sequence[Camera]) -> list[list[PartHull]]:
    """Outlines of all parts in some views; those too near to the camera, or behind it, are left out.

    All kinds of parts are convex, or so nearly that nobody sees it: the hull of the surface is the outline.
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


def place_on_part(body: PosedBody, camera: Camera, part: int, pointer_px: Array) -> Array:
    """The place on a part that a pointer touches, (3,), in the part's frame, metres.

    Where the line of sight just misses the part, as it may along its outline, it is the place nearest to the line.

    Args:
        body: with its pose.
        camera: the view.
        part: index of the part.
        pointer_px: undistorted px, (2,).
    """
    T_part_world = rigid.inverse(body.kinematics.Ts_world_part[part])
    start = rigid.apply(T_part_world, camera.center_world)
    ray = rigid.apply(T_part_world, camera.pinhole.back_project(np.asarray(pointer_px, dtype=np.float64), 1.0)) - start
    ray /= np.linalg.norm(ray)
    corners = _triangles(body.model.shapes[part]) + body.model.centers_part[part]  # (n, 3 corners, 3)
    # Where the line meets each triangle's plane, in the triangle's own coordinates (Moeller & Trumbore 1997).
    ab, ac = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(ray, ac)
    det = np.einsum("ij,ij->i", ab, across)
    det = np.where(np.abs(det) < 1e-15, np.inf, det)
    from_a = start - corners[:, 0]
    turned = np.cross(from_a, ab)
    s, t = np.einsum("ij,ij->i", from_a, across) / det, turned @ ray / det
    far = np.einsum("ij,ij->i", ac, turned) / det
    hit = (s >= -1e-9) & (t >= -1e-9) & (s + t <= 1 + 1e-9) & (far > 0) & np.isfinite(det)
    if np.any(hit):
        return np.asarray(start + far[hit].min() * ray)
    points = corners[:, 0]
    along = (points - start) @ ray
    return np.asarray(points[np.argmin(np.linalg.norm(points - start - along[:, None] * ray, axis=1))])


@lru_cache(maxsize=32)
def _surfaces(model: BodyModel) -> Array:
    """The centre of each part, then points on its surface, (n_parts, 1 + n, 3), in the part's frame, metres."""
    surfaces = [shape.triangles(_RINGS, _SECTORS).vertices for shape in model.shapes]
    return np.stack([np.vstack([c, s + c]) for s, c in zip(surfaces, model.centers_part, strict=True)])


@lru_cache(maxsize=256)
def _triangles(shape: Shape) -> Array:
    """Corners of a shape's triangles, (n, 3, 3), in its frame, metres."""
    vertices, faces = shape.triangles()
    return vertices[faces]
