"""Draw body parts into the cells of a view: the visible part of each cell, and its nearness.

Meshes are coarser than those of `label_image`, and faces seen from behind are skipped, because whole recordings and
hundreds of poses of a limb are drawn.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody, ahead
from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.evidence.contours.occluding_contours import part_poses
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, FloatArray, Image, Mask
from tracker.geometry.cameras import NEAR_PLANE_M, Camera

CELL_PX = 2
"""Side of a cell, working px. At 640x480 and 4 m a forearm is 4 cells wide, and an independent sample 4 cells."""


class CellView(NamedTuple):
    """The cells of a region of one view."""

    camera: Camera
    """Camera of the region, which projects to cells."""
    corner: tuple[int, int]
    """Column and row of the first cell among those of the whole view."""
    colors: Image
    """Mean colour of each cell, (h, w, 3) RGB."""
    ahead_frames: float = 0.0
    """Frames by which the picture was taken later than the frame."""


def cells_of(view: ViewEvidence) -> CellView | None:
    """Return the cells that lie in the region of a view; None without an image."""
    if view.colors is None:
        return None
    (u, v), (height, width) = view.corner_px, view.colors.shape[:2]
    left, top = -u % CELL_PX, -v % CELL_PX
    columns, rows = (width - left) // CELL_PX, (height - top) // CELL_PX
    if columns < 1 or rows < 1:
        return None
    box = (left, top, left + columns * CELL_PX, top + rows * CELL_PX)
    part = view.colors[box[1] : box[3], box[0] : box[2]]
    colors = cv2.resize(part, (columns, rows), interpolation=cv2.INTER_AREA)
    camera = view.camera.cropped(box).scaled(1 / CELL_PX)
    corner = ((u + left) // CELL_PX, (v + top) // CELL_PX)
    return CellView(camera, corner, np.asarray(colors, np.uint8), view.ahead_frames)


def cells_of_image(image: Image) -> Image:
    """Return the colours of the cells of a whole view, (H, W, 3), (h, w, 3)."""
    height, width = image.shape[0] // CELL_PX, image.shape[1] // CELL_PX
    part = image[: height * CELL_PX, : width * CELL_PX]
    return np.asarray(cv2.resize(part, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


_N_RINGS, _N_SECTORS = 8, 16
"""Cells of the mesh of a part. Chords around a thigh of 9 cm lie up to 2 mm inside it: a tenth of a cell."""


class Meshes(NamedTuple):
    """Triangles of the parts of some bodies, the same number for each part."""

    points: FloatArray
    """Corners in the coordinates of their part, (P, 3, n), metres."""
    faces: NDArray[np.int32]
    """Indices of the corners of each triangle within a part, counter-clockwise seen from outside, (F, 3)."""


_Face: TypeAlias = tuple[np.float32, ...]
"""Column, row and nearness of the first corner, from there to the second and the third one, and 1 / twice the area."""


class Canvas(NamedTuple):
    """Cells of a view with the parts that are drawn into them."""

    nearness: FloatArray
    """1 / depth of the visible surface, (h, w), 1/m; 0 without a part."""
    labels: NDArray[np.uint8]
    """1 + index of the visible part, counted through all bodies, (h, w); 0 for none."""


@lru_cache(maxsize=32)
def meshes_of(models: tuple[BodyModel, ...]) -> Meshes:
    """Return the meshes of the parts of some bodies; at most 255 parts in all."""
    parts = [(s, c) for m in models for s, c in zip(m.shapes, m.centers_part, strict=True)]
    assert len(parts) < 256, len(parts)
    surfaces = [shape.triangles(_N_RINGS, _N_SECTORS) for shape, _ in parts]
    points = [(s.vertices + center).T for s, (_, center) in zip(surfaces, parts, strict=True)]
    return Meshes(np.ascontiguousarray(points, np.float32), surfaces[0].faces.astype(np.int32))


def draw(meshes: Meshes, P: Array, Ts_world_part: Array, height: int, width: int) -> Canvas:
    """Draw parts, (n, 4, 4), metres, into a view with a projection, (3, 4), to its cells."""
    canvas = Canvas(np.zeros((height, width), np.float32), np.zeros((height, width), np.uint8))
    image = np.empty((meshes.points.shape[2], 3), np.float32)
    _draw(meshes.points, meshes.faces, (P @ Ts_world_part).astype(np.float32), image, canvas.nearness, canvas.labels)
    return canvas


def draw_bodies(bodies: Sequence[PosedBody], views: Sequence[CellView]) -> list[Canvas]:
    """Draw all bodies into views, where they are at the time of each picture."""
    meshes = meshes_of(tuple(b.model for b in bodies))
    poses = {time: part_poses(ahead(bodies, time)) for time in {v.ahead_frames for v in views}}
    return [draw(meshes, v.camera.projection, poses[v.ahead_frames], *v.colors.shape[:2]) for v in views]


def grown(canvas: Canvas, margin: float) -> Mask:
    """Return the cells within a margin, cells times metres, around what is drawn, at the depth of the nearest part."""
    radius = max(1, round(margin * float(canvas.nearness.max(initial=0.0))))
    mask = (canvas.labels > 0).view(np.uint8)
    return np.asarray(cv2.dilate(mask, np.ones((2 * radius + 1, 2 * radius + 1), np.uint8))) > 0


@njit(**NO_REFCOUNT)
def _draw(
    points: FloatArray, faces: NDArray[np.int32], to_px: FloatArray, image: FloatArray, nearness: FloatArray,
    labels: NDArray[np.uint8],
) -> None:  # fmt: skip
    """Draw parts with a depth test.

    Args:
        points: see `Meshes`.
        faces: see `Meshes`.
        to_px: from the coordinates of each part to homogeneous cells, (P, 3, 4).
        image: scratch, (n, 3).
        nearness: see `Canvas`.
        labels: see `Canvas`.
    """
    height, width = labels.shape
    for part in range(points.shape[0]):
        if not project_mesh(points[part], to_px[part], image):
            continue
        for f in range(faces.shape[0]):
            face, (top, bottom, left, right) = face_in_image(image, faces[f], width, height)
            for v in range(top, bottom):
                for u in range(left, right):
                    near = nearness_at(face, u, v)
                    if near > nearness[v, u]:
                        nearness[v, u] = near
                        labels[v, u] = part + 1


@njit(inline="always", **NO_REFCOUNT)
def face_in_image(
    image: FloatArray, corners: NDArray[np.int32], width: int, height: int
) -> tuple[_Face, tuple[int, int, int, int]]:
    """Return a face in an image, and the cells around it: first row and column, and those after the last.

    Args:
        image: columns, rows and 1 / depths of the corners of a part, (n, 3).
        corners: indices of those of the face, (3,).
        width: of the image.
        height: of the image.
    """
    ua, va, na = image[corners[0], 0], image[corners[0], 1], image[corners[0], 2]
    ub, vb, nb = image[corners[1], 0] - ua, image[corners[1], 1] - va, image[corners[1], 2] - na
    uc, vc, nc = image[corners[2], 0] - ua, image[corners[2], 1] - va, image[corners[2], 2] - na
    area = ub * vc - uc * vb
    if area >= 0.0:  # seen from behind: v points down
        return (ua, va, na, ub, vb, nb, uc, vc, nc, area), (0, 0, 0, 0)
    top = max(0.0, np.ceil(va + min(0.0, vb, vc)))
    bottom = min(height - 1.0, np.floor(va + max(0.0, vb, vc)))
    left = max(0.0, np.ceil(ua + min(0.0, ub, uc)))
    right = min(width - 1.0, np.floor(ua + max(0.0, ub, uc)))
    box = int(top), int(bottom) + 1, int(left), int(right) + 1
    return (ua, va, na, ub, vb, nb, uc, vc, nc, np.float32(1.0) / area), box


@njit(inline="always", **NO_REFCOUNT)
def nearness_at(face: _Face, u: int, v: int) -> np.float32:
    """Return the nearness of a face of an image at a cell; 0 beside it."""
    ua, va, na, ub, vb, nb, uc, vc, nc, share = face
    x, y = np.float32(u) - ua, np.float32(v) - va
    in_b, in_c = (x * vc - uc * y) * share, (ub * y - x * vb) * share
    is_within = in_b >= 0.0 and in_c >= 0.0 and in_b + in_c <= 1.0
    return na + in_b * nb + in_c * nc if is_within else np.float32(0.0)


@njit(**NO_REFCOUNT)
def project_mesh(points: FloatArray, to_px: FloatArray, image: FloatArray) -> bool:
    """Fill column, row and 1 / depth of the corners of a part, (n, 3), px and 1/m.

    Returns:
        Whether the whole part is beyond the near plane; else it is not drawn.
    """
    for k in range(points.shape[1]):
        x, y, z = points[0, k], points[1, k], points[2, k]
        w = to_px[2, 0] * x + to_px[2, 1] * y + to_px[2, 2] * z + to_px[2, 3]
        if w < NEAR_PLANE_M:
            return False
        near = np.float32(1.0) / w
        image[k, 0] = (to_px[0, 0] * x + to_px[0, 1] * y + to_px[0, 2] * z + to_px[0, 3]) * near
        image[k, 1] = (to_px[1, 0] * x + to_px[1, 1] * y + to_px[1, 2] * z + to_px[1, 3]) * near
        image[k, 2] = near
    return True
