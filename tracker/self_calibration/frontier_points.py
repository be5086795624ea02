"""Frontier points: where the plane through two camera centres touches the body, so that both silhouettes show it.

The lines from an epipole that touch a silhouette above and below touch the body where those of the other camera do
(Sinha, Pollefeys and McMillan 2004). They lie on the convex hulls. While cameras change, a point slides along its line,
so that its distance from the epipolar line of the other is right to first order.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import Camera
from tracker.self_calibration.seen_joints import SeenJoints


def frontier_points(hulls_px: Sequence[Sequence[Array]], cameras: Sequence[Camera]) -> SeenJoints:
    """Return the frontier points of each pair of cameras, as joints that only the two show.

    Args:
        hulls_px: by frame and camera, vertices of the convex hull, (n, 2), original pixels; none where unknown.
        cameras: as far as they are known.
    """
    pairs = [*combinations(range(len(cameras)), 2)]
    px = np.full((len(hulls_px), len(cameras), 2 * len(pairs), 2), np.nan)
    for k, hulls in enumerate(hulls_px):
        rays = [c.rays(h) if len(h) else np.zeros((0, 3)) for c, h in zip(cameras, hulls, strict=True)]
        for n, (i, j) in enumerate(pairs):
            baseline = cameras[j].center_world - cameras[i].center_world
            a, b = _touching(rays[i], baseline), _touching(rays[j], baseline)
            if len(a) != 2 or len(b) != 2:
                continue  # the epipole lies within the silhouette
            if _apart(rays[i][a], rays[j][b], baseline) > _apart(rays[i][a], rays[j][b[::-1]], baseline):
                b = b[::-1]
            px[k, i, 2 * n : 2 * n + 2] = hulls[i][a]
            px[k, j, 2 * n : 2 * n + 2] = hulls[j][b]
    return SeenJoints(("",) * px.shape[2], px, np.asarray(np.isfinite(px).all(axis=-1)))


def plane_angles(hulls_px: Sequence[Sequence[Array]], cameras: Sequence[Camera], pair: tuple[int, int]) -> Array:
    """Return the angles of frontier points of one camera from the planes of those of another, (n,), rad.

    Both show silhouettes on each of these frames; NaN where an epipole lies within one.
    """
    (i, j), out = pair, list[Array]()
    baseline = cameras[j].center_world - cameras[i].center_world
    for hulls in hulls_px:
        if not len(hulls[i]) or not len(hulls[j]):
            continue
        a, b = cameras[i].rays(hulls[i]), cameras[j].rays(hulls[j])
        a, b = a[_touching(a, baseline)], b[_touching(b, baseline)]
        if len(a) != 2 or len(b) != 2:
            out.append(np.full(2, np.nan))
            continue
        normals = np.cross(a, baseline)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        out.append(min((np.abs(np.sum(normals * o, axis=1)) for o in (b, b[::-1])), key=lambda v: float(v.sum())))
    return np.array(out).ravel()


def _touching(rays: Array, baseline: Array) -> IntArray:
    """Return the vertices of a hull, given by their rays, (n, 3), where planes through the baseline touch it."""
    if len(rays) < 3:
        return np.zeros(0, dtype=np.int64)
    sides = np.cross(rays, np.roll(rays, -1, axis=0)) @ baseline > 0
    return np.flatnonzero(sides != np.roll(sides, 1))


def _apart(a: Array, b: Array, baseline: Array) -> float:
    """Return how far the planes through the baseline and rays, (n, 3), differ from those of others."""
    normals = [np.cross(r, baseline) for r in (a, b)]
    normals = [n / np.linalg.norm(n, axis=1, keepdims=True) for n in normals]
    return float(np.sum((normals[0] - normals[1]) ** 2))
