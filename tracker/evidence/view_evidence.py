"""What a frame shows: per view the edges that poses are scored against, and their distance image.

What an image shows does not depend on what is expected there (`RegionFeatures`); which of its edges are kept does.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.geometry.arrays import FloatArray, Image
from tracker.geometry.cameras import Camera, Region
from tracker.images.background_subtraction import Mask
from tracker.images.color_histogram import BINS, count_colors
from tracker.images.distance_transform import distance_image
from tracker.images.edge_segments import Samples, Segments, accept_segments, link_edges, sample_segments
from tracker.images.edges import Edges
from tracker.images.silhouette_contour import SilhouetteContour, contour_trust, trace_silhouette
from tracker.images.static_edges import StaticEdgeModel

SCENE_SPACING_PX = 4
"""Scene edges are thinned to one point per cell of this many pixels a side."""

ACCEPTED_SHARE = 0.5
"""Mean distance to the predicted contours up to which a segment of edges is accepted, as a share of theta."""


@dataclass(frozen=True, eq=False)
class Silhouette:
    """Everybody's silhouette in a region of a view, as far as masks or a background tell it."""

    inside: Mask
    """The silhouette, shadows left out, (H, W)."""
    points_px: FloatArray
    """Points of its contour, thinned, (N, 2), working px of the region."""
    normals: FloatArray
    """Unit normals at these, out of the silhouette, (N, 2)."""
    trust: float
    """How far it can be trusted, 0 to 1; see `silhouette_contour.contour_trust`."""
    contour: SilhouetteContour
    """All pixels of its contour."""
    limit_px: float
    """Where `distance` is cut off, working px."""

    @cached_property
    def distance(self) -> FloatArray:
        """Distance to the contour, (H, W), working px."""
        on_contour = np.zeros(self.inside.shape, np.uint8)
        u, v = self.contour.points_px.T.astype(np.intp)
        on_contour[v, u] = 1
        return distance_image(on_contour, self.limit_px)


@dataclass(frozen=True, eq=False)
class ViewEvidence:
    """The edges of one view, or of a region of it, as they are matched."""

    camera: Camera
    """The view without lens distortion, at the working scale, of the region: pixels count from its corner."""
    scale: float
    """Working pixels per pixel of the footage, at most 1."""
    points_px: FloatArray
    """Edge points for the image-to-model direction, thinned, (N, 2), working px of the region."""
    distance: FloatArray
    """Distance to the nearest edge, cut off at the limit it was made with, (H, W), working px."""
    corner_px: tuple[int, int] = (0, 0)
    """Where the region's first pixel lies in the whole image, working px."""
    image_size: tuple[int, int] | None = None
    """Width and height of the whole image, working px; None where the region is all of it."""
    normals: FloatArray = field(default_factory=lambda: np.empty((0, 2), np.float32))
    """Unit gradient at each of `points_px`, from dark to light, (N, 2); zero where the edge's direction is unknown."""
    colors: Image | None = None
    """The region of the frame itself, smoothed, (H, W, 3) RGB; None where it is damaged or was not kept."""
    segments: Segments | None = None
    """All edges found, linked, in px of the region; None where the directions of the edges are unknown."""
    accepted: NDArray[np.bool_] | None = None
    """Which segments the prediction accepts, (S,); `points_px` and `distance` hold only those. None: all of them."""
    is_static: NDArray[np.bool_] | None = None
    """Which segments are edges of the room, (S,), and never accepted; None where nothing is known of it."""
    silhouette: Silhouette | None = None
    """The silhouette in the region; None where neither a mask nor a background tells it."""

    @cached_property
    def samples(self) -> Samples | None:
        """Pixels of the segments, to be asked how far they are from contours."""
        return None if self.segments is None else sample_segments(self.segments)

    @cached_property
    def color_counts(self) -> NDArray[np.int64]:
        """Pixels of each colour, (BINS^3,); see `sights.bin_of`; all 0 where there is no image."""
        counts = np.zeros(BINS**3, np.int64)
        if self.colors is not None:
            count_colors(self.colors, counts)
        return counts

    @property
    def theta_px(self) -> float:
        """Distance beyond which an edge says nothing, working px; that of the whole image, whatever the region."""
        return _theta_px(self.image_size or self.camera.size)

    def outlier_px(self, theta_px: float | None) -> float:
        """An outlier distance in px of the footage as working px; `theta_px` of the view for None."""
        return self.theta_px if theta_px is None else theta_px * self.scale


def default_theta_px(camera: Camera) -> float:
    """Distance beyond which an edge says nothing: 3% of the longer side of the image (20 px at 640x480)."""
    return _theta_px(camera.size)


def _theta_px(size: tuple[int, int]) -> float:
    return 0.03 * max(size)


def view_evidence(
    camera: Camera,
    scale: float,
    edge_map: NDArray[np.bool_] | NDArray[np.uint8],
    corner_px: tuple[int, int] = (0, 0),
    image_size: tuple[int, int] | None = None,
    gradients: NDArray[np.int16] | None = None,
    colors: Image | None = None,
    predicted_px: FloatArray | None = None,
    static_edges: StaticEdgeModel | None = None,
) -> ViewEvidence:
    """Make the evidence of a view from its edge map.

    Args:
        camera: the view without lens distortion at the scale of the edge map.
        scale: pixels of the edge map per pixel of the footage.
        edge_map: (H, W), edges are not 0.
        corner_px: see `ViewEvidence`.
        image_size: see `ViewEvidence`.
        gradients: of the image along u and v, (2, H, W); None where the directions of the edges are unknown.
        colors: see `ViewEvidence`.
        predicted_px: see `accepted`; None keeps all edges. Without gradients no edges are refused.
        static_edges: what is known to stand still in the view; such edges are refused.
    """
    assert edge_map.shape == (camera.height, camera.width), (edge_map.shape, camera.size)
    found = edge_map.view(np.uint8)
    segments = None if gradients is None else link_edges(found, gradients)
    features = RegionFeatures(camera, scale, corner_px, image_size, found, segments, colors=colors)
    return select_evidence(features, predicted_px, static_edges)


def silhouette_evidence(inside: Mask, edges: Edges, limit_px: float) -> Silhouette:
    """A silhouette, (H, W), in a region whose edges are known, with its distance cut off at a limit, working px."""
    contour = trace_silhouette(inside)
    first = _first_in_cells(contour.points_px, *inside.shape)
    trust = contour_trust(contour, inside, edges)
    return Silhouette(inside, contour.points_px[first], contour.normals[first], trust, contour, limit_px)


class RegionFeatures(NamedTuple):
    """What a region of a view shows, whatever is expected there; see `ViewEvidence`."""

    camera: Camera
    scale: float
    corner_px: tuple[int, int]
    image_size: tuple[int, int] | None
    found: NDArray[np.uint8]
    """Edges are not 0, (H, W)."""
    segments: Segments | None = None
    samples: Samples | None = None
    """Of the segments, where they have been taken."""
    colors: Image | None = None
    silhouette: Silhouette | None = None

    @property
    def box(self) -> Region:
        """The region, working px of the whole image."""
        (u0, v0), (width, height) = self.corner_px, self.camera.size
        return u0, v0, u0 + width, v0 + height


def select_evidence(
    features: RegionFeatures, predicted_px: FloatArray | None, static_edges: StaticEdgeModel | None
) -> ViewEvidence:
    """What of a region's edges is kept where something is expected and something stands still; see `view_evidence`."""
    segments, theta = features.segments, _theta_px(features.image_size or features.camera.size)
    chosen = is_static = None
    if segments is not None:
        if predicted_px is not None:
            chosen = accept_segments(
                features.samples or sample_segments(segments), predicted_px, ACCEPTED_SHARE * theta
            )
        if static_edges is not None:
            is_static = static_edges.contains(segments, features.corner_px)
            chosen = ~is_static if chosen is None else chosen & ~is_static
    points, normals, found = _matched_edges(segments, chosen, features.found)
    # Beyond twice theta nothing asks for the distance any more.
    distance = distance_image(found, 2 * theta)
    seen = ViewEvidence(
        features.camera, features.scale, points, distance, features.corner_px, features.image_size, normals,
        features.colors, segments, chosen, is_static, features.silhouette,
    )  # fmt: skip
    if features.samples is not None:
        seen.__dict__["samples"] = features.samples  # taken once
    return seen


def with_accepted_segments(
    view: ViewEvidence, predicted_px: FloatArray, threshold_px: float | None = None
) -> ViewEvidence:
    """The same view with only the edges that the prediction explains, segment by segment (GD96 Sect. 4.2, Fig. 6).

    Args:
        view: with directions of edges.
        predicted_px: visible pieces of the predicted contours, x0, y0, x1, y1, (M, 4), px of the view's camera.
        threshold_px: mean distance of a segment to them up to which it is accepted, px; by default half of theta.
    """
    assert view.samples is not None
    return with_segments(
        view, accept_segments(view.samples, predicted_px, threshold_px or ACCEPTED_SHARE * view.theta_px)
    )


def with_all_segments(view: ViewEvidence) -> ViewEvidence:
    """The same view with all edges but the room's: a wrong prediction may have refused what it missed."""
    if view.segments is None or view.accepted is None or view.accepted.all():
        return view
    seen = with_segments(view, foreground_segments(view.segments, view.is_static))
    return replace(seen, accepted=None) if view.is_static is None else seen


def foreground_segments(segments: Segments, is_static: NDArray[np.bool_] | None) -> NDArray[np.bool_]:
    """Which segments may be a person's, (S,): all but those that are known to stand `still`, (S,)."""
    return np.ones(len(segments.firsts) - 1, np.bool_) if is_static is None else ~is_static


def with_segments(view: ViewEvidence, chosen: NDArray[np.bool_]) -> ViewEvidence:
    """The same view with only the edges of some segments, (S,); its segments must be known."""
    assert view.segments is not None
    points, normals, found = _edges_of(view.segments, chosen, (view.camera.height, view.camera.width))
    distance = distance_image(found, 2 * view.theta_px)
    return replace(view, points_px=points, normals=normals, distance=distance, accepted=chosen)


def _matched_edges(
    segments: Segments | None, chosen: NDArray[np.bool_] | None, found: NDArray[np.uint8]
) -> tuple[FloatArray, FloatArray, NDArray[np.uint8]]:
    """Thinned points (N, 2) and normals (N, 2) of chosen segments, and the map of all their pixels."""
    if segments is not None and chosen is not None:
        return _edges_of(segments, chosen, found.shape)
    if segments is None:
        pixels = cv2.findNonZero(found)
        points = np.empty((0, 2), np.float32) if pixels is None else np.asarray(pixels, np.float32).reshape(-1, 2)
        normals = np.zeros_like(points)
    else:
        points, normals = segments.points_px, segments.normals
    first = _first_in_cells(points, *found.shape)
    return points[first], normals[first], found


def _edges_of(
    segments: Segments, chosen: NDArray[np.bool_], shape: tuple[int, ...]
) -> tuple[FloatArray, FloatArray, NDArray[np.uint8]]:
    """The same of chosen segments, (S,), in an image of a height and width."""
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
    """Mark the pixels (N, 2) of chosen segments in a map, and list the first of them in each cell; their number."""
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
def _first_in_cells(points: FloatArray, height: int, width: int) -> NDArray[np.int64]:
    """Index of the first of the points (N, 2) in each cell of the scene spacing, (M,)."""
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
