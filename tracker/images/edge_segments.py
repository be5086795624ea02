"""Edges linked into chains, chains cut into segments of constant curvature, segments taken or left as a whole.

GD96 Sect. 4.2 and Fig. 6: what belongs together is judged together. A segment is accepted by its directed chamfer
distance to the contours of the predicted bodies, so that an edge of the background that merely crosses a limb is
refused with all its points, and one of the limb is kept with all of them.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.compute.numba_options import FAST
from tracker.geometry.arrays import FloatArray, IntArray
from tracker.geometry.segment_distance import LANES, RowSortedPoints, cells_within, sort_points

MAX_LENGTH = 30
"""Most pixels of a segment: where body and background are linked in a smooth line, they part here at the latest."""
BEND_RAD = 0.35
"""How far the direction of the edge may stray from one that turns evenly before the segment ends, rad."""
STRAYS = 3
"""As many pixels in a row must stray: single ones are noise."""
MAX_ANGLE_RAD = np.radians(45.0)
"""Largest angle between an edge and a contour that it may belong to."""
_STRIDE = 2  # of the pixels that are sampled
_NONE_LEFT = -10
_ZERO, _ONE = np.float32(0.0), np.float32(1.0)  # plain numbers would turn the kernel's arithmetic into float64
_SHORT2 = np.float32(1e-6)
"""A piece is as long at least, px^2."""


class Segments(NamedTuple):
    """Edge pixels in the order in which they are linked."""

    points_px: FloatArray
    """u and v of each edge pixel, (N, 2), px."""
    normals: FloatArray
    """Unit gradient at each, from dark to light, (N, 2)."""
    firsts: IntArray
    """Index of the first pixel of each segment, and N, (S + 1,)."""


def link_edges(found: NDArray[np.uint8], gradients: NDArray[np.int16]) -> Segments:
    """Link edge pixels into chains and cut these into segments of constant curvature.

    Args:
        found: thin edges, not 0, (H, W).
        gradients: of the image along u and v, (2, H, W); none may be zero on an edge.
    """
    pixels = cv2.findNonZero(found)
    n = 0 if pixels is None else len(pixels)
    points, normals = np.empty((n, 2), np.float32), np.empty((n, 2), np.float32)
    firsts = np.zeros(n + 1, np.int64)
    if pixels is None:
        return Segments(points, normals, firsts)
    begins = np.zeros(n, np.bool_)
    _chain(found, np.asarray(pixels, np.int32).reshape(-1, 2), gradients, points, normals, begins)
    count = _cut(points, normals, begins, firsts)
    return Segments(points, normals, firsts[: count + 1].copy())


def accept_segments(samples: "Samples", pieces_px: FloatArray, threshold_px: float) -> NDArray[np.bool_]:
    """Judge each segment by its directed chamfer distance to predicted contours.

    A pixel counts with its distance to the nearest piece of contour that runs more or less as the edge does, at most
    twice the threshold.

    Args:
        samples: of the segments of a view.
        pieces_px: end points x0, y0, x1, y1 of the visible pieces of predicted contours, (M, 4), px of the view.
        threshold_px: mean distance up to which a segment is accepted, px.

    Returns:
        (S,) bool.
    """
    return np.asarray(samples.means(samples.distances(pieces_px, 2.0 * threshold_px)) <= threshold_px)


class Samples(NamedTuple):
    """Pixels of segments, every other one: distances change little from one to the next."""

    pixels: RowSortedPoints
    """u and v, the normal's u and v, and the index of the segment, sorted for `distances`; n pixels."""
    counts: IntArray
    """Number of them in each segment, (S,)."""

    def distances(self, pieces_px: FloatArray, reach_px: float) -> FloatArray:
        """Distance of each to the nearest piece of contour, (M, 4), that runs more or less as its edge, (n,), px; none
        is longer than the reach."""
        out = np.empty(self.pixels.points.shape[1], np.float32)
        pieces = np.ascontiguousarray(pieces_px, np.float32)
        nearest_parallel_segment(self.pixels.points, self.pixels.rows, pieces, reach_px, MAX_ANGLE_RAD, out)
        return out[: self.pixels.n_points]

    def means(self, distances: FloatArray) -> NDArray[np.float64]:
        """The mean of each segment's pixels, (n,) to (S,)."""
        sums = np.zeros(len(self.counts))
        _sum_up(self.pixels.points[4], distances, sums)
        return sums / self.counts


def sample_segments(segments: Segments) -> Samples:
    """Sample segments, from the first pixel of each on."""
    counts = -(-np.diff(segments.firsts) // _STRIDE)
    points = np.empty((counts.sum(), 5), np.float32)
    width, height = _sample(segments.points_px, segments.normals, segments.firsts, points)
    return Samples(sort_points(points, (width, height)), counts)


@njit(nogil=True, cache=True)
def _sample(points: FloatArray, normals: FloatArray, firsts: IntArray, out: FloatArray) -> tuple[int, int]:
    """Fill points, their normals and the index of their segment, (n, 5); the size of an image that holds them."""
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
    """Add distances, (n,), to the sums, (S,), that they are of, (n or more,)."""
    for i in range(distances.shape[0]):
        sums[int(of[i])] += distances[i]


@njit(nogil=True, cache=True, error_model="numpy")
def _chain(
    found: NDArray[np.uint8], pixels: NDArray[np.int32], gradients: NDArray[np.int16],
    points: FloatArray, normals: FloatArray, begins: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Put the pixels (N, 2) of edges in linked order, and mark where chains begin, (N,).

    Chains begin at ends of edges first, then anywhere; at a junction the straightest way is taken.
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
                inverse = np.float32(1.0) / np.sqrt(max(gu * gu + gv * gv, np.float32(1e-6)))
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
    """Pixels of edges around one."""
    count = -1
    for dv in range(-1, 2):
        for du in range(-1, 2):
            count += left[v + dv, u + du]
    return count


@njit(nogil=True, cache=True, error_model="numpy")
def _cut(points: FloatArray, normals: FloatArray, begins: NDArray[np.bool_], firsts: IntArray) -> int:
    """Cut chains where they stop turning evenly; fills the first pixels of segments and returns their number.

    The direction of the gradient, unwrapped, is a straight line over the length of a circular arc. That line is fitted
    to what the segment has so far; the segment ends before the first of some pixels in a row that stray from it, or
    where the direction jumps, as it does at a corner and where the other side becomes the darker one.
    """
    n_points = points.shape[0]
    count, i = 0, 0
    while i < n_points:
        firsts[count] = i
        count += 1
        n, sum_x, sum_y, sum_xx, sum_xy, x, y, strays = 1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
        j = i + 1
        while j < n_points and not begins[j] and j - i < MAX_LENGTH:
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


@njit(**FAST)
def nearest_parallel_segment(
    pixels: FloatArray, rows: IntArray, pieces: FloatArray, reach: float, max_angle: float, out: FloatArray
) -> None:
    """Distance of each pixel, (5, N) as in `Samples`, to the nearest piece, (M, 4), that runs its way, up to a reach.

    As in `nearest.nearest_segment`, pieces are held only against the pixels nearby.
    """
    far, across = np.float32(reach), np.float32(np.sin(max_angle) ** 2)
    u, v, nu, nv = pixels[0], pixels[1], pixels[2], pixels[3]
    out[:] = far * far
    for k in range(pieces.shape[0]):
        x, y, x1, y1 = pieces[k, 0], pieces[k, 1], pieces[k, 2], pieces[k, 3]
        dx, dy = x1 - x, y1 - y
        length2 = max(dx * dx + dy * dy, _SHORT2)
        inverse, widest = _ONE / length2, across * length2
        left, right, top, bottom = cells_within(x, y, x1, y1, far, rows)
        for strip in range(left, right + 1):
            first, last = np.uint64(rows[strip, top]), np.uint64(rows[strip, bottom])
            for j in range((last - first + np.uint64(LANES - 1)) // np.uint64(LANES) * np.uint64(LANES)):
                i = first + j
                from_u, from_v = u[i] - x, v[i] - y
                t = (from_u * dx + from_v * dy) * inverse
                t = t if t > _ZERO else _ZERO
                t = t if t < _ONE else _ONE
                off_u, off_v = from_u - t * dx, from_v - t * dy
                turned = nu[i] * dx + nv[i] * dy
                squared = off_u * off_u + off_v * off_v
                squared = squared if turned * turned <= widest else out[i]
                out[i] = squared if squared < out[i] else out[i]
    for k in range(out.shape[0]):
        out[k] = np.sqrt(out[k])
