"""The silhouette's own contour as evidence, and how far to trust it."""

from typing import NamedTuple

import cv2
import numpy as np

from tracker.edges import Edges
from tracker.rigid import FloatArray
from tracker.silhouettes import Mask

LEAST_LENGTH = 24
"""Contours of fewer pixels go around specks and pinholes, and are left out."""
_NORMAL_WINDOW = (7, 7)
_NEAR = np.ones((5, 5), np.uint8)  # an edge this near to the contour is the same
_ALIGNED = 0.7  # cosine of the angle between the contour's normal and the image's gradient
_NO_TRUST, _FULL_TRUST = 0.5, 0.9
"""Shares of the outline with an edge of the image along it."""
_FULL, _TOO_FULL = 0.5, 0.75
"""Shares of the region that a silhouette fills."""


class Outline(NamedTuple):
    """Pixels on the contour of a silhouette."""

    points_px: FloatArray
    """Outermost pixels that belong to the silhouette, in order along each contour, (N, 2), px."""
    normals: FloatArray
    """Unit normals out of the silhouette, (N, 2)."""


def trace_outline(silhouette: Mask) -> Outline:
    """Trace the contours of a silhouette, (H, W), and of the holes in it; where it leaves the image it has none."""
    found, _ = cv2.findContours(silhouette.view(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    height, width = silhouette.shape
    long = [np.asarray(c, np.int32).reshape(-1, 2) for c in found if len(c) >= LEAST_LENGTH]
    points = np.concatenate(long) if long else np.empty((0, 2), np.int32)
    u, v = points.T
    points = points[(u > 0) & (v > 0) & (u < width - 1) & (v < height - 1)]
    soft = cv2.blur(silhouette.view(np.uint8) * np.uint8(255), _NORMAL_WINDOW)
    u, v = points.T
    inward = np.stack([np.asarray(g)[v, u] for g in cv2.spatialGradient(soft)], axis=-1).astype(np.float32)
    lengths = np.linalg.norm(inward, axis=-1, keepdims=True)
    # Around something one pixel wide neither side is out.
    kept = lengths[:, 0] > 0
    return Outline(points[kept].astype(np.float32), -inward[kept] / lengths[kept])


def trust_outline(outline: Outline, silhouette: Mask, edges: Edges) -> float:
    """How far a silhouette can be trusted, 0 to 1, judged from the image alone.

    The contour of a person is an edge of the image, running the same way. Where the background is broken or the camera
    has moved, the silhouette ends where the image shows nothing; where the light has changed, it is everywhere.

    Args:
        outline: the silhouette's.
        silhouette: (H, W) bool.
        edges: of the same image, at least within some pixels of the silhouette.
    """
    if not len(outline.points_px):
        return 0.0
    u, v = outline.points_px.T.astype(np.intp)
    near = np.asarray(cv2.dilate(edges.found, _NEAR))[v, u] > 0
    gradients = edges.gradients[:, v, u].T.astype(np.float32)
    lengths = np.linalg.norm(gradients, axis=-1)
    aligned = np.abs(np.sum(gradients * outline.normals, axis=-1)) > _ALIGNED * lengths
    seen = (float(np.mean(near & aligned)) - _NO_TRUST) / (_FULL_TRUST - _NO_TRUST)
    plausible = (_TOO_FULL - cv2.countNonZero(silhouette.view(np.uint8)) / silhouette.size) / (_TOO_FULL - _FULL)
    return min(max(seen, 0.0), 1.0) * min(max(plausible, 0.0), 1.0)
