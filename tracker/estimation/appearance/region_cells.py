"""Cells of a view: squares of working pixels in which regions are compared. Their colours are means."""

from typing import NamedTuple

import cv2
import numpy as np

from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Image
from tracker.geometry.cameras import Camera

CELL_PX = 2
"""Side of a cell, working px. At 640x480 and 4 m a forearm is 4 cells wide, and an independent sample 4 cells."""


class CellView(NamedTuple):
    """The cells of a region of one view."""

    camera: Camera
    """Camera of the region, which projects to cells."""
    corner: tuple[int, int]
    """Column and row of the first cell among those of the whole view."""
    colors: Image
    """Mean colour of each cell, (h, w, 3) RGB."""
    ahead_frames: float = 0.0
    """Frames by which the picture was taken later than the frame."""


def cells_of(view: ViewEvidence) -> CellView | None:
    """Return the cells that lie in the region of a view; None without an image."""
    if view.colors is None:
        return None
    (u, v), (height, width) = view.corner_px, view.colors.shape[:2]
    left, top = -u % CELL_PX, -v % CELL_PX
    columns, rows = (width - left) // CELL_PX, (height - top) // CELL_PX
    if columns < 1 or rows < 1:
        return None
    box = (left, top, left + columns * CELL_PX, top + rows * CELL_PX)
    part = view.colors[box[1] : box[3], box[0] : box[2]]
    colors = cv2.resize(part, (columns, rows), interpolation=cv2.INTER_AREA)
    camera = view.camera.cropped(box).scaled(1 / CELL_PX)
    corner = ((u + left) // CELL_PX, (v + top) // CELL_PX)
    return CellView(camera, corner, np.asarray(colors, np.uint8), view.ahead_frames)


def cells_of_image(image: Image) -> Image:
    """Return the colours of the cells of a whole view, (H, W, 3), (h, w, 3)."""
    height, width = image.shape[0] // CELL_PX, image.shape[1] // CELL_PX
    part = image[: height * CELL_PX, : width * CELL_PX]
    return np.asarray(cv2.resize(part, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
