"""Arrays of the contour residuals: the evidence of all views, scratch buffers, and the sums that the kernels fill."""

from enum import IntEnum, auto
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.evidence.contours.pieces import Pieces, piece_buffer
from tracker.evidence.contours.static_cache import StaticContours
from tracker.evidence.contours.surfaces import Surfaces
from tracker.geometry.arrays import Array, FloatArray


class ContourMotion(IntEnum):
    """How contour points move; see `contour_residuals.MatchSettings`."""

    ACROSS = auto()
    RIGID = auto()
    SLIDING = auto()


class ViewArrays(NamedTuple):
    """The evidence of all views as arrays; lengths in working px."""

    P: Array
    """Projection matrices, (V, 3, 4)."""
    eyes: Array
    """Camera centres in the world, (V, 3), metres."""
    sizes: NDArray[np.int64]
    """Widths and heights, (V, 2), px."""
    distances: FloatArray
    """Distance images, one after the other, row by row."""
    points: FloatArray
    """Columns of `points_to_match`, (N_COLUMNS, N), one view after the other, each as
    `segment_distance.RowSortedPoints`. Padding points have no weight."""
    firsts: NDArray[np.int64]
    """Index of the first point of each view, then the number of all points, (V + 1,)."""
    rows: NDArray[np.int64]
    """Index, within the view, of the first point of each strip and row, (V, strips, rows + 1)."""
    thetas: Array
    """Outlier distances, (V,), px."""
    weights: Array
    """Information per pixel of contour, model to image and image to model, (V, 2)."""


class Scratch(NamedTuple):
    """Buffers of the kernels, used by one thread at a time."""

    traced: Pieces
    pieces: FloatArray
    """Visible pieces, part by part: u, v of the middle, length, the normal's u, v, and the middle's x, y, z in the unit
    coordinates of its part, (8, room)."""
    firsts: NDArray[np.int64]
    """Index of the first visible piece of each part, then the number of all, (P + 1,)."""
    pulls: Array
    """Weighted sums over the residuals of each visible piece, (7, room). For residuals across the piece: squared image
    gradients, and gradients times residuals. For residuals at its ends: g_u^2, g_u g_v, g_v^2, and g_u and g_v times
    the residuals."""
    segments: FloatArray
    """Segments, each of consecutive pieces on one straight edge: u, v, du, dv, 1 / length^2, the normal's u, v, (7,
    room)."""
    of_segment: NDArray[np.int32]
    """First piece of each segment, its number of pieces, and its part, (3, room)."""
    wanted: NDArray[np.bool_]
    """Whether points are compared with each segment, (room,)."""
    best: FloatArray
    """Squared distance of each edge point to its segment, with the angle between them, (room,), px^2."""
    nearest: NDArray[np.int32]
    """Index of that segment, (room,); -1 for a cached static segment (see `static_cache`)."""
    pull: FloatArray
    """Weight of each edge point's residual, (room,)."""


def scratch_buffer(surfaces: Surfaces, room: int, n_points: int) -> Scratch:
    """Return uninitialized scratch for a number of pieces in a view and of points in all views."""
    return Scratch(
        piece_buffer(surfaces, room), np.empty((8, room), np.float32),
        np.empty(len(surfaces.radii) + 1, np.int64), np.empty((7, room)), np.empty((7, room), np.float32),
        np.empty((3, room), np.int32), np.empty(room, np.bool_), np.empty(n_points, np.float32),
        np.empty(n_points, np.int32), np.empty(n_points, np.float32),
    )  # fmt: skip


class Sums(NamedTuple):
    """Sums that the kernels fill."""

    M: Array
    """Normal matrix of each part's twist, upper triangles, (P, 6, 6)."""
    b: Array
    """Gradient by each part's twist, (P, 6)."""
    parts: Array
    """Per view and part: visible length, its summed cut-off distance, and explained points, (V, P, 3)."""
    costs: Array
    """Cost of each view, (V,)."""


def sums_buffer(n_parts: int, n_views: int) -> Sums:
    """Return uninitialized sums."""
    return Sums(np.empty((n_parts, 6, 6)), np.empty((n_parts, 6)), np.empty((n_views, n_parts, 3)), np.empty(n_views))


class ContourTerm(NamedTuple):
    """Arguments of `contour_kernels.accumulate_normal_equations`. The scratch and sums make it single-threaded."""

    Ts: Array
    """World poses of all parts, (P, 4, 4), metres."""
    first: int
    """Index of the first part that is fitted."""
    last: int
    """Index after the last part that is fitted. The other parts occlude, and take the points that are nearer to
    them."""
    surfaces: Surfaces
    views: ViewArrays
    scale: float
    """See `contour_residuals.MatchSettings`."""
    turn: float
    """See `contour_residuals.MatchSettings`."""
    motion: int
    """A `ContourMotion`."""
    static: StaticContours
    scratch: Scratch
    sums: Sums
    """Output."""
