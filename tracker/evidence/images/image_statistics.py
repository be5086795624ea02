"""Measure contrast, noise and colours of a whole image at some thousand samples.

Thresholds follow the whole image and must not depend on the region of interest. Gradients and smoothed colours at a
grid of samples take a fraction of the time of computing them everywhere.
"""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import njit
from tracker.evidence.images.background_subtraction import SMOOTHING_PX
from tracker.geometry.arrays import FloatArray, Image

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
    """L1 norm of the gradient of the strongest channel, (n,), as `edges` computes it."""


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
