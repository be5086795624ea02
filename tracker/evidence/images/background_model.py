"""Learn the empty scene of a view from an image, from an empty clip, or from a recording in which people move."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from tracker.compute.quantiles import MAD_TO_SIGMA
from tracker.geometry.arrays import FloatArray, Image


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
