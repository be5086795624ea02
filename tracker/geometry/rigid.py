"""Rigid motions as plain arrays: rotations `(..., 3, 3)` and homogeneous transforms `(..., 4, 4)`.

`T_a_b` maps coordinates of frame b to frame a, so `T_a_c = T_a_b @ T_b_c`.

These functions are used for a few rotations at a time. There scipy's `Rotation` multiplies quaternions more slowly, and
loading it takes 0.1 s.
"""

import numpy as np

from tracker.geometry.arrays import TINY, Array


def skew(v: Array) -> Array:
    """Return the matrix `[v]x` with `[v]x @ u = v x u`; `(..., 3)` to `(..., 3, 3)`."""
    v = np.asarray(v, dtype=np.float64)
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2] = -v[..., 2], v[..., 1]
    out[..., 1, 0], out[..., 1, 2] = v[..., 2], -v[..., 0]
    out[..., 2, 0], out[..., 2, 1] = -v[..., 1], v[..., 0]
    return out


def so3_exp(rotvec: Array) -> Array:
    """Return the rotation matrix of a rotation vector in radians (Rodrigues' formula); `(..., 3)` to `(..., 3, 3)`."""
    rotvec = np.asarray(rotvec, dtype=np.float64)
    theta2 = np.sum(rotvec**2, axis=-1)[..., None, None]
    theta = np.sqrt(theta2)
    # Taylor series below 1e-4 rad, where sin(x)/x and (1-cos x)/x^2 lose digits.
    small = theta < 1e-4
    safe = np.where(small, 1.0, theta)
    a = np.where(small, 1.0 - theta2 / 6, np.sin(safe) / safe)
    b = np.where(small, 0.5 - theta2 / 24, (1.0 - np.cos(safe)) / safe**2)
    K = skew(rotvec)
    return np.eye(3) + a * K + b * (K @ K)


def so3_log(R: Array) -> Array:
    """Return the rotation vector in radians, length at most pi, of a rotation matrix; `(..., 3, 3)` to `(..., 3)`."""
    return quaternion_log(quaternion_from_matrix(R))


def quaternion_from_matrix(R: Array) -> Array:
    """Return the unit quaternion (w, x, y, z) with w >= 0 of a rotation matrix; `(..., 3, 3)` to `(..., 4)`."""
    R = np.asarray(R, dtype=np.float64)
    m00, m11, m22 = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    # Shepperd's method: of the four equivalent forms use the one with the largest pivot.
    pivots = np.stack([1 + m00 + m11 + m22, 1 + m00 - m11 - m22, 1 - m00 + m11 - m22, 1 - m00 - m11 + m22], axis=-1)
    x_w, y_w, z_w = R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]
    xy, xz, yz = R[..., 0, 1] + R[..., 1, 0], R[..., 0, 2] + R[..., 2, 0], R[..., 1, 2] + R[..., 2, 1]
    rows = np.stack(
        [
            np.stack([pivots[..., 0], x_w, y_w, z_w], axis=-1),
            np.stack([x_w, pivots[..., 1], xy, xz], axis=-1),
            np.stack([y_w, xy, pivots[..., 2], yz], axis=-1),
            np.stack([z_w, xz, yz, pivots[..., 3]], axis=-1),
        ],
        axis=-2,
    )
    best = np.argmax(pivots, axis=-1)
    q = np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(q[..., :1] < 0, -q, q)


def matrix_from_quaternion(wxyz: Array) -> Array:
    """Return the rotation matrix of a quaternion (w, x, y, z), normalized first; `(..., 4)` to `(..., 3, 3)`."""
    q = np.asarray(wxyz, dtype=np.float64)
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    w, V = q[..., 0][..., None, None], skew(q[..., 1:])
    return np.eye(3) + 2.0 * w * V + 2.0 * (V @ V)


def quaternion_log(wxyz: Array) -> Array:
    """Return the rotation vector in radians of a unit quaternion (w, x, y, z); `(..., 4)` to `(..., 3)`."""
    q = np.asarray(wxyz, dtype=np.float64)
    q = np.where(q[..., :1] < 0, -q, q)
    s = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(s, q[..., :1])
    small = s < TINY
    factor = np.where(small, 2.0, angle / np.where(small, 1.0, s))
    return factor * q[..., 1:]


def quaternion_exp(rotvec: Array) -> Array:
    """Return the unit quaternion (w, x, y, z) of a rotation vector in radians; `(..., 3)` to `(..., 4)`."""
    rotvec = np.asarray(rotvec, dtype=np.float64)
    half = np.linalg.norm(rotvec, axis=-1, keepdims=True) / 2.0
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * rotvec], axis=-1)


def quaternion_multiply(a: Array, b: Array) -> Array:
    """Multiply quaternions (w, x, y, z): the product `a b` rotates by b, then by a; `(..., 4)`."""
    a, b = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    (aw, ax, ay, az), (bw, bx, by, bz) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bw - (ax * bx + ay * by + az * bz),
            aw * bx + bw * ax + (ay * bz - az * by),
            aw * by + bw * ay + (az * bx - ax * bz),
            aw * bz + bw * az + (ax * by - ay * bx),
        ],
        axis=-1,
    )


def clip_swing_twist(wxyz: Array, cone: float, twist: float) -> Array:
    """Limit the swing and the twist about z of a rotation, rad; quaternion `(4,)` to quaternion `(4,)`."""
    q = wxyz / np.linalg.norm(wxyz)
    norm = np.hypot(q[0], q[3])
    turn = np.array([q[0], 0.0, 0.0, q[3]]) / norm if norm > TINY else np.array([1.0, 0.0, 0.0, 0.0])
    swing = quaternion_log(quaternion_multiply(q, turn * (1.0, -1.0, -1.0, -1.0)))
    angle = np.linalg.norm(swing)
    if angle > cone:
        swing *= cone / angle
    about_z = np.clip(quaternion_log(turn)[2], -twist, twist)
    turn = quaternion_exp(np.array([0.0, 0.0, about_z]))
    return quaternion_multiply(quaternion_exp(swing), turn)


def transform(R: Array | None = None, t: Array | None = None) -> Array:
    """Build a homogeneous transform from a rotation `(3, 3)` and a translation `(3,)`; identity for a missing one."""
    T = np.eye(4)
    if R is not None:
        T[:3, :3] = R
    if t is not None:
        T[:3, 3] = t
    return T


def inverse(T: Array) -> Array:
    """Invert rigid transforms `(..., 4, 4)`: `inverse(T_a_b)` is `T_b_a`."""
    R_t = np.swapaxes(T[..., :3, :3], -1, -2)
    out = np.zeros_like(T)
    out[..., :3, :3] = R_t
    out[..., :3, 3] = -(R_t @ T[..., :3, 3:])[..., 0]
    out[..., 3, 3] = 1.0
    return out


def apply(T_a_b: Array, points_b: Array) -> Array:
    """Map points `(..., 3)` from frame b to frame a by a transform `(4, 4)`."""
    return points_b @ T_a_b[:3, :3].T + T_a_b[:3, 3]
