"""Contours drawn to edges: the image's residuals in the Gauss-Newton (KRH08 Sect. 5, made symmetric and robust).

Both directions of the chamfer distance pull at the pose. A visible piece of the model's contour looks up its distance
to the nearest edge, and the slope of the distance image there (KRH08 Eq. 59-61, with the derivative of the bilinear
distance as DESIGN section 7 has it); an edge point finds the nearest piece of contour that runs its way (Eq. 58). How
a residual changes with the pose is asked of the surface point under the piece: across its tangent the occluding
contour moves as that material point does, because what it slides on the surface it slides along the line of sight
(KRH08 Sect. 4).

Residuals are not kept one by one. A point X of a part moves by the part's spatial twist (omega, v) as omega x X + v,
so the row of its residual is (X x g, g), g the derivative by X. Rows are summed per part into a 6x6 normal matrix;
only these are carried over to the degrees of freedom, whatever the shapes of the parts.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker import contours
from tracker.body import Body, BodyModel
from tracker.contours import FloatArray
from tracker.evidence import SCENE_SPACING_PX, ViewEvidence
from tracker.fit import Normal
from tracker.kinematics import IntArray, Kinematics
from tracker.rigid import Array

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)  # plain numbers would turn the kernel's arithmetic into float64
_CAPTURE = 2.0
"""Edge points farther than this many outlier distances from the predicted contours are left out for good."""


@dataclass(frozen=True)
class MatchSettings:
    """How contours and edges are matched."""

    scale: float = 0.4
    """Distance at which a residual's pull is down to a quarter (Geman-McClure), in outlier distances."""
    turn: float = 0.5
    """What an edge at right angles to the contour counts as squared distance, in squared outlier distances."""
    model_to_image: float = 0.5
    """Weight of the model-to-image residuals; 0 leaves them out."""
    image_to_model: float = 0.5
    """Weight of the image-to-model residuals; 0 leaves them out."""
    silhouette: float = 0.5
    """Weight of the silhouette's contour against edges, where its view is fully trusted; 0 leaves it out."""
    information_per_px: float = 0.0125
    """What one pixel of contour tells: 1 / (variance in px^2 times the length over which errors are alike, px)."""


class PartCosts(NamedTuple):
    """How well the contours of the parts fit, for people and for the judgement of a pose."""

    length_px: Array
    """Visible contour within the images, (V, n_parts), matched px."""
    forward_px: Array
    """Mean distance of it to the edges, outliers cut off, (V, n_parts), matched px; NaN where nothing is visible."""
    points: Array
    """Points of edges and silhouette that the part explains, (V, n_parts)."""
    outline: Array
    """Share of the silhouette's contour that some part explains, (V,); NaN in views without a silhouette."""


class _Scene(NamedTuple):
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
    """u, v of the edge points, their normals' u, v, and their weights, one view after the other, (5, N)."""
    firsts: NDArray[np.int64]
    """Index of the first edge point of each view, and the number of all, (V + 1,)."""
    outlines: NDArray[np.int64]
    """Index of the first point of each view's silhouette, which follow those of its edges, (V,)."""
    thetas: Array
    """Outlier distances, (V,)."""
    weights: Array
    """Information per pixel of contour, model to image and image to model, (V, 2)."""


class _Scratch(NamedTuple):
    """Room that the kernel works in."""

    contour: contours.Contour
    pieces: FloatArray
    """x, y, dx, dy, 1 / length^2, nx, ny of each visible piece, (7, room)."""
    which: NDArray[np.int64]
    """Index of each visible piece into the contour, (room,)."""
    best: FloatArray
    """Squared distance of each edge point to its piece, with the turn between them, (room,)."""
    nearest: NDArray[np.int32]
    """Index of that piece among the visible ones, (room,)."""


class _Sums(NamedTuple):
    """What the kernel adds up."""

    M: Array
    """Normal matrix of each part's twist, upper triangles, (P, 6, 6)."""
    b: Array
    """Gradient by each part's twist, (P, 6)."""
    parts: Array
    """Per view and part: visible length, its summed cut-off distance, explained points, (V, P, 3)."""
    outline: Array
    """Points of each view's silhouette that are explained, (V,)."""


class ContourMatch:
    """The residuals of one person's contours against the edges of all views: a block for `fit.solve`.

    The others stand where they are; they hide, and draw the edges that are nearer to them.
    """

    def __init__(
        self,
        views: Sequence[ViewEvidence],
        bodies: Sequence[Body],
        person: int = 0,
        settings: MatchSettings | None = None,
        theta_px: float | None = None,
        everywhere: bool = False,
    ) -> None:
        """Prepare the evidence for the kernel.

        Args:
            views: the evidence of each view.
            bodies: everybody in the scene, as predicted.
            person: index of the body that is fitted.
            settings: how to match.
            theta_px: outlier distance, px of the footage; by default that of each view.
            everywhere: keep edge points however far from the predicted contours they are, for poses far from it.
        """
        settings = settings or MatchSettings()
        self._settings = settings
        self._model = bodies[person].model
        self._first = sum(len(b.model.parts) for b in bodies[:person])
        self._surfaces = contours.surfaces_of(tuple(b.model for b in bodies))
        self._Ts = contours.part_poses(bodies)
        thetas = [v.theta_px if theta_px is None else theta_px * v.scale for v in views]
        points = [
            _within(v, bodies, np.inf if everywhere else _CAPTURE * theta, settings.silhouette)
            for v, theta in zip(views, thetas, strict=True)
        ]
        firsts = np.cumsum([0] + [p.shape[1] for p in points])
        self._outline_points = np.array([0 if v.silhouette is None else len(v.silhouette.points_px) for v in views])
        weights = settings.information_per_px * np.array([settings.model_to_image, settings.image_to_model])
        self._scene = _Scene(
            np.stack([contours.projection(v.camera) for v in views]),
            np.stack([v.camera.center_world for v in views]),
            np.array([v.camera.size for v in views], dtype=np.int64),
            np.concatenate([v.distance.ravel() for v in views]),
            np.ascontiguousarray(np.concatenate([p[:5] for p in points], axis=1)),
            firsts,
            firsts[:-1] + np.array([int(np.sum(p[5] == 0)) for p in points]),
            np.array(thetas),
            # A view without any edge has nothing to say; its distance image is flat.
            np.array([weights if len(v.points_px) else 0 * weights for v in views]),
        )
        widest = max((v.camera for v in views), key=lambda camera: camera.width)
        contour = contours.contour_buffer(widest, len(bodies))
        room, n_points, n_parts = len(contour.parts), self._scene.points.shape[1], len(self._Ts)
        self._scratch = _Scratch(
            contour, np.empty((7, room), np.float32), np.empty(room, np.int64), np.empty(n_points, np.float32),
            np.empty(n_points, np.int32),
        )  # fmt: skip
        self._sums = _Sums(
            np.empty((n_parts, 6, 6)), np.empty((n_parts, 6)), np.empty((len(views), n_parts, 3)), np.empty(len(views))
        )

    def normal(self, model: BodyModel, values: Array, kinematics: Kinematics) -> Normal:
        """See `fit.Block`."""
        assert model is self._model
        own = slice(self._first, self._first + len(model.parts))
        cost = self._gather(kinematics)
        gradient, hessian = np.empty(model.n_dofs), np.empty((model.n_dofs, model.n_dofs))
        _to_dofs(
            self._sums.M[own], self._sums.b[own], kinematics.axes_world, kinematics.origins_world, model.dof_is_length,
            model.dof_joint, model.tree.parents, model.moves, gradient, hessian,
        )  # fmt: skip
        return Normal(cost, gradient, hessian)

    def costs(self, candidates: Array) -> Array:
        """Costs alone of many poses, (C, n_values) to (C,)."""
        return np.array([self._gather(self._model.kinematics(values), derive=False) for values in candidates])

    def part_costs(self, values: Array) -> PartCosts:
        """How well each part of the person fits, at a pose."""
        self._gather(self._model.kinematics(values), derive=False)
        own = slice(self._first, self._first + len(self._model.parts))
        length, distance, points = np.moveaxis(self._sums.parts[:, own], -1, 0).copy()
        forward = np.divide(distance, length, out=np.full_like(length, np.nan), where=length > 0)
        total = self._outline_points
        outline = np.divide(self._sums.outline, total, out=np.full(len(total), np.nan), where=total > 0)
        return PartCosts(length, forward, points, outline)

    def _gather(self, kinematics: Kinematics, derive: bool = True) -> float:
        own, settings = slice(self._first, self._first + len(self._model.parts)), self._settings
        self._Ts[own] = kinematics.Ts_world_part
        return _gather(
            self._Ts, self._first, own.stop, self._surfaces, self._scene, settings.scale, settings.turn, derive,
            self._scratch, self._sums,
        )  # fmt: skip


def _within(view: ViewEvidence, bodies: Sequence[Body], reach_px: float, silhouette: float) -> FloatArray:
    """Points of edges, then of the silhouette, within reach of the visible contours, (6, N).

    Rows: u, v, normal's u, v, weight, and 0 for edges, 1 for the silhouette.
    """
    rows = [_rows(view.points_px, view.normals, 1.0, 0.0)]
    if view.silhouette is not None and silhouette * view.silhouette.trust > 0:
        outline = view.silhouette
        rows.append(_rows(outline.points_px, outline.normals, silhouette * outline.trust, 1.0))
    points = np.concatenate(rows, axis=1)
    if np.isinf(reach_px):
        return points
    contour = contours.trace(bodies, view.camera)
    pieces = contour.pieces_px[~contour.hidden]
    if not len(pieces) or not points.shape[1]:
        return points[:, :0]
    # A coarse raster of the contours' surroundings is enough: this only spares work.
    size = (view.camera.height // 8 + 1, view.camera.width // 8 + 1)
    near = np.zeros(size, np.bool_)
    _mark(pieces, int(np.ceil(reach_px / 8)), near)
    return points[:, near[points[1].astype(np.intp) // 8, points[0].astype(np.intp) // 8]]


def _rows(points_px: FloatArray, normals: FloatArray, weight: float, kind: float) -> FloatArray:
    """Points (N, 2) with normals (N, 2) as the rows of `_within`, (6, N)."""
    n = len(points_px)
    return np.stack([*points_px.T, *normals.T, np.full(n, weight), np.full(n, kind)]).astype(np.float32)


@njit(nogil=True, cache=True)
def _mark(pieces: FloatArray, reach: int, near: NDArray[np.bool_]) -> None:
    """Mark the cells of 8 px around the middles of pieces, in steps of one for all cells within reach."""
    rows, columns = near.shape
    for i in range(pieces.shape[0]):
        c = int(0.5 * (pieces[i, 0] + pieces[i, 2])) // 8
        r = int(0.5 * (pieces[i, 1] + pieces[i, 3])) // 8
        if c < -reach or r < -reach or c >= columns + reach or r >= rows + reach:
            continue
        near[max(0, r - reach) : max(0, r + reach + 1), max(0, c - reach) : max(0, c + reach + 1)] = True


@njit(nogil=True, cache=True, fastmath=True)
def _nearest_alike(
    u: FloatArray, v: FloatArray, nu: FloatArray, nv: FloatArray, pieces: FloatArray, n: int, turn: float,
    best: FloatArray, nearest: NDArray[np.int32],
) -> None:  # fmt: skip
    """For each edge point (u, v) with normal (nu, nv), (N,) each, the piece that is nearest.

    The turn between the edge and the piece counts as distance. Brute force with the points in the inner loop, as in
    `nearest.nearest_piece`.
    """
    n_points = u.shape[0]
    for i in range(n_points):
        best[i] = np.float32(1e12)
        nearest[i] = 0
    weight = np.float32(turn)
    for k in range(n):
        x, y, dx, dy, inverse = pieces[0, k], pieces[1, k], pieces[2, k], pieces[3, k], pieces[4, k]
        nx, ny, index = pieces[5, k], pieces[6, k], np.int32(k)
        for i in range(n_points):
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


@njit(nogil=True, cache=True)
def _add(
    M: Array, b: Array, P: Array, x: float, y: float, X: FloatArray, gu: float, gv: float, weight: float, r: float
) -> None:
    """Add the row of a residual r with image gradient (gu, gv) at the image (x, y) of the surface point X."""
    z = P[2, 0] * X[0] + P[2, 1] * X[1] + P[2, 2] * X[2] + P[2, 3]
    e = gu * x + gv * y
    gx = (gu * P[0, 0] + gv * P[1, 0] - e * P[2, 0]) / z
    gy = (gu * P[0, 1] + gv * P[1, 1] - e * P[2, 1]) / z
    gz = (gu * P[0, 2] + gv * P[1, 2] - e * P[2, 2]) / z
    row = (X[1] * gz - X[2] * gy, X[2] * gx - X[0] * gz, X[0] * gy - X[1] * gx, gx, gy, gz)
    for i in range(6):
        scaled = weight * row[i]
        b[i] += scaled * r
        for j in range(i, 6):
            M[i, j] += scaled * row[j]


@njit(nogil=True, cache=True)
def _visible(contour: contours.Contour, n: int, pieces: FloatArray, which: NDArray[np.int64]) -> int:
    """Pack the visible ones of n pieces for `_nearest_alike`; their number."""
    kept = 0
    for i in range(n):
        if contour.hidden[i]:
            continue
        x, y = contour.pieces_px[i, 0], contour.pieces_px[i, 1]
        dx, dy = contour.pieces_px[i, 2] - x, contour.pieces_px[i, 3] - y
        length = np.sqrt(max(dx * dx + dy * dy, np.float32(1e-12)))
        pieces[0, kept], pieces[1, kept], pieces[2, kept], pieces[3, kept] = x, y, dx, dy
        pieces[4, kept], pieces[5, kept], pieces[6, kept] = 1 / (length * length), -dy / length, dx / length
        which[kept] = i
        kept += 1
    return kept


@njit(nogil=True, cache=True)
def _model_to_image(
    view: int, first: int, last: int, pixel: int, kept: int, scene: _Scene, scale: float, derive: bool,
    scratch: _Scratch, sums: _Sums,
) -> float:  # fmt: skip
    """Add the residuals of the visible pieces of the parts from first to last; their cost."""
    width, height = scene.sizes[view, 0], scene.sizes[view, 1]
    P, theta, weight = scene.P[view], scene.thetas[view], scene.weights[view, 0]
    s2, cost = (scale * theta) ** 2, 0.0
    q, D = scratch.pieces, scene.distances
    for k in range(kept):
        i = scratch.which[k]
        part = scratch.contour.parts[i]
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
        _add(
            sums.M[part], sums.b[part], P, x, y, scratch.contour.points_world[i], across * q[5, k], across * q[6, k],
            w * f * f, d,
        )  # fmt: skip
    return cost


@njit(nogil=True, cache=True)
def _image_to_model(
    view: int, first: int, last: int, kept: int, scene: _Scene, scale: float, turn: float, derive: bool,
    scratch: _Scratch, sums: _Sums,
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
    _nearest_alike(us, vs, nu, nv, q, kept, turn * limit, scratch.best, scratch.nearest)
    for j in range(stop - start):
        squared = min(scratch.best[j], limit)
        cost += 0.5 * weight * weights[j] * s2 * squared / (s2 + squared)
        if scratch.best[j] >= limit:
            continue
        if start + j >= scene.outlines[view]:
            sums.outline[view] += 1.0
        k = scratch.nearest[j]
        i = scratch.which[k]
        part = scratch.contour.parts[i]
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
        _add(
            sums.M[part], sums.b[part], P, x, y, scratch.contour.points_world[i], gu, gv, weight * weights[j] * f * f, d
        )
    return cost


@njit(nogil=True, cache=True)
def _gather(
    Ts: Array, first: int, last: int, surfaces: contours.Surfaces, scene: _Scene, scale: float, turn: float,
    derive: bool, scratch: _Scratch, sums: _Sums,
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
            n = contours.trace_view(scene.P[view], scene.eyes[view], Ts, surfaces, contours.PIECE_PX, scratch.contour)
            kept = _visible(scratch.contour, n, scratch.pieces, scratch.which)
            if scene.weights[view, 0] > 0.0 or not derive:  # whoever asks for the costs of the parts asks for both
                cost += _model_to_image(view, first, last, pixel, kept, scene, scale, derive, scratch, sums)
            if scene.weights[view, 1] > 0.0:
                cost += _image_to_model(view, first, last, kept, scene, scale, turn, derive, scratch, sums)
        pixel += scene.sizes[view, 0] * scene.sizes[view, 1]
    return cost


@njit(nogil=True, cache=True)
def _to_dofs(
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
