"""The flash by which cameras can be aligned: a light that goes on and brightens whole pictures at once."""

from typing import NamedTuple

import numpy as np

from tracker.footage.recording import Recording
from tracker.geometry.arrays import TINY, Array, Image


class Flash(NamedTuple):
    """A light that goes on."""

    frame: float
    """When, in frames of the session, with the share of the exposure that was still dark."""
    ratio: float
    """Rise of the brightness over the largest other change from one picture to the next."""
    is_clear: bool


def find_flash(recording: Recording, camera: int, n_frames: int) -> Flash | None:
    """Return the flash in the pictures of a camera, by index; None without a change."""
    images = (recording.read_view(camera, k) for k in range(n_frames))
    return flash_of([np.full((3, 3), np.nan) if image is None else tiles(image) for image in images])


def tiles(image: Image) -> Array:
    """Return the mean brightness of the nine tiles of a picture, (3, 3)."""
    height, width = (n // 3 for n in image.shape[:2])
    cut = image[: 3 * height, : 3 * width].mean(axis=2)
    return np.asarray(cut.reshape(3, height, 3, width).mean(axis=(1, 3)))


def flash_of(brightness: list[Array]) -> Flash | None:
    """Return the flash among pictures by the brightness of their tiles, (3, 3) each.

    It must brighten every tile. A picture during whose exposure the light goes on is brighter by the share of the
    exposure after that moment.
    """
    levels = np.array(brightness)
    steps = np.diff(levels, axis=0).min(axis=(1, 2))  # people and lamps in the picture brighten some tiles
    means = levels.mean(axis=(1, 2))
    if len(steps) < 3 or not np.nanmax(steps) > 0:
        return None
    first = int(np.nanargmax(steps))
    if first > 0 and steps[first - 1] > 0.02 * steps[first]:
        first -= 1  # the light went on late in the exposure of the picture before
    last = min(first + 2, len(means) - 1)
    rise = means[last] - means[first]
    share = (means[first + 1] - means[first]) / rise if rise > 0 else 1.0
    others = np.delete(np.abs(np.diff(means)), [first, last - 1])
    ratio = float(rise / max(np.nanmax(others, initial=0.0), TINY))
    return Flash(first + 1 + float(np.clip(1 - share, 0.0, 1.0)), ratio, ratio >= 5.0)
