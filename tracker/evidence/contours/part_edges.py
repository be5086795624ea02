"""Find the occlusion of single points, and the curves where parts intersect."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import PosedBody
from tracker.compute.jit import FAST_MATH, njit
from tracker.evidence.contours import occluding_contours
from tracker.evidence.contours.pieces import PIECE_PX
from tracker.evidence.contours.surfaces import N_RINGS, N_SECTORS, Surfaces, surfaces_of
from tracker.evidence.contours.visibility import LANES, mark_occluded
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.cameras import Camera

_LIFT_M = 0.012
"""Distance by which a curve is lifted off the surfaces before its occlusion is tested, metres."""


def points_occluded(bodies: Sequence[PosedBody], cameras: Sequence[Camera], points_world: Array) -> NDArray[np.bool_]:
    """Return whether any body occludes each point, (V, n); see `points_occluded_by_body`."""
    return np.asarray(points_occluded_by_body(bodies, cameras, points_world).any(axis=1))


def points_occluded_by_body(
    bodies: Sequence[PosedBody], cameras: Sequence[Camera], points_world: Array
) -> NDArray[np.bool_]:
    """Return whether each body occludes each point, (V, n_bodies, n).

    Parts that contain the point itself, as around a joint, do not count.

    Args:
        bodies: all bodies in the scene.
        cameras: the views.
        points_world: (n, 3), metres.
    """
    occluded = np.zeros((len(cameras), len(bodies), len(points_world)), dtype=bool)
    for i, body in enumerate(bodies):
        surfaces, Ts = surfaces_of((body.model,)), occluding_contours.part_poses([body])
        holds = np.stack(
            [
                shape.inside_outside((points_world - T[:3, 3]) @ T[:3, :3] - center) < 1.5
                for shape, T, center in zip(body.model.shapes, Ts, surfaces.centers, strict=True)
            ]
        )
        for view, camera in enumerate(cameras):
            occluded[view, i] = _occluded_points(camera, Ts, surfaces, points_world, holds)
    return occluded


def part_edges(bodies: Sequence[PosedBody], cameras: Sequence[Camera]) -> list[FloatArray]:
    """Return the visible curves in which surfaces of parts intersect: drawn, but never matched (GD96 Sect. 5).

    Args:
        bodies: all bodies in the scene.
        cameras: the views.

    Returns:
        For each view end points x0, y0, x1, y1 in undistorted px, (N, 4).
    """
    surfaces = surfaces_of(tuple(b.model for b in bodies))
    Ts = occluding_contours.part_poses(bodies)
    curves = _intersections(bodies, Ts, surfaces)
    shown = []
    for camera in cameras:
        pieces, points = _cut(curves, camera)
        # If both surfaces face the camera, a small step towards it leaves both parts.
        towards = camera.center_world - points
        lifted = points + _LIFT_M * towards / np.linalg.norm(towards, axis=-1, keepdims=True)
        nothing = np.zeros((len(Ts), len(points)), dtype=bool)
        shown.append(pieces[~_occluded_points(camera, Ts, surfaces, lifted, nothing)])
    return shown


def _intersections(bodies: Sequence[PosedBody], Ts: Array, surfaces: Surfaces) -> Array:
    """Return segments of the curves in which parts intersect, (n, 2, 3), metres.

    The surface of each part is cut by the implicit function of every part near it.
    """
    shapes = [s for b in bodies for s in b.model.shapes]
    centers_world = np.einsum("pij,pj->pi", Ts[:, :3, :3], surfaces.centers) + Ts[:, :3, 3]
    apart_m = np.linalg.norm(centers_world[:, None] - centers_world, axis=-1)
    is_near = np.tril(apart_m <= surfaces.radii[:, None] + surfaces.radii, -1)  # each pair once: it is on both surfaces
    buffer, found = np.empty((6 * (N_RINGS + N_SECTORS), 2, 3), np.float32), [np.empty((0, 2, 3))]
    for a in np.flatnonzero(is_near.any(axis=1)):
        grid = (shapes[a].grid(N_RINGS, N_SECTORS)[0] + surfaces.centers[a]) @ Ts[a, :3, :3].T + Ts[a, :3, 3]
        for b in np.flatnonzero(is_near[a]):
            local = (grid - Ts[b, :3, 3]) @ Ts[b, :3, :3] - surfaces.centers[b]
            # The root makes the implicit function nearly linear across the surface, for interpolation.
            depth = shapes[b].inside_outside(local) ** (1 / shapes[b].degree) - 1.0
            n = _zero_line(depth.astype(np.float32), grid.astype(np.float32), buffer)
            found.append(buffer[:n].astype(np.float64))
    return np.concatenate(found)


def _cut(segments: Array, camera: Camera) -> tuple[FloatArray, Array]:
    """Cut segments (n, 2, 3) in the world into pieces of at most PIECE_PX.

    Returns:
        End points x0, y0, x1, y1, (N, 4), px, and the middles, (N, 3), metres.
    """
    if not len(segments):
        return np.empty((0, 4), np.float32), np.empty((0, 3))
    px = camera.project(segments.reshape(-1, 3)).reshape(-1, 2, 2)
    lengths = np.linalg.norm(px[:, 1] - px[:, 0], axis=1)
    counts = np.maximum(1, np.ceil(lengths / PIECE_PX)).astype(int)
    which = np.repeat(np.arange(len(segments)), counts)
    starts = (np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[which]
    along = starts[:, None] + [0.0, 0.5, 1.0] / counts[which, None]  # (N, 3)
    ends = px[which, :1] + along[:, ::2, None] * (px[which, 1:] - px[which, :1])
    middles = segments[which, 0] + along[:, 1:2] * (segments[which, 1] - segments[which, 0])
    return ends.reshape(-1, 4).astype(np.float32), middles


@njit(nogil=True, cache=True)
def _zero_line(f: FloatArray, g: FloatArray, segments: FloatArray) -> int:
    """Fill the zero line of f over the surface grid g as segments (n, 2, 3) by marching squares; return their
    number."""
    n_rings, n_sectors = f.shape
    n = 0
    for r in range(n_rings - 1):
        for s in range(n_sectors):
            s1 = s + 1 if s + 1 < n_sectors else 0
            a, b, c, d = f[r, s], f[r, s1], f[r + 1, s1], f[r + 1, s]
            inside = int(a > 0) + int(b > 0) + int(c > 0) + int(d > 0)
            if inside == 0 or inside == 4 or n + 2 > segments.shape[0]:
                continue
            crossings = 0
            for side in range(4):
                if side == 0:
                    v0, v1, r0, s0, r1, s2 = a, b, r, s, r, s1
                elif side == 1:
                    v0, v1, r0, s0, r1, s2 = b, c, r, s1, r + 1, s1
                elif side == 2:
                    v0, v1, r0, s0, r1, s2 = c, d, r + 1, s1, r + 1, s
                else:
                    v0, v1, r0, s0, r1, s2 = d, a, r + 1, s, r, s
                if (v0 > 0) != (v1 > 0):
                    t = v0 / (v0 - v1)
                    k, end = n + crossings // 2, crossings % 2
                    for i in range(3):
                        segments[k, end, i] = g[r0, s0, i] + t * (g[r1, s2, i] - g[r0, s0, i])
                    crossings += 1
            n += crossings // 2
    return n


def _occluded_points(
    camera: Camera, Ts: Array, surfaces: Surfaces, points: Array, ignored: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return whether a part occludes each point (n, 3), apart from the parts ignored for it, (P, n)."""
    n = len(points)
    room = np.zeros((3, n + LANES), np.float32)
    room[:, :n] = points.T
    occluded, by_part = np.zeros(n + LANES, dtype=bool), np.empty(n + LANES, dtype=bool)
    shared, Q = np.empty((2, n + LANES), np.float32), np.empty((3, 5), np.float32)
    _mark_occluded_points(
        camera.center_world, Ts, surfaces.centers, surfaces.half_axes, surfaces.solids, ignored, Q, shared, by_part,
        room, occluded,
    )  # fmt: skip
    return occluded[:n]


@njit(**FAST_MATH)
def _mark_occluded_points(
    eye: Array, Ts: Array, centers: Array, half_axes: Array, solids: FloatArray, ignored: NDArray[np.bool_],
    Q: FloatArray, shared: FloatArray, by_part: NDArray[np.bool_], points: FloatArray, occluded: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Mark the points, (3, n and `LANES` more), that a part occludes; see `mark_occluded` for Q and shared."""
    n = ignored.shape[1]
    for part in range(Ts.shape[0]):
        for i in range(3):
            offset, sight = -centers[part, i], -centers[part, i]
            for k in range(3):
                offset -= Ts[part, k, i] * Ts[part, k, 3]
                sight += Ts[part, k, i] * (eye[k] - Ts[part, k, 3])
                Q[i, k] = Ts[part, k, i] / half_axes[part, i]
            Q[i, 3] = offset / half_axes[part, i]
            Q[i, 4] = sight / half_axes[part, i]
        for j in range(n):
            by_part[j] = occluded[j] or ignored[part, j]
        mark_occluded(part, solids, Q, 0.0, points, 0, n, shared, by_part)
        for j in range(n):
            occluded[j] |= by_part[j] and not ignored[part, j]
