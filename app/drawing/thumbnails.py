"""Draw thumbnails of one person: a crop of the view that shows a limb best, with the contours of the pose."""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from app.drawing import overlay_colors, pictures
from app.drawing.pictures import draw_lines
from tracker.body.limbs import limbs
from tracker.body.model import PosedBody
from tracker.evidence.contours import occluding_contours, part_edges
from tracker.geometry.arrays import Array, Image
from tracker.geometry.cameras import Camera, Region

SIZE_PX = 160
"""Width and height of a thumbnail, pixels."""
_MARGIN = 0.12
"""Margin around the person, as a share of the crop."""


class Crop(NamedTuple):
    """Square part of a view around a person. It may reach beyond the image."""

    camera: int
    """Index of the view."""
    region: Region
    """u0, v0, u1, v1 in the image that the thumbnail is cut from."""


def choose_crop(bodies: Sequence[PosedBody], person: int, limb: int | None, cameras: Sequence[Camera]) -> Crop | None:
    """Choose the view that shows a limb best, and the square around its person there.

    Of the views it is the one with the largest visible extent of the limb, in shares of the crop.

    Args:
        bodies: all people of the frame.
        person: index of the person.
        limb: index among the limbs of the person's body; None for the whole body.
        cameras: of the images to cut from, without lens distortion.

    Returns:
        None if no view shows the person.
    """
    points = [b.points_world for b in bodies]
    hidden = part_edges.points_occluded(bodies, cameras, np.concatenate(points))
    first = sum(len(p) for p in points[:person])
    own = slice(first, first + len(points[person]))
    chosen = _points_of(bodies[person], limb)
    found: list[tuple[float, int, Crop]] = []
    for index, camera in enumerate(cameras):
        px = camera.project(points[person])
        inside = np.isfinite(px).all(axis=1) & np.all((px >= 0) & (px < np.array(camera.size)), axis=1)
        if not inside.any():
            continue
        region = _square(px[inside])
        seen = px[chosen & inside & ~hidden[index][own]]
        extent_px = float(np.linalg.norm(np.ptp(seen, axis=0))) if len(seen) else 0.0
        share = extent_px / (region[2] - region[0])
        visible = len(seen) / max(1, int(np.count_nonzero(chosen)))
        found.append((visible * (1.0 + share), -index, Crop(index, region)))
    return max(found)[2] if found else None


def thumbnail(
    image: Image | None,
    camera: Camera,
    region: Region,
    bodies: Sequence[PosedBody],
    colors: Sequence[str],
    limb: NDArray[np.bool_],
) -> bytes:
    """Draw a thumbnail as JPEG, `SIZE_PX` wide and high.

    Args:
        image: of the view, undistorted, (H, W, 3) RGB; None if it is damaged.
        camera: of this image.
        region: square to cut out.
        bodies: all people of the frame.
        colors: of the people.
        limb: which parts of all bodies, in order, stand out.
    """
    if image is None:
        return pictures.footage(None, (SIZE_PX, SIZE_PX))
    u0, v0, u1, v1 = region
    canvas = np.zeros((v1 - v0, u1 - u0, 3), np.uint8)
    left, top, right, bottom = max(0, u0), max(0, v0), min(camera.width, u1), min(camera.height, v1)
    canvas[top - v0 : bottom - v0, left - u0 : right - u0] = image[top:bottom, left:right]
    drawn = np.asarray(cv2.resize(canvas, (SIZE_PX, SIZE_PX), interpolation=cv2.INTER_AREA), np.uint8)
    contour = occluding_contours.trace(bodies, camera.cropped(region).scaled(SIZE_PX / (u1 - u0)))
    people = np.repeat(np.arange(len(bodies)), [len(b.model.parts) for b in bodies])
    shown = ~contour.occluded
    for person, color in enumerate(colors):
        draw_lines(drawn, contour.pieces_px[shown & (people == person)[contour.parts]], overlay_colors.rgb(color), 2)
    # The limb also where it is occluded: that is often why it is lost.
    draw_lines(drawn, contour.pieces_px[limb[contour.parts]], overlay_colors.rgb(overlay_colors.NEUTRAL), 2)
    return pictures.footage(drawn, (SIZE_PX, SIZE_PX))


def limb_parts(bodies: Sequence[PosedBody], person: int, limb: int | None) -> NDArray[np.bool_]:
    """Return which parts of all bodies, in order, belong to a limb of a person; none for the whole body."""
    chosen = [np.zeros(len(b.model.parts), dtype=bool) for b in bodies]
    if limb is not None:
        chosen[person][limbs(bodies[person].model)[limb].parts] = True
    return np.concatenate(chosen)


def _points_of(body: PosedBody, limb: int | None) -> NDArray[np.bool_]:
    """Return which points of a body belong to a limb; all for the whole body."""
    if limb is None:
        return np.ones(len(body.model.point_names), dtype=bool)
    return np.isin(body.model.point_parts, limbs(body.model)[limb].parts)


def _square(points_px: Array) -> Region:
    """Return the square around points, with a margin."""
    low, high = points_px.min(axis=0), points_px.max(axis=0)
    side = max(16, int(np.ceil((1 + 2 * _MARGIN) * float((high - low).max()))))
    u0, v0 = (int(c) for c in np.round((low + high - side) / 2))
    return u0, v0, u0 + side, v0 + side
