"""Normal equations of pieces of contour by corrections of cameras, sizes of a body, and its pose.

Residuals are summed by the motions of each part and the focal length of their camera first, compiled, and then
converted to all unknowns. A camera that is turned or moved sees the world as if all parts were turned or moved about
it: its columns are a linear map of theirs (`sum_of_camera`). Tests compare both with sums of derivatives by numpy.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel
from tracker.compute.jit import njit
from tracker.estimation.acquisition.part_derivatives import N_MOTIONS, shape_derivatives
from tracker.estimation.fitting.contour_residuals import PieceSums
from tracker.estimation.fitting.gauss_newton import NormalEquations
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.camera_correction import DRIFT, FOCAL, N_CORRECTIONS, ROTATION, TIME
from tracker.geometry.cameras import NEAR_PLANE_M, Camera
from tracker.geometry.rigid import so3_exp

OF_CAMERA = slice(TIME)
"""Columns of a piece by which its camera moves: the logarithm of the focal length, then the rotation and the
translation of its part in the world."""
OF_PART = slice(1, None)
"""Columns by which its part moves: the motions of `part_derivatives`, which begin with the same rotation and
translation."""


@njit(nogil=True, cache=True)
def sum_pieces(
    parts: IntArray, unit_points: Array, by_shapes: Array, gradients: Array, hessians: Array, Ts: Array, centers: Array,
    half_axes: Array, T_camera_world: Array, K: Array, b: Array, M: Array,
) -> None:  # fmt: skip
    """Add the residuals of pieces to gradients and normal matrices.

    Args:
        parts: index of the part of each piece, (N,).
        unit_points: middle of each in the unit coordinates of its part, (N, 3).
        by_shapes: derivatives of each in its part by tapers and exponents, (N, 3, 4), metres; (N, 3, 0) without these.
        gradients: derivative of the cost by the image of each, (N, 2), per px.
        hessians: second derivative, (N, 2, 2), per px^2.
        Ts: pose of each part in the world, (P, 4, 4), metres.
        centers: centre of each shape in its part, (P, 3), metres.
        half_axes: of each shape, (P, 3), metres.
        T_camera_world: of the corrected camera, (4, 4).
        K: of it, (3, 3), px.
        b: gradients by part, (P, k), 0 before.
        M: normal matrices by part, (P, k, k), 0 before.
    """
    n_columns = b.shape[1]
    world, eye, J = np.empty(3), np.empty(3), np.empty((2, n_columns))
    for n in range(len(parts)):
        h00, h01, h11 = hessians[n, 0, 0], hessians[n, 0, 1], hessians[n, 1, 1]
        if h00 == 0.0 and h11 == 0.0:
            continue
        p = parts[n]
        T, unit = Ts[p], unit_points[n]
        for i in range(3):
            world[i] = T[i, 3]
            for j in range(3):
                world[i] += T[i, j] * (centers[p, j] + unit[j] * half_axes[p, j])
        for i in range(3):
            eye[i] = T_camera_world[i, 3]
            for j in range(3):
                eye[i] += T_camera_world[i, j] * world[j]
        _differentiate(unit, by_shapes[n], T, world, eye, T_camera_world, K, J)
        for i in range(n_columns):
            b[p, i] += gradients[n, 0] * J[0, i] + gradients[n, 1] * J[1, i]
            first, second = h00 * J[0, i] + h01 * J[1, i], h01 * J[0, i] + h11 * J[1, i]
            for j in range(i, n_columns):
                M[p, i, j] += first * J[0, j] + second * J[1, j]
    for p in range(len(M)):
        for i in range(n_columns):
            for j in range(i):
                M[p, i, j] = M[p, j, i]


@njit(nogil=True, cache=True)
def _differentiate(
    unit: Array, by_shape: Array, T: Array, world: Array, eye: Array, T_camera_world: Array, K: Array, J: Array
) -> None:
    """Fill the derivatives of the image of a point of a part by all columns, (2, k)."""
    z = max(eye[2], NEAR_PLANE_M)
    x, y = eye[0] / z, eye[1] / z
    for r in range(2):
        away = K[r, 0] * x + K[r, 1] * y
        gx, gy, gz = K[r, 0] / z, K[r, 1] / z, -away / z if eye[2] >= NEAR_PLANE_M else 0.0
        J[r, 0] = away
        for j in range(3):
            J[r, 4 + j] = gx * T_camera_world[0, j] + gy * T_camera_world[1, j] + gz * T_camera_world[2, j]
        wx, wy, wz = J[r, 4], J[r, 5], J[r, 6]
        J[r, 1] = world[1] * wz - world[2] * wy
        J[r, 2] = world[2] * wx - world[0] * wz
        J[r, 3] = world[0] * wy - world[1] * wx
        J[r, 10:] = 0.0
        for j in range(3):
            along = wx * T[0, j] + wy * T[1, j] + wz * T[2, j]
            J[r, 7 + j] = along * unit[j]
            for k in range(by_shape.shape[1]):
                J[r, 10 + k] += along * by_shape[j, k]


@njit(nogil=True, cache=True)
def sum_of_camera(
    b: Array, M: Array, T_camera_world: Array, turn: Array, moving: Array, time_s: float, gradient: Array,
    hessian: Array, by_parts: Array,
) -> None:  # fmt: skip
    """Fill the sums of a view by the corrections of its camera.

    Args:
        b: see `sum_pieces`.
        M: see `sum_pieces`.
        T_camera_world: of the corrected camera, (4, 4).
        turn: rotation of its correction, (3, 3).
        moving: motions of the parts in a second, (P, k - 1).
        time_s: time of the frame, seconds, by which a drift shifts its picture.
        gradient: filled, (N_CORRECTIONS,).
        hessian: filled, (N_CORRECTIONS, N_CORRECTIONS).
        by_parts: filled with the second derivatives by corrections and motions of parts, (N_CORRECTIONS, P * (k - 1)).
    """
    own = _camera_motions(T_camera_world, turn)
    n, first, n_motions = OF_CAMERA.stop, OF_PART.start, moving.shape[1]
    for p in range(len(M)):
        rows, of_part = own @ np.ascontiguousarray(M[p, :n]), np.ascontiguousarray(M[p, first:, first:])
        to_part, velocity = np.ascontiguousarray(rows[:, first:]), np.ascontiguousarray(moving[p])
        hessian[:TIME, :TIME] += np.ascontiguousarray(rows[:, :n]) @ own.T
        gradient[:TIME] += own @ np.ascontiguousarray(b[p, :n])
        moved = of_part @ velocity
        parts = by_parts[:, p * n_motions : (p + 1) * n_motions]
        parts[:TIME], parts[TIME], parts[DRIFT] = to_part, moved, time_s * moved
        by_time = to_part @ velocity
        slope, curvature = np.ascontiguousarray(b[p, first:]) @ velocity, moved @ velocity
        for i, share in ((TIME, 1.0), (DRIFT, time_s)):
            gradient[i] += share * slope
            hessian[i, :TIME] += share * by_time
            hessian[:TIME, i] += share * by_time
            hessian[i, TIME] += share * curvature
            hessian[i, DRIFT] += share * time_s * curvature


@njit(nogil=True, cache=True)
def _camera_motions(T_camera_world: Array, turn: Array) -> Array:
    """Return the derivatives of the columns `OF_CAMERA` by the corrections of the camera, (TIME, 7)."""
    out, R, t = np.zeros((TIME, OF_CAMERA.stop)), T_camera_world[:3, :3], T_camera_world[:3, 3]
    out[FOCAL, 0] = 1.0
    for j in range(3):
        for i in range(3):
            before, after = (i + 2) % 3, (i + 1) % 3
            out[i, 1 + j] = R[i, j]
            out[i, 4 + j] = t[after] * R[before, j] - t[before] * R[after, j]  # t x
            for k in range(3):
                out[3 + i, 4 + j] -= turn[k, i] * R[k, j]
    return out


class SeenPieces(NamedTuple):
    """Residuals of a person in one view."""

    camera: int
    shown_by: Camera
    """With its correction."""
    delay_s: float
    """Time by which the picture was taken later than the frame, seconds."""
    pieces: PieceSums


class PartSums(NamedTuple):
    """Residuals summed by the columns of the parts."""

    b: Array
    """Gradients, (n_parts, k)."""
    M: Array
    """Normal matrices, (n_parts, k, k)."""


def sums_of_views(
    views: Sequence[tuple[Camera, PieceSums]], body: BodyModel, kinematics: Kinematics, n_motions: int
) -> list[PartSums]:
    """Sum the residuals of each view.

    Args:
        views: camera with its correction, and residuals.
        body: at its present sizes.
        kinematics: of its pose.
        n_motions: number of motions of a part, with or without its shape.
    """
    with_shapes, shapes, k = n_motions == N_MOTIONS, body.shapes, n_motions + OF_PART.start
    pieces = [p.pulled if with_shapes else p for _, p in views]
    parts, units = (np.concatenate(own) for own in zip(*((p.parts, p.unit_points) for p in pieces), strict=True))
    by_shapes = shape_derivatives(shapes, parts, units, with_shapes)
    ends = np.cumsum([len(p.parts) for p in pieces])
    half_axes, out = np.array([s.half_axes for s in shapes]), list[PartSums]()
    for (camera, _), own, by_shape in zip(views, pieces, np.split(by_shapes, ends), strict=False):
        out.append(PartSums(np.zeros((len(shapes), k)), np.zeros((len(shapes), k, k))))
        sum_pieces(
            *(own.parts, own.unit_points, by_shape, own.gradients, own.hessians, kinematics.Ts_world_part),
            *(body.centers_part, half_axes, camera.T_camera_world, camera.K, *out[-1]),
        )
    return out


class GroupSums(NamedTuple):
    """Normal equations of a person on a frame, by all corrections and then the unknowns of the body.

    Sums over the motions of parts are converted to the unknowns of the body once for all views, which takes most time.
    """

    gradient: Array
    """(n,)."""
    hessian: Array
    """(n, n); the block of body by corrections is filled by `equations`."""
    n_cameras: int
    """Number of corrections of all cameras."""

    @classmethod
    def zeros(cls, n_cameras: int, n_body: int) -> "GroupSums":
        """Return empty sums."""
        n = n_cameras + n_body
        return cls(np.zeros(n), np.zeros((n, n)), n_cameras)

    def add_camera(
        self, view: SeenPieces, sums: PartSums, correction: Array, moving: Array, time_s: float, by_parts: Array
    ) -> None:
        """Add what a view says of its own camera.

        Args:
            view: its camera.
            sums: of the view.
            correction: (N_CORRECTIONS,).
            moving: motions of the parts in a second, (n_parts, n_motions).
            time_s: time of the frame, seconds.
            by_parts: filled with the second derivatives by corrections and the motions of parts, for `add_body`.
        """
        at = slice(view.camera * N_CORRECTIONS, (view.camera + 1) * N_CORRECTIONS)
        turn = so3_exp(correction[ROTATION]) if correction[ROTATION].any() else np.eye(3)
        sum_of_camera(
            *sums, view.shown_by.T_camera_world, turn, moving, time_s, self.gradient[at], self.hessian[at, at],
            by_parts[at],
        )  # fmt: skip

    def add_body(self, of_views: Sequence[PartSums], J: Array, by_parts: Array) -> None:
        """Add the sums of some views, and convert what they say of their cameras.

        Args:
            of_views: sums of each view.
            J: derivatives of the motions of the parts by the unknowns of the body, (n_parts, n_motions, n_body).
            by_parts: second derivatives by corrections and the motions of parts, (n_cameras, n_parts * n_motions).
        """
        n, flat = self.n_cameras, J.reshape(-1, J.shape[2])
        b, M = (np.sum(own, axis=0) for own in zip(*of_views, strict=True))
        weighted = (M[:, OF_PART, OF_PART] @ J).reshape(flat.shape)
        self.gradient[n:] += flat.T @ b[:, OF_PART].ravel()
        self.hessian[:, n:] += np.concatenate([by_parts, weighted.T]) @ flat

    def equations(self, cost: float) -> NormalEquations:
        """Return the normal equations."""
        n = self.n_cameras
        self.hessian[n:, :n] = self.hessian[:n, n:].T
        return NormalEquations(cost, self.gradient, self.hessian)
