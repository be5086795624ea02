"""The image contours of a view that the contours of the model are compared with, and their chamfer images."""

from dataclasses import replace

import numpy as np

from tracker.estimation.contour.settings import ImageContours
from tracker.evidence.images.distance_transform import distance_image
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import FloatArray


def select_contours(view: ViewEvidence, wanted: ImageContours) -> ViewEvidence:
    """Return a view whose edges are its wanted contours.

    Args:
        view: the evidence.
        wanted: `silhouettes` replaces the edges of a view that has a silhouette by the silhouette's contour.
    """
    shown = view.silhouette
    if wanted == "edges" or shown is None:
        return view
    return replace(
        view, points_px=shown.points_px, normals=shown.normals, distance=_distances(view, shown.contour.points_px, 2.0),
        segments=None, samples=None, accepted=None, is_static=None,
    )  # fmt: skip


def with_unlimited_distances(view: ViewEvidence, wanted: ImageContours) -> ViewEvidence:
    """Return a view whose distance image has no limit: the chamfer image of KRH08 Sect. 5.2, in px.

    Args:
        view: the evidence, see `select_contours`.
        wanted: what its edges are.
    """
    if view.segments is None:
        rows, columns = np.nonzero(view.distance == 0)
        pixels = np.stack([columns, rows], axis=1).astype(np.float32)
    else:
        pixels = view.segments.points_px
    if wanted == "silhouettes" and view.silhouette is not None:
        pixels = view.silhouette.contour.points_px
    return replace(view, distance=_distances(view, pixels, None))


def _distances(view: ViewEvidence, pixels: FloatArray, limit: float | None) -> FloatArray:
    """Return the distance to the nearest of some pixels, (N, 2), up to a number of outlier distances."""
    width, height = view.camera.size
    found = np.zeros((height, width), np.uint8)
    u, v = pixels.T.astype(np.intp)
    found[v, u] = 1
    return distance_image(found, float(np.hypot(width, height)) if limit is None else limit * view.theta_px)
