"""Distances from points to the nearest of many line segments, up to a maximum distance.

Points are sorted by vertical strips of the image and by row within each strip. A segment is compared only with the
points within its reach, which are contiguous in memory and processed as whole vectors.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import FAR, FAR2, FAST_MATH, HALF, NO_REFCOUNT, ONE, TINY, ZERO, njit
from tracker.geometry.arrays import FloatArray, IntArray

LANES = 16
"""Numbers that are processed together; buffers of points have this many to spare."""
STRIP_PX = 128
"""Width of the strips. Narrower strips hold fewer points out of reach, but fill fewer vectors with points within."""


class Segments(NamedTuple):
    """Line segments, in buffers of a fixed size."""

    u: FloatArray
    """Start point, (room,), px."""
    v: FloatArray
    """(room,), px."""
    du: FloatArray
    """Vector from start to end, (room,), px."""
    dv: FloatArray
    """(room,), px."""


def segment_buffer(room: int) -> Segments:
    """Allocate uninitialized segments."""
    return Segments(*(np.empty(room, np.float32) for _ in range(4)))


class RowSortedPoints(NamedTuple):
    """Points sorted by strip of the image, then by row."""

    points: FloatArray
    """u and v, px, and any further values of each point, (2 + more, N). N is a multiple of `LANES`. At least `LANES`
    points at the end are padding: far away, with further values 0."""
    rows: IntArray
    """Index of the first point of each strip in each row or below, (strips, height + 1). The last entry of a strip is
    the start of the next strip, that of the last strip the number of points."""

    @property
    def n_points(self) -> int:
        """Number of points."""
        return int(self.rows[-1, -1])


def sort_points(points: FloatArray, size: tuple[int, int]) -> RowSortedPoints:
    """Sort points (N, 2 + more) of an image of the given width and height; points outside count as on its border."""
    n_strips = -(-size[0] // STRIP_PX)
    filled = np.zeros((points.shape[1], _room_for(len(points))), np.float32)
    filled[:2] = FAR
    begins = np.zeros((n_strips, size[1] + 1), np.int64)
    _sort(np.ascontiguousarray(points, np.float32), np.empty(len(points), np.int64), begins, filled)
    return RowSortedPoints(filled, begins)


def _room_for(n: int) -> int:
    """Size of the buffer of sorted points, see `RowSortedPoints`."""
    return (n // LANES + 2) * LANES


@njit(nogil=True, cache=True)
def _sort(points: FloatArray, cells: IntArray, begins: IntArray, out: FloatArray) -> None:
    """Sort points (N, n) into out (n, N or more) by counting. `cells` is a buffer of N numbers; `begins` is zero."""
    n_strips, height = begins.shape[0], begins.shape[1] - 1
    flat = begins.reshape(-1)
    for i in range(points.shape[0]):
        strip = min(max(int(np.floor(points[i, 0])) // STRIP_PX, 0), n_strips - 1)
        cells[i] = strip * (height + 1) + min(max(int(np.floor(points[i, 1])), 0), height - 1)
        flat[cells[i]] += 1
    total = 0
    for k in range(flat.shape[0]):
        here, flat[k] = flat[k], total
        total += here
    for i in range(points.shape[0]):
        for k in range(points.shape[1]):
            out[k, flat[cells[i]]] = points[i, k]
        flat[cells[i]] += 1
    for k in range(flat.shape[0] - 1, 0, -1):  # each cell has advanced to the start of the next one
        flat[k] = flat[k - 1]
    flat[0] = 0


def within_reach(
    everything: RowSortedPoints, pieces_px: FloatArray, hidden: NDArray[np.bool_], reach: float
) -> RowSortedPoints:
    """Select the points within reach, px, of a visible piece, x0, y0, x1, y1, (M, 4); hidden is (M,)."""
    points, rows = everything.points.copy(), everything.rows.copy()
    n = _keep_within(
        points, rows, pieces_px, hidden, reach, segment_buffer(len(hidden)), np.empty(points.shape[1], np.float32)
    )
    return RowSortedPoints(points[:, : _room_for(n)], rows)


@njit(**NO_REFCOUNT)
def _keep_within(
    points: FloatArray, rows: IntArray, pieces: FloatArray, hidden: NDArray[np.bool_], reach: float,
    segments: Segments, distances: FloatArray,
) -> int:  # fmt: skip
    """Move the points, (n, N), within reach of a visible piece to the front in sorted order, and return their number.

    Segments and distances are buffers, (M,) and (N,).
    """
    n = np.int64(0)
    for i in range(pieces.shape[0]):
        if not hidden[i]:
            segments.u[n], segments.v[n] = pieces[i, 0], pieces[i, 1]
            segments.du[n], segments.dv[n] = pieces[i, 2] - pieces[i, 0], pieces[i, 3] - pieces[i, 1]
            n += 1
    nearest_segment(points[0], points[1], rows, segments, n, reach, distances)
    kept = i = 0
    for strip in range(rows.shape[0]):
        for row in range(rows.shape[1]):
            while i < rows[strip, row]:
                if distances[i] <= reach:
                    for k in range(points.shape[0]):
                        points[k, kept] = points[k, i]
                    kept += 1
                i += 1
            rows[strip, row] = kept
    points[:2, kept:], points[2:, kept:] = FAR, ZERO
    return kept


def stack_rows(rows: Sequence[IntArray]) -> IntArray:
    """Stack the `RowSortedPoints.rows` of several images in one array, (n, most strips, largest height + 1).

    A smaller image is padded with empty rows and copies of its last strip; its points must lie within it.
    """
    out = np.empty((len(rows), max(r.shape[0] for r in rows), max(r.shape[1] for r in rows)), np.int64)
    for into, given in zip(out, rows, strict=True):
        strips, n_rows = given.shape
        into[:strips, :n_rows] = given
        into[:strips, n_rows:] = given[:, -1:]
        into[strips:] = into[strips - 1]
    return out


class SortedViews(NamedTuple):
    """Sorted points of several images."""

    points: FloatArray
    """`RowSortedPoints.points`, one image after the other, (2 + more, N)."""
    firsts: IntArray
    """Index of the first point of each image, then N, (V + 1,)."""
    rows: IntArray
    """See `stack_rows`, (V, strips, rows + 1)."""
    counts: IntArray
    """Number of points of each image without padding, (V,)."""


def stack_points(points: Sequence[FloatArray], sizes: Sequence[tuple[int, int]]) -> SortedViews:
    """Sort the points (N, 2 + more) of images of the given widths and heights; see `sort_points`."""
    return _stacked([sort_points(p, size) for p, size in zip(points, sizes, strict=True)])


def near_points(
    points: Sequence[FloatArray], sizes: Sequence[tuple[int, int]],
    pieces: Sequence[tuple[FloatArray, NDArray[np.bool_]]], reaches: Sequence[float],
) -> SortedViews:  # fmt: skip
    """Sort the points of images and select those near visible pieces; see `sort_points` and `within_reach`.

    Args:
        points: of each image, (N, 2 + more).
        sizes: width and height of each, px.
        pieces: x0, y0, x1, y1, (M, 4), of each, and whether they are hidden, (M,).
        reaches: largest distance in each, px.
    """
    each = zip(points, sizes, pieces, reaches, strict=True)
    return _stacked([within_reach(sort_points(p, size), *own, reach) for p, size, own, reach in each])


def _stacked(each: Sequence[RowSortedPoints]) -> SortedViews:
    return SortedViews(
        np.ascontiguousarray(np.concatenate([e.points for e in each], axis=1)),
        np.cumsum([0, *(e.points.shape[1] for e in each)], dtype=np.int64),
        stack_rows([e.rows for e in each]), np.array([e.n_points for e in each], dtype=np.int64),
    )  # fmt: skip


@njit(**NO_REFCOUNT)
def cells_within(
    u0: np.float32, v0: np.float32, u1: np.float32, v1: np.float32, reach: np.float32, rows: IntArray
) -> tuple[int, int, int, int]:
    """Return the first and last strip, the first row and the row after the last within reach of a segment."""
    last_strip, last_row = rows.shape[0] - 1, rows.shape[1] - 2
    left, right = int(min(u0, u1) - reach) // STRIP_PX, int(max(u0, u1) + reach) // STRIP_PX
    top, bottom = int(min(v0, v1) - reach) - 1, int(max(v0, v1) + reach) + 1
    return (
        min(max(left, 0), last_strip), min(max(right, 0), last_strip),
        min(max(top, 0), last_row), min(max(bottom, 0), last_row) + 1,
    )  # fmt: skip


@njit(**FAST_MATH)
def nearest_segment(
    u: FloatArray, v: FloatArray, rows: IntArray, segments: Segments, n: int, reach: float, out: FloatArray
) -> None:
    """Compute the distance of each point to the nearest of n segments; beyond the reach it is at least the reach.

    Args:
        u: of the points (see `RowSortedPoints`), (N,), px.
        v: (N,), px.
        rows: index of the first point of each strip and row, (strips, height + 1).
        segments: the segments.
        n: their number.
        reach: largest distance of interest, px.
        out: the distances, (N,), px.
    """
    out[: u.shape[0]] = FAR2
    far = np.float32(reach)
    for k in range(n):
        x, y, dx, dy = segments.u[k], segments.v[k], segments.du[k], segments.dv[k]
        left, right, top, bottom = cells_within(x, y, x + dx, y + dy, far, rows)
        # Coordinates along and across the segment, from its middle.
        length = np.sqrt(dx * dx + dy * dy)
        along_u, along_v = (dx / length, dy / length) if length > TINY else (ONE, ZERO)
        half = HALF * length
        x, y = x + HALF * dx, y + HALF * dy
        for strip in range(left, right + 1):
            first, last = np.uint64(rows[strip, top]), np.uint64(rows[strip, bottom])
            # Round up to whole vectors; the extra points are nearby at worst. Unsigned indices let it vectorize.
            for j in range((last - first + np.uint64(LANES - 1)) // np.uint64(LANES) * np.uint64(LANES)):
                i = first + j
                from_u, from_v = u[i] - x, v[i] - y
                across = from_v * along_u - from_u * along_v
                beyond = abs(from_u * along_u + from_v * along_v) - half
                beyond = beyond if beyond > ZERO else ZERO
                squared = across * across + beyond * beyond
                out[i] = squared if squared < out[i] else out[i]
    for k in range(u.shape[0]):
        out[k] = np.sqrt(out[k])
