"""Label each pixel with the body part that a camera sees there, by a depth buffer over all surfaces."""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.compute.jit import FAST_MATH, njit
from tracker.evidence.contours.occluding_contours import part_poses
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import NEAR_PLANE_M, Camera


class _Mesh(NamedTuple):
    """Triangles of all parts of some bodies."""

    points: NDArray[np.float32]
    """Corners in the coordinates of their part, (3, V), metres."""
    owners: NDArray[np.int32]
    """Index of the part of each corner, counted through all bodies, (V,)."""
    faces: NDArray[np.int32]
    """Indices of the corners of each triangle, (F, 3)."""


def part_labels(bodies: Sequence[PosedBody], camera: Camera) -> NDArray[np.uint8]:
    """Label the pixels that bodies cover, with occlusion by depth.

    Args:
        bodies: all bodies in the scene; at most 255 parts in all.
        camera: the view; its lens distortion is ignored (undistorted pixels).

    Returns:
        (H, W): 1 + the index of the visible part, counted through all bodies; 0 for none.
    """
    camera = camera.pinhole
    labels = np.zeros((camera.height, camera.width), np.uint8)
    if not bodies:
        return labels
    mesh = _mesh(tuple(b.model for b in bodies))
    T = camera.projection @ part_poses(bodies)  # (P, 3, 4), to homogeneous pixels
    nearness = np.zeros((camera.height, camera.width), np.float32)
    image = np.empty((mesh.points.shape[1], 3), np.float32)
    _project(T.astype(np.float32), mesh.points, mesh.owners, image)
    _fill(mesh.faces, mesh.owners, image, nearness, labels)
    return labels


@lru_cache(maxsize=8)
def _mesh(models: tuple[BodyModel, ...]) -> _Mesh:
    points, owners, faces, n = [], [], [], 0
    parts = [(s, c) for m in models for s, c in zip(m.shapes, m.centers_part, strict=True)]
    assert len(parts) < 256, len(parts)
    for part, (shape, center) in enumerate(parts):
        vertices, corners_of = shape.triangles()
        corners = vertices + center
        points.append(corners)
        owners.append(np.full(len(corners), part, np.int32))
        faces.append(corners_of.astype(np.int32) + n)
        n += len(corners)
    return _Mesh(
        np.ascontiguousarray(np.concatenate(points).T, np.float32), np.concatenate(owners), np.concatenate(faces)
    )


@njit(**FAST_MATH)
def _project(T: NDArray[np.float32], points: NDArray[np.float32], owners: NDArray[np.int32], image: Array) -> None:
    """Fill u, v and 1 / depth of each corner, px and 1/m; 1 / depth is 0 nearer than the near plane and behind the
    camera."""
    for k in range(points.shape[1]):
        p, x, y, z = owners[k], points[0, k], points[1, k], points[2, k]
        w = T[p, 2, 0] * x + T[p, 2, 1] * y + T[p, 2, 2] * z + T[p, 2, 3]
        if w < NEAR_PLANE_M:
            image[k, 2] = 0.0
            continue
        near = np.float32(1.0) / w
        image[k, 0] = (T[p, 0, 0] * x + T[p, 0, 1] * y + T[p, 0, 2] * z + T[p, 0, 3]) * near
        image[k, 1] = (T[p, 1, 0] * x + T[p, 1, 1] * y + T[p, 1, 2] * z + T[p, 1, 3]) * near
        image[k, 2] = near


@njit(**FAST_MATH)
def _fill(
    faces: NDArray[np.int32], owners: NDArray[np.int32], image: Array, nearness: NDArray[np.float32],
    labels: NDArray[np.uint8],
) -> None:  # fmt: skip
    """Draw the triangles with a depth test on 1 / depth, which is linear in the image of a plane."""
    height, width = labels.shape
    for f in range(faces.shape[0]):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ua, va, na = image[a, 0], image[a, 1], image[a, 2]
        ub, vb, nb = image[b, 0], image[b, 1], image[b, 2]
        uc, vc, nc = image[c, 0], image[c, 1], image[c, 2]
        if na == 0.0 or nb == 0.0 or nc == 0.0:
            continue
        area = (ub - ua) * (vc - va) - (uc - ua) * (vb - va)
        if area == 0.0:
            continue
        # A corner far outside the image would overflow an integer.
        top, bottom = max(0.0, min(va, vb, vc)), min(height - 1.0, max(va, vb, vc))
        left, right = max(0.0, min(ua, ub, uc)), min(width - 1.0, max(ua, ub, uc))
        if top > bottom or left > right:
            continue
        label, share = np.uint8(owners[a] + 1), 1.0 / area
        for v in range(int(np.ceil(top)), int(np.floor(bottom)) + 1):
            for u in range(int(np.ceil(left)), int(np.floor(right)) + 1):
                in_b = ((u - ua) * (vc - va) - (uc - ua) * (v - va)) * share
                in_c = ((ub - ua) * (v - va) - (u - ua) * (vb - va)) * share
                in_a = 1.0 - in_b - in_c
                if in_a >= 0.0 and in_b >= 0.0 and in_c >= 0.0:
                    near = in_a * na + in_b * nb + in_c * nc
                    if near > nearness[v, u]:
                        nearness[v, u] = near
                        labels[v, u] = label
