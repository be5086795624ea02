"""Turn changed pixels into silhouettes: morphology, small holes, largest components, and a figure of their quality."""

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Mask

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
