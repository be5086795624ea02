"""Learn the static edges of a view while bodies are tracked: a background model of edges.

Without masks or a background image, an edge that was there before a limb came is not the limb's. Otherwise an arm that
passes a picture on the wall sticks to it. The model averages the edges of a view away from the bodies. A segment that
lies on them is refused as a whole, as GD96 Sect. 4.2 refuses segments that the prediction does not explain.
"""

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import njit
from tracker.evidence.images.edge_segments import EdgeSegments
from tracker.geometry.arrays import FloatArray, IntArray

_MEMORY = 4
"""Length of the running mean, frames. A new edge is known at once; one where none was before, after three frames."""
_KNOWN = 0.5
"""Smallest share of frames in which an edge was present with the same direction, and of a segment on such edges."""


class StaticEdgeModel:
    """Running mean of the edges of one view away from all bodies."""

    def __init__(self, size: tuple[int, int]) -> None:
        """Begin without any edges.

        Args:
            size: width and height of the whole image, working px.
        """
        width, height = size
        # Mean of unit gradients, 0 in frames without an edge. It is short where an edge flickers or turns.
        self._gradients = np.zeros((height, width, 2), np.float32)
        self._frames = np.zeros((height, width), np.uint8)

    def contains(self, segments: EdgeSegments, corner_px: tuple[int, int]) -> NDArray[np.bool_]:
        """Return which segments are static, (S,).

        Args:
            segments: segments of a region.
            corner_px: first pixel of the region in the whole image, working px.
        """
        known = np.zeros(len(segments.firsts) - 1, np.bool_)
        _mark_known(segments, self._gradients, *corner_px, known)
        return known

    def update(
        self,
        segments: EdgeSegments,
        corner_px: tuple[int, int],
        size: tuple[int, int],
        pieces_px: FloatArray,
        reach_px: float,
    ) -> None:
        """Update the model with the edges of a region away from the bodies.

        Args:
            segments: all segments of the region.
            corner_px: first pixel of the region in the whole image, working px.
            size: width and height of the region, px.
            pieces_px: visible pieces of the contours of all bodies, x0, y0, x1, y1, (M, 4), px of the region.
            reach_px: edges nearer to these pieces may belong to bodies and are left out, px.
        """
        box = np.array([*corner_px, *size])
        _update_means(segments, pieces_px, int(np.ceil(reach_px)), self._gradients, self._frames, box)


@njit(nogil=True, cache=True)
def _mark_known(segments: EdgeSegments, gradients: FloatArray, left: int, top: int, known: NDArray[np.bool_]) -> None:
    """Mark the known segments of a region, (S,), by the mean gradients of the whole image, (H, W, 2)."""
    points, normals, firsts = segments.points_px, segments.normals, segments.firsts
    for s in range(known.shape[0]):
        there = 0
        for i in range(firsts[s], firsts[s + 1]):
            u, v = left + int(points[i, 0]), top + int(points[i, 1])
            if gradients[v, u, 0] * normals[i, 0] + gradients[v, u, 1] * normals[i, 1] > _KNOWN:
                there += 1
        known[s] = there > _KNOWN * (firsts[s + 1] - firsts[s])


@njit(nogil=True, cache=True)
def _update_means(
    segments: EdgeSegments, pieces: FloatArray, reach: int, gradients: FloatArray, frames: NDArray[np.uint8],
    box: IntArray,
) -> None:  # fmt: skip
    """Update the mean gradients, (H, W, 2), of pixels away from all pieces, and their frame counts, (H, W).

    Segments and pieces lie in the region `box`: left, top, width and height. Edges are drawn one pixel wider on all
    sides, because noise moves them by that much.
    """
    left, top = box[0], box[1]
    width, height = min(box[2], frames.shape[1] - left), min(box[3], frames.shape[0] - top)
    now, free = np.zeros((height, width, 2), np.float32), np.ones((height, width), np.bool_)
    points, normals = segments.points_px, segments.normals
    for i in range(points.shape[0]):
        u, v = int(points[i, 0]), int(points[i, 1])
        for y in range(max(0, v - 1), min(height, v + 2)):
            for x in range(max(0, u - 1), min(width, u + 2)):
                now[y, x, 0], now[y, x, 1] = normals[i, 0], normals[i, 1]
    for i in range(pieces.shape[0]):
        u, v = int(0.5 * (pieces[i, 0] + pieces[i, 2])), int(0.5 * (pieces[i, 1] + pieces[i, 3]))
        free[max(0, v - reach) : max(0, v + reach + 1), max(0, u - reach) : max(0, u + reach + 1)] = False
    for y in range(height):
        for x in range(width):
            if free[y, x]:
                v, u = top + y, left + x
                frames[v, u] = min(frames[v, u] + 1, _MEMORY)
                share = np.float32(1.0) / np.float32(frames[v, u])
                gradients[v, u, 0] += share * (now[y, x, 0] - gradients[v, u, 0])
                gradients[v, u, 1] += share * (now[y, x, 1] - gradients[v, u, 1])
