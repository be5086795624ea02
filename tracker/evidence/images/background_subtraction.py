"""Find the silhouette: the pixels in which a frame differs from the empty scene.

Learn the empty scene of a view from an image, from an empty clip, or from a recording in which people move.

Turn changed pixels into silhouettes: morphology, small holes, largest components, and a figure of their quality.
"""

from collections.abc import Iterable, Sequence
from enum import IntEnum
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.compute.jit import njit
from tracker.compute.quantiles import MAD_TO_SIGMA, median
from tracker.evidence.images.change import MIN_DIFFERENCE, NOISE_SIGMAS
from tracker.geometry.arrays import FloatArray, Image, Mask

SMOOTHING_PX = 1.0
"""Standard deviation of the Gaussian that smooths images before they are compared or differentiated, px."""
MIN_SHADE = 0.5
"""Brightness of the darkest shadow, as a share of the unshaded background."""
MAX_HUE_SHIFT = 7.0
"""Largest deviation of a channel from the darkened background within a shadow, gray levels."""
MAX_HIGHLIGHT = 1.3
"""Brightness of the brightest highlight, as a share of the unlit background."""
_UNRELIABLE = 20.0
"""Distance from either end of the gray levels up to which a ratio of colours is not reliable."""
_MIN_SAMPLES = 50
"""Fewest usable samples whose median gives a gain."""


class _PixelClass(IntEnum):
    """Classes of a pixel, by growing difference from the empty scene."""

    SAME = 0
    SHADOW = 1
    NEW = 2


def smooth_image(image: Image) -> Image:
    """Smooth an image, (H, W, 3), against the noise of single pixels."""
    return np.asarray(cv2.GaussianBlur(image, (0, 0), SMOOTHING_PX), dtype=np.uint8)


def has_usable_exposure(empty_colors: NDArray[np.float32]) -> Mask:
    """Return which samples of an empty scene are neither too dark nor too bright to measure exposure, (n,).

    Args:
        empty_colors: smoothed colours of the samples, (n, 3).
    """
    dark, bright = _UNRELIABLE, np.iinfo(np.uint8).max - _UNRELIABLE
    return np.asarray(np.all((empty_colors > dark) & (empty_colors < bright), axis=-1))


def exposure_gain(colors: NDArray[np.float32], empty_colors: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the gain of each channel of a frame over the empty scene, (3,), as automatic exposure causes it.

    Args:
        colors: smoothed colours at samples spread over the whole frame, (n, 3); most of them show the background.
        empty_colors: colours of the empty scene at the same samples, (n, 3), all usable (`has_usable_exposure`).
    """
    return np.ones(3, np.float32) if len(colors) < _MIN_SAMPLES else median(colors / empty_colors).astype(np.float32)


def change_threshold(differences: NDArray[np.float32]) -> float:
    """Return the difference above which a pixel has changed, gray levels.

    The threshold follows the noise of the view. Most pixels show the background, so the median difference measures the
    noise of an unchanged pixel.

    Args:
        differences: largest difference over the channels between smoothed frame and smoothed background, at samples
            spread over the whole image, (n,).
    """
    return max(MIN_DIFFERENCE, NOISE_SIGMAS * float(median(differences)))


def exposure_and_threshold(
    colors: NDArray[np.float32], empty_colors: NDArray[np.float32]
) -> tuple[NDArray[np.float32], float]:
    """Return `exposure_gain` by the usable samples, (3,), and `change_threshold` by all, both as (n, 3)."""
    usable = has_usable_exposure(empty_colors)
    gain = exposure_gain(colors[usable], empty_colors[usable])
    return gain, change_threshold(np.abs(colors - gain * empty_colors).max(axis=-1))


def apply_gain(image: Image, gain: NDArray[np.float32]) -> Image:
    """Multiply the channels of an image, (H, W, 3), by a gain, (3,)."""
    table = np.clip(np.round(np.arange(256)[:, None] * gain), 0, 255).astype(np.uint8)
    return np.asarray(cv2.LUT(np.ascontiguousarray(image), table[None]), dtype=np.uint8)


class Shading(NamedTuple):
    """Changes of the light that leave a pixel in the background (Horprasert, Harwood & Davis 1999)."""

    darkest: float = MIN_SHADE
    """Brightness distortion of the darkest shadow, as a share of the background."""
    brightest: float = 1.0
    """Brightness distortion of the brightest highlight, as a share of the background; 1 for none."""
    max_chromaticity: float = MAX_HUE_SHIFT
    """Largest chromaticity distortion: deviation of a channel from the background at that brightness, gray levels."""


SHADOWS = Shading()
"""Shadows alone are background. Edges of a bright person count while tracking."""
SHADOWS_AND_HIGHLIGHTS = Shading(brightest=MAX_HIGHLIGHT)
"""Shadows and highlights are background."""


class Changes(NamedTuple):
    """The pixels in which a frame differs from the empty scene."""

    inside: Mask
    """Silhouette without shadows, with holes where colours agree, (H, W)."""
    anything: Mask
    """Silhouette with shadows, (H, W). It includes clothes that look like a shadow of what is behind them."""
    unknown: Mask | None = None
    """Pixels of which a mask does not say whether they are inside, (H, W); `anything` includes them. None without."""


def subtract_background(
    smooth: Image, background: Image, threshold: float, shading: Shading = SHADOWS, noise: FloatArray | None = None
) -> Changes:
    """Find the pixels that differ from the background.

    A darker or brighter pixel with the hue of the background is classified as shadow or highlight (brightness and
    chromaticity distortion, Horprasert, Harwood & Davis 1999 Eq. 4 and 5, with one threshold for a whole view).

    Args:
        smooth: smoothed frame, (H, W, 3) RGB.
        background: smoothed empty scene, (H, W, 3) RGB, with the same pixels.
        threshold: see `change_threshold`.
        shading: changes of the light that are background.
        noise: standard deviation of the empty scene over time, (H, W), gray levels; None if it is not known.
    """
    changed = np.empty(smooth.shape[:2], np.uint8)
    bounds = [np.float32(x) for x in (threshold, *shading)]
    _find_changes(smooth.ravel(), background.ravel(), *bounds, changed.ravel())
    if noise is not None:
        difference = cv2.absdiff(smooth, background).max(axis=-1)
        changed[difference < NOISE_SIGMAS * noise] = _PixelClass.SAME
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    inside, anything = (
        np.asarray(cv2.morphologyEx((changed > least).view(np.uint8), cv2.MORPH_OPEN, cross)) > 0
        for least in (_PixelClass.SHADOW, _PixelClass.SAME)
    )
    return Changes(inside, anything)


@njit(nogil=True, cache=True, error_model="numpy")
def _find_changes(
    image: NDArray[np.uint8], empty: NDArray[np.uint8], threshold: float, darkest: float, brightest: float,
    max_chromaticity: float, changed: NDArray[np.uint8],
) -> None:  # fmt: skip
    """Fill the class of each pixel, (n,): unchanged, in a shadow or highlight, or new.

    The kernel uses float32, no branches and no check for division by zero, so that it is vectorized: ten times as fast.

    Args:
        image: colours of the frame, (3 n,).
        empty: colours of the empty scene, (3 n,).
        threshold: smallest difference of a changed pixel, gray levels.
        darkest: see `Shading`.
        brightest: see `Shading`.
        max_chromaticity: see `Shading`.
        changed: filled with values of `_PixelClass`, (n,).
    """
    one = np.float32(1.0)
    same, shadow = np.float32(_PixelClass.SAME.value), np.float32(_PixelClass.SHADOW.value)
    new = np.float32(_PixelClass.NEW.value)
    for i in range(changed.shape[0]):
        r, g, b = np.float32(image[3 * i]), np.float32(image[3 * i + 1]), np.float32(image[3 * i + 2])
        r0, g0, b0 = np.float32(empty[3 * i]), np.float32(empty[3 * i + 1]), np.float32(empty[3 * i + 2])
        shade = (r * r0 + g * g0 + b * b0) / (r0 * r0 + g0 * g0 + b0 * b0 + one)
        red, green, blue = abs(r - r0), abs(g - g0), abs(b - b0)
        difference = red if red > green else green
        difference = difference if difference > blue else blue
        red, green, blue = abs(r - shade * r0), abs(g - shade * g0), abs(b - shade * b0)
        shift = red if red > green else green
        shift = shift if shift > blue else blue
        became = shadow if shift < max_chromaticity else new
        became = became if shade > darkest else new
        became = became if shade < brightest else new
        changed[i] = np.uint8(became if difference > threshold else same)


def dilate(mask: Mask, radius_px: float) -> Mask:
    """Dilate a mask by a radius, px: the generous foreground in which edges may belong to a person.

    The disc is an octagon made of a square and diamonds. It takes a third of the time of a distance transform.
    """
    radius = round(radius_px)
    straight = round((np.sqrt(2) - 1) * radius)  # as wide along the diagonals as along the axes
    square = np.ones((2 * straight + 1, 2 * straight + 1), np.uint8)
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    grown = cv2.dilate(mask.view(np.uint8), square)
    return np.asarray(cv2.dilate(grown, cross, iterations=radius - straight)) > 0


class BackgroundModel(NamedTuple):
    """The empty scene of a view."""

    image: Image
    """Smoothed, (H, W, 3) RGB."""
    noise: FloatArray | None
    """Standard deviation over time of the channel that varies most, (H, W), gray levels; None for a single image."""


def background_of_clip(images: Iterable[Image]) -> BackgroundModel | None:
    """Return the mean and the standard deviation of smoothed images of an empty scene; None without any image.

    Args:
        images: smoothed, (H, W, 3) RGB, of one size. They are read one by one.
    """
    count, mean, squares = 0, np.zeros(0), np.zeros(0)
    for image in images:
        values = image.astype(np.float64)
        count += 1
        if count == 1:
            mean, squares = values, np.zeros_like(values)
            continue
        deviation = values - mean  # Welford's method: one pass, without cancellation
        mean = mean + deviation / count
        squares += deviation * (values - mean)
    if not count:
        return None
    noise = None if count == 1 else np.sqrt(squares.max(axis=-1) / (count - 1)).astype(np.float32)
    return BackgroundModel(np.asarray(np.round(mean), np.uint8), noise)


def background_of_recording(images: Sequence[Image]) -> BackgroundModel:
    """Return the temporal median of smoothed images in which people move, and the spread about it.

    A person who covers a pixel in half of the images becomes background there.

    Args:
        images: smoothed, (H, W, 3) RGB, of one size, spread over the recording; at least one.
    """
    stack = np.stack(images)
    median = np.median(stack, axis=0)
    deviations = np.median(np.abs(stack - median), axis=0).max(axis=-1)
    return BackgroundModel(np.asarray(np.round(median), np.uint8), (MAD_TO_SIGMA * deviations).astype(np.float32))


_CLOSING = 0.004
"""Radius of the morphological closing, as a fraction of the longer side of the image: 3 px of 640."""
_MAX_HOLE = 0.015
"""Largest area of a hole that is filled, as a share of the silhouette; larger ones lie between limbs."""
MIN_COMPONENT = 0.1
"""Smallest area of a component that is kept, as a share of the largest one."""
MIN_AREA = 0.0005
"""Smallest area of a silhouette, as a share of the image."""
_RIM = 0.0025
"""Half the width of a silhouette's rim, as a fraction of the longer side of the image: 2 px of 640."""


class CleanSilhouette(NamedTuple):
    """A silhouette without noise and small holes."""

    mask: Mask
    """(H, W)."""
    quality: float
    """Jaccard index of the silhouette and of the pixels it was made from, 0 to 1. It falls with noise and holes."""


def clean_silhouette(changed: Mask) -> CleanSilhouette:
    """Close gaps, fill small holes and keep the largest components of the changed pixels of a view, (H, W).

    The result is empty if nothing changed but specks.
    """
    closed = cv2.morphologyEx(changed.view(np.uint8), cv2.MORPH_CLOSE, _disc(_CLOSING, changed))
    mask = _without_small_holes(largest_components(np.asarray(closed) > 0))
    union = np.count_nonzero(changed | mask)
    return CleanSilhouette(mask, float(np.count_nonzero(changed & mask) / union) if union else 0.0)


def without_rims(mask: Mask) -> Mask:
    """Remove what is no wider than the rim of a silhouette from a mask, (H, W).

    Pixels there mix the person's colours with the background's.
    """
    return np.asarray(cv2.morphologyEx(mask.view(np.uint8), cv2.MORPH_OPEN, _disc(_RIM, mask))) > 0


def largest_components(mask: Mask) -> Mask:
    """Keep the connected components of a mask, (H, W), that are not much smaller than the largest one."""
    n, labels, statistics, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=8)
    if n < 2:
        return np.zeros_like(mask)
    areas = statistics[:, cv2.CC_STAT_AREA].astype(np.float64)
    areas[0] = 0
    kept = areas >= max(MIN_COMPONENT * areas.max(), MIN_AREA * mask.size)
    return np.asarray(kept[labels])


def _disc(share: float, mask: Mask) -> NDArray[np.uint8]:
    """Return a disc whose radius is a share of the longer side of an image."""
    radius = max(1, round(share * max(mask.shape)))
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1)), np.uint8)


def _without_small_holes(mask: Mask) -> Mask:
    n, labels, statistics, _ = cv2.connectedComponentsWithStats((~mask).view(np.uint8), connectivity=4)
    if n < 2:
        return mask
    filled = statistics[:, cv2.CC_STAT_AREA] <= _MAX_HOLE * np.count_nonzero(mask)
    filled[0] = False  # the mask itself
    out: NDArray[np.bool_] = mask | filled[labels]
    return out
