"""What stands still in a view: the edges of the room, learnt while the bodies are followed.

Where neither a mask nor a background tells who is in the picture, an edge that was there before a limb came, at the
same place and in the same direction, is not the limb's: without this an arm that passes a picture on the wall is left
hanging on it. Each view remembers the edges that it showed away from the bodies; a segment that lies on them is refused
as a whole, as GD96 Sect. 4.2 refuses those that the prediction does not explain.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.geometry.arrays import FloatArray
from tracker.images.edge_segments import Segments

_MEMORY = 4
"""Frames that count: an edge is known at first sight, and three frames later where its place was seen without it."""
_KNOWN = 0.5
"""Least share of the time that an edge was there, running the same way, and of a segment that lies on such edges."""


class StaticEdgeModel:
    """The edges of one view that are not near any body."""

    def __init__(self, size: tuple[int, int]) -> None:
        """Begin knowing nothing.

        Args:
            size: width and height of the whole image, working px.
        """
        width, height = size
        # Where an edge flickers or turns, the mean of its unit gradients, 0 where there was none, is short.
        self._gradients = np.zeros((height, width, 2), np.float32)
        self._frames = np.zeros((height, width), np.uint8)

    def contains(self, segments: Segments, corner_px: tuple[int, int]) -> NDArray[np.bool_]:
        """Which segments are edges of the room, (S,).

        Args:
            segments: of a region.
            corner_px: where its first pixel lies in the whole image, working px.
        """
        known = np.zeros(len(segments.firsts) - 1, np.bool_)
        left, top = corner_px
        _mark_known(segments, self._gradients[top:, left:], known)
        return known

    def update(
        self,
        segments: Segments,
        corner_px: tuple[int, int],
        size: tuple[int, int],
        pieces_px: FloatArray,
        reach_px: float,
    ) -> None:
        """Take in what a region shows away from the bodies.

        Args:
            segments: of the region, all of them.
            corner_px: where its first pixel lies in the whole image, working px.
            size: its width and height.
            pieces_px: visible pieces of the contours of all bodies, x0, y0, x1, y1, (M, 4), px of the region.
            reach_px: edges nearer to these may be the bodies' own, px.
        """
        (left, top), (width, height) = corner_px, size
        region = slice(top, top + height), slice(left, left + width)
        _update_means(segments, pieces_px, int(np.ceil(reach_px)), self._gradients[region], self._frames[region])


@njit(nogil=True, cache=True)
def _mark_known(segments: Segments, gradients: FloatArray, known: NDArray[np.bool_]) -> None:
    """See `StaticEdgeModel.contains`; the remembered gradients (h, w, 2) begin at the region's corner."""
    points, normals, firsts = segments.points_px, segments.normals, segments.firsts
    for s in range(known.shape[0]):
        there = 0
        for i in range(firsts[s], firsts[s + 1]):
            u, v = int(points[i, 0]), int(points[i, 1])
            if gradients[v, u, 0] * normals[i, 0] + gradients[v, u, 1] * normals[i, 1] > _KNOWN:
                there += 1
        known[s] = there > _KNOWN * (firsts[s + 1] - firsts[s])


@njit(nogil=True, cache=True)
def _update_means(
    segments: Segments, pieces: FloatArray, reach: int, gradients: FloatArray, frames: NDArray[np.uint8]
) -> None:
    """Bring the mean gradients (H, W, 2) of the pixels that no piece is near up to date, and their count of frames.

    An edge is written a pixel wider on all sides: noise moves edges by so much.
    """
    height, width = frames.shape
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
                frames[y, x] = min(frames[y, x] + 1, _MEMORY)
                share = np.float32(1.0) / np.float32(frames[y, x])
                gradients[y, x, 0] += share * (now[y, x, 0] - gradients[y, x, 0])
                gradients[y, x, 1] += share * (now[y, x, 1] - gradients[y, x, 1])
