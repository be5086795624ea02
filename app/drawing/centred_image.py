"""Resample a camera's image for a viewer without a principal point: the optical axis in the middle of the canvas."""

import cv2
import numpy as np

from tracker.geometry.arrays import Array, Image
from tracker.geometry.cameras import Camera

_AROUND = (24, 26, 29)
"""Colour of the canvas outside of the image, RGB."""


def field_of_view(camera: Camera, aspect: float) -> float:
    """Return the vertical field of view of a canvas that shows all of the undistorted image, rad.

    Args:
        camera: of the image.
        aspect: width by height of the canvas.
    """
    return 2 * float(np.arctan(_half_height(camera, aspect)))


def aspect_around(camera: Camera) -> float:
    """Return width by height of the smallest canvas that shows all of the image, the optical axis in the middle."""
    x, y = _reach(camera)
    return float(x / y)


def centred(image: Image, camera: Camera, size: tuple[int, int]) -> Image:
    """Resample an undistorted image for a canvas that looks along the optical axis with `field_of_view`.

    With F the canvas' focal length in its pixels, its pixel `(a, b)` sees the direction `x = (a - a0) / F,
    y = (b - b0) / F` of the camera, which the image has at `K (x, y, 1)`; `(a0, b0)` is the middle of the canvas.

    Args:
        image: undistorted, (H, W, 3).
        camera: of the image.
        size: width and height of the canvas, px.
    """
    width, height = size
    focal_px = height / 2 / _half_height(camera, width / height)
    shrunk = min(1.0, 2 * focal_px / camera.K[1, 1])
    if shrunk < 1.0:  # otherwise the resampling below would skip pixels
        camera = camera.scaled(shrunk)
        image = np.asarray(cv2.resize(image, camera.size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    a0, b0 = (width - 1) / 2, (height - 1) / 2
    from_canvas = camera.K[:2] @ np.array([[1, 0, -a0], [0, 1, -b0], [0, 0, focal_px]]) / focal_px
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    out = cv2.warpAffine(image, from_canvas, size, flags=flags, borderMode=cv2.BORDER_CONSTANT, borderValue=_AROUND)
    return np.asarray(out, dtype=np.uint8)


def _half_height(camera: Camera, aspect: float) -> float:
    """Return the tangent of half the vertical field of view."""
    x, y = _reach(camera)
    return float(max(y, x / aspect))


def _reach(camera: Camera) -> Array:
    """Return the largest distance of the image from the optical axis along x and y, (2,), at depth 1."""
    w, h = camera.size
    corners = np.array([[-0.5, -0.5], [w - 0.5, -0.5], [-0.5, h - 0.5], [w - 0.5, h - 0.5]])
    return np.abs(np.linalg.solve(camera.K, np.column_stack([corners, np.ones(4)]).T)[:2]).max(axis=1)
