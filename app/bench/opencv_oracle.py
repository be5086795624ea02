"""The chamfer cost written with numpy and OpenCV, with which the compiled kernels are compared.

The two share only the shapes. Each part's contour is the convex hull of its projected mesh. Parts are painted from far
to near into a label image; contour points that still show there are visible. The distances from the edges to the
contours come from a distance transform of the painted contours.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array

SAMPLE_PX = 4.0
_RINGS, _SECTORS = 12, 16
_SHIFT = 4
"""OpenCV draws at sixteenths of a pixel."""
_MARGIN_PX = 24
"""Margin painted around the body, px; edges farther away are outliers anyway."""


class PaintedCost:
    """Scores poses of one person against fixed evidence by painting."""

    def __init__(
        self, views: Sequence[ViewEvidence], model: BodyModel, edge_points_px: Sequence[NDArray[np.float32]]
    ) -> None:
        """Sample the parts' surfaces.

        Args:
            views: the evidence of each view.
            model: the body.
            edge_points_px: the edge points that count in each view, (n, 2).
        """
        self._views, self._model, self._scene = tuple(views), model, tuple(edge_points_px)
        grids = [s.grid(_RINGS, _SECTORS)[0].reshape(-1, 3) for s in model.shapes]
        self._surface = np.stack([g + c for g, c in zip(grids, model.centers_part, strict=True)])

    def __call__(self, values: Array) -> float:
        """Return the undirected chamfer distance, mean over the views, px."""
        Ts = self._model.kinematics(values).Ts_world_part
        world = np.einsum("pij,pnj->pni", Ts[:, :3, :3], self._surface) + Ts[:, None, :3, 3]
        return float(np.mean([self._score(v, s, world) for v, s in zip(self._views, self._scene, strict=True)]))

    def _score(self, view: ViewEvidence, scene: NDArray[np.float32], world: Array) -> float:
        n_parts, n_points, _ = world.shape
        flat = world.reshape(-1, 3)
        px = view.camera.project(flat).reshape(n_parts, n_points, 2).astype(np.float32)
        depths = view.camera.depths(flat).reshape(n_parts, n_points).mean(axis=1)
        corner = np.floor(px.min(axis=(0, 1))) - _MARGIN_PX
        size = np.ceil(px.max(axis=(0, 1)) + _MARGIN_PX - corner).astype(int)
        labels = np.zeros(size[::-1], np.uint8)
        hulls = [cv2.convexHull(p - corner.astype(np.float32))[:, 0] for p in px]
        for part in np.argsort(-depths):
            corners = np.round(hulls[part] * (1 << _SHIFT)).astype(np.int32)
            cv2.fillConvexPoly(labels, corners, int(part) + 1, shift=_SHIFT)
        outlines = [_evenly(h) for h in hulls]
        points = np.concatenate(outlines)
        parts = np.repeat(np.arange(n_parts) + 1, [len(o) for o in outlines])
        seen = self._outermost(labels, points, parts)
        joined = seen[:-1] & seen[1:] & (parts[:-1] == parts[1:])
        lines = np.stack([points[:-1][joined], points[1:][joined]], axis=1)
        return 0.5 * (_forward(view, points[seen] + corner) + _backward(view, scene - corner, labels.shape, lines))

    def _outermost(self, labels: NDArray[np.uint8], points: Array, parts: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return whether each contour point is visible: its own label, and no other part's, is painted around it."""
        u, v = np.round(points).astype(int).T
        around = np.stack([labels[v + dv, u + du] for du, dv in ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1))])
        shows = np.any(around == parts, axis=0)
        parents = np.array(self._model.parents) + 1
        family = np.zeros((len(parents) + 1, len(parents) + 1), dtype=bool)
        family[np.arange(1, len(parents) + 1), parents] = family[parents, np.arange(1, len(parents) + 1)] = True
        family[0] = family[:, 0] = False
        return shows & ~np.any(family[parts, around], axis=0)


def _evenly(hull: NDArray[np.float32]) -> Array:
    """Sample a closed polygon at intervals of SAMPLE_PX, (n, 2)."""
    ring = np.concatenate([hull, hull[:1]])
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(ring, axis=0).T))])
    at = np.arange(0.0, along[-1], SAMPLE_PX)
    return np.stack([np.interp(at, along, ring[:, 0]), np.interp(at, along, ring[:, 1])], axis=1)


def _forward(view: ViewEvidence, points: Array) -> float:
    if not len(points):
        return view.theta_px
    inside = np.clip(points, 0, np.array(view.camera.size) - 1.0)
    u, v = inside.astype(np.float32).T[:, None]
    sampled = cv2.remap(view.distance, u, v, cv2.INTER_LINEAR)[0]
    far = sampled + np.hypot(*(points - inside).T)
    return float(np.minimum(far, view.theta_px).mean())


def _backward(view: ViewEvidence, scene: Array, shape: tuple[int, ...], lines: Array) -> float:
    if not len(lines) or not len(scene):
        return view.theta_px
    painted = np.full(shape, 255, np.uint8)
    cv2.polylines(painted, list(np.round(lines).astype(np.int32)), False, 0)
    distance = cv2.distanceTransform(painted, cv2.DIST_L2, cv2.DIST_MASK_5)
    u, v = np.round(scene).astype(int).T
    within = (u >= 0) & (v >= 0) & (u < shape[1]) & (v < shape[0])
    far = np.full(len(scene), view.theta_px)
    far[within] = np.minimum(distance[v[within], u[within]], view.theta_px)
    return float(far.mean())
