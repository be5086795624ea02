"""Where posed bodies are in the views: regions to look at, contours to expect, how large a metre is there."""

from collections.abc import Sequence

import numpy as np

from tracker import contours
from tracker.body import Body, BodyModel
from tracker.cameras import Camera, Region
from tracker.matched import region_around
from tracker.rigid import Array, FloatArray

_NEAREST_M = 0.3
"""Bodies nearer to a camera, and those behind it, count as this near."""
_REGION_MARGIN_M = 0.22
"""What is added around the joints to the region that is looked at: the flesh, and what the prediction may be off."""


def regions(cameras: Sequence[Camera], bodies: Sequence[Body]) -> list[Region | None]:
    """Where to look in each view: around everybody, as predicted; None where that is the whole image."""
    points = np.concatenate([b.model.points_world(b.values) for b in bodies])
    out: list[Region | None] = []
    for camera in cameras:
        depths = camera.depths(points)
        if depths.min() < 2 * _REGION_MARGIN_M:  # too near for its outline to lie around the joints' images
            out.append(None)
            continue
        margin = _REGION_MARGIN_M * camera.K[0, 0] / float(np.median(depths))
        out.append(region_around(camera.project(points), margin, camera.size))
    return out


def visible_outline(bodies: Sequence[Body], camera: Camera) -> FloatArray:
    """Visible pieces of the contours, x0, y0, x1, y1, (M, 4), px."""
    contour = contours.trace(bodies, camera)
    return contour.pieces_px[~contour.hidden]


def px_per_m(cameras: Sequence[Camera], model: BodyModel, values: Array) -> float:
    """Length of a metre where a body stands, in the view that shows it in between the largest and the smallest."""
    middle = model.points_world(values).mean(axis=0)
    return float(np.median([c.K[0, 0] / max(c.depths(middle), _NEAREST_M) for c in cameras]))
