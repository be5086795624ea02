"""The outlines of one person's silhouettes as evidence for the chamfer measure, before any pose is known."""

from collections.abc import Sequence

import numpy as np

from tracker.evidence.view_evidence import ViewEvidence, thin_points
from tracker.geometry.cameras import Camera
from tracker.images.background_subtraction import Mask
from tracker.images.distance_transform import distance_image
from tracker.images.silhouette_contour import trace_silhouette

REACH = 0.2
"""Outlier distance as a fraction of the longer side of the image: a limb may be far from where it is first assumed."""


def outline_evidence(masks: Sequence[Mask], cameras: Sequence[Camera]) -> tuple[ViewEvidence, ...]:
    """Return the outlines of silhouettes as evidence. A view without a silhouette has no edges and does not count.

    Args:
        masks: silhouettes of one person, (H, W) each, raw pixels.
        cameras: cameras of these pixels, with their lens distortion. Costs are in these pixels.
    """
    return tuple(_outline(mask, camera) for mask, camera in zip(masks, cameras, strict=True))


def _outline(mask: Mask, camera: Camera) -> ViewEvidence:
    inside = camera.undistort_image(mask.astype(np.uint8) * 255) > 127
    points = trace_silhouette(inside).points_px.astype(np.float32)
    u, v = points.T.astype(np.intp)
    # Where the image cuts a person off, its border is no contour.
    within = (u > 0) & (v > 0) & (u < camera.width - 1) & (v < camera.height - 1)
    on_contour = np.zeros(inside.shape, np.uint8)
    on_contour[v[within], u[within]] = 1
    own = points[within]
    return ViewEvidence(
        camera.pinhole, 1.0, own[thin_points(own, *inside.shape)], distance_image(on_contour, REACH * max(camera.size))
    )
