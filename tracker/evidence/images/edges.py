"""Detect edges over all colour channels, within the foreground if one is known, and measure whole images for that.

Thresholds follow the whole image and must not depend on the region of interest. Gradients and smoothed colours at a
grid of samples take a fraction of the time of computing them everywhere.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import njit
from tracker.compute.quantiles import quantiles
from tracker.evidence.images.background_subtraction import SMOOTHING_PX
from tracker.geometry.arrays import FloatArray, Image, Mask

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
