"""Arrays of the contour residuals: points and evidence of all views, scratch buffers, and the sums of the kernels."""

from enum import IntEnum, auto
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.pieces import Pieces, StaticContours, piece_buffer, static_contours_buffer
from tracker.evidence.contours.surfaces import Surfaces, surfaces_of
from tracker.evidence.images.silhouette_contour import SAME_PX
from tracker.evidence.view_evidence import SCENE_SPACING_PX, ViewEvidence
from tracker.geometry.arrays import Array, FloatArray, IntArray


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


def no_contours(model: BodyModel) -> ContourTerm:
    """Return the term of no views, which adds nothing: a body without contours, for kernels that expect some."""
    surfaces, n_parts = surfaces_of((model,)), len(model.parts)
    views = ViewArrays(
        np.empty((0, 3, 4)), np.empty((0, 3)), np.empty((0, 2), np.int64), np.empty(0, np.float32),
        np.empty((N_COLUMNS, 0), np.float32), np.zeros(1, np.int64), np.empty((0, 0, 0), np.int64), np.empty(0),
        np.empty((0, 2)),
    )  # fmt: skip
    static = static_contours_buffer(0, 0, 0, np.ones(n_parts, np.bool_))
    return ContourTerm(
        np.empty((n_parts, 4, 4)), 0, n_parts, surfaces, views, 1.0, 1.0, int(ContourMotion.ACROSS), static,
        scratch_buffer(surfaces, 0, 0), sums_buffer(n_parts, 0),
    )  # fmt: skip


N_COLUMNS = 6
"""Columns of a point: u, v, the normal's u and v, the weight, and the number of points it stands for."""
_AREA_PX = 8
"""Size of the areas that are classified as near a contour or not, px. It only saves work, so coarse areas suffice."""
_SAME_COS = 0.9
"""Smallest cosine of the angle between a silhouette point and the edge that it lies on: 26 degrees, because both point
for the same line."""


def points_to_match(
    view: ViewEvidence, contour: occluding_contours.Contour | None, reach_px: float, edges: float, silhouette: float
) -> FloatArray:
    """Return the points of a view within reach of the visible contours, each line once, (N, N_COLUMNS).

    The contour of a silhouette mostly is an edge as well. One point then stands for both. It lies between them and has
    their summed weight, so that it pulls a pose like both.

    Args:
        view: evidence of the view.
        contour: contours of all bodies in the view; None keeps all points.
        reach_px: largest distance of points from the visible contours, working px.
        edges: weight of an edge point.
        silhouette: weight of a silhouette point in a fully trusted view.
    """
    (width, height), shown, n_edges = view.camera.size, view.silhouette, len(view.points_px)
    weight = 0.0 if shown is None else silhouette * shown.trust
    n_silhouette = len(shown.points_px) if shown is not None and weight > 0 else 0
    points = np.empty((n_edges + n_silhouette, N_COLUMNS), np.float32)
    points[:n_edges, :2], points[:n_edges, 2:4], points[:n_edges, 4:] = view.points_px, view.normals, (edges, 1.0)
    n = n_edges
    if shown is not None and n_silhouette:
        own = points[n_edges:]
        own[:, :2], own[:, 2:4], own[:, 4:] = shown.points_px, shown.normals, (weight, 1.0)
        cells = (height // SCENE_SPACING_PX + 1, width // SCENE_SPACING_PX + 1)
        n = _merge(points, n_edges, np.full(cells, -1, np.int64))
    if contour is None:
        return points[:n]
    near = np.zeros((height // _AREA_PX + 1, width // _AREA_PX + 1), np.bool_)
    _mark(contour.pieces_px, contour.occluded, int(np.ceil(reach_px / _AREA_PX)), near)
    return points[: _pack(points[:n], near)]


@njit(**NO_REFCOUNT)
def _merge(points: FloatArray, n_edges: int, cells: IntArray) -> int:
    """Merge silhouette points, which follow the edge points, into the edges that they lie on.

    Args:
        points: (N, N_COLUMNS).
        n_edges: number of edge points.
        cells: scratch, -1 in each cell of the spacing of the points.

    Returns:
        Number of remaining points; they are at the front.
    """
    rows, columns = cells.shape
    for i in range(n_edges):
        cells[int(points[i, 1]) // SCENE_SPACING_PX, int(points[i, 0]) // SCENE_SPACING_PX] = i
    n = n_edges
    for i in range(n_edges, points.shape[0]):
        u, v, nu, nv = points[i, 0], points[i, 1], points[i, 2], points[i, 3]
        row, column, nearest, best = int(v) // SCENE_SPACING_PX, int(u) // SCENE_SPACING_PX, -1, np.inf
        for r in range(max(0, row - 1), min(rows, row + 2)):
            for c in range(max(0, column - 1), min(columns, column + 2)):
                k = cells[r, c]
                if k < 0 or abs(points[k, 2] * nu + points[k, 3] * nv) < _SAME_COS:
                    continue
                du, dv = u - points[k, 0], v - points[k, 1]
                squared = du * du + dv * dv
                if squared < best and abs(du * nu + dv * nv) <= SAME_PX:
                    nearest, best = k, squared
        if nearest >= 0:
            for k in range(4, N_COLUMNS):
                points[nearest, k] += points[i, k]
            share = points[i, 4] / points[nearest, 4]
            for k in range(2):
                points[nearest, k] += share * (points[i, k] - points[nearest, k])
        else:
            for k in range(N_COLUMNS):
                points[n, k] = points[i, k]
            n += 1
    return n


@njit(nogil=True, cache=True)
def _mark(pieces: FloatArray, occluded: NDArray[np.bool_], reach: int, near: NDArray[np.bool_]) -> None:
    """Mark the areas within reach of the middles of visible pieces."""
    rows, columns = near.shape
    for i in range(pieces.shape[0]):
        c = int(0.5 * (pieces[i, 0] + pieces[i, 2])) // _AREA_PX
        r = int(0.5 * (pieces[i, 1] + pieces[i, 3])) // _AREA_PX
        if occluded[i] or c < -reach or r < -reach or c >= columns + reach or r >= rows + reach:
            continue
        near[max(0, r - reach) : max(0, r + reach + 1), max(0, c - reach) : max(0, c + reach + 1)] = True


@njit(nogil=True, cache=True)
def _pack(points: FloatArray, near: NDArray[np.bool_]) -> int:
    """Move the points in marked areas to the front; return their number."""
    n = 0
    for i in range(points.shape[0]):
        if near[int(points[i, 1]) // _AREA_PX, int(points[i, 0]) // _AREA_PX]:
            for k in range(N_COLUMNS):
                points[n, k] = points[i, k]
            n += 1
    return n
