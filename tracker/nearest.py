"""How far points are from the nearest of many line segments, as far as that matters.

Points are kept sorted by the row of the image they lie in, so that a segment is held only against those whose rows
come within reach of it: whole vectors of points, one after the other in memory.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.kernels import FAST

FloatArray = NDArray[np.float32]
IntArray = NDArray[np.int64]

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)  # plain numbers would turn the kernel's arithmetic into float64
_FAR, _FAR2 = np.float32(1e6), np.float32(1e12)
LANES = 16
"""Points that are worked on together."""


class Segments(NamedTuple):
    """Line segments, as many as there is room for."""

    u: FloatArray
    """Where each begins, (room,), px."""
    v: FloatArray
    """(room,), px."""
    du: FloatArray
    """The way to its end, (room,), px."""
    dv: FloatArray
    """(room,), px."""


def segment_buffer(room: int) -> Segments:
    """Uninitialized room for segments."""
    return Segments(*(np.empty(room, np.float32) for _ in range(4)))


class RowSorted(NamedTuple):
    """Points sorted by the row of the image they lie in."""

    points: FloatArray
    """u and v, px, and whatever else was given with each point, (2 + more, N); N is filled up to whole `LANES` by
    points far away, of which all else is 0."""
    rows: IntArray
    """Index of the first point in each row or below, (height + 1,); the last is the number of points."""

    @property
    def n_points(self) -> int:
        """Number of points."""
        return int(self.rows[-1])


def sort_by_row(points: FloatArray, height: int) -> RowSorted:
    """Sort points (N, 2 + more) by row; those above or below the image count to its first or last."""
    rows = np.clip(np.floor(points[:, 1]), 0, height - 1).astype(np.int64)
    order = np.argsort(rows, kind="stable")
    filled = np.zeros((points.shape[1], -(-len(points) // LANES) * LANES), np.float32)
    filled[:2] = _FAR
    filled[:, : len(points)] = points[order].T
    return RowSorted(filled, np.searchsorted(rows[order], np.arange(height + 1)).astype(np.int64))


@njit(**FAST)
def nearest_segment(
    u: FloatArray, v: FloatArray, rows: IntArray, segments: Segments, n: int, reach: float, out: FloatArray
) -> None:
    """Distance of each point to the nearest of n segments; exact up to the reach, beyond it at least the reach.

    Args:
        u: of the points (see `RowSorted`), (N,), px.
        v: (N,), px.
        rows: index of the first point of each row, (height + 1,).
        segments: the segments.
        n: their number.
        reach: up to where distances matter, px.
        out: the distances, (N,), px.
    """
    last_row = rows.shape[0] - 1
    out[: u.shape[0]] = _FAR2
    far = np.float32(reach)
    for k in range(n):
        x, y, dx, dy = segments.u[k], segments.v[k], segments.du[k], segments.dv[k]
        inverse = _ONE / max(dx * dx + dy * dy, np.float32(1e-12))
        top, bottom = int(min(y, y + dy) - far) - 1, int(max(y, y + dy) + far) + 1
        first = rows[min(max(top, 0), last_row - 1)] // LANES * LANES  # whole vectors, of points nearby at worst
        count = (rows[min(max(bottom, 1), last_row)] - first + LANES - 1) // LANES * LANES
        for j in range(np.uint64(count)):  # unsigned: an index that may be negative is not vectorized
            i = np.uint64(first) + j
            from_u, from_v = u[i] - x, v[i] - y
            t = (from_u * dx + from_v * dy) * inverse
            t = t if t > _ZERO else _ZERO
            t = t if t < _ONE else _ONE
            off_u, off_v = from_u - t * dx, from_v - t * dy
            squared = off_u * off_u + off_v * off_v
            out[i] = squared if squared < out[i] else out[i]
    for k in range(u.shape[0]):
        out[k] = np.sqrt(out[k])
