"""Detect edges over all colour channels, within the foreground if one is known, and measure whole images for that.

Thresholds follow the whole image and must not depend on the region of interest. Gradients and smoothed colours at a
grid of samples take a fraction of the time of computing them everywhere.

Learn the static edges of a view while bodies are tracked: a background model of edges.

Without masks or a background image, an edge that was there before a limb came is not the limb's. Otherwise an arm that
passes a picture on the wall sticks to it. The model averages the edges of a view away from the bodies. A segment that
lies on them is refused as a whole, as GD96 Sect. 4.2 refuses segments that the prediction does not explain.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import njit
from tracker.compute.quantiles import quantiles
from tracker.evidence.images.background_subtraction import SMOOTHING_PX
from tracker.evidence.images.edge_segments import EdgeSegments
from tracker.geometry.arrays import FloatArray, Image, IntArray, Mask

_FRACTIONS = (0.92, 0.80)
"""Canny's strong and weak threshold without a foreground, as the fractions of pixels with a weaker gradient."""
MIN_GRADIENT = 24.0
"""Gradient below which edges are noise, gray levels (Sobel 3x3, of 255)."""


class Levels(NamedTuple):
    """Canny's two thresholds, gray levels of the L1 norm of a Sobel gradient."""

    strong: float
    """An edge begins where the gradient is stronger."""
    weak: float
    """An edge continues while the gradient is stronger."""


class Edges(NamedTuple):
    """Thin edges and the image gradient."""

    found: NDArray[np.uint8]
    """255 on an edge, one pixel thin, (H, W)."""
    gradients: NDArray[np.int16]
    """Sobel gradient of the colour channel with the strongest gradient, along u and v, (2, H, W)."""


def levels(strengths: FloatArray, restricted: bool) -> Levels:
    """Choose Canny's thresholds for an image.

    Args:
        strengths: L1 norms of the strongest channel's gradient at samples spread over the whole image, (n,).
        restricted: whether edges are restricted to a foreground. The bounds then follow noise, not the share of texture
            in the image.
    """
    strongest, weaker = quantiles(strengths, _FRACTIONS).tolist()
    strong, weak = max(2 * MIN_GRADIENT, strongest), max(MIN_GRADIENT, weaker)
    return Levels(min(strong, 4 * MIN_GRADIENT), min(weak, 2 * MIN_GRADIENT)) if restricted else Levels(strong, weak)


def detect_edges(smooth: Image, bounds: Levels, foreground: Mask | None = None) -> Edges:
    """Detect Canny edges over colour channels: at each pixel the channel with the strongest gradient counts.

    Two regions of equal brightness and different hue have an edge that a gray image does not show.

    Args:
        smooth: smoothed frame, (H, W, 3) RGB.
        bounds: Canny's thresholds.
        foreground: where edges may lie, (H, W) bool; everywhere if None.
    """
    gradients = np.empty((2, *smooth.shape[:2]), np.int16)
    _strongest(smooth.reshape(len(smooth), -1), *gradients)
    found = cv2.Canny(gradients[0], gradients[1], bounds.weak, bounds.strong)
    if foreground is not None:
        found = cv2.bitwise_and(found, found, mask=foreground.view(np.uint8))
    return Edges(np.asarray(found, dtype=np.uint8), gradients)


@njit(nogil=True, cache=True)
def _strongest(image: NDArray[np.uint8], out_x: NDArray[np.int16], out_y: NDArray[np.int16]) -> None:
    """Fill the Sobel gradient of the channel with the largest L1 norm at each pixel, (H, 3 W) to (H, W) each.

    The image is mirrored beyond its border. Rows are processed one by one, because fresh memory for a whole image costs
    more than the sums. Float32 is vectorized; numba would widen integers to 64 bits.
    """
    height, width = image.shape
    # One more pixel (three numbers) on either side.
    blurred, derived = np.empty(width + 6, np.float32), np.empty(width + 6, np.float32)
    gx, gy = np.empty(width, np.float32), np.empty(width, np.float32)
    for v in range(height):
        above, here, below = image[min(abs(v - 1), height - 1)], image[v], image[height - 1 - abs(height - 2 - v)]
        for i in range(width):
            a, b, c = np.float32(above[i]), np.float32(here[i]), np.float32(below[i])
            blurred[i + 3], derived[i + 3] = a + b + b + c, c - a
        for i in range(3):
            blurred[i], derived[i] = blurred[i + 6], derived[i + 6]
            blurred[width + 3 + i], derived[width + 3 + i] = blurred[width - 3 + i], derived[width - 3 + i]
        for i in range(width):
            gx[i] = blurred[i + 6] - blurred[i]
            gy[i] = derived[i] + derived[i + 3] + derived[i + 3] + derived[i + 6]
        _take_strongest(gx, gy, out_x[v], out_y[v])


@njit(nogil=True, cache=True)
def _take_strongest(gx: FloatArray, gy: FloatArray, out_x: NDArray[np.int16], out_y: NDArray[np.int16]) -> None:
    """Fill the gradients of the strongest channels of a row, (3 W,) to (W,) each."""
    for i in range(out_x.shape[0]):
        x0, x1, x2 = gx[3 * i], gx[3 * i + 1], gx[3 * i + 2]
        y0, y1, y2 = gy[3 * i], gy[3 * i + 1], gy[3 * i + 2]
        m0, m1, m2 = abs(x0) + abs(y0), abs(x1) + abs(y1), abs(x2) + abs(y2)
        x, y, m = (x1, y1, m1) if m1 > m0 else (x0, y0, m0)
        out_x[i], out_y[i] = (np.int16(x2), np.int16(y2)) if m2 > m else (np.int16(x), np.int16(y))


SPACING_PX = 20
"""Distance between neighbouring samples, working px."""
_MIN_SAMPLES = 8
"""Smallest number of samples along each axis: fewer show too little of a small image."""
_TAPS = 9
"""Side of the patch that smoothing (7) and a derivative (3) read, working px."""


class ImageStatistics(NamedTuple):
    """Measurements at the samples of an image."""

    colors: FloatArray
    """Smoothed colour, (n, 3), gray levels."""
    strengths: FloatArray
    """L1 norm of the gradient of the strongest channel, (n,)."""


class SampleGrid:
    """A grid of samples in the images of one camera, as filmed."""

    def __init__(self, size: tuple[int, int], scale: float) -> None:
        """Lay out the grid.

        Args:
            size: width and height of the footage, px.
            scale: working pixels per pixel of the footage, at most 1.
        """
        self._columns, self._rows = (_taps(length, scale) for length in size)
        self._block = min(int(1 / scale), 2)
        self._kernels = _kernels()

    def measure(self, image: Image) -> ImageStatistics:
        """Measure a frame as filmed, (H, W, 3), at the samples."""
        n = len(self._rows) * len(self._columns)
        out = ImageStatistics(np.empty((n, 3), np.float32), np.empty(n, np.float32))
        image = image.view()
        image.flags.writeable = False  # images of the cache are not writable: one kernel reads both kinds
        _read(image, self._rows, self._columns, self._block, self._kernels, out)
        return out


def _taps(length: int, scale: float) -> NDArray[np.int64]:
    """Return the tap positions along one axis, (places, taps), px of the footage, within the image."""
    places = max(_MIN_SAMPLES, round(length * scale / SPACING_PX))
    middles = (np.arange(places) + 0.5) * length / places
    taps = middles[:, None] + (np.arange(_TAPS) - _TAPS // 2) / scale
    return np.clip(np.round(taps), 0, length - 1).astype(np.int64)


def _kernels() -> FloatArray:
    """Return smoothing and Sobel's derivatives along u and v of the smoothed image as rows, (3, taps^2)."""
    smooth = np.pad(cv2.getGaussianKernel(_TAPS - 2, SMOOTHING_PX).ravel(), 1)
    narrow = smooth[1:-1]
    wide, derived = np.convolve(narrow, (1.0, 2.0, 1.0)), np.convolve(narrow, (1.0, 0.0, -1.0))
    pairs = ((smooth, smooth), (wide, derived), (derived, wide))  # along v, along u
    return np.stack([np.outer(v, u).ravel() for v, u in pairs]).astype(np.float32)


@njit(nogil=True, cache=True, fastmath={"reassoc", "contract"})
def _read(
    image: Image,
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    block: int,
    kernels: FloatArray,
    out: ImageStatistics,
) -> None:
    """Fill the measurements of each sample from the responses of the kernels, (3, taps^2).

    Samples are processed one by one. All patches at once would need fresh memory, and BLAS would spread their product
    over threads that wait for busy cores.
    """
    patch, responses, n = np.empty((3, kernels.shape[1]), np.float32), np.empty(3, np.float32), 0
    for r in range(rows.shape[0]):
        for c in range(columns.shape[0]):
            _take_patch(image, rows[r], columns[c], block, patch)
            strongest = np.float32(0.0)
            for channel in range(3):
                for k in range(3):
                    total = np.float32(0.0)
                    for t in range(kernels.shape[1]):
                        total += patch[channel, t] * kernels[k, t]
                    responses[k] = total
                out.colors[n, channel] = responses[0]
                strongest = max(strongest, abs(responses[1]) + abs(responses[2]))
            out.strengths[n] = strongest
            n += 1


@njit(nogil=True, cache=True)
def _take_patch(
    image: Image, rows: NDArray[np.int64], columns: NDArray[np.int64], block: int, patch: FloatArray
) -> None:
    """Fill a patch, (3, taps^2). Each tap is the mean of a block of pixels, like a pixel of a reduced image."""
    height, width, _ = image.shape
    share = np.float32(1.0 / (block * block))
    for di in range(block):
        for dj in range(block):
            for i in range(rows.shape[0]):
                line = image[min(rows[i] + di, height - 1)]
                for j in range(columns.shape[0]):
                    # An index that may be negative is checked twice.
                    u, t = np.uint64(min(columns[j] + dj, width - 1)), np.uint64(i * columns.shape[0] + j)
                    for channel in range(3):
                        level = share * np.float32(line[u, channel])
                        patch[channel, t] = level if di + dj == 0 else patch[channel, t] + level


_MEMORY = 4
"""Length of the running mean, frames. A new edge is known at once; one where none was before, after three frames."""
_KNOWN = 0.5
"""Smallest share of frames in which an edge was present with the same direction, and of a segment on such edges."""


class StaticEdgeModel:
    """Running mean of the edges of one view away from all bodies."""

    def __init__(self, size: tuple[int, int]) -> None:
        """Begin without any edges.

        Args:
            size: width and height of the whole image, working px.
        """
        width, height = size
        # Mean of unit gradients, 0 in frames without an edge. It is short where an edge flickers or turns.
        self._gradients = np.zeros((height, width, 2), np.float32)
        self._frames = np.zeros((height, width), np.uint8)

    def contains(self, segments: EdgeSegments, corner_px: tuple[int, int]) -> NDArray[np.bool_]:
        """Return which segments are static, (S,).

        Args:
            segments: segments of a region.
            corner_px: first pixel of the region in the whole image, working px.
        """
        known = np.zeros(len(segments.firsts) - 1, np.bool_)
        _mark_known(segments, self._gradients, *corner_px, known)
        return known

    def update(
        self,
        segments: EdgeSegments,
        corner_px: tuple[int, int],
        size: tuple[int, int],
        pieces_px: FloatArray,
        reach_px: float,
    ) -> None:
        """Update the model with the edges of a region away from the bodies.

        Args:
            segments: all segments of the region.
            corner_px: first pixel of the region in the whole image, working px.
            size: width and height of the region, px.
            pieces_px: visible pieces of the contours of all bodies, x0, y0, x1, y1, (M, 4), px of the region.
            reach_px: edges nearer to these pieces may belong to bodies and are left out, px.
        """
        box = np.array([*corner_px, *size])
        _update_means(segments, pieces_px, int(np.ceil(reach_px)), self._gradients, self._frames, box)


@njit(nogil=True, cache=True)
def _mark_known(segments: EdgeSegments, gradients: FloatArray, left: int, top: int, known: NDArray[np.bool_]) -> None:
    """Mark the known segments of a region, (S,), by the mean gradients of the whole image, (H, W, 2)."""
    points, normals, firsts = segments.points_px, segments.normals, segments.firsts
    for s in range(known.shape[0]):
        there = 0
        for i in range(firsts[s], firsts[s + 1]):
            u, v = left + int(points[i, 0]), top + int(points[i, 1])
            if gradients[v, u, 0] * normals[i, 0] + gradients[v, u, 1] * normals[i, 1] > _KNOWN:
                there += 1
        known[s] = there > _KNOWN * (firsts[s + 1] - firsts[s])


@njit(nogil=True, cache=True)
def _update_means(
    segments: EdgeSegments, pieces: FloatArray, reach: int, gradients: FloatArray, frames: NDArray[np.uint8],
    box: IntArray,
) -> None:  # fmt: skip
    """Update the mean gradients, (H, W, 2), of pixels away from all pieces, and their frame counts, (H, W).

    Segments and pieces lie in the region `box`: left, top, width and height. Edges are drawn one pixel wider on all
    sides, because noise moves them by that much.
    """
    left, top = box[0], box[1]
    width, height = min(box[2], frames.shape[1] - left), min(box[3], frames.shape[0] - top)
    now, free = np.zeros((height, width, 2), np.float32), np.ones((height, width), np.bool_)
    points, normals = segments.points_px, segments.normals
    for i in range(points.shape[0]):
        u, v = int(points[i, 0]), int(points[i, 1])
        for y in range(max(0, v - 1), min(height, v + 2)):
            for x in range(max(0, u - 1), min(width, u + 2)):
                now[y, x, 0], now[y, x, 1] = normals[i, 0], normals[i, 1]
    for i in range(pieces.shape[0]):
        u, v = int(0.5 * (pieces[i, 0] + pieces[i, 2])), int(0.5 * (pieces[i, 1] + pieces[i, 3]))
        free[max(0, v - reach) : max(0, v + reach + 1), max(0, u - reach) : max(0, u + reach + 1)] = False
    for y in range(height):
        for x in range(width):
            if free[y, x]:
                v, u = top + y, left + x
                frames[v, u] = min(frames[v, u] + 1, _MEMORY)
                share = np.float32(1.0) / np.float32(frames[v, u])
                gradients[v, u, 0] += share * (now[y, x, 0] - gradients[v, u, 0])
                gradients[v, u, 1] += share * (now[y, x, 1] - gradients[v, u, 1])
