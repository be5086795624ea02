"""Link edges into chains, cut chains into segments of constant curvature, and accept or refuse whole segments.

Segments follow GD96 Sect. 4.2 and Fig. 6. A segment is accepted by its directed chamfer distance to the contours of the
predicted bodies. A background edge that merely crosses a limb is therefore refused with all its pixels, and an edge of
the limb is accepted with all of them.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import FAST_MATH, ONE, TINY, ZERO, njit
from tracker.geometry.arrays import FloatArray, IntArray
from tracker.geometry.segment_distance import LANES, RowSortedPoints, cells_within, sort_points

MAX_LENGTH = 30
"""Largest number of pixels of a segment. It separates body and background where they are linked smoothly."""
BEND_RAD = 0.35
"""Largest deviation of an edge's direction from one that turns evenly within a segment, rad."""
STRAYS = 3
"""Number of consecutive deviating pixels that end a segment; single ones are noise."""
MAX_ANGLE_RAD = float(np.radians(45.0))
"""Largest angle between an edge and a contour that it may belong to, rad."""
_STRIDE = 2
"""Pixels from one sample of a segment to the next."""
_NONE_LEFT = -10
"""Score of a pixel that has no neighbour left: below any score."""


class EdgeSegments(NamedTuple):
    """Edge pixels in linked order."""

    points_px: FloatArray
    """u and v of each edge pixel, (N, 2), px."""
    normals: FloatArray
    """Unit gradient at each pixel, from dark to light, (N, 2)."""
    firsts: IntArray
    """Index of the first pixel of each segment, then N, (S + 1,)."""


def link_edges(
    found: NDArray[np.uint8], gradients: NDArray[np.int16], max_length: int | None = MAX_LENGTH
) -> EdgeSegments:
    """Link the pixels of edges into segments of constant curvature.

    Args:
        found: thin edges, not 0, (H, W).
        gradients: image gradient along u and v, (2, H, W); not zero on edges.
        max_length: largest number of pixels of a segment; None: no limit.
    """
    pixels = cv2.findNonZero(found)
    n = 0 if pixels is None else len(pixels)
    points, normals = np.empty((n, 2), np.float32), np.empty((n, 2), np.float32)
    firsts = np.zeros(n + 1, np.int64)
    if pixels is None:
        return EdgeSegments(points, normals, firsts)
    begins = np.zeros(n, np.bool_)
    _chain(found, np.asarray(pixels, np.int32).reshape(-1, 2), gradients, points, normals, begins)
    count = _cut(points, normals, begins, n + 1 if max_length is None else max_length, firsts)
    return EdgeSegments(points, normals, firsts[: count + 1].copy())


def link_and_sample(
    found: NDArray[np.uint8], gradients: NDArray[np.int16], max_length: int | None
) -> tuple[EdgeSegments, "Samples"]:
    """Link the pixels of edges into segments, see `link_edges`, and sample them."""
    segments = link_edges(found, gradients, max_length)
    return segments, sample_segments(segments)


def accept_segments(
    samples: "Samples", pieces_px: FloatArray, threshold_px: float, max_angle_rad: float = MAX_ANGLE_RAD
) -> NDArray[np.bool_]:
    """Return which segments are accepted by their directed chamfer distance to predicted contours, (S,) bool.

    Each pixel counts with its distance to the nearest piece of contour of similar direction, at most twice the
    threshold.

    Args:
        samples: samples of the segments of a view.
        pieces_px: end points x0, y0, x1, y1 of the visible pieces of predicted contours, (M, 4), px of the view.
        threshold_px: largest mean distance of an accepted segment, px.
        max_angle_rad: largest angle between a pixel's edge and a piece, rad.
    """
    distances = samples.distances(pieces_px, 2.0 * threshold_px, max_angle_rad)
    return np.asarray(samples.means(distances) <= threshold_px)


class Samples(NamedTuple):
    """Every other pixel of each segment; distances change little from one pixel to the next."""

    pixels: RowSortedPoints
    """u, v, the normal's u and v, and the segment's index, sorted for `distances`; n pixels."""
    counts: IntArray
    """Number of samples of each segment, (S,)."""

    def distances(self, pieces_px: FloatArray, reach_px: float, max_angle_rad: float = MAX_ANGLE_RAD) -> FloatArray:
        """Return the distance of each sample to the nearest piece of similar direction, (n,), px, at most the reach.

        Args:
            pieces_px: end points of pieces of contour, (M, 4), px.
            reach_px: largest distance, px.
            max_angle_rad: largest angle between a pixel's edge and a piece, rad.
        """
        out = np.empty(self.pixels.points.shape[1], np.float32)
        pieces = np.ascontiguousarray(pieces_px, np.float32)
        nearest_parallel_segment(self.pixels.points, self.pixels.rows, pieces, reach_px, max_angle_rad, out)
        return out[: self.counts.sum()]

    def means(self, distances: FloatArray) -> NDArray[np.float64]:
        """Return the mean of each segment's samples, (n,) to (S,)."""
        sums = np.zeros(len(self.counts))
        _sum_up(self.pixels.points[4], distances, sums)
        return sums / self.counts


def sample_segments(segments: EdgeSegments) -> Samples:
    """Sample segments, beginning with the first pixel of each."""
    counts = -(-np.diff(segments.firsts) // _STRIDE)
    points = np.empty((counts.sum(), 5), np.float32)
    width, height = _sample(segments.points_px, segments.normals, segments.firsts, points)
    return Samples(sort_points(points, (width, height)), counts)


@njit(nogil=True, cache=True)
def _sample(points: FloatArray, normals: FloatArray, firsts: IntArray, out: FloatArray) -> tuple[int, int]:
    """Fill points, normals and segment indices, (n, 5); return width and height of an image that holds them, px."""
    n, width, height = 0, 1, 1
    for segment in range(firsts.shape[0] - 1):
        for i in range(firsts[segment], firsts[segment + 1], _STRIDE):
            out[n, 0], out[n, 1] = points[i, 0], points[i, 1]
            out[n, 2], out[n, 3], out[n, 4] = normals[i, 0], normals[i, 1], segment
            width, height = max(width, 1 + int(points[i, 0])), max(height, 1 + int(points[i, 1]))
            n += 1
    return width, height


@njit(nogil=True, cache=True)
def _sum_up(of: FloatArray, distances: FloatArray, sums: NDArray[np.float64]) -> None:
    """Add distances, (n,), to the sums of their segments, (S,); `of` holds the segment of each, (n or more,)."""
    for i in range(distances.shape[0]):
        sums[int(of[i])] += distances[i]


@njit(nogil=True, cache=True, error_model="numpy")
def _chain(
    found: NDArray[np.uint8], pixels: NDArray[np.int32], gradients: NDArray[np.int16],
    points: FloatArray, normals: FloatArray, begins: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Put edge pixels in linked order and mark where chains begin.

    Chains begin at ends of edges first, then anywhere. At a junction the straightest continuation is taken.

    Args:
        found: edges are not 0, (H, W).
        pixels: u and v of the edges, (N, 2).
        gradients: image gradient along u and v, (2, H, W).
        points: filled with the pixels in order, (N, 2).
        normals: filled with their unit gradients, (N, 2).
        begins: marked where chains begin, (N,).
    """
    height, width = found.shape
    left = np.zeros((height + 2, width + 2), np.uint8)  # with a border, so that every pixel has eight neighbours
    for i in range(pixels.shape[0]):
        left[pixels[i, 1] + 1, pixels[i, 0] + 1] = 1
    n = 0
    for ends_only in (True, False):
        for i in range(pixels.shape[0]):
            u, v = pixels[i, 0] + 1, pixels[i, 1] + 1
            if left[v, u] == 0 or (ends_only and _neighbours(left, u, v) > 1):
                continue
            begins[n] = True
            step_u, step_v = 0, 0
            while True:
                left[v, u] = 0
                gu, gv = np.float32(gradients[0, v - 1, u - 1]), np.float32(gradients[1, v - 1, u - 1])
                inverse = np.float32(1.0) / np.sqrt(max(gu * gu + gv * gv, ONE))
                points[n, 0], points[n, 1] = u - 1, v - 1
                normals[n, 0], normals[n, 1] = gu * inverse, gv * inverse
                n += 1
                best, next_u, next_v = _NONE_LEFT, 0, 0
                for dv in range(-1, 2):
                    for du in range(-1, 2):
                        if left[v + dv, u + du]:
                            # A straight step before a diagonal one leaves no single pixels behind on stairs.
                            score = 2 * (du * step_u + dv * step_v) - abs(du * dv)
                            if score > best:
                                best, next_u, next_v = score, du, dv
                if best == _NONE_LEFT:
                    break
                step_u, step_v = next_u, next_v
                u, v = u + step_u, v + step_v


@njit(nogil=True, cache=True)
def _neighbours(left: NDArray[np.uint8], u: int, v: int) -> int:
    """Count the edge pixels around an edge pixel."""
    count = -1
    for dv in range(-1, 2):
        for du in range(-1, 2):
            count += int(left[v + dv, u + du])
    return count


@njit(nogil=True, cache=True, error_model="numpy")
def _cut(points: FloatArray, normals: FloatArray, begins: NDArray[np.bool_], max_length: int, firsts: IntArray) -> int:
    """Cut chains where they stop turning evenly; fill the first pixels of segments and return the number of segments.

    Along a circular arc the unwrapped gradient direction is a straight line over arc length. That line is fitted to the
    segment so far. The segment ends before the first of `STRAYS` consecutive pixels that deviate from it. It also ends
    where the direction jumps: at a corner, or where the darker side changes.
    """
    n_points = points.shape[0]
    count, i = 0, 0
    while i < n_points:
        firsts[count] = i
        count += 1
        n, sum_x, sum_y, sum_xx, sum_xy, x, y, strays = 1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
        j = i + 1
        while j < n_points and not begins[j] and j - i < max_length:
            cross = normals[j - 1, 0] * normals[j, 1] - normals[j - 1, 1] * normals[j, 0]
            dot = normals[j - 1, 0] * normals[j, 0] + normals[j - 1, 1] * normals[j, 1]
            if dot < 0.5:
                break
            x += np.sqrt((points[j, 0] - points[j - 1, 0]) ** 2 + (points[j, 1] - points[j - 1, 1]) ** 2)
            y += np.arctan2(cross, dot)
            j += 1
            if n >= 4:
                slope = (n * sum_xy - sum_x * sum_y) / (n * sum_xx - sum_x * sum_x)
                if abs(y - (sum_y - slope * sum_x) / n - slope * x) > BEND_RAD:
                    strays += 1
                    if strays == STRAYS:
                        j -= STRAYS
                        break
                    continue
                strays = 0
            n, sum_x, sum_y, sum_xx, sum_xy = n + 1, sum_x + x, sum_y + y, sum_xx + x * x, sum_xy + x * y
        i = j
    firsts[count] = n_points
    return count


@njit(**FAST_MATH)
def nearest_parallel_segment(
    pixels: FloatArray, rows: IntArray, pieces: FloatArray, reach: float, max_angle: float, out: FloatArray
) -> None:
    """Fill the distance of each pixel to the nearest piece of similar direction, (N,), px, at most the reach.

    As in `segment_distance.nearest_segment`, a piece is compared only with nearby pixels.

    Args:
        pixels: see `Samples.pixels`, (5, N).
        rows: cells of the sorted pixels.
        pieces: end points x0, y0, x1, y1, (M, 4), px.
        reach: largest distance, px.
        max_angle: largest angle between edge and piece, rad.
        out: filled.
    """
    far, across = np.float32(reach), np.float32(np.sin(max_angle) ** 2)
    u, v, nu, nv = pixels[0], pixels[1], pixels[2], pixels[3]
    out[:] = far * far
    for k in range(pieces.shape[0]):
        x, y, x1, y1 = pieces[k, 0], pieces[k, 1], pieces[k, 2], pieces[k, 3]
        dx, dy = x1 - x, y1 - y
        length2 = max(dx * dx + dy * dy, TINY)
        inverse, widest = ONE / length2, across * length2
        left, right, top, bottom = cells_within(x, y, x1, y1, far, rows)
        for strip in range(left, right + 1):
            first, last = np.uint64(rows[strip, top]), np.uint64(rows[strip, bottom])
            for j in range((last - first + np.uint64(LANES - 1)) // np.uint64(LANES) * np.uint64(LANES)):
                i = first + j
                from_u, from_v = u[i] - x, v[i] - y
                t = (from_u * dx + from_v * dy) * inverse
                t = t if t > ZERO else ZERO
                t = t if t < ONE else ONE
                off_u, off_v = from_u - t * dx, from_v - t * dy
                turned = nu[i] * dx + nv[i] * dy
                squared = off_u * off_u + off_v * off_v
                squared = squared if turned * turned <= widest else out[i]
                out[i] = squared if squared < out[i] else out[i]
    for k in range(out.shape[0]):
        out[k] = np.sqrt(out[k])
