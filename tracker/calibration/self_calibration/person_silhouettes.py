"""Silhouettes of one person: their convex hulls, and crown and feet where the person stands upright."""

from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

import cv2
import numpy as np

from tracker.evidence.images.background_subtraction import MIN_AREA
from tracker.geometry.arrays import Array, Mask


class UprightRules(NamedTuple):
    """Properties of the silhouette of a person who stands upright."""

    elongation: float = 2.0
    """Least ratio of its standard deviations along and across its axis. A walking body has 3 to 5, one with arms
    stretched aside 2, one that crouches or bends 1 to 1.7."""
    end: float = 0.03
    """Standard deviation of its ends as a share of its length: half a foot, or the way of the crown in a step."""


class Flaw(StrEnum):
    """Reason for which a silhouette does not count."""

    NOBODY = "show nobody"
    CUT = "cut the person at the border"
    SEVERAL = "show several people"
    BENT = "show the person not upright"


class PersonSilhouette(NamedTuple):
    """Silhouette of a person in a picture."""

    hull_px: Array = np.zeros((0, 2))
    """Vertices of its convex hull, (n, 2), original pixels, in order; none if it does not count."""
    upright_px: Array = np.full((2, 2), np.nan)
    """Crown and middle of the feet, (2, 2), original pixels; NaN unless the person is upright."""
    flaw: Flaw | None = None
    """Reason for which it does not count, in part or as a whole."""


NOTHING = PersonSilhouette(flaw=Flaw.NOBODY)
"""Silhouette where nobody is seen."""


def measure_silhouette(mask: Mask, undistort: Callable[[Array], Array]) -> PersonSilhouette:
    """Find hull, crown and feet of the person in a mask, (H, W).

    Crown and feet are the ends of the silhouette along its principal axis (Lv, Zhao and Nevatia 2006).

    Args:
        mask: where people are, original pixels.
        undistort: maps original pixels to undistorted ones, in which hulls are convex.
    """
    areas = _areas(mask)
    if not len(areas) or areas.sum() < MIN_AREA * mask.size:
        return NOTHING
    if len(areas) > 1 and 2 * areas[1] > areas[0]:
        return PersonSilhouette(flaw=Flaw.SEVERAL)
    if mask[[0, -1]].any() or mask[:, [0, -1]].any():
        return PersonSilhouette(flaw=Flaw.CUT)
    contours, _ = cv2.findContours(mask.view(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    contour = np.concatenate(contours)[:, 0].astype(np.float64)
    plain = undistort(contour).astype(np.float32)
    hull = contour[cv2.convexHull(plain, returnPoints=False)[:, 0]]
    upright = _ends(mask, contour)
    return PersonSilhouette(hull, flaw=Flaw.BENT) if upright is None else PersonSilhouette(hull, upright)


def _areas(mask: Mask) -> Array:
    """Return the areas of the connected components, the largest first."""
    _, _, statistics, _ = cv2.connectedComponentsWithStats(mask.view(np.uint8), connectivity=8)
    return np.asarray(np.sort(statistics[1:, cv2.CC_STAT_AREA])[::-1], dtype=np.float64)


def _ends(mask: Mask, contour: Array) -> Array | None:
    """Return the upper and the lower end of a silhouette along its axis, (2, 2); None if it is not long enough."""
    m = cv2.moments(mask.view(np.uint8), binaryImage=True)
    middle = np.array([m["m10"], m["m01"]]) / m["m00"]
    variances, axes = np.linalg.eigh(np.array([[m["mu20"], m["mu11"]], [m["mu11"], m["mu02"]]]))
    if variances[1] < UprightRules().elongation ** 2 * variances[0]:
        return None
    up = axes[:, 1] * -np.sign(axes[1, 1])  # y points down in a picture
    along = (contour - middle) @ up
    across = (contour - middle) @ np.array([-up[1], up[0]])
    # Raised hands stand beside the axis; the crown is where the axis leaves the silhouette.
    on_axis = along[np.abs(across) <= UprightRules().end * np.ptp(along)]
    return np.stack([middle + on_axis.max() * up, middle + along.min() * up]) if len(on_axis) else None
