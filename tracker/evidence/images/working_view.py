"""Convert footage to working pixels: undistorted, at working scale, and only in the requested region.

All image work is done in a region around the predicted bodies (GD96 Sect. 4.2).
"""

from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Array, Image, Mask
from tracker.geometry.cameras import Camera, Region

WORKING_AREA_PX = 640 * 480
"""Largest number of pixels of a frame as filmed at working scale. Smaller frames are not enlarged."""
MIN_REGION_PX = 16
"""Smallest width and height of a region, px; edges and distances need neighbours."""
_REGION_STEP_PX = 8
"""Raster of the borders of regions, px: small motions do not change them."""
_MARGIN_PX = 2
"""Pixels around a region of the footage that bilinear interpolation may read."""


def working_scale(camera: Camera) -> float:
    """Return the working scale of a camera as calibrated: 1 up to 640x480 px of its footage, smaller above."""
    return min(1.0, float(np.sqrt(WORKING_AREA_PX / (camera.width * camera.height))))


def fit_region(region: Region, size: tuple[int, int]) -> Region:
    """Fit a region into an image of a width and height, px, at least `MIN_REGION_PX` wide and high.

    A region beside the image becomes the nearest strip of it. The edges there are not the body's, but harmless.
    """
    spans = []
    for low, high, length in zip(region[:2], region[2:], size, strict=True):
        least = min(MIN_REGION_PX, length)
        first = min(max(low, 0), length - least)
        spans.append((first, max(min(high, length), first + least)))
    return spans[0][0], spans[1][0], spans[0][1], spans[1][1]


def region_around(points_px: Array, margin_px: float, size: tuple[int, int]) -> Region:
    """Return the region of an image that holds points and a margin around them.

    Its borders lie at multiples of 8 px, so that small motions do not change it.

    Args:
        points_px: (N, 2), N > 0, working px; they may lie outside the image.
        margin_px: margin on each side, px.
        size: image width and height, px.
    """
    step = _REGION_STEP_PX
    # Points near the camera plane project far outside, where integers would overflow.
    reach = 2 * max(size)
    points = np.clip(points_px, -reach, reach)
    u0, v0 = np.floor((points.min(axis=0) - margin_px) / step).astype(int) * step
    u1, v1 = np.ceil((points.max(axis=0) + margin_px) / step).astype(int) * step
    return fit_region((int(u0), int(v0), int(u1), int(v1)), size)


class WorkingView:
    """Conversion of one camera's footage to working pixels. Immutable and therefore thread-safe."""

    source: Camera
    """Camera as calibrated, at the size of the footage."""
    camera: Camera
    """The same camera without lens distortion, at working scale."""
    scale: float
    """Working pixels per pixel of the footage, at most 1."""

    def __init__(self, source: Camera, scale: float | None = None, beyond: int = cv2.BORDER_REPLICATE) -> None:
        """Compute the map of all pixels once; a region uses a part of it.

        Args:
            source: camera as calibrated.
            scale: scale other than the working scale, at most 1.
            beyond: OpenCV border mode for pixels beside the footage. Replication is for edges: a black frame around the
                image would have some.
        """
        self.source, self._beyond = source, beyond
        self.scale = working_scale(source) if scale is None else scale
        self.camera = source.pinhole.scaled(self.scale)
        # Larger footage is first reduced by a whole factor with area averaging, which is fast; the map does the rest.
        self._reduction = int(1 / self.scale)
        self._plain = source.is_pinhole and self.scale == 1
        if self._plain:
            return
        f = np.float32(self._reduction)
        u, v = ((m + np.float32(0.5)) / f - np.float32(0.5) for m in self._map())
        self._cells, self._fractions = cv2.convertMaps(u, v, cv2.CV_16SC2)

    def _map(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return where each working pixel lies in the footage, u and v, (H, W) each, px."""
        return self.source.distortion_map(self.camera)

    @cached_property
    def _nearest(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """The same map in OpenCV's form for nearest-neighbour interpolation."""
        return cv2.convertMaps(*self._map(), cv2.CV_16SC2, nninterpolation=True)

    @cached_property
    def filmed(self) -> Camera:
        """The camera of the footage at working scale, with its lens. The picture of a fisheye is larger undistorted."""
        return self.source.scaled(self.scale)

    @cached_property
    def shown(self) -> Mask | None:
        """Pixels of a fisheye's picture that show footage, (H, W), but for its border; None for other lenses.

        Elsewhere it repeats the border of the footage, whose edges are nobody's.
        """
        if not self.source.fisheye:
            return None
        columns, rows = self._map()
        m = _MARGIN_PX / self.scale
        width, height = self.source.size
        return np.asarray((columns >= m) & (columns <= width - 1 - m) & (rows >= m) & (rows <= height - 1 - m))

    @property
    def whole(self) -> Region:
        """Region of the whole image."""
        return 0, 0, self.camera.width, self.camera.height

    def image(self, frame: Image, region: Region) -> Image:
        """Return a region of a frame as filmed, `(H, W, 3)`, in working pixels, (v1 - v0, u1 - u0, 3)."""
        u0, v0, u1, v1 = region
        if self._plain:
            return frame[v0:v1, u0:u1]
        cells, fractions = self._cells[v0:v1, u0:u1], self._fractions[v0:v1, u0:u1]
        f = self._reduction
        if f > 1:
            read = cells.reshape(-1, 2) if self.source.fisheye else _border(cells)
            left, top, right, bottom = self._needed(read, frame.shape[1] // f, frame.shape[0] // f)
            part = frame[top * f : bottom * f, left * f : right * f]
            frame = np.asarray(cv2.resize(part, (right - left, bottom - top), interpolation=cv2.INTER_AREA), np.uint8)
            cells = cells - np.array([left, top], np.int16)
        out = cv2.remap(frame, cells, fractions, cv2.INTER_LINEAR, borderMode=self._beyond)
        return np.asarray(out, np.uint8)

    def mask(self, mask: NDArray[np.uint8], region: Region) -> Mask:
        """Return a region of a mask as filmed, `(H, W)`, in working pixels, (v1 - v0, u1 - u0); True where it is not
        0."""
        u0, v0, u1, v1 = region
        if self._plain:
            return mask[v0:v1, u0:u1] > 0
        cells, no_fractions = self._nearest
        return np.asarray(cv2.remap(mask, cells[v0:v1, u0:u1], no_fractions, cv2.INTER_NEAREST)) > 0

    @staticmethod
    def _needed(cells: NDArray[Any], width: int, height: int) -> Region:
        """Return the region of the reduced footage that entries of a map, (n, 2), read."""
        (left, top), (right, bottom) = cells.min(axis=0).tolist(), cells.max(axis=0).tolist()
        m = _MARGIN_PX
        left, top = min(max(left - m, 0), width - 1), min(max(top - m, 0), height - 1)
        return left, top, max(min(right + m + 1, width), left + 1), max(min(bottom + m + 1, height), top + 1)


def _border(cells: NDArray[Any]) -> NDArray[Any]:
    """Return the border of a map, (h, w, 2), as rows, (n, 2). The extremes of a common lens's map lie there."""
    return np.concatenate([cells[0], cells[-1], cells[:, 0], cells[:, -1]])
