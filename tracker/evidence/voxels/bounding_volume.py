"""The volume in which people can be, from the centroids and boxes of their silhouettes (MTHC01 Sect. 2)."""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.errors import TrackerError
from tracker.evidence.silhouettes import ViewSilhouette
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import MAX_LENS_RADIUS, NEAR_PLANE_M, viewed_point

_REACH = 1.5
"""Half the edge of the largest volume, in the mean distance of the cameras from the point that they look at."""
_PIXEL = 1.0
"""Margin around the box of a silhouette, px: a body may reach nearly to the next pixel's centre."""


class BoundingVolume(NamedTuple):
    """A box in the world that holds all people."""

    low: Array
    """Lowest corner, (3,), metres."""
    high: Array
    """Highest corner, (3,), metres."""


def bounding_volume(silhouettes: Sequence[ViewSilhouette], pyramids: Sequence[Array] = ()) -> BoundingVolume:
    """Return the box around the intersection of the pyramids that the silhouettes' boxes span.

    A side of a box at the image's border does not bound the person, who may be cut off there. A silhouette that a
    fisheye lens shows at its own border, or at right angles to its axis, bounds nobody.

    Args:
        silhouettes: of all views. Views with an empty silhouette are left out.
        pyramids: the `pyramid` of each, if they are known; none is empty then.

    Raises:
        TrackerError: fewer than two views show people, or the views show nothing in common.
    """
    seen = [s for s in silhouettes if not s.is_empty]
    if len(seen) < 2:
        empty = [s.camera.name for s in silhouettes if s.is_empty]
        found = f"nobody in {', '.join(empty)}" if seen else "none"
        raise TrackerError(
            f"expected somebody in the silhouettes of at least 2 views, found {found}; choose a frame that shows the "
            "person, and check the background",
            camera=next(iter(empty), None),
        )
    around = [s.camera for s in seen]
    middle = viewed_point(around)
    reach = _REACH * float(np.mean([np.linalg.norm(c.center_world - middle) for c in around]))
    box = _intersection(pyramids or [pyramid(s) for s in seen], middle - reach, middle + reach)
    if box is None:
        raise TrackerError(
            "expected silhouettes of the same people in all views, found none in common; check that the calibration is "
            "of these cameras, that no camera has moved, and that the videos start at the same time"
        )
    return BoundingVolume(*box)


def pyramid(silhouette: ViewSilhouette) -> Array:
    """Return the planes (a, b) with a . x <= b, (m, 4), of the pyramid that a silhouette's box spans; none if it spans
    none."""
    camera, mask = silhouette.camera, silhouette.mask
    v, u = np.nonzero(mask)
    on_border = (u.min() == 0, v.min() == 0, u.max() == camera.width - 1, v.max() == camera.height - 1)
    rows, columns = np.unique(v), np.unique(u)
    outline = [(mask[r].nonzero()[0][[0, -1]], r) for r in rows] + [
        (c, mask[:, c].nonzero()[0][[0, -1]]) for c in columns
    ]
    points = np.concatenate([np.stack(np.broadcast_arrays(a, b), axis=-1) for a, b in outline]).astype(np.float64)
    corners = np.concatenate([points + d for d in itertools.product((-_PIXEL, _PIXEL), repeat=2)])
    rays = camera.rays(corners) @ camera.T_camera_world[:3, :3].T
    # Silhouettes of a fisheye lens that reach farther span no pyramid. NaN is beyond the lens.
    if not np.all(np.linalg.norm(rays[:, :2], axis=1) < MAX_LENS_RADIUS * rays[:, 2]):
        return np.empty((0, 4))
    slopes = rays[:, :2] / rays[:, 2:]
    (x0, y0), (x1, y1) = slopes.min(axis=0), slopes.max(axis=0)
    sides = [(-1.0, 0.0, x0), (0.0, -1.0, y0), (1.0, 0.0, -x1), (0.0, 1.0, -y1)]
    planes = [(*side, 0.0) for side, cut in zip(sides, on_border, strict=True) if not cut]
    planes.append((0.0, 0.0, -1.0, -NEAR_PLANE_M))
    T = camera.T_camera_world
    normals = np.array(planes)
    return np.column_stack([normals[:, :3] @ T[:3, :3], normals[:, 3] - normals[:, :3] @ T[:3, 3]])


def _intersection(pyramids: Sequence[Array], low: Array, high: Array) -> tuple[Array, Array] | None:
    """Return the box around the intersection of pyramids within a box; None if it is empty."""
    from scipy.optimize import linprog  # imported lazily: loading scipy takes 0.3 s

    planes = np.concatenate(pyramids)
    limits, bounds = [], list(zip(low, high, strict=True))
    for sign, axis in itertools.product((1.0, -1.0), range(3)):
        found = linprog(sign * np.eye(3)[axis], A_ub=planes[:, :3], b_ub=planes[:, 3], bounds=bounds)
        if not found.success:
            return None
        limits.append(sign * float(found.fun or 0.0))
    return np.array(limits[:3]), np.array(limits[3:])
