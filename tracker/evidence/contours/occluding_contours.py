"""Trace the visible occluding contours of posed bodies in one camera (the synthesis of GD96 Sect. 4.2).

The contour generator of each part (see `generator`) is projected and cut into short pieces (see `pieces`). Pieces that
another part occludes are marked (see `visibility`). Parts that adjoin at a joint also occlude each other up to
`JOINT_MARGIN_M` behind the line of sight, so that no contour runs across the body at a joint.

Each view is one compiled kernel, because a search evaluates thousands of poses a second.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import PosedBody, ahead
from tracker.compute.jit import FAST_MATH, njit
from tracker.evidence.contours.generator import MAX_POINTS, grid_generator, revolved_generator
from tracker.evidence.contours.pieces import (
    PIECE_PX,
    Pieces,
    cut_into_pieces,
    piece_buffer,
    place_eye,
    place_parts,
    project_generator,
)
from tracker.evidence.contours.surfaces import Surfaces, surfaces_of
from tracker.evidence.contours.visibility import JOINT_MARGIN_M, mark_occluded
from tracker.geometry.arrays import Array, FloatArray
from tracker.geometry.cameras import NEAR_PLANE_M, Camera

MAX_PIECES = 6000
"""Room for the pieces of one view. A 22-DOF body that fills a 640x480 image has some 600."""
_SAG_PX = 0.2
"""Largest distance of a chord around a part from its arc, px. The grid of other parts is as coarse."""
_MIN_TURN = 4 * np.pi / MAX_POINTS
"""Smallest angle between points around a part, rad: two circles then fill half of the room for a generator."""


class Contour(NamedTuple):
    """Short straight pieces of occluding contours in one view."""

    pieces_px: FloatArray
    """End points x0, y0, x1, y1, (N, 4), undistorted px."""
    parts: NDArray[np.int32]
    """Index of the part of each piece, counted through all bodies, (N,)."""
    occluded: NDArray[np.bool_]
    """Whether another part occludes the piece, (N,)."""
    points_world: FloatArray
    """Middle of each piece on the surface, (N, 3), metres."""


def part_poses(bodies: Sequence[PosedBody]) -> Array:
    """Return the world poses of all parts of all bodies, (P, 4, 4), metres."""
    return np.concatenate([b.kinematics.Ts_world_part for b in bodies])


def trace(bodies: Sequence[PosedBody], camera: Camera, piece_px: float = PIECE_PX) -> Contour:
    """Trace the occluding contours of all bodies in a view, with occluded pieces marked.

    Args:
        bodies: all bodies in the scene; they occlude one another.
        camera: the view; its lens distortion is ignored (undistorted pixels).
        piece_px: longest piece, px.
    """
    return trace_surfaces(surfaces_of(tuple(b.model for b in bodies)), part_poses(bodies), camera, piece_px)


def trace_views(bodies: Sequence[PosedBody], cameras: Sequence[Camera], times: Sequence[float]) -> list[Contour]:
    """Trace the contours of all bodies in several views, (V,), whose pictures are later than the frame; see `ahead`."""
    surfaces, poses = surfaces_of(tuple(b.model for b in bodies)), {t: part_poses(ahead(bodies, t)) for t in {*times}}
    pieces = piece_buffer(surfaces, contour_room([c.pinhole for c in cameras], len(bodies)))
    out = []
    for camera, time in zip(cameras, times, strict=True):
        place_parts(poses[time], surfaces, pieces)
        out.append(_traced(surfaces, camera, PIECE_PX, pieces))
    return out


def trace_surfaces(surfaces: Surfaces, Ts_world_part: Array, camera: Camera, piece_px: float) -> Contour:
    """Trace the contours of shapes, placed by their parts' poses (P, 4, 4), in a view; see `trace`."""
    n_bodies = int(surfaces.people.max()) + 1
    pieces = piece_buffer(surfaces, contour_room([camera.pinhole], n_bodies, piece_px))
    place_parts(Ts_world_part, surfaces, pieces)
    return _traced(surfaces, camera, piece_px, pieces)


def _traced(surfaces: Surfaces, camera: Camera, piece_px: float, pieces: Pieces) -> Contour:
    """Return the contours of placed parts in a view."""
    n = trace_pieces(camera.projection, camera.center_world, surfaces, float(piece_px), pieces)
    out = contour_buffer(n)
    store_contour(pieces, out)
    return out


def contour_room(cameras: Sequence[Camera], n_bodies: int, piece_px: float = PIECE_PX) -> int:
    """Return the largest number of pieces of one of several views."""
    width = max(c.size[0] for c in cameras)
    return int(MAX_PIECES * max(1.0, PIECE_PX / piece_px) * max(1.0, width / 640) * n_bodies)


def contour_buffer(room: int) -> Contour:
    """Return uninitialized room for a number of pieces, filled by `store_contour`."""
    return Contour(
        np.empty((room, 4), np.float32), np.empty(room, np.int32), np.empty(room, np.bool_),
        np.empty((room, 3), np.float32),
    )  # fmt: skip


@njit(**FAST_MATH)
def mark_all_occluded(n_parts: int, surfaces: Surfaces, out: Pieces) -> None:
    """Mark the pieces that parts occlude of one another.

    Only pairs of parts whose boxes in the image meet and whose depths allow it are tested. Occlusion between two static
    parts is already marked in the cache.
    """
    boxes, distances, radii, firsts, adjoining = (
        out.boxes,
        out.distances,
        surfaces.radii,
        out.firsts,
        surfaces.adjoining,
    )
    to_unit, to_world, middles, shared, occluded = (
        out.Ts_unit_world, out.Ts_world_unit, out.middles, out.shared, out.occluded
    )  # fmt: skip
    solids, is_static, related = surfaces.solids, out.is_static, out.related
    for a in range(n_parts):
        if firsts[a] == firsts[a + 1]:
            continue
        u0, v0, u1, v1 = boxes[a, 0], boxes[a, 1], boxes[a, 2], boxes[a, 3]
        behind = distances[a] + radii[a] + JOINT_MARGIN_M
        for b in range(n_parts):
            if (
                b == a
                or firsts[b] == firsts[b + 1]
                or distances[b] - radii[b] > behind
                or (is_static[a] and is_static[b])
            ):
                continue
            if boxes[b, 0] > u1 or boxes[b, 2] < u0 or boxes[b, 1] > v1 or boxes[b, 3] < v0:
                continue
            Q = out.between[a, b]
            if not related[a, b]:
                related[a, b] = True
                for i in range(3):
                    p, q, r = to_unit[b, i, 0], to_unit[b, i, 1], to_unit[b, i, 2]
                    for k in range(3):
                        Q[i, k] = p * to_world[a, 0, k] + q * to_world[a, 1, k] + r * to_world[a, 2, k]
                    Q[i, 3] = p * to_world[a, 0, 3] + q * to_world[a, 1, 3] + r * to_world[a, 2, 3] + to_unit[b, i, 3]
            for i in range(3):
                Q[i, 4] = to_unit[b, i, 4]
            margin = JOINT_MARGIN_M / distances[a] if adjoining[a, b] else 0.0
            mark_occluded(b, solids, Q, margin, middles, firsts[a], firsts[a + 1], shared, occluded)


@njit(inline="always", **FAST_MATH)
def focal_px(P: Array) -> float:
    """Return the focal length of a projection matrix, (3, 4), px."""
    return np.sqrt(P[0, 0] ** 2 + P[0, 1] ** 2 + P[0, 2] ** 2)


@njit(**FAST_MATH)
def trace_part(
    part: int, P: Array, focal: float, surfaces: Surfaces, piece_px: float, n: int, edge: int, out: Pieces
) -> tuple[int, int]:  # fmt: skip
    """Append the pieces of a placed part; return the new numbers of pieces and of edges."""
    unit_eye, to_world, to_unit, half_axes = out.unit_eye, out.Ts_world_unit, out.Ts_unit_world, surfaces.half_axes
    generator, image, n_points = out.generator, out.image, 0
    depth = P[2, 3]
    for i in range(3):
        depth += P[2, i] * to_world[part, i, 3]
        unit_eye[i] = to_unit[part, i, 4]
    # A part that reaches the near plane has no contour.
    if depth >= surfaces.radii[part] + NEAR_PLANE_M:
        n_profile = surfaces.profile_sizes[part]
        if n_profile > 0:
            radius = max(half_axes[part, 0], half_axes[part, 1])
            turn = np.float32(min(max(np.sqrt(8 * _SAG_PX * depth / (radius * focal)), _MIN_TURN), 0.6))
            n_points = revolved_generator(part, n_profile, surfaces.profiles, unit_eye, turn, out.half, generator)
        else:
            n_points = grid_generator(part, unit_eye, surfaces, out.f, generator)
    if n_points > 0:
        n_edges = project_generator(part, P, n_points, to_world, generator, image, out.boxes)
        n = cut_into_pieces(n_edges, edge, piece_px, n, generator, image, out.ends, out.middles, out.edges)
        edge += n_edges
    return n, edge


@njit(**FAST_MATH)
def trace_pieces(P: Array, eye: Array, surfaces: Surfaces, piece_px: float, out: Pieces) -> int:
    """Fill the pieces of placed parts in one view and return their number.

    Args:
        P: projection matrix, (3, 4), px; its third row gives depths in metres.
        eye: camera centre in the world, (3,), metres.
        surfaces: shapes of the parts.
        piece_px: longest piece, px.
        out: placed parts (see `place_parts`), and room for the pieces; those that do not fit are left out.
    """
    n_parts, focal = surfaces.radii.shape[0], focal_px(P)
    n = edge = np.int64(0)  # a literal would compile `trace_part` once more
    place_eye(eye, out)
    for part in range(n_parts):
        out.firsts[part], out.is_static[part] = n, False
        n, edge = trace_part(part, P, focal, surfaces, piece_px, n, edge, out)
    out.firsts[n_parts] = n
    for i in range(n):
        out.occluded[i] = False
    mark_all_occluded(n_parts, surfaces, out)
    return int(n)


@njit(**FAST_MATH)
def store_contour(pieces: Pieces, out: Contour) -> None:
    """Store the traced pieces with their parts and their points in the world."""
    points, W = out.points_world, pieces.Ts_world_unit
    for part in range(W.shape[0]):
        for i in range(pieces.firsts[part], pieces.firsts[part + 1]):
            out.parts[i], out.occluded[i] = part, pieces.occluded[i]
            x, y, z = pieces.middles[0, i], pieces.middles[1, i], pieces.middles[2, i]
            for k in range(4):
                out.pieces_px[i, k] = pieces.ends[k, i]
            for k in range(3):
                points[i, k] = W[part, k, 0] * x + W[part, k, 1] * y + W[part, k, 2] * z + W[part, k, 3]
