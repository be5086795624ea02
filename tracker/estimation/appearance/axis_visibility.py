"""Occlusion and image positions of samples along the axes of body parts.

Each part is represented by an ellipsoid: fast, and accurate enough for samples on axes.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.compute.jit import NO_REFCOUNT, njit
from tracker.geometry.arrays import TINY, Array
from tracker.geometry.shapes import AXIS_SHARE

ALONG = 7
"""Samples along the axis of each part."""


@lru_cache(maxsize=32)  # of each body; asked for on each frame
def ellipsoids(model: BodyModel) -> Array:
    """Return centre and half-axes of the ellipsoids that represent the parts, (n_parts, 6), metres."""
    return np.array([(*c, *s.half_axes) for c, s in zip(model.centers_part, model.shapes, strict=True)])


def unit_balls(shapes: Array) -> Array:
    """Return the transforms from coordinates in which ellipsoids, (N, 6), are the unit ball to their parts, (N, 4,
    4)."""
    out = np.zeros((len(shapes), 4, 4))
    out[:, range(3), range(3)], out[:, :3, 3], out[:, 3, 3] = shapes[:, 3:], shapes[:, :3], 1.0
    return out


@njit(**NO_REFCOUNT)
def ray_transform(eye: Array, T: Array, shape: Array, ray: Array) -> None:
    """Fill the transform of rays to the coordinates in which a part is the unit ball, (13,).

    It holds the transform of directions, the eye in these coordinates, and the squared distance of the eye minus 1.
    """
    C = -1.0
    for i in range(3):
        o = -shape[i]
        for k in range(3):
            o += T[k, i] * (eye[k] - T[k, 3])
            ray[3 * i + k] = T[k, i] / shape[3 + i]
        o /= shape[3 + i]
        ray[9 + i] = o
        C += o * o
    ray[12] = C


@njit(**NO_REFCOUNT)
def occludes(ray: Array, x: float, y: float, z: float) -> bool:
    """Return whether a part occludes the point at (x, y, z) from the eye.

    It does if the middle of the chord that the ray cuts from the part is nearer than the point.
    """
    d0 = ray[0] * x + ray[1] * y + ray[2] * z
    d1 = ray[3] * x + ray[4] * y + ray[5] * z
    d2 = ray[6] * x + ray[7] * y + ray[8] * z
    A = d0 * d0 + d1 * d1 + d2 * d2
    B = ray[9] * d0 + ray[10] * d1 + ray[11] * d2
    return B < 0.0 and -B < A and B * B - A * ray[12] > 0.0


@njit(**NO_REFCOUNT)
def axis_sample(shape: Array, sample: int) -> float:
    """Return the position of a sample along the axis of a part, from its centre, metres."""
    return shape[5] * AXIS_SHARE * (2.0 * sample / (ALONG - 1) - 1.0)


@njit(**NO_REFCOUNT)
def project_axis(P: Array, eye: Array, T: Array, shape: Array, axis: Array) -> None:
    """Fill the axis of a part relative to the eye and in the image, (4, 3).

    The rows are: its centre from the eye, metres; its centre in homogeneous pixels; the change of these per metre along
    the axis; and per metre across axis and ray.
    """
    for i in range(3):
        axis[0, i] = T[i, 0] * shape[0] + T[i, 1] * shape[1] + T[i, 2] * shape[2] + T[i, 3] - eye[i]
    x, y, z = axis[0, 0], axis[0, 1], axis[0, 2]
    ax, ay, az = T[0, 2], T[1, 2], T[2, 2]
    sx, sy, sz = ay * z - az * y, az * x - ax * z, ax * y - ay * x
    norm = np.sqrt(sx * sx + sy * sy + sz * sz) + TINY
    for i in range(3):
        axis[1, i] = P[i, 0] * (x + eye[0]) + P[i, 1] * (y + eye[1]) + P[i, 2] * (z + eye[2]) + P[i, 3]
        axis[2, i] = P[i, 0] * ax + P[i, 1] * ay + P[i, 2] * az
        axis[3, i] = (P[i, 0] * sx + P[i, 1] * sy + P[i, 2] * sz) / norm


@njit(**NO_REFCOUNT)
def is_occluded(
    T: Array, axis: Array, along_m: float, own: int, rays: Array, among: NDArray[np.int64], n_among: int
) -> bool:
    """Return whether another part occludes a point on the axis of a part.

    Args:
        T: pose of the part, (4, 4), metres.
        axis: see `project_axis`.
        along_m: position from the centre of the part, metres.
        own: index of the part.
        rays: of all parts, see `ray_transform`, (P, 13).
        among: indices of possible occluders, (room,).
        n_among: their number.
    """
    x, y, z = axis[0, 0] + along_m * T[0, 2], axis[0, 1] + along_m * T[1, 2], axis[0, 2] + along_m * T[2, 2]
    for i in range(n_among):
        p = among[i]
        if p != own and occludes(rays[p], x, y, z):
            return True
    return False


@njit(**NO_REFCOUNT)
def pixel_on_axis(axis: Array, along_m: float) -> tuple[float, float, float, float]:
    """Return the image of a point on an axis, px, and its change sideways, px per metre.

    See `project_axis`. Near the axis the projection is practically linear.
    """
    near = 1.0 / (axis[1, 2] + along_m * axis[2, 2])
    u = (axis[1, 0] + along_m * axis[2, 0]) * near
    v = (axis[1, 1] + along_m * axis[2, 1]) * near
    return u, v, (axis[3, 0] - u * axis[3, 2]) * near, (axis[3, 1] - v * axis[3, 2]) * near
