"""Draw lines into an image with a dark outline, legible on bright and on dark footage."""

import cv2
import numpy as np

from app.drawing.overlay_colors import OUTLINE_RGB
from tracker.geometry.arrays import Array, FloatArray, Image

_SUBPIXEL_BITS = 4


def draw_lines(image: Image, segments_px: Array | FloatArray, color: tuple[int, int, int], width: int) -> None:
    """Draw line segments, x0, y0, x1, y1, (N, 4), into an image in place.

    All outlines lie below all lines: the pieces of a contour join without gaps.
    """
    ends = list(np.round(segments_px.reshape(-1, 2, 2) * (1 << _SUBPIXEL_BITS)).astype(np.int32))
    for stroke, wide in ((OUTLINE_RGB, width + 2), (color, width)):
        cv2.polylines(image, ends, False, stroke, wide, cv2.LINE_AA, _SUBPIXEL_BITS)
