"""Evidence of one view: the edges that poses are scored against, and their distance image.

The features of a region do not depend on a prediction (`RegionFeatures`). Which of its edges count does
(`select_evidence`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import njit
from tracker.evidence.images.background_subtraction import Changes
from tracker.evidence.images.color_histogram import BINS, count_colors
from tracker.evidence.images.distance_transform import distance_image
from tracker.evidence.images.edge_segments import (
    MAX_ANGLE_RAD,
    MAX_LENGTH,
    EdgeSegments,
    Samples,
    accept_segments,
    sample_segments,
)
from tracker.evidence.images.edges import Edges, StaticEdgeModel
from tracker.evidence.images.silhouette_contour import SilhouetteContour, contour_trust, trace_silhouette
from tracker.evidence.keypoints import ViewKeypoints
from tracker.geometry.arrays import Array, FloatArray, Image, Mask
from tracker.geometry.cameras import Camera, Region

SCENE_SPACING_PX = 4
"""Size of the cells in which edges are thinned to one point each, px."""

ACCEPTED_SHARE = 0.5
"""Largest mean distance of an accepted segment to the predicted contours, as a share of theta."""


@dataclass(frozen=True)
class EdgeSettings:
    """Settings that decide which edges of a frame are evidence."""

    whole_images: bool = False
    """Whether edges are found in whole images; else in the region around the prediction."""
    foreground: bool = True
    """Whether edges are restricted to the foreground, where masks or a background exist, and its contour is used."""
    static: bool = True
    """Whether edges that stay where they are while people move are refused, in views without masks and background."""
    max_segment_px: int | None = MAX_LENGTH
    """Largest number of pixels of a segment; None: no limit."""
    max_angle_rad: float = MAX_ANGLE_RAD
    """Largest angle between an edge of an accepted segment and the predicted contour, rad."""


DEFAULT_EDGES = EdgeSettings()


@dataclass(frozen=True, eq=False)
class Silhouette:
    """Silhouette of all people in a region of a view, from masks or a background."""

    inside: Mask
    """The silhouette without shadows, with what is unknown, (H, W)."""
    points_px: FloatArray
    """Thinned points of its contour, (N, 2), working px of the region."""
    normals: FloatArray
    """Unit normals at these points, out of the silhouette, (N, 2)."""
    trust: float
    """How far to trust it, 0 to 1; see `silhouette_contour.contour_trust`."""
    contour: SilhouetteContour
    """All pixels of its contour."""
    limit_px: float
    """Largest value of `distance`, working px."""

    @cached_property
    def distance(self) -> FloatArray:
        """Distance to the contour, (H, W), working px."""
        on_contour = np.zeros(self.inside.shape, np.uint8)
        u, v = self.contour.points_px.T.astype(np.intp)
        on_contour[v, u] = 1
        return distance_image(on_contour, self.limit_px)


@dataclass(frozen=True, eq=False)
class ViewEvidence:
    """The edges of one view, or of a region of it, in working pixels."""

    camera: Camera
    """Camera of the region: without lens distortion, at working scale, with pixels counted from the region's corner."""
    scale: float
    """Working pixels per pixel of the footage, at most 1."""
    points_px: FloatArray
    """Thinned edge points for the image-to-model direction, (N, 2), working px of the region."""
    distance: FloatArray
    """Distance to the nearest edge, cut off at twice theta, (H, W), working px."""
    corner_px: tuple[int, int] = (0, 0)
    """First pixel of the region in the whole image, working px."""
    image_size: tuple[int, int] | None = None
    """Width and height of the footage at working scale, px; None if the region is the whole image of a lens that is no
    fisheye."""
    normals: FloatArray = field(default_factory=lambda: np.empty((0, 2), np.float32))
    """Unit gradient at each of `points_px`, from dark to light, (N, 2); zero where the direction is unknown."""
    colors: Image | None = None
    """Smoothed image of the region, (H, W, 3) RGB; None if the frame is damaged or the image was not kept."""
    segments: EdgeSegments | None = None
    """All edges, linked, in px of the region; None if their directions are unknown."""
    samples: Samples | None = None
    """Samples of the segments, for distances to contours; None without segments."""
    accepted: NDArray[np.bool_] | None = None
    """Which segments the prediction accepts, (S,); only these are in `points_px` and `distance`. None: all segments."""
    is_static: NDArray[np.bool_] | None = None
    """Which segments are static edges, (S,), and never accepted; None if unknown."""
    silhouette: Silhouette | None = None
    """Silhouette in the region; None without masks and background."""
    ahead_frames: float = 0.0
    """Frames by which the picture was taken later than the frame; see `Clock.ahead`."""
    keypoints: tuple[ViewKeypoints | None, ...] = ()
    """Key points of each person in px of the region; None of one without any, empty where there are none at all."""

    @cached_property
    def color_counts(self) -> NDArray[np.int64]:
        """Histogram of the colours, (BINS^3,); see `color_histogram.bin_of`. All 0 without an image."""
        counts = np.zeros(BINS**3, np.int64)
        if self.colors is not None:
            count_colors(self.colors, counts)
        return counts

    @property
    def theta_px(self) -> float:
        """Outlier distance, working px: beyond it an edge does not count. It follows the size of the whole image."""
        return default_theta_px(self.image_size or self.camera.size)

    def outlier_px(self, theta_px: float | None) -> float:
        """Convert an outlier distance from px of the footage to working px; None gives `theta_px` of the view."""
        return self.theta_px if theta_px is None else theta_px * self.scale


def with_colors_only(view: ViewEvidence, colors: Image | None = None) -> ViewEvidence:
    """Return a view without its edges, which takes a tenth of the memory; with other colours, (H, W, 3), if given."""
    no_points, no_distance = np.empty((0, 2), np.float32), np.empty((0, 0), np.float32)
    return ViewEvidence(
        view.camera, view.scale, no_points, no_distance, view.corner_px, view.image_size,
        colors=view.colors if colors is None else colors, ahead_frames=view.ahead_frames,
    )  # fmt: skip


def outliers_px(views: Sequence[ViewEvidence], theta_px: float | None) -> Array:
    """Convert an outlier distance from px of the footage to working px of each view, (V,); see `outlier_px`."""
    return np.array([v.outlier_px(theta_px) for v in views])


def default_theta_px(size: tuple[int, int]) -> float:
    """Return the outlier distance of an image of a size, px: 3% of its longer side (20 px at 640x480)."""
    return 0.03 * max(size)


def silhouette_evidence(changes: Changes, edges: Edges, size: tuple[int, int]) -> Silhouette:
    """Build the evidence of a silhouette. Next to unknown pixels it has no contour, and among them no outside.

    Args:
        changes: the silhouette in a region.
        edges: edges of the same region.
        size: of the footage at working scale, px; distances to the contour end at twice its outlier distance.
    """
    inside, contour = changes.inside, trace_silhouette(changes.inside)
    if changes.unknown is not None:
        contour, inside = contour.away_from(changes.unknown), changes.inside | changes.unknown
    first = thin_points(contour.points_px, *inside.shape)
    trust = contour_trust(contour, inside, edges)
    return Silhouette(
        inside, contour.points_px[first], contour.normals[first], trust, contour, 2 * default_theta_px(size)
    )


class RegionFeatures(NamedTuple):
    """Features of a region of a view that do not depend on a prediction; see `ViewEvidence`."""

    camera: Camera
    scale: float
    corner_px: tuple[int, int]
    image_size: tuple[int, int] | None
    found: NDArray[np.uint8]
    """Edges are not 0, (H, W)."""
    segments: EdgeSegments | None = None
    samples: Samples | None = None
    """Samples of the segments; None if not yet taken."""
    colors: Image | None = None
    silhouette: Silhouette | None = None

    @property
    def box(self) -> Region:
        """The region, working px of the whole image."""
        (u0, v0), (width, height) = self.corner_px, self.camera.size
        return u0, v0, u0 + width, v0 + height


def select_evidence(
    features: RegionFeatures,
    predicted_px: FloatArray | None,
    static_edges: StaticEdgeModel | None,
    max_angle_rad: float = MAX_ANGLE_RAD,
    ahead_frames: float = 0.0,
) -> ViewEvidence:
    """Select the edges of a region that the prediction accepts and that are not static.

    Args:
        features: features of the region.
        predicted_px: visible pieces of the predicted contours, x0, y0, x1, y1, (M, 4), px of the region; None accepts
            all edges. Without segments all edges are accepted.
        static_edges: static edges of the view, which are refused; None if unknown.
        max_angle_rad: largest angle between an edge of an accepted segment and a contour, rad.
        ahead_frames: frames by which the picture was taken later than the frame.
    """
    segments, samples, theta = (
        features.segments,
        features.samples,
        default_theta_px(features.image_size or features.camera.size),
    )
    chosen = is_static = None
    if segments is not None:
        samples = samples or sample_segments(segments)
        if predicted_px is not None:
            chosen = accept_segments(samples, predicted_px, ACCEPTED_SHARE * theta, max_angle_rad)
        if static_edges is not None:
            is_static = static_edges.contains(segments, features.corner_px)
            chosen = ~is_static if chosen is None else chosen & ~is_static
    points, normals, found = _matched_edges(segments, chosen, features.found)
    # Distances beyond twice theta are never used.
    distance = distance_image(found, 2 * theta)
    return ViewEvidence(
        features.camera, features.scale, points, distance, features.corner_px, features.image_size, normals,
        features.colors, segments, samples, chosen, is_static, features.silhouette, ahead_frames,
    )  # fmt: skip


def with_all_segments(view: ViewEvidence) -> ViewEvidence:
    """Return a view with all edges that are not static, because a wrong prediction may have refused the right ones."""
    if view.segments is None or view.accepted is None or view.accepted.all():
        return view
    seen = with_segments(view, foreground_segments(view.segments, view.is_static))
    return replace(seen, accepted=None) if view.is_static is None else seen


def foreground_segments(segments: EdgeSegments, is_static: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    """Return which segments may belong to a person, (S,): all that are not static, (S,)."""
    return np.ones(len(segments.firsts) - 1, np.bool_) if is_static is None else ~is_static


def with_segments(view: ViewEvidence, chosen: NDArray[np.bool_]) -> ViewEvidence:
    """Return a view with only the edges of the chosen segments, (S,)."""
    assert view.segments is not None
    points, normals, found = _edges_of(view.segments, chosen, (view.camera.height, view.camera.width))
    distance = distance_image(found, 2 * view.theta_px)
    return replace(view, points_px=points, normals=normals, distance=distance, accepted=chosen)


def _matched_edges(
    segments: EdgeSegments | None, chosen: NDArray[np.bool_] | None, found: NDArray[np.uint8]
) -> tuple[FloatArray, FloatArray, NDArray[np.uint8]]:
    """Return the thinned points (N, 2) and normals (N, 2) of chosen segments, and the map of all their pixels, (H,
    W)."""
    if segments is not None and chosen is not None:
        return _edges_of(segments, chosen, found.shape)
    if segments is None:
        pixels = cv2.findNonZero(found)
        points = np.empty((0, 2), np.float32) if pixels is None else np.asarray(pixels, np.float32).reshape(-1, 2)
        normals = np.zeros_like(points)
    else:
        points, normals = segments.points_px, segments.normals
    first = thin_points(points, *found.shape)
    return points[first], normals[first], found


def _edges_of(
    segments: EdgeSegments, chosen: NDArray[np.bool_], shape: tuple[int, ...]
) -> tuple[FloatArray, FloatArray, NDArray[np.uint8]]:
    """Return the same for chosen segments, (S,), in an image of a height and width."""
    found = np.zeros(shape, np.uint8)
    cells = np.zeros((shape[0] // SCENE_SPACING_PX + 1, shape[1] // SCENE_SPACING_PX + 1), np.bool_)
    first = np.empty(len(segments.points_px), np.int64)
    n = _mark_chosen(segments.points_px, segments.firsts, chosen, found, cells, first)
    return segments.points_px[first[:n]], segments.normals[first[:n]], found


@njit(nogil=True, cache=True)
def _mark_chosen(
    points: FloatArray, firsts: NDArray[np.int64], chosen: NDArray[np.bool_], found: NDArray[np.uint8],
    cells: NDArray[np.bool_], first: NDArray[np.int64],
) -> int:  # fmt: skip
    """Mark the pixels (N, 2) of chosen segments in a map, and list the first pixel in each cell; return their
    number."""
    n = 0
    for segment in range(len(chosen)):
        if not chosen[segment]:
            continue
        for i in range(firsts[segment], firsts[segment + 1]):
            u, v = int(points[i, 0]), int(points[i, 1])
            found[v, u] = 1
            row, column = v // SCENE_SPACING_PX, u // SCENE_SPACING_PX
            if not cells[row, column]:
                cells[row, column] = True
                first[n] = i
                n += 1
    return n


@njit(nogil=True, cache=True)
def thin_points(points: FloatArray, height: int, width: int) -> NDArray[np.int64]:
    """Return the index of the first of the points (N, 2), px, in each cell of `SCENE_SPACING_PX`, (M,).

    Args:
        points: (N, 2), px, within an image.
        height: of the image, px.
        width: of the image, px.
    """
    columns = width // SCENE_SPACING_PX + 1
    taken = np.zeros((height // SCENE_SPACING_PX + 1) * columns, np.bool_)
    first = np.empty(points.shape[0], np.int64)
    n = 0
    for i in range(points.shape[0]):
        cell = (int(points[i, 1]) // SCENE_SPACING_PX) * columns + int(points[i, 0]) // SCENE_SPACING_PX
        if not taken[cell]:
            taken[cell] = True
            first[n] = i
            n += 1
    return first[:n].copy()
