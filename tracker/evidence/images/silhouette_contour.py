"""Trace the contour of a silhouette and estimate how far to trust it."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import njit
from tracker.evidence.images.change import MAX_FILL
from tracker.evidence.images.edge_segments import MAX_ANGLE_RAD
from tracker.evidence.images.edges import Edges
from tracker.geometry.arrays import FloatArray, Mask

MIN_LENGTH_PX = 24
"""Contours of fewer pixels surround specks and pinholes, and are left out."""
_NORMAL_WINDOW = (7, 7)
"""Window over which a silhouette is blurred before its normals are taken, px: wider than the steps of its pixels."""
SAME_PX = 2
"""Largest distance of a contour point from the image edge that it lies on, px."""
_TRUST_RAMP = (0.5, 0.9)
"""Shares of the contour with an image edge along it, for no trust and for full trust."""
MIN_TRUST = 0.5
"""Trust below which a silhouette is left out where it alone decides."""
_ALONG = np.float32(np.cos(MAX_ANGLE_RAD))


class SilhouetteContour(NamedTuple):
    """Pixels on the contour of a silhouette."""

    points_px: FloatArray
    """Outermost pixels of the silhouette, in order along each contour, (N, 2), px."""
    normals: FloatArray
    """Unit normals pointing out of the silhouette, (N, 2)."""

    def away_from(self, pixels: Mask) -> "SilhouetteContour":
        """Return the part of the contour that is not next to some pixels, (H, W)."""
        near = cv2.dilate(pixels.view(np.uint8), np.ones((3, 3), np.uint8))
        kept = near[self.points_px[:, 1].astype(np.intp), self.points_px[:, 0].astype(np.intp)] == 0
        return SilhouetteContour(self.points_px[kept], self.normals[kept])


def trace_silhouette(silhouette: Mask) -> SilhouetteContour:
    """Trace the contours of a silhouette, (H, W), and of its holes, except along the border of the image."""
    found, _ = cv2.findContours(silhouette.view(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    long = [np.asarray(c, np.int32).reshape(-1, 2) for c in found if len(c) >= MIN_LENGTH_PX]
    points = np.concatenate(long) if long else np.empty((0, 2), np.int32)
    soft = np.asarray(cv2.blur(silhouette.view(np.uint8) * np.uint8(255), _NORMAL_WINDOW))
    contour = SilhouetteContour(np.empty((len(points), 2), np.float32), np.empty((len(points), 2), np.float32))
    n = _trace_normals(points, soft, contour)
    return SilhouetteContour(contour.points_px[:n], contour.normals[:n])


@njit(nogil=True, cache=True)
def _trace_normals(points: NDArray[np.int32], soft: NDArray[np.uint8], out: SilhouetteContour) -> int:
    """Fill the points, (N, 2), that are not on the border, and their normals; return their number.

    Normals point against the Sobel slope of the blurred silhouette, (H, W).
    """
    height, width = soft.shape
    n = 0
    for i in range(points.shape[0]):
        u, v = points[i, 0], points[i, 1]
        if u <= 0 or v <= 0 or u >= width - 1 or v >= height - 1:
            continue
        du = dv = 0
        for k in (-1, 0, 1):
            weight = 2 - abs(k)
            du += weight * (int(soft[v + k, u + 1]) - int(soft[v + k, u - 1]))
            dv += weight * (int(soft[v + 1, u + k]) - int(soft[v - 1, u + k]))
        length = np.sqrt(np.float32(du * du + dv * dv))
        if length == 0:  # a line one pixel wide has no outer side
            continue
        out.points_px[n, 0], out.points_px[n, 1] = u, v
        out.normals[n, 0], out.normals[n, 1] = -np.float32(du) / length, -np.float32(dv) / length
        n += 1
    return n


def contour_trust(contour: SilhouetteContour, silhouette: Mask, edges: Edges) -> float:
    """Estimate from the image alone how far a silhouette can be trusted, 0 to 1.

    The contour of a person is an image edge of the same direction. If the background is wrong or the camera has
    moved, the silhouette ends where the image has no edge. If the light has changed, it fills the region.

    Args:
        contour: the silhouette's contour.
        silhouette: (H, W) bool.
        edges: edges of the same image, at least within some pixels of the silhouette.
    """
    if not len(contour.points_px):
        return 0.0
    along = _count_along(contour, edges.found, edges.gradients) / len(contour.points_px)
    none, full = _TRUST_RAMP
    seen = (along - none) / (full - none)
    is_plausible = cv2.countNonZero(silhouette.view(np.uint8)) < MAX_FILL * silhouette.size
    return min(max(seen, 0.0), 1.0) if is_plausible else 0.0


@njit(nogil=True, cache=True)
def _count_along(contour: SilhouetteContour, found: NDArray[np.uint8], gradients: NDArray[np.int16]) -> int:
    """Count the contour points with an edge nearby, (H, W), whose image gradient, (2, H, W), is across the contour."""
    count = 0
    for i in range(contour.points_px.shape[0]):
        u, v = int(contour.points_px[i, 0]), int(contour.points_px[i, 1])
        gu, gv = np.float32(gradients[0, v, u]), np.float32(gradients[1, v, u])
        across = abs(gu * contour.normals[i, 0] + gv * contour.normals[i, 1])
        if across <= _ALONG * np.sqrt(gu * gu + gv * gv):
            continue
        count += _is_near(found, u, v)
    return count


@njit(nogil=True, cache=True)
def _is_near(found: NDArray[np.uint8], u: int, v: int) -> bool:
    """Return whether an edge map, (H, W), has an edge near a pixel."""
    height, width = found.shape
    for row in range(max(0, v - SAME_PX), min(height, v + SAME_PX + 1)):
        for column in range(max(0, u - SAME_PX), min(width, u + SAME_PX + 1)):
            if found[row, column]:
                return True
    return False
