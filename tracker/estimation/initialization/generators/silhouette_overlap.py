"""Measure how well bodies in many poses fill the silhouettes of one person: an overlap with soft borders.

The views are reduced to cells of a voxel's size at the person. A cell of the silhouette that a body leaves empty
costs, and so does a cell beside the silhouette that a body covers. Cells near the border cost less, because no two
bodies have the same shape. A limb in many poses only costs its own cells, so that thousands are measured in a second.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.compute.jit import FAR, FAST_MATH, njit
from tracker.compute.threads import N_HELPERS, kernel_pool
from tracker.evidence.voxels.voxel_grid import VOXEL_M
from tracker.geometry.arrays import Array, FloatArray, IntArray, Mask
from tracker.geometry.cameras import NEAR_PLANE_M, Camera

_BROKEN = 0.3
"""Cost of a view from which on more counts less and less."""
_RINGS, _SECTORS = 4, 8
"""Corners of the meshes that stand for the parts."""


class _Views(NamedTuple):
    """The silhouettes as arrays; pixels are cells."""

    P: FloatArray
    """Projection matrices, (V, 3, 4)."""
    weights: FloatArray
    """Cost of covering each cell, of all views one after the other, row by row. It is positive beside the silhouette
    and negative within; 1 is a whole silhouette."""
    layout: IntArray
    """First cell, width and height of each view, (V, 3)."""


class _Mesh(NamedTuple):
    corners: FloatArray
    """Corners of each part in its frame, (P, K, 3), metres."""
    edges: IntArray
    """Indices of the corners at both ends of the edges of a part, (E, 2)."""


class SilhouetteOverlap:
    """Cost of bodies against the silhouettes of one person: in each view 0 where they fill it, 1 where nothing does."""

    def __init__(self, model: BodyModel, masks: Sequence[Mask], cameras: Sequence[Camera], center: Array) -> None:
        """Reduce the silhouettes.

        Args:
            model: the body.
            masks: silhouettes of the person, (H, W) each, raw pixels; empty ones do not count.
            cameras: cameras of these pixels, with their lens distortion.
            center: of the person, (3,), metres.
        """
        self._mesh = _mesh(model)
        pairs = [(m, c) for m, c in zip(masks, cameras, strict=True) if m.any()]
        views = [_reduced(mask, camera, center) for mask, camera in pairs]
        sizes = [w.size for w, _ in views]
        firsts = np.cumsum([0, *sizes])
        self._n_cells = int(firsts[-1])
        self._views = _Views(
            np.array([c.projection for _, c in views], np.float32),
            np.concatenate([w.ravel() for w, _ in views]),
            np.array([(f, *c.size) for f, (_, c) in zip(firsts, views, strict=False)], np.int64),
        )

    def nothing(self) -> NDArray[np.bool_]:
        """Return the covered cells where nothing is, to which `cover` adds."""
        return np.zeros(self._n_cells, np.bool_)

    @staticmethod
    def total(view_costs: Array) -> Array:
        """Return the cost over all views, (..., V) to (...): a broken silhouette, which no body fills, counts less."""
        return np.asarray(np.mean(view_costs / (view_costs + _BROKEN), axis=-1))

    def cover(self, Ts: Array, parts: IntArray, covered: NDArray[np.bool_]) -> Array:
        """Mark the cells that some parts of one body cover; return the costs that they add, (V,).

        Args:
            Ts: poses of the parts, (n, 4, 4).
            parts: their indices, (n,).
            covered: is added to.
        """
        marks = np.zeros(self._n_cells, np.int32)
        added = self._measure(Ts[None], parts, covered, marks)[0]
        covered |= marks > 0
        return added

    def added(self, Ts: Array, parts: IntArray, covered: NDArray[np.bool_]) -> Array:
        """Return the costs that parts in many poses add to each view, (C, V), where some cells are covered already.

        Args:
            Ts: poses of the parts, (C, n, 4, 4).
            parts: their indices, (n,).
            covered: the cells that are covered.
        """
        shares = [s for s in np.array_split(np.arange(len(Ts)), N_HELPERS) if len(s)]

        def measure(share: IntArray) -> Array:
            return self._measure(Ts[share[0] : share[-1] + 1], parts, covered, np.zeros(self._n_cells, np.int32))

        others = [kernel_pool().submit(measure, share) for share in shares[1:]]
        return np.concatenate([measure(shares[0]), *(o.result() for o in others)])

    def _measure(self, Ts: Array, parts: IntArray, covered: NDArray[np.bool_], marks: NDArray[np.int32]) -> Array:
        out = np.zeros((len(Ts), len(self._views.P)))
        n_corners, most = self._mesh.corners.shape[1], int(self._views.layout[:, 2].max())
        image = np.empty((n_corners, 2), np.float32)
        spans = np.empty((most, 2), np.int64)
        _add(Ts.astype(np.float32), parts, self._mesh, self._views, covered, marks, image, spans, out)
        return out


def _reduced(mask: Mask, camera: Camera, center: Array) -> tuple[FloatArray, Camera]:
    """Return the cost of covering each cell, (H, W), as shares of the silhouette, and the camera of the cells."""
    depth = max(float(camera.depths(center)), NEAR_PLANE_M)
    whole = camera.pinhole
    cells = whole.scaled(min(1.0, depth / (whole.K[0, 0] * VOXEL_M)))
    shown = camera.undistort_image(mask.astype(np.uint8) * 255)
    inside = (cv2.resize(shown, cells.size, interpolation=cv2.INTER_AREA) > 127).astype(np.uint8)
    soft = 2 * VOXEL_M * cells.K[0, 0] / depth  # a voxel may be missing or too many on either side of a border
    within, beside = (
        np.minimum(1.0, (cv2.distanceTransform(part, cv2.DIST_L2, 5) - 0.5) / soft) for part in (inside, 1 - inside)
    )
    weights = np.where(inside > 0, -within, beside)
    return (weights / max(1.0, float(within[inside > 0].sum()))).astype(np.float32), cells


@lru_cache(maxsize=8)
def _mesh(model: BodyModel) -> _Mesh:
    parts = [shape.triangles(_RINGS, _SECTORS) for shape in model.shapes]
    corners = [vertices + center for (vertices, _), center in zip(parts, model.centers_part, strict=True)]
    faces = parts[0].faces
    pairs = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return _Mesh(np.array(corners, np.float32), np.unique(pairs, axis=0).astype(np.int64))


@njit(**FAST_MATH)
def _add(
    Ts: FloatArray, parts: IntArray, mesh: _Mesh, views: _Views, covered: NDArray[np.bool_], marks: NDArray[np.int32],
    image: FloatArray, spans: IntArray, out: Array,
) -> None:  # fmt: skip
    """Add the costs of the cells that parts in each pose cover and that are not covered yet.

    Args:
        Ts: poses of the parts, (C, n, 4, 4).
        parts: their indices, (n,).
        mesh: of all parts.
        views: the silhouettes.
        covered: cells that are covered.
        marks: scratch for each cell, zeros; the number of the last pose that covers it, from 1.
        image: scratch for projected corners, (K, 2).
        spans: scratch for the first and last column of each row, (rows, 2).
        out: is added to, (C, V).
    """
    for c in range(Ts.shape[0]):
        for v in range(views.P.shape[0]):
            first, width, height = views.layout[v, 0], views.layout[v, 1], views.layout[v, 2]
            for i in range(parts.shape[0]):
                low, high = _spans(views.P[v], Ts[c, i], mesh.corners[parts[i]], mesh.edges, height, image, spans)
                for row in range(low, high + 1):
                    start = first + row * width
                    for column in range(max(0, spans[row, 0]), min(width - 1, spans[row, 1]) + 1):
                        cell = start + column
                        if marks[cell] != c + 1 and not covered[cell]:
                            out[c, v] += views.weights[cell]
                            marks[cell] = c + 1


@njit(**FAST_MATH)
def _spans(
    P: FloatArray, T: FloatArray, corners: FloatArray, edges: IntArray, height: int, image: FloatArray, spans: IntArray
) -> tuple[int, int]:
    """Fill the columns that a convex part covers in each row; return its first and last row within the image."""
    top, bottom = FAR, -FAR
    for k in range(corners.shape[0]):
        x, y, z = corners[k, 0], corners[k, 1], corners[k, 2]
        X = T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3]
        Y = T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3]
        Z = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
        w = P[2, 0] * X + P[2, 1] * Y + P[2, 2] * Z + P[2, 3]
        if w < NEAR_PLANE_M:
            return 0, -1
        image[k, 0] = (P[0, 0] * X + P[0, 1] * Y + P[0, 2] * Z + P[0, 3]) / w
        image[k, 1] = (P[1, 0] * X + P[1, 1] * Y + P[1, 2] * Z + P[1, 3]) / w
        top, bottom = min(top, image[k, 1]), max(bottom, image[k, 1])
    low, high = max(0, int(np.ceil(top))), min(height - 1, int(np.floor(bottom)))
    for row in range(low, high + 1):
        spans[row, 0], spans[row, 1] = 1 << 30, -1
    for e in range(edges.shape[0]):
        a, b = edges[e, 0], edges[e, 1]
        if image[a, 1] > image[b, 1]:
            a, b = b, a
        first, last = max(low, int(np.ceil(image[a, 1]))), min(high, int(np.floor(image[b, 1])))
        if first > last:
            continue
        rise = image[b, 1] - image[a, 1]
        slope = (image[b, 0] - image[a, 0]) / rise if rise > 0.0 else np.float32(0.0)
        for row in range(first, last + 1):
            u = image[a, 0] + slope * (np.float32(row) - image[a, 1])
            spans[row, 0], spans[row, 1] = min(spans[row, 0], int(np.ceil(u))), max(spans[row, 1], int(np.floor(u)))
    return low, high
