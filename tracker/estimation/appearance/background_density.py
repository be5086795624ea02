"""How likely each colour is where a view shows nobody, learnt over a run.

The background of a cell is a Gaussian around its usual colour, the same colour in a shadow, or an outlier: something
that moves there, as often as it was seen around that place.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.compute.quantiles import MAD_TO_SIGMA
from tracker.estimation.appearance.part_colors import VOLUME, log_density
from tracker.estimation.appearance.part_drawing import CellView
from tracker.evidence.images.background_subtraction import MAX_HUE_SHIFT, MIN_SHADE, exposure_gain, has_usable_exposure
from tracker.evidence.images.change import NOISE_SIGMAS
from tracker.evidence.images.color_histogram import BINS, bin_of
from tracker.geometry.arrays import FloatArray, Image, Mask

MIN_SEEN = 8
"""Fewest frames in which a cell was open, for a colour of its own."""
_MIN_NOISE = 2.0
"""Smallest standard deviation of a channel, gray levels: rounding, and the losses of a compressed video."""
_BLOCK = 8
"""Side of the blocks that share the rates of outliers and shadows, cells. The rates of the whole view count as much as
one frame of a block; every fourth cell of a row or column measures the exposure."""
_HUE_NOISE = MAX_HUE_SHIFT / 2
"""Standard deviation of a channel about the darkened background within a shadow, gray levels."""


class BackgroundDensity(NamedTuple):
    """The background of one view, in cells."""

    mean: FloatArray
    """Usual colour, (h, w, 3)."""
    noise: FloatArray
    """Standard deviation of a channel, (h, w), gray levels; 0 where the usual colour is unknown."""
    outlier: FloatArray
    """Share of outliers, (h, w)."""
    shadow: FloatArray
    """Share of shadows, (h, w)."""
    outlier_density: FloatArray
    """Density of the colours of outliers, (BINS^3,), per cubic gray level."""

    def gain(self, view: CellView, open_cells: Mask) -> FloatArray:
        """Return the gain of each channel of a frame over the usual colours, (3,), by the cells that show nobody."""
        rows, columns = _box(view)
        few = (slice(None, None, _BLOCK // 2), slice(None, None, _BLOCK // 2))
        chosen = open_cells[few] & (self.noise[rows, columns][few] > 0)
        colors, usual = view.colors[few][chosen].astype(np.float32), self.mean[rows, columns][few][chosen]
        usable = has_usable_exposure(usual)
        return exposure_gain(colors[usable], usual[usable])

    def log_density(self, view: CellView, gain: FloatArray) -> FloatArray:
        """Return the log density of the colour of each cell as background, (h, w), per cubic gray level."""
        mean, noise, outlier, shadow = _cut(_box(view), self.mean, self.noise, self.outlier, self.shadow)
        out = np.empty(view.colors.shape[:2], np.float32)
        _log_density(view.colors, mean, noise, outlier, shadow, self.outlier_density, gain, out)
        return out


def learn_background(
    views: Sequence[CellView], occupied: Sequence[Mask], shape: tuple[int, int], empty: Image | None
) -> BackgroundDensity:
    """Learn the background of a view from frames in which people move.

    Args:
        views: the view on several frames.
        occupied: cells of each that may show people, (h, w).
        shape: rows and columns of the cells of the whole view.
        empty: colours of the cells of the empty scene, (h, w, 3); None if unknown.
    """
    mean = np.zeros((*shape, 3), np.float32)
    if empty is not None:
        mean[:] = empty[: shape[0], : shape[1]]
    noise = np.full(shape, 0.0 if empty is None else 2 * _MIN_NOISE, np.float32)
    rates, uniform = np.full(shape, 0.1, np.float32), np.full(BINS**3, 1 / (VOLUME * BINS**3), np.float32)
    rough = BackgroundDensity(mean, noise, rates, rates, uniform)
    if empty is None:
        rough = _with_medians(rough, views, occupied, [np.ones(3, np.float32)] * len(views))
    gains = [rough.gain(v, ~o) for v, o in zip(views, occupied, strict=True)]
    return _with_rates(_with_medians(rough, views, occupied, gains), views, occupied, gains)


def _with_medians(
    before: BackgroundDensity, views: Sequence[CellView], occupied: Sequence[Mask], gains: Sequence[FloatArray]
) -> BackgroundDensity:
    """Return a background with the median and the spread of the cells that were open in enough frames."""
    if not views:
        return before
    mean, noise = before.mean.copy(), before.noise.copy()
    boxes = [_box(v) for v in views]
    top, left = (min(b[i].start for b in boxes) for i in (0, 1))
    bottom, right = (max(b[i].stop for b in boxes) for i in (0, 1))
    values = np.zeros((bottom - top, right - left, 3, len(views)), np.float32)
    n = np.zeros(values.shape[:2], np.int64)
    for view, hidden, gain in zip(views, occupied, gains, strict=True):
        _append(
            view.colors, hidden, (1 / gain).astype(np.float32), view.corner[1] - top, view.corner[0] - left, values, n
        )
    box = slice(top, bottom), slice(left, right)
    own_mean, own_noise = _cut(box, mean, noise)
    _medians(values, n, own_mean, own_noise)
    mean[box], noise[box] = own_mean, own_noise
    return before._replace(mean=mean, noise=noise)


@njit(**NO_REFCOUNT)
def _append(
    colors: Image, hidden: Mask, scale: FloatArray, top: int, left: int, values: FloatArray, n: NDArray[np.int64]
) -> None:
    """Append the colours of open cells to the lists of all cells, (H, W, 3, room), of lengths (H, W)."""
    for v in range(colors.shape[0]):
        for u in range(colors.shape[1]):
            if not hidden[v, u]:
                k = n[top + v, left + u]
                for c in range(3):
                    values[top + v, left + u, c, k] = colors[v, u, c] * scale[c]
                n[top + v, left + u] = k + 1


def _medians(values: FloatArray, n: NDArray[np.int64], mean: FloatArray, noise: FloatArray) -> None:
    """Fill the median colour and the largest spread of a channel of each cell with enough values.

    In NumPy: a kernel with its median takes longer to compile than all runs of a day spend here.
    """
    seen = n >= MIN_SEEN
    counts = n[seen][:, None, None]
    own = np.where(np.arange(values.shape[-1]) < counts, values[seen], np.inf)  # (k, 3, room)
    middle = _middle(own, counts)
    spread = _middle(np.abs(own - middle), counts).max(axis=(1, 2))
    mean[seen] = middle[..., 0]
    noise[seen] = np.maximum(_MIN_NOISE, MAD_TO_SIGMA * spread)


def _middle(values: FloatArray, counts: NDArray[np.int64]) -> FloatArray:
    """Return the medians of the first values of each list, (k, 3, room), by their number, (k, 1, 1), as (k, 3, 1)."""
    ordered = np.sort(values, axis=-1)
    low, high = (
        np.take_along_axis(ordered, np.broadcast_to(k, (*values.shape[:2], 1)), -1)
        for k in ((counts - 1) // 2, counts // 2)
    )
    return np.asarray((low + high) / 2, dtype=values.dtype)


def _with_rates(
    before: BackgroundDensity, views: Sequence[CellView], occupied: Sequence[Mask], gains: Sequence[FloatArray]
) -> BackgroundDensity:
    """Return a background with the rates of outliers and shadows around each place."""
    shape = before.noise.shape
    blocks = np.zeros((3, shape[0] // _BLOCK + 1, shape[1] // _BLOCK + 1))
    counts = np.zeros(BINS**3)
    for view, hidden, gain in zip(views, occupied, gains, strict=True):
        rows, columns = _box(view)
        mean, noise = _cut((rows, columns), before.mean, before.noise)
        _count(view.colors, hidden, mean, noise, gain, rows.start, columns.start, blocks, counts)
    total = blocks.sum(axis=(1, 2)) + 1.0
    shares = total / total.sum()
    rates = (blocks + _BLOCK**2 * shares[:, None, None]) / (blocks.sum(axis=0) + _BLOCK**2)
    known = before.noise > 0
    shadow, outlier = (
        np.repeat(np.repeat(rates[i], _BLOCK, axis=0), _BLOCK, axis=1)[: shape[0], : shape[1]] for i in (1, 2)
    )
    density = np.exp(log_density(counts)).astype(np.float32)
    outlier, shadow = np.where(known, outlier, 1.0), np.where(known, shadow, 0.0)
    return before._replace(
        outlier=outlier.astype(np.float32), shadow=shadow.astype(np.float32), outlier_density=density
    )


@njit(**NO_REFCOUNT)
def _count(
    colors: Image, hidden: Mask, mean: FloatArray, noise: FloatArray, gain: FloatArray, top: int, left: int,
    blocks: NDArray[np.float64], counts: NDArray[np.float64],
) -> None:  # fmt: skip
    """Count usual cells, shadows and outliers in each block, (3, h, w), and the colours of outliers, (BINS^3,).

    Cells of unknown background count as outliers by their colours alone.
    """
    for v in range(colors.shape[0]):
        for u in range(colors.shape[1]):
            if hidden[v, u]:
                continue
            kind = 2
            if noise[v, u] > 0.0:
                apart, shade, aside = _compare(colors, v, u, mean, gain)
                if apart < (NOISE_SIGMAS * noise[v, u]) ** 2:
                    kind = 0
                elif MIN_SHADE < shade < 1.0 and aside < (NOISE_SIGMAS * max(noise[v, u], _HUE_NOISE)) ** 2:
                    kind = 1
                blocks[kind, (top + v) // _BLOCK, (left + u) // _BLOCK] += 1.0
            if kind == 2:
                counts[bin_of(colors, v, u)] += 1.0


@njit(**NO_REFCOUNT)
def _compare(colors: Image, v: int, u: int, mean: FloatArray, gain: FloatArray) -> tuple[float, float, float]:
    """Return how a cell differs from its usual colour: squared distance, shade, and squared distance at that shade."""
    dot, own, square = 0.0, 0.0, 1.0
    for c in range(3):
        m, x = mean[v, u, c] * gain[c], np.float64(colors[v, u, c])
        dot += m * x
        square += m * m
        own += (x - m) ** 2
    shade, aside = dot / square, 0.0
    for c in range(3):
        aside += (colors[v, u, c] - shade * mean[v, u, c] * gain[c]) ** 2
    return own, shade, aside


@njit(**NO_REFCOUNT)
def _log_density(
    colors: Image, mean: FloatArray, noise: FloatArray, outlier: FloatArray, shadow: FloatArray, table: FloatArray,
    gain: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Fill the log density of each cell, (h, w); see `BackgroundDensity`."""
    for v in range(colors.shape[0]):
        for u in range(colors.shape[1]):
            p = outlier[v, u] * table[bin_of(colors, v, u)]
            sigma = noise[v, u]
            if sigma > 0.0:
                apart, shade, aside = _compare(colors, v, u, mean, gain)
                usual = 1.0 - outlier[v, u] - shadow[v, u]
                p += usual * np.exp(-0.5 * apart / sigma**2) / (np.sqrt(2 * np.pi) * sigma) ** 3
                if MIN_SHADE < shade < 1.0:
                    s = max(sigma, _HUE_NOISE)
                    length = np.sqrt(mean[v, u, 0] ** 2 + mean[v, u, 1] ** 2 + mean[v, u, 2] ** 2) + 1.0
                    p += shadow[v, u] * np.exp(-0.5 * aside / s**2) / (2 * np.pi * s**2 * (1.0 - MIN_SHADE) * length)
            out[v, u] = np.log(p + 1e-30)


def _box(view: CellView) -> tuple[slice, slice]:
    """Return rows and columns of a region among the cells of the whole view."""
    (u, v), (height, width) = view.corner, view.colors.shape[:2]
    return slice(v, v + height), slice(u, u + width)


def _cut(box: tuple[slice, slice], *cells: FloatArray) -> Iterator[FloatArray]:
    """Return a region of some arrays of cells, contiguous: kernels are compiled again for each order in memory."""
    return (of_view[box].copy() for of_view in cells)
