"""Visible occluding contours of posed bodies in one camera (the synthesis of GD96 Sect. 4.2).

Each part's shape is a fixed grid of points and normals. A surface point lies on the occluding contour where the
line of sight grazes the surface, `n . (x - c) = 0` for the camera centre c; the zero line of that function is
followed through the cells of the grid. Pieces of it that a part hides are marked. Parts that adjoin at a joint hide
each other also where they lie less than `JOINT_MARGIN_M` behind the line, so that no contour runs across the body
where its parts merely meet.

All of it is one compiled kernel per view, because a search evaluates thousands of poses a second.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.body import Body, BodyModel
from tracker.cameras import Camera
from tracker.rigid import Array

FloatArray = NDArray[np.float32]

JOINT_MARGIN_M = 0.03
"""How far in front of an adjoining part a contour must lie to be seen as one, metres."""
PIECE_PX = 4.0
"""Longest piece of contour that is scored or hidden as a whole, px."""
N_RINGS, N_SECTORS = 14, 24
MAX_PIECES = 6000
"""Room for the pieces of one view; a 22-DOF body that fills a 640x480 image has some 600."""


class Contour(NamedTuple):
    """Short straight pieces of occluding contours in one view."""

    pieces_px: FloatArray
    """End points x0, y0, x1, y1, (N, 4), undistorted px."""
    parts: NDArray[np.int32]
    """Index of the part of each piece, counted through all bodies, (N,)."""
    hidden: NDArray[np.bool_]
    """Whether another part hides the piece, (N,)."""
    points_world: FloatArray
    """Middle of each piece on the surface, (N, 3), metres."""


class Surfaces(NamedTuple):
    """The shapes of several bodies as arrays, for the kernels. Parts are counted through all bodies."""

    points: FloatArray
    """Grid of surface points in the part's frame, (P, rings, sectors, 3), metres."""
    normals: FloatArray
    """Outward unit normals, (P, rings, sectors, 3)."""
    offsets: FloatArray
    """Normal times point, (P, rings, sectors), metres."""
    centers: Array
    """Centre of each shape in the part's frame, (P, 3), metres."""
    shapes: Array
    """a1, a2, a3 (metres), e1, e2, k_x, k_y, bounding radius (metres) of each shape, (P, 8)."""
    adjoining: NDArray[np.bool_]
    """Whether two parts share a joint, (P, P)."""
    people: NDArray[np.int64]
    """Index of the body of each part, (P,)."""


@lru_cache(maxsize=32)
def surfaces_of(models: tuple[BodyModel, ...]) -> Surfaces:
    """Arrays of the shapes of the given bodies; kept, because models are immutable."""
    shapes = [s for m in models for s in m.shapes]
    centers = np.concatenate([m.centers_part for m in models])
    grids = [s.grid(N_RINGS, N_SECTORS) for s in shapes]
    points = np.stack([g[0] + c for g, c in zip(grids, centers, strict=True)])
    normals = np.stack([g[1] for g in grids])
    adjoining = np.zeros((len(shapes), len(shapes)), dtype=bool)
    first, people = 0, []
    for i, m in enumerate(models):
        for part, parent in enumerate(m.parents):
            if parent >= 0:
                adjoining[first + part, first + parent] = adjoining[first + parent, first + part] = True
        people += [i] * len(m.parts)
        first += len(m.parts)
    radii = [np.linalg.norm(p - c, axis=-1).max() for p, c in zip(points, centers, strict=True)]
    table = [(*s.half_axes, *s.exponents, *s.taper, r) for s, r in zip(shapes, radii, strict=True)]
    return Surfaces(
        points.astype(np.float32),
        normals.astype(np.float32),
        np.sum(points * normals, axis=-1).astype(np.float32),
        centers,
        np.array(table),
        adjoining,
        np.array(people, dtype=np.int64),
    )


def part_poses(bodies: Sequence[Body]) -> Array:
    """World poses of all parts of all bodies, (P, 4, 4), metres."""
    return np.concatenate([b.model.kinematics(b.values).Ts_world_part for b in bodies])


def trace(bodies: Sequence[Body], camera: Camera, piece_px: float = PIECE_PX) -> Contour:
    """Trace the occluding contours of all bodies in a view, hidden pieces included and marked.

    Args:
        bodies: everybody in the scene; they hide one another.
        camera: the view; its lens distortion is left out (undistorted pixels).
        piece_px: longest piece, px.
    """
    surfaces = surfaces_of(tuple(b.model for b in bodies))
    out = contour_buffer(camera, len(bodies), piece_px)
    n = trace_view(projection(camera), camera.center_world, part_poses(bodies), surfaces, piece_px, out)
    return Contour(out.pieces_px[:n], out.parts[:n], out.hidden[:n], out.points_world[:n])


def contour_buffer(camera: Camera, n_bodies: int, piece_px: float = PIECE_PX) -> Contour:
    """Uninitialized room for the contours of a view, to be filled by `trace_view`."""
    room = int(MAX_PIECES * max(1.0, PIECE_PX / piece_px) * max(1.0, camera.width / 640) * n_bodies)
    return Contour(
        np.empty((room, 4), np.float32), np.empty(room, np.int32), np.empty(room, np.bool_),
        np.empty((room, 3), np.float32),
    )  # fmt: skip


def projection(camera: Camera) -> Array:
    """Projection matrix of undistorted pixels, (3, 4)."""
    return camera.K @ camera.T_camera_world[:3]


class Blockers(NamedTuple):
    """The parts that may hide one part in one view; room for all."""

    parts: NDArray[np.int64]
    """Index of each blocking part, (P,)."""
    transform: Array
    """From the hidden part's frame to the frame of the blocker's shape, (P, 3, 4), metres."""
    eye: Array
    """Camera centre in the frame of the blocker's shape, (P, 3), metres."""
    reach: Array
    """Largest t on the line of sight (0 camera, 1 contour) at which the blocker still hides, (P,)."""


@njit(nogil=True, cache=True)
def _inside_outside(x: float, y: float, z: float, shape: Array) -> float:
    """`TaperedSuperquadric.inside_outside` for one point relative to the shape's centre, and one row of shapes."""
    zn = z / shape[2]
    zc = min(1.0, max(-1.0, zn))
    X = abs(x / (shape[0] * (1.0 + shape[5] * zc)))
    Y = abs(y / (shape[1] * (1.0 + shape[6] * zc)))
    e1, e2 = shape[3], shape[4]
    if e2 == 1.0:
        return (X * X + Y * Y) ** (1.0 / e1) + (zn * zn) ** (1.0 / e1)
    return (X ** (2.0 / e2) + Y ** (2.0 / e2)) ** (e2 / e1) + (zn * zn) ** (1.0 / e1)


@njit(nogil=True, cache=True)
def hide(
    first: int, last: int, blockers: Blockers, k: int, shapes: Array, points: FloatArray, hidden: NDArray[np.bool_]
) -> None:
    """Mark the pieces that the k-th blocker hides; their middles are in the frame of the part they belong to.

    The line of sight runs from the eye (t = 0) to the piece (t = 1) in the frame of the blocker's shape. First it is
    cut with the enclosing elliptic cylinder, in closed form, then the implicit function is evaluated at four points
    of what they share: exact but for lines that graze the surface.
    """
    shape, Q = shapes[blockers.parts[k]], blockers.transform[k]
    q00, q01, q02, q03 = Q[0, 0], Q[0, 1], Q[0, 2], Q[0, 3]
    q10, q11, q12, q13 = Q[1, 0], Q[1, 1], Q[1, 2], Q[1, 3]
    q20, q21, q22, q23 = Q[2, 0], Q[2, 1], Q[2, 2], Q[2, 3]
    ex, ey, ez = blockers.eye[k, 0], blockers.eye[k, 1], blockers.eye[k, 2]
    girth = 2.0 ** (0.5 * (1.0 - shape[4]))
    a1 = 1.0 / (shape[0] * girth * (1.0 + abs(shape[5])))
    a2 = 1.0 / (shape[1] * girth * (1.0 + abs(shape[6])))
    a3 = 1.0 / shape[2]
    ox, oy, oz, t_max = ex * a1, ey * a2, ez * a3, blockers.reach[k]
    C = ox * ox + oy * oy - 1.0
    for i in range(first, last):
        if hidden[i]:
            continue
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        lx = q00 * x + q01 * y + q02 * z + q03 - ex
        ly = q10 * x + q11 * y + q12 * z + q13 - ey
        lz = q20 * x + q21 * y + q22 * z + q23 - ez
        dx, dy, dz = lx * a1, ly * a2, lz * a3
        A = dx * dx + dy * dy + 1e-12
        B = ox * dx + oy * dy
        disc = B * B - A * C
        if disc <= 0.0:
            continue
        root = np.sqrt(disc)
        if abs(dz) < 1e-12:
            dz = 1e-12
        near, far = (-1.0 - oz) / dz, (1.0 - oz) / dz
        t0 = max(max(0.0, (-B - root) / A), min(near, far))
        t1 = min(min(t_max, (-B + root) / A), max(near, far))
        if t1 <= t0:
            continue
        for step in range(1, 5):
            t = t0 + (0.25 * step if step < 4 else 0.999) * (t1 - t0)
            if _inside_outside(ex + t * lx, ey + t * ly, ez + t * lz, shape) < 1.0:
                hidden[i] = True
                break


@njit(nogil=True, cache=True)
def _find_blockers(a: int, eye: Array, Ts: Array, surfaces: Surfaces, out: Blockers) -> int:
    """List the parts whose cone of sight meets that of part a and that are not all behind it; their count."""
    centers, shapes = surfaces.centers, surfaces.shapes
    ca, cb = np.empty(3), np.empty(3)
    for i in range(3):
        ca[i] = Ts[a, i, 3] - eye[i]
        for k in range(3):
            ca[i] += Ts[a, i, k] * centers[a, k]
    da, ra = np.sqrt(ca[0] ** 2 + ca[1] ** 2 + ca[2] ** 2), shapes[a, 7]
    count = 0
    for b in range(Ts.shape[0]):
        if b == a:
            continue
        for i in range(3):
            cb[i] = Ts[b, i, 3] - eye[i]
            for k in range(3):
                cb[i] += Ts[b, i, k] * centers[b, k]
        db, rb = np.sqrt(cb[0] ** 2 + cb[1] ** 2 + cb[2] ** 2), shapes[b, 7]
        if db < rb + 0.05 or db - rb > da + ra + JOINT_MARGIN_M:
            continue
        cosine = (ca[0] * cb[0] + ca[1] * cb[1] + ca[2] * cb[2]) / (da * db)
        angle = np.arccos(min(1.0, max(-1.0, cosine)))
        if angle > np.arcsin(min(1.0, ra / da)) + np.arcsin(rb / db):
            continue
        transform, eye_b = out.transform[count], out.eye[count]
        for i in range(3):  # inverse(T_b) T_a, then relative to the shape's centre
            transform[i, 3] = eye_b[i] = -centers[b, i]
            for k in range(3):
                transform[i, k] = Ts[b, 0, i] * Ts[a, 0, k] + Ts[b, 1, i] * Ts[a, 1, k] + Ts[b, 2, i] * Ts[a, 2, k]
                transform[i, 3] += Ts[b, k, i] * (Ts[a, k, 3] - Ts[b, k, 3])
                eye_b[i] += Ts[b, k, i] * (eye[k] - Ts[b, k, 3])
        out.reach[count] = 1.0 + JOINT_MARGIN_M / da if surfaces.adjoining[a, b] else 1.0
        out.parts[count] = b
        count += 1
    return count


@njit(nogil=True, cache=True)
def _cap_line(f: FloatArray, g: FloatArray, segment: FloatArray) -> bool:
    """Zero line across the cap beyond the first or last ring; the cap is nearly flat, so it is taken as straight."""
    n_sectors, crossings = f.shape[0], 0
    for s in range(n_sectors):
        s1 = s + 1 if s + 1 < n_sectors else 0
        if (f[s] > 0) != (f[s1] > 0):
            if crossings < 2:
                t = f[s] / (f[s] - f[s1])
                for i in range(3):
                    segment[crossings, i] = g[s, i] + t * (g[s1, i] - g[s, i])
            crossings += 1
    return crossings == 2


@njit(nogil=True, cache=True)
def zero_line(f: FloatArray, g: FloatArray, segments: FloatArray) -> int:
    """Zero line of f over the surface grid g as segments (n, 2, 3), by marching squares; their number."""
    n_rings, n_sectors = f.shape
    n = 0
    for ring in (0, n_rings - 1):
        n += _cap_line(f[ring], g[ring], segments[n])
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


@njit(nogil=True, cache=True)
def cut(segments: FloatArray, n_segments: int, M: Array, piece_px: float, n: int, out: Contour) -> int:
    """Project segments (n, 2, 3) by M, cut them into pieces and append those; returns the new count of pieces.

    The middles of the pieces are left in the frame of the segments.
    """
    pieces, points, room = out.pieces_px, out.points_world, out.parts.shape[0]
    for k in range(n_segments):
        x0, y0, z0 = segments[k, 0, 0], segments[k, 0, 1], segments[k, 0, 2]
        x1, y1, z1 = segments[k, 1, 0], segments[k, 1, 1], segments[k, 1, 2]
        w0 = M[2, 0] * x0 + M[2, 1] * y0 + M[2, 2] * z0 + M[2, 3]
        w1 = M[2, 0] * x1 + M[2, 1] * y1 + M[2, 2] * z1 + M[2, 3]
        u0 = (M[0, 0] * x0 + M[0, 1] * y0 + M[0, 2] * z0 + M[0, 3]) / w0
        v0 = (M[1, 0] * x0 + M[1, 1] * y0 + M[1, 2] * z0 + M[1, 3]) / w0
        u1 = (M[0, 0] * x1 + M[0, 1] * y1 + M[0, 2] * z1 + M[0, 3]) / w1
        v1 = (M[1, 0] * x1 + M[1, 1] * y1 + M[1, 2] * z1 + M[1, 3]) / w1
        count = int(np.ceil(np.sqrt((u1 - u0) ** 2 + (v1 - v0) ** 2) / piece_px))
        for i in range(min(count, room - n)):
            a, b = i / count, (i + 1) / count
            # The middle in the image is not the middle in space; 1/depth is linear along the projected segment.
            m = 0.5 * (a + b)
            m = m * w0 / (w1 + m * (w0 - w1))
            points[n, 0], points[n, 1], points[n, 2] = x0 + m * (x1 - x0), y0 + m * (y1 - y0), z0 + m * (z1 - z0)
            pieces[n, 0], pieces[n, 1] = u0 + a * (u1 - u0), v0 + a * (v1 - v0)
            pieces[n, 2], pieces[n, 3] = u0 + b * (u1 - u0), v0 + b * (v1 - v0)
            n += 1
    return n


@njit(nogil=True, cache=True)
def trace_view(P: Array, eye: Array, Ts: Array, surfaces: Surfaces, piece_px: float, out: Contour) -> int:
    """Fill a contour buffer for one view; returns the number of pieces. See `trace`.

    Args:
        P: projection matrix, (3, 4), px.
        eye: camera centre in the world, (3,), metres.
        Ts: part poses, (P, 4, 4).
        surfaces: the shapes of the parts.
        piece_px: longest piece, px.
        out: room for the pieces; what does not fit is left out.
    """
    n_parts, n_rings, n_sectors = surfaces.offsets.shape
    shapes, points = surfaces.shapes, out.points_world
    f = np.empty((n_rings, n_sectors), np.float32)
    segments = np.empty((6 * (n_rings + n_sectors), 2, 3), np.float32)
    blockers = Blockers(
        np.empty(n_parts, np.int64), np.empty((n_parts, 3, 4)), np.empty((n_parts, 3)), np.empty(n_parts)
    )
    M, e = np.empty((3, 4)), np.empty(3, np.float32)
    n = 0
    for part in range(n_parts):
        T, c = Ts[part], surfaces.centers[part]
        for i in range(3):
            for k in range(4):
                M[i, k] = P[i, 0] * T[0, k] + P[i, 1] * T[1, k] + P[i, 2] * T[2, k]
            M[i, 3] += P[i, 3]
            e[i] = T[0, i] * (eye[0] - T[0, 3]) + T[1, i] * (eye[1] - T[1, 3]) + T[2, i] * (eye[2] - T[2, 3])
        # A part that reaches the plane of the camera has no contour that could be drawn.
        if M[2, 0] * c[0] + M[2, 1] * c[1] + M[2, 2] * c[2] + M[2, 3] < shapes[part, 7] + 0.05:
            continue
        normals, offsets = surfaces.normals[part], surfaces.offsets[part]
        for r in range(n_rings):
            for s in range(n_sectors):
                f[r, s] = offsets[r, s] - (normals[r, s, 0] * e[0] + normals[r, s, 1] * e[1] + normals[r, s, 2] * e[2])
        first = n
        n = cut(segments, zero_line(f, surfaces.points[part], segments), M, piece_px, n, out)
        out.parts[first:n] = part
        out.hidden[first:n] = False
        for k in range(_find_blockers(part, eye, Ts, surfaces, blockers)):
            hide(first, n, blockers, k, shapes, points, out.hidden)
        for i in range(first, n):
            x, y, z = points[i, 0], points[i, 1], points[i, 2]
            for row in range(3):
                points[i, row] = T[row, 0] * x + T[row, 1] * y + T[row, 2] * z + T[row, 3]
    return n
