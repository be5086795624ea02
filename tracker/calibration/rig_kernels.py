"""Sum the residuals at pieces of contour by the motions of their part and the corrections of their camera, compiled.

`part_motions.rows_of_pieces` has the derivatives of the parts by numpy. With those of the camera, tests compare both.
"""

import numpy as np

from tracker.calibration.camera_correction import TIME
from tracker.compute.jit import njit
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import NEAR_PLANE_M

N_PART = 9
"""Columns of a part: its rotation, its translation and its half-axes. Those of the camera, but the clock's, follow."""
N_CAMERA = TIME


@njit(nogil=True, cache=True)
def sum_pieces(
    parts: IntArray, unit_points: Array, gradients: Array, hessians: Array, Ts: Array, centers: Array, half_axes: Array,
    T_camera_world: Array, K: Array, turn: Array, b: Array, M: Array,
) -> None:  # fmt: skip
    """Add the residuals of pieces to gradients and normal matrices.

    Args:
        parts: index of the part of each piece, (N,).
        unit_points: middle of each in the unit coordinates of its part, (N, 3).
        gradients: derivative of the cost by the image of each, (N, 2), per px.
        hessians: second derivative, (N, 2, 2), per px^2.
        Ts: pose of each part in the world, (P, 4, 4), metres.
        centers: centre of each shape in its part, (P, 3), metres.
        half_axes: of each shape, (P, 3), metres.
        T_camera_world: of the corrected camera, (4, 4).
        K: of it, (3, 3), px.
        turn: rotation of its correction, (3, 3).
        b: gradients by part, (P, N_PART + N_CAMERA).
        M: normal matrices by part, (P, N_PART + N_CAMERA, N_PART + N_CAMERA); only above the diagonal.
    """
    k, J = N_PART + N_CAMERA, np.empty((2, N_PART + N_CAMERA))
    for n in range(len(parts)):
        p = parts[n]
        _differentiate(unit_points[n], Ts[p], centers[p], half_axes[p], T_camera_world, K, turn, J)
        h00, h01, h11 = hessians[n, 0, 0], hessians[n, 0, 1], hessians[n, 1, 1]
        for i in range(k):
            b[p, i] += gradients[n, 0] * J[0, i] + gradients[n, 1] * J[1, i]
            first, second = h00 * J[0, i] + h01 * J[1, i], h01 * J[0, i] + h11 * J[1, i]
            for j in range(i, k):
                M[p, i, j] += first * J[0, j] + second * J[1, j]


@njit(nogil=True, cache=True)
def _differentiate(
    unit_point: Array, T: Array, center: Array, half_axes: Array, T_camera_world: Array, K: Array, turn: Array, J: Array
) -> None:
    """Fill the derivatives of the image of a point of a part by all columns, (2, N_PART + N_CAMERA)."""
    world, eye, by_camera, by_world = np.empty(3), np.empty(3), np.empty((2, 3)), np.empty((2, 3))
    for i in range(3):
        world[i] = T[i, 3]
        for j in range(3):
            world[i] += T[i, j] * (center[j] + unit_point[j] * half_axes[j])
    _transform(T_camera_world, world, eye)
    z = max(eye[2], NEAR_PLANE_M)
    x, y = eye[0] / z, eye[1] / z
    for r in range(2):
        by_camera[r, 0], by_camera[r, 1] = K[r, 0] / z, K[r, 1] / z
        by_camera[r, 2] = -(K[r, 0] * x + K[r, 1] * y) / z if eye[2] >= NEAR_PLANE_M else 0.0
        _times(by_camera[r], T_camera_world, by_world[r])
        _cross(by_world[r], world, J[r, 0:3])
        J[r, 3:6] = by_world[r]
        _times(by_world[r], T, J[r, 6:9])
        for j in range(3):
            J[r, 6 + j] *= unit_point[j]
        _cross(by_camera[r], eye, J[r, 9:12])
        _times(by_camera[r], turn, J[r, 12:15])
        J[r, 12:15] *= -1.0
        J[r, 15] = K[r, 0] * x + K[r, 1] * y


@njit(nogil=True, cache=True)
def _transform(T: Array, point: Array, out: Array) -> None:
    """Fill a transformed point, (3,)."""
    for i in range(3):
        out[i] = T[i, 3]
        for j in range(3):
            out[i] += T[i, j] * point[j]


@njit(nogil=True, cache=True)
def _times(row: Array, T: Array, out: Array) -> None:
    """Fill a row, (3,), times the rotation of a transform."""
    for j in range(3):
        out[j] = row[0] * T[0, j] + row[1] * T[1, j] + row[2] * T[2, j]


@njit(nogil=True, cache=True)
def _cross(row: Array, point: Array, out: Array) -> None:
    """Fill the derivative of `row @ point` by a rotation of the point, `point x row`, (3,)."""
    out[0] = point[1] * row[2] - point[2] * row[1]
    out[1] = point[2] * row[0] - point[0] * row[2]
    out[2] = point[0] * row[1] - point[1] * row[0]
