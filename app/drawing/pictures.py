"""Draw into pictures, and encode them for the page: footage and evidence as JPEG, masks as PNG with transparency."""

from collections.abc import Sequence
from io import BytesIO

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pillow

from app.drawing import overlay_colors
from tracker.body.model import PosedBody
from tracker.evidence.contours.label_image import part_labels
from tracker.evidence.view_evidence import ViewEvidence
from tracker.geometry.arrays import Array, FloatArray, Image, Mask
from tracker.geometry.cameras import Camera

_JPEG_QUALITY = 85
_SUBPIXEL_BITS = 4
_FAST = 1
"""zlib's lowest level: masks are large even areas, for which it compresses as well as the highest."""


def footage(image: Image | None, size: tuple[int, int]) -> bytes:
    """Encode an image of the footage as JPEG.

    Args:
        image: undistorted, (H, W, 3) RGB; None where the frame is damaged.
        size: width and height of the placeholder for a damaged frame, px.
    """
    return _jpeg(placeholder(size, "frame damaged") if image is None else image)


def unreadable(size: tuple[int, int]) -> bytes:
    """Encode the placeholder for a frame that cannot be read now, as JPEG of a width and height, px."""
    return _jpeg(placeholder(size, "frame unreadable"))


def distance(view: ViewEvidence) -> bytes:
    """Encode the distance image of a view as JPEG, bright at the edges and dark at its limit."""
    near = 1.0 - view.distance / max(1e-6, 2 * view.theta_px)
    coloured = cv2.applyColorMap((255 * near).astype(np.uint8), cv2.COLORMAP_INFERNO)
    return _jpeg(np.asarray(cv2.cvtColor(coloured, cv2.COLOR_BGR2RGB), dtype=np.uint8))


def distance_limit_px(view: ViewEvidence) -> float:
    """Return the distance at which the picture of the distance image is darkest, px of the footage."""
    return 2 * view.theta_px / view.scale


def silhouette(view: ViewEvidence) -> bytes:
    """Encode the silhouette of all people in a view as PNG of one bit per pixel; empty if unknown."""
    if view.silhouette is None:
        return mask(np.zeros((view.camera.height, view.camera.width), np.bool_), overlay_colors.SILHOUETTE)
    return mask(view.silhouette.inside, overlay_colors.SILHOUETTE)


def mask(inside: Mask, color: str) -> bytes:
    """Encode a mask, (H, W), in one colour as PNG of one bit per pixel."""
    return labels(inside.view(np.uint8), [color], bits=1)


def labels(parts: NDArray[np.uint8], colors: Sequence[str], bits: int = 8) -> bytes:
    """Encode labels, (H, W), as PNG of some bits per pixel: 0 is transparent, k has the k-th colour, counted from 1."""
    picture, data = Pillow.fromarray(parts, "P"), BytesIO()
    picture.putpalette(bytes(3) + b"".join(bytes.fromhex(color[1:]) for color in colors))
    picture.save(data, "PNG", transparency=0, bits=bits, compress_level=_FAST)
    return data.getvalue()


def parts(bodies: Sequence[PosedBody], camera: Camera, colors: Sequence[str], reduction: float) -> bytes:
    """Encode the areas of the body parts, each in its colour, as PNG.

    Args:
        bodies: of all people.
        camera: the view, without lens distortion.
        colors: of the parts of all bodies, in order.
        reduction: image pixels per picture pixel along either side.
    """
    return labels(part_labels(bodies, camera.scaled(1 / reduction)), colors)


def placeholder(size: tuple[int, int], text: str) -> Image:
    """Return a picture of a width and height, px, that says in words why it shows nothing."""
    image = np.full((size[1], size[0], 3), 24, np.uint8)
    cv2.putText(image, text, (20, size[1] // 2), cv2.FONT_HERSHEY_SIMPLEX, size[0] / 640, (200, 200, 200), 2)
    return image


def _jpeg(image: Image) -> bytes:
    done, data = cv2.imencode(".jpg", cv2.cvtColor(image, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])
    assert done
    return bytes(data)


def draw_lines(image: Image, segments_px: Array | FloatArray, color: tuple[int, int, int], width: int) -> None:
    """Draw line segments, x0, y0, x1, y1, (N, 4), into an image in place.

    All outlines lie below all lines: the pieces of a contour join without gaps.
    """
    ends = list(np.round(segments_px.reshape(-1, 2, 2) * (1 << _SUBPIXEL_BITS)).astype(np.int32))
    for stroke, wide in ((overlay_colors.OUTLINE_RGB, width + 2), (color, width)):
        cv2.polylines(image, ends, False, stroke, wide, cv2.LINE_AA, _SUBPIXEL_BITS)
