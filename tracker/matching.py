"""The kernel under `refine`: one pose's contours traced, matched with the points of all views, summed part by part."""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker import contours
from tracker.contours import FloatArray
from tracker.evidence import SCENE_SPACING_PX
from tracker.kernels import BORROW, FAST
from tracker.kinematics import IntArray
from tracker.nearest import LANES
from tracker.rigid import Array

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)  # plain numbers would turn the kernel's arithmetic into float64
_FAR2 = np.float32(1e12)


class Scene(NamedTuple):
    """The evidence of all views as arrays, for the kernel; lengths in matched px."""

    P: Array
    """Projection matrices, (V, 3, 4)."""
    eyes: Array
    """Camera centres in the world, (V, 3), metres."""
    sizes: NDArray[np.int64]
    """Widths and heights, (V, 2)."""
    distances: FloatArray
    """The distance images, one after the other, row by row."""
    points: FloatArray
    """u, v of the points, their normals' u, v, their weights, and 0 for edges, 1 for the silhouette, (6, N); one view
    after the other, in each sorted by the row of the image and filled up to whole `LANES` by points without weight."""
    firsts: NDArray[np.int64]
    """Index of the first point of each view, and the number of all, (V + 1,)."""
    rows: NDArray[np.int64]
    """Index, within the view, of the first point in each row of its image or below, (V, rows + 1)."""
    thetas: Array
    """Outlier distances, (V,)."""
    weights: Array
    """Information per pixel of contour, model to image and image to model, (V, 2)."""


class Scratch(NamedTuple):
    """Room that the kernel works in."""

    traced: contours.Pieces
    pieces: FloatArray
    """x, y, dx, dy, 1 / length^2, nx, ny of each visible piece, (7, room)."""
    which: NDArray[np.int64]
    """Index of each visible piece among those traced, (room,)."""
    parts: NDArray[np.int64]
    """Part of each visible piece, (room,)."""
    best: FloatArray
    """Squared distance of each edge point to its piece, with the turn between them, (room,)."""
    nearest: NDArray[np.int32]
    """Index of that piece among the visible ones, (room,)."""


class Sums(NamedTuple):
    """What the kernel adds up."""

    M: Array
    """Normal matrix of each part's twist, upper triangles, (P, 6, 6)."""
    b: Array
    """Gradient by each part's twist, (P, 6)."""
    parts: Array
    """Per view and part: visible length, its summed cut-off distance, explained points, (V, P, 3)."""
    outline: Array
    """Points of each view's silhouette that are explained, (V,)."""


@njit(**FAST)
def nearest_alike(
    u: FloatArray, v: FloatArray, nu: FloatArray, nv: FloatArray, rows: IntArray, pieces: FloatArray, n: int,
    turn: float, reach: float, best: FloatArray, nearest: NDArray[np.int32],
) -> None:  # fmt: skip
    """For each point (u, v) with normal (nu, nv), (N,) each, the nearest piece within reach.

    The turn between the point's edge and the piece counts as squared distance. Beyond the reach anything may be named,
    at a distance beyond it. As `nearest.nearest_segment`, each piece is held only against points of rows nearby.
    """
    last_row = rows.shape[0] - 1
    best[: u.shape[0]] = _FAR2
    far, weight = np.float32(reach), np.float32(turn)
    for k in range(n):
        x, y, dx, dy, inverse = pieces[0, k], pieces[1, k], pieces[2, k], pieces[3, k], pieces[4, k]
        nx, ny, index = pieces[5, k], pieces[6, k], np.int32(k)
        top, bottom = int(min(y, y + dy) - far) - 1, int(max(y, y + dy) + far) + 1
        first = rows[min(max(top, 0), last_row - 1)] // LANES * LANES
        count = (rows[min(max(bottom, 1), last_row)] - first + LANES - 1) // LANES * LANES
        for j in range(np.uint64(count)):
            i = np.uint64(first) + j
            from_u, from_v = u[i] - x, v[i] - y
            t = (from_u * dx + from_v * dy) * inverse
            t = t if t > _ZERO else _ZERO
            t = t if t < _ONE else _ONE
            off_u, off_v = from_u - t * dx, from_v - t * dy
            alike = nu[i] * nx + nv[i] * ny
            squared = off_u * off_u + off_v * off_v + weight * (_ONE - alike * alike)
            closer = squared < best[i]
            nearest[i] = index if closer else nearest[i]
            best[i] = squared if closer else best[i]


@njit(**BORROW)
def _add(
    M: Array, b: Array, P: Array, x: float, y: float, X: float, Y: float, Z: float, gu: float, gv: float,
    weight: float, r: float,
) -> None:  # fmt: skip
    """Add the row of a residual r with image gradient (gu, gv) at the image (x, y) of the surface point (X, Y, Z)."""
    w = 1.0 / (P[2, 0] * X + P[2, 1] * Y + P[2, 2] * Z + P[2, 3])
    e = gu * x + gv * y
    gx = (gu * P[0, 0] + gv * P[1, 0] - e * P[2, 0]) * w
    gy = (gu * P[0, 1] + gv * P[1, 1] - e * P[2, 1]) * w
    gz = (gu * P[0, 2] + gv * P[1, 2] - e * P[2, 2]) * w
    row = (Y * gz - Z * gy, Z * gx - X * gz, X * gy - Y * gx, gx, gy, gz)
    for i in range(6):
        scaled = weight * row[i]
        b[i] += scaled * r
        for j in range(i, 6):
            M[i, j] += scaled * row[j]


@njit(**BORROW)
def _visible(n_parts: int, scratch: Scratch) -> int:
    """Pack the visible pieces for `nearest_alike`; their number."""
    traced, pieces, which, parts = scratch.traced, scratch.pieces, scratch.which, scratch.parts
    ends, hidden, firsts = traced.ends, traced.hidden, traced.firsts
    kept = 0
    for part in range(n_parts):
        for i in range(firsts[part], firsts[part + 1]):
            if hidden[i]:
                continue
            x, y = ends[0, i], ends[1, i]
            dx, dy = ends[2, i] - x, ends[3, i] - y
            length = np.sqrt(max(dx * dx + dy * dy, np.float32(1e-12)))
            pieces[0, kept], pieces[1, kept], pieces[2, kept], pieces[3, kept] = x, y, dx, dy
            pieces[4, kept], pieces[5, kept], pieces[6, kept] = 1 / (length * length), -dy / length, dx / length
            which[kept], parts[kept] = i, part
            kept += 1
    return kept


@njit(**BORROW)
def _world(k: int, scratch: Scratch) -> tuple[float, float, float]:
    """The surface point under a visible piece, metres."""
    W, m, i = scratch.traced.Ts_world_unit[scratch.parts[k]], scratch.traced.middles, scratch.which[k]
    x, y, z = m[0, i], m[1, i], m[2, i]
    return (
        W[0, 0] * x + W[0, 1] * y + W[0, 2] * z + W[0, 3],
        W[1, 0] * x + W[1, 1] * y + W[1, 2] * z + W[1, 3],
        W[2, 0] * x + W[2, 1] * y + W[2, 2] * z + W[2, 3],
    )


@njit(**BORROW)
def _model_to_image(
    view: int, first: int, last: int, pixel: int, kept: int, scene: Scene, scale: float, derive: bool,
    scratch: Scratch, sums: Sums,
) -> float:  # fmt: skip
    """Add the residuals of the visible pieces of the parts from first to last; their cost."""
    width, height = scene.sizes[view, 0], scene.sizes[view, 1]
    P, theta, weight = scene.P[view], scene.thetas[view], scene.weights[view, 0]
    s2, cost = (scale * theta) ** 2, 0.0
    q, D = scratch.pieces, scene.distances
    for k in range(kept):
        part = scratch.parts[k]
        x, y = q[0, k] + 0.5 * q[2, k], q[1, k] + 0.5 * q[3, k]
        # What lies outside the image is neither explained nor refuted: a body may be cut off at the border.
        if part < first or part >= last or x < 0 or y < 0 or x > width - 1 or y > height - 1:
            continue
        c, r = min(int(x), width - 2), min(int(y), height - 2)
        a, b = x - c, y - r
        at = pixel + r * width + c
        d00, d01, d10, d11 = D[at], D[at + 1], D[at + width], D[at + width + 1]
        d = (d00 * (1 - a) + d01 * a) * (1 - b) + (d10 * (1 - a) + d11 * a) * b
        length = np.sqrt(q[2, k] ** 2 + q[3, k] ** 2)
        sums.parts[view, part, 0] += length
        sums.parts[view, part, 1] += length * min(d, theta)
        w = weight * length
        cut = min(d, theta)
        cost += 0.5 * w * s2 * cut * cut / (s2 + cut * cut)
        if d >= theta or not derive:
            continue
        gu, gv = (1 - b) * (d01 - d00) + b * (d11 - d10), (1 - a) * (d10 - d00) + a * (d11 - d01)
        across = gu * q[5, k] + gv * q[6, k]
        f = s2 / (s2 + d * d)
        X, Y, Z = _world(k, scratch)
        _add(sums.M[part], sums.b[part], P, x, y, X, Y, Z, across * q[5, k], across * q[6, k], w * f * f, d)
    return cost


@njit(**BORROW)
def _image_to_model(
    view: int, first: int, last: int, kept: int, scene: Scene, scale: float, turn: float, derive: bool,
    scratch: Scratch, sums: Sums,
) -> float:  # fmt: skip
    """Add the residuals of the view's edge points whose nearest piece is of the parts from first to last; their cost.

    The points are the same at every pose, so that their costs compare like with like: one that no piece is near, or
    that is nearest to somebody else, costs what a point at the outlier distance does.
    """
    P, theta, weight = scene.P[view], scene.thetas[view], scene.weights[view, 1] * SCENE_SPACING_PX
    s2, limit, cost = (scale * theta) ** 2, theta * theta, 0.0
    start, stop = scene.firsts[view], scene.firsts[view + 1]
    us, vs, q = scene.points[0][start:stop], scene.points[1][start:stop], scratch.pieces
    nu, nv, weights = scene.points[2][start:stop], scene.points[3][start:stop], scene.points[4][start:stop]
    of_silhouette, rows = scene.points[5][start:stop], scene.rows[view][: scene.sizes[view, 1] + 1]
    nearest_alike(us, vs, nu, nv, rows, q, kept, turn * limit, theta, scratch.best, scratch.nearest)
    for j in range(stop - start):
        squared = min(scratch.best[j], limit)
        cost += 0.5 * weight * weights[j] * s2 * squared / (s2 + squared)
        if scratch.best[j] >= limit:
            continue
        sums.outline[view] += of_silhouette[j]
        k = scratch.nearest[j]
        part = scratch.parts[k]
        if part < first or part >= last:
            continue
        sums.parts[view, part, 2] += 1
        if not derive:
            continue
        u, v = us[j], vs[j]
        t = min(max(((u - q[0, k]) * q[2, k] + (v - q[1, k]) * q[3, k]) * q[4, k], 0.0), 1.0)
        x, y = q[0, k] + t * q[2, k], q[1, k] + t * q[3, k]
        gu, gv = x - u, y - v
        d = np.sqrt(gu * gu + gv * gv)
        if d < 1e-3:
            gu, gv = q[5, k], q[6, k]
        else:
            gu, gv = gu / d, gv / d
        f = s2 / (s2 + squared)
        X, Y, Z = _world(k, scratch)
        _add(sums.M[part], sums.b[part], P, x, y, X, Y, Z, gu, gv, weight * weights[j] * f * f, d)
    return cost


@njit(nogil=True, cache=True)
def gather(
    Ts: Array, first: int, last: int, surfaces: contours.Surfaces, scene: Scene, scale: float, turn: float,
    derive: bool, scratch: Scratch, sums: Sums,
) -> float:  # fmt: skip
    """Fill the sums for one pose of the parts from first to last, the other parts fixed; returns the cost.

    Without `derive` the normal matrices stay empty.
    """
    sums.M[:] = 0.0
    sums.b[:] = 0.0
    sums.parts[:] = 0.0
    sums.outline[:] = 0.0
    pixel, cost = 0, 0.0
    for view in range(scene.P.shape[0]):
        if scene.weights[view, 0] > 0.0 or scene.weights[view, 1] > 0.0:
            contours.trace_pieces(scene.P[view], scene.eyes[view], Ts, surfaces, contours.PIECE_PX, scratch.traced)
            kept = _visible(Ts.shape[0], scratch)
            if scene.weights[view, 0] > 0.0 or not derive:  # whoever asks for the costs of the parts asks for both
                cost += _model_to_image(view, first, last, pixel, kept, scene, scale, derive, scratch, sums)
            if scene.weights[view, 1] > 0.0:
                cost += _image_to_model(view, first, last, kept, scene, scale, turn, derive, scratch, sums)
        pixel += scene.sizes[view, 0] * scene.sizes[view, 1]
    return cost


@njit(nogil=True, cache=True)
def to_dofs(
    M: Array, b: Array, axes: Array, origins: Array, is_length: NDArray[np.bool_], parts: IntArray, parents: IntArray,
    moves: NDArray[np.bool_], gradient: Array, hessian: Array,
) -> None:  # fmt: skip
    """Carry the parts' normal matrices, upper triangles (n_parts, 6, 6), over to the degrees of freedom.

    The spatial twist of a rotation by axis a through o is (a, o x a), of a translation (0, a). A degree of freedom
    moves its part and all parts below it alike, so their matrices are summed up the tree first.
    """
    n_parts, n = M.shape[0], axes.shape[0]
    for p in range(n_parts - 1, 0, -1):
        for i in range(6):
            b[parents[p], i] += b[p, i]
            for j in range(i, 6):
                M[parents[p], i, j] += M[p, i, j]
    twists, forces = np.empty((n, 6)), np.empty((n, 6))
    for k in range(n):
        ax, ay, az = axes[k, 0], axes[k, 1], axes[k, 2]
        ox, oy, oz = origins[k, 0], origins[k, 1], origins[k, 2]
        if is_length[k]:
            twists[k, 0], twists[k, 1], twists[k, 2] = 0.0, 0.0, 0.0
            twists[k, 3], twists[k, 4], twists[k, 5] = ax, ay, az
        else:
            twists[k, 0], twists[k, 1], twists[k, 2] = ax, ay, az
            twists[k, 3], twists[k, 4], twists[k, 5] = oy * az - oz * ay, oz * ax - ox * az, ox * ay - oy * ax
        part, total = parts[k], 0.0
        for i in range(6):
            force = 0.0
            for j in range(6):
                force += (M[part, i, j] if j >= i else M[part, j, i]) * twists[k, j]
            forces[k, i] = force
            total += twists[k, i] * b[part, i]
        gradient[k] = total
    for k in range(n):
        for m in range(k, n):
            total = 0.0
            if moves[k, parts[m]]:  # the joints come parent first, so m is the deeper one
                for i in range(6):
                    total += twists[k, i] * forces[m, i]
            hessian[k, m] = hessian[m, k] = total
