"""Frontier points: where the plane through two camera centres touches the body, so that both silhouettes show it.

The lines from an epipole that touch a silhouette above and below touch the body where those of the other camera do
(Sinha, Pollefeys and McMillan 2004). They lie on the convex hulls. While cameras change, a point slides along its line,
so that its distance from the epipolar line of the other is right to first order.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from tracker.calibration.self_calibration.seen_joints import SeenJoints
from tracker.geometry.arrays import Array
from tracker.geometry.camera_derivatives import project_with_columns
from tracker.geometry.cameras import Camera


class FrontierPoints(NamedTuple):
    """Frontier points of all pairs of cameras."""

    seen: SeenJoints
    """As joints that only the two cameras of a pair show: the upper one in the first, then the other."""
    outward: Array
    """Directions in the pictures out of the silhouettes, across the tangents, (F, V, N, 2); NaN where there is none."""


class _Touching(NamedTuple):
    """Vertices of two hulls that planes through both camera centres touch."""

    at: tuple[Array, Array]
    """Their numbers in each hull, (2,) each, the upper one in the first picture first."""
    rays: tuple[Array, Array]
    """Their rays, (2, 3) each."""
    baseline: Array
    """From the first to the second camera, (3,)."""


def frontier_points(hulls_px: Sequence[Sequence[Array]], cameras: Sequence[Camera]) -> FrontierPoints:
    """Return the frontier points of each pair of cameras.

    Args:
        hulls_px: by frame and camera, vertices of the convex hull, (n, 2), original pixels; none where unknown.
        cameras: as far as they are known.
    """
    pairs = [*combinations(range(len(cameras)), 2)]
    px = np.full((len(hulls_px), len(cameras), 2 * len(pairs), 2), np.nan)
    outward = px.copy()
    for k, hulls in enumerate(hulls_px):
        for n, pair in enumerate(pairs):
            found = _touching(hulls, cameras, pair)
            if found is None:
                continue
            for i, at, rays in zip(pair, found.at, found.rays, strict=True):
                px[k, i, 2 * n : 2 * n + 2] = hulls[i][at]
                outward[k, i, 2 * n : 2 * n + 2] = _outward(cameras[i], hulls[i], rays, found.baseline)
    seen = SeenJoints(("",) * px.shape[2], px, np.asarray(np.isfinite(px).all(axis=-1)))
    return FrontierPoints(seen, outward)


def plane_angles(hulls_px: Sequence[Sequence[Array]], cameras: Sequence[Camera], pair: tuple[int, int]) -> Array:
    """Return the angles of frontier points of one camera from the planes of those of another, (n,), rad.

    Both show silhouettes on each of these frames; NaN where an epipole lies within one.
    """
    out = list[Array]()
    for hulls in hulls_px:
        if not len(hulls[pair[0]]) or not len(hulls[pair[1]]):
            continue
        found = _touching(hulls, cameras, pair)
        if found is None:
            out.append(np.full(2, np.nan))
            continue
        out.append(np.abs(np.sum(_normals(found.rays[0], found.baseline) * found.rays[1], axis=1)))
    return np.array(out).ravel()


def _touching(hulls: Sequence[Array], cameras: Sequence[Camera], pair: tuple[int, int]) -> _Touching | None:
    """Return the vertices of two hulls that touch the same planes; None if an epipole lies within a silhouette."""
    i, j = pair
    if min(len(hulls[i]), len(hulls[j])) < 3:
        return None
    baseline = cameras[j].center_world - cameras[i].center_world
    at, rays = [], []
    for v in pair:
        own = cameras[v].rays(hulls[v])
        sides = np.cross(own, np.roll(own, -1, axis=0)) @ baseline > 0
        touching = np.flatnonzero(sides != np.roll(sides, 1))
        if len(touching) != 2:
            return None
        touching = touching[np.argsort(hulls[v][touching, 1])]
        at.append(touching)
        rays.append(own[touching])
    a, b = (_normals(r, baseline) for r in rays)
    if np.sum(a * b) < np.sum(a * b[::-1]):
        at[1], rays[1] = at[1][::-1], rays[1][::-1]
    return _Touching((at[0], at[1]), (rays[0], rays[1]), baseline)


def _normals(rays: Array, baseline: Array) -> Array:
    """Return the unit normals of the planes through the baseline and rays, (n, 3)."""
    normals = np.cross(rays, baseline)
    return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def _outward(camera: Camera, hull: Array, rays: Array, baseline: Array) -> Array:
    """Return the unit directions across the lines from the epipole, out of a hull, (2, 2), at rays that touch it."""
    derived = project_with_columns(camera, camera.center_world + rays)
    tangents = derived.by_point @ baseline
    across = np.stack([-tangents[:, 1], tangents[:, 0]], axis=1)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return np.asarray(across * np.sign(np.sum(across * (derived.px - hull.mean(axis=0)), axis=1, keepdims=True)))
