"""Sum the residuals at pieces of contour by the motions of their part and the focal length of their camera, compiled.

A camera that is turned or moved sees the world as if all parts were turned or moved about it: its columns are a linear
map of theirs (`sum_of_camera`). Tests compare both with sums of derivatives by numpy.
"""

import numpy as np

from tracker.compute.jit import njit
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.camera_correction import DRIFT, FOCAL, TIME
from tracker.geometry.cameras import NEAR_PLANE_M

OF_CAMERA = slice(TIME)
"""Columns of a piece by which its camera moves: the logarithm of the focal length, then the rotation and the
translation of its part in the world."""
OF_PART = slice(1, None)
"""Columns by which its part moves: the motions of `part_motions`, which begin with the same rotation and
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
