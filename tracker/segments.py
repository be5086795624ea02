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

FloatArray = NDArray[np.float32]
IntArray = NDArray[np.int64]

MAX_LENGTH = 30
"""Most pixels of a segment: where body and background are linked in a smooth line, they part here at the latest."""
BEND_RAD = 0.35
"""How far the direction of the edge may stray from one that turns evenly before the segment ends, rad."""
STRAYS = 3
"""As many pixels in a row must stray: single ones are noise."""
MAX_ANGLE_RAD = np.radians(45.0)
"""Largest angle between an edge and a contour that it may belong to."""
_STRIDE = 2  # distances change little from one pixel of a segment to the next
_NONE_LEFT = -10


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


def accept(segments: Segments, pieces_px: FloatArray, threshold_px: float) -> NDArray[np.bool_]:
    """Judge each segment by its directed chamfer distance to predicted contours.

    A pixel counts with its distance to the nearest piece of contour that runs more or less as the edge does, at most
    twice the threshold.

    Args:
        segments: the segments of a view.
        pieces_px: end points x0, y0, x1, y1 of the visible pieces of predicted contours, (M, 4), px of the view.
        threshold_px: mean distance up to which a segment is accepted, px.

    Returns:
        (S,) bool.
    """
    total, count = _summed(segments, pieces_px, 2.0 * threshold_px)
    return np.asarray(total <= threshold_px * count)


def distances(
    segments: Segments, pieces_px: FloatArray, reach_px: float, asked: NDArray[np.bool_] | None = None
) -> NDArray[np.float64]:
    """Mean distance of each segment, (S,), px, to contours as `accept` takes it, each pixel's cut off at a reach.

    That of segments that are not `asked`, (S,), is the reach.
    """
    total, count = _summed(segments, pieces_px, reach_px, asked)
    return np.divide(total, count, out=np.full(len(total), float(reach_px)), where=count > 0)


def _summed(
    segments: Segments, pieces_px: FloatArray, reach_px: float, asked: NDArray[np.bool_] | None = None
) -> tuple[FloatArray, IntArray]:
    """Summed distances of the pixels of each segment that are asked, (S,), px, and their number, (S,)."""
    n = len(segments.firsts) - 1
    total, count = np.empty(n, np.float32), np.empty(n, np.int64)
    if n:
        pieces, wanted = np.ascontiguousarray(pieces_px, np.float32), np.ones(n, np.bool_) if asked is None else asked
        _sum_distances(segments, pieces, reach_px, MAX_ANGLE_RAD, wanted, total, count)
    return total, count


def pixels_of(segments: Segments, chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which pixels belong to chosen segments, (S,) to (N,)."""
    return np.repeat(chosen, np.diff(segments.firsts))


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


@njit(nogil=True, cache=True, error_model="numpy")
def _sum_distances(
    segments: Segments, pieces: FloatArray, reach: float, max_angle: float, asked: NDArray[np.bool_],
    totals: FloatArray, counts: IntArray,
) -> None:  # fmt: skip
    """See `_summed`. Pieces are filed by cells as large as the largest distance that counts."""
    points, normals, firsts = segments.points_px, segments.normals, segments.firsts
    far = np.float32(reach)
    across = np.float32(np.sin(max_angle) ** 2)
    low_u, low_v = points[:, 0].min() - far, points[:, 1].min() - far
    columns = int((points[:, 0].max() + far - low_u) / far) + 1
    rows = int((points[:, 1].max() + far - low_v) / far) + 1
    heads, following = np.full((rows, columns), -1, np.int64), np.empty(pieces.shape[0], np.int64)
    for k in range(pieces.shape[0]):
        # Pieces are short: their middle tells the cell, and the search goes one cell further.
        c = int(np.floor((0.5 * (pieces[k, 0] + pieces[k, 2]) - low_u) / far))
        r = int(np.floor((0.5 * (pieces[k, 1] + pieces[k, 3]) - low_v) / far))
        if 0 <= r < rows and 0 <= c < columns:
            following[k] = heads[r, c]
            heads[r, c] = k
    for s in range(totals.shape[0]):
        first, last = firsts[s], firsts[s + 1]
        total, count = np.float32(0.0), 0
        for i in range(first, last if asked[s] else first, _STRIDE):
            u, v, nu, nv = points[i, 0], points[i, 1], normals[i, 0], normals[i, 1]
            c, r = int((u - low_u) / far), int((v - low_v) / far)
            best = far * far
            for row in range(max(0, r - 1), min(rows, r + 2)):
                for column in range(max(0, c - 1), min(columns, c + 2)):
                    k = heads[row, column]
                    while k >= 0:
                        x, y = pieces[k, 0], pieces[k, 1]
                        dx, dy = pieces[k, 2] - x, pieces[k, 3] - y
                        length2 = max(dx * dx + dy * dy, np.float32(1e-6))
                        along = nu * dx + nv * dy
                        if along * along <= across * length2:
                            t = ((u - x) * dx + (v - y) * dy) / length2
                            t = min(max(t, np.float32(0.0)), np.float32(1.0))
                            off_u, off_v = u - x - t * dx, v - y - t * dy
                            best = min(best, off_u * off_u + off_v * off_v)
                        k = following[k]
            total += np.sqrt(best)
            count += 1
        totals[s], counts[s] = total, count
