"""Where posed bodies are in the views: regions to look at, contours to expect, how large a metre is there."""

from collections.abc import Sequence

import numpy as np

from tracker.body.model import PosedBody
from tracker.contours import occluding_contours
from tracker.geometry.arrays import FloatArray
from tracker.geometry.cameras import Camera, Region
from tracker.images.working_view import region_around

_NEAREST_M = 0.3
"""Bodies nearer to a camera, and those behind it, count as this near."""
_REGION_MARGIN_M = 0.22
"""What is added around the joints to the region that is looked at: the flesh, and what the prediction may be off."""
_AHEAD_MARGIN_M, _LEAST_MARGIN_M = 0.25, 0.19
"""The same a frame ahead, where a prediction is farther off; and what must be left of it when the time comes."""


def regions(
    cameras: Sequence[Camera], bodies: Sequence[PosedBody], margin_m: float = _REGION_MARGIN_M
) -> list[Region | None]:
    """Where to look in each view: around everybody, as predicted; None where that is the whole image."""
    points = np.concatenate([b.points_world for b in bodies])
    out: list[Region | None] = []
    for camera in cameras:
        depths = camera.depths(points)
        if depths.min() < 2 * _REGION_MARGIN_M:  # too near for its outline to lie around the joints' images
            out.append(None)
            continue
        margin = margin_m * camera.K[0, 0] / float(np.median(depths))
        out.append(region_around(camera.project(points), margin, camera.size))
    return out


def regions_ahead(cameras: Sequence[Camera], bodies: Sequence[PosedBody]) -> list[Region | None]:
    """Where to look in each view before the frame before is known: around everybody, as predicted two frames on."""
    return regions(cameras, bodies, _AHEAD_MARGIN_M)


def confirmed(
    ahead: Sequence[Region | None], cameras: Sequence[Camera], bodies: Sequence[PosedBody]
) -> list[Region | None]:
    """The regions that were looked at ahead, but for views in which somebody, as predicted now, comes near the border.

    They follow from poses alone, so that what is found in them does not depend on what was done first.
    """
    least, anew = regions(cameras, bodies, _LEAST_MARGIN_M), regions(cameras, bodies)
    return [a if _holds(a, small) else new for a, small, new in zip(ahead, least, anew, strict=True)]


def _holds(outer: Region | None, inner: Region | None) -> bool:
    """Whether a region lies within another; None is the whole image."""
    if outer is None or inner is None:
        return outer is None
    return all(o <= i for o, i in zip(outer[:2], inner[:2], strict=True)) and all(
        o >= i for o, i in zip(outer[2:], inner[2:], strict=True)
    )


def visible_outline(bodies: Sequence[PosedBody], camera: Camera) -> FloatArray:
    """Visible pieces of the contours, x0, y0, x1, y1, (M, 4), px."""
    contour = occluding_contours.trace(bodies, camera)
    return contour.pieces_px[~contour.occluded]


def px_per_m(cameras: Sequence[Camera], body: PosedBody) -> float:
    """Length of a metre where a body stands, in the view that shows it in between the largest and the smallest."""
    middle = body.points_world.mean(axis=0)
    return float(np.median([c.K[0, 0] / max(c.depths(middle), _NEAREST_M) for c in cameras]))
