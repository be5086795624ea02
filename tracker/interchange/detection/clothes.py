"""Colors of a person's clothes in a picture, by which views and frames show the same person."""

import cv2
import numpy as np

from tracker.geometry.arrays import Array, Image


def clothes_colors(picture: Image, torso_px: Array, knees_px: Array) -> Array:
    """Return the median colors of trunk and thighs, (6,), CIELAB of 8 bits; NaN for one that the picture does not show.

    Args:
        picture: (H, W, 3) RGB.
        torso_px: left and right shoulder, left and right hip, (4, 2), px.
        knees_px: left and right knee, (2, 2), px.
    """
    shares = np.linspace(0.2, 0.8, 7)  # the edges may show what is behind the person
    left, right = (torso_px[side] + shares[:, None] * (torso_px[side + 2] - torso_px[side]) for side in (0, 1))
    trunk = left[:, None] + shares[None, :, None] * (right - left)[:, None]
    thighs = torso_px[2:] + shares[:, None, None] * (knees_px - torso_px[2:])
    return np.concatenate([_median_color(picture, places.reshape(-1, 2)) for places in (trunk, thighs)])


def _median_color(picture: Image, places_px: Array) -> Array:
    """Return the median color of some places, (n, 2), px; NaN if fewer than half of them are within the picture."""
    known = places_px[np.isfinite(places_px).all(axis=1)].round().astype(int)
    inside = known[((known >= 0) & (known < picture.shape[1::-1])).all(axis=1)]
    if 2 * len(inside) < len(places_px):
        return np.full(3, np.nan)
    colors = cv2.cvtColor(np.ascontiguousarray(picture[inside[:, 1], inside[:, 0]][None]), cv2.COLOR_RGB2LAB)
    return np.asarray(np.median(colors[0], axis=0), dtype=np.float64)
