"""Lens models of OpenCV: Brown and Conrady's for common lenses, and the equidistant one for fisheye lenses.

Brown and Conrady's model moves the slopes x/z and y/z of a ray, and so ends before 90 degrees from the axis. The
equidistant model (Kannala & Brandt 2006 Eq. 6; `cv2.fisheye`) gives the distance from the axis as a polynomial of the
angle, r = a (1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8). It has no such end.
"""

import numpy as np

from tracker.geometry.arrays import TINY, Array

_TABLE_SIZE = 2049
"""Angles between which the inverse of the polynomial is interpolated before Newton's method refines it."""
_NEWTON_STEPS = 5
"""Each step doubles the digits of the interpolation, which has at least three."""


def distort_slopes(xy: Array, distortion: Array) -> Array:
    """Apply Brown and Conrady's model to slopes of rays, (..., 2).

    Args:
        xy: x/z and y/z in camera coordinates.
        distortion: k1, k2, p1, p2[, k3[, k4, k5, k6]]; (0,), (4,), (5,) or (8,).
    """
    k1, k2, p1, p2, k3, k4, k5, k6 = np.pad(distortion, (0, 8 - distortion.size))
    x, y = xy[..., 0], xy[..., 1]
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return np.stack(
        [x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y],
        axis=-1,
    )


def fisheye_limit(distortion: Array) -> float:
    """Return the angle from the axis up to which the polynomial grows, at most pi, rad; beyond, it shows nothing."""
    # dr/da as a polynomial of 1/a^2, multiplied by its fourth power, so that the first coefficient is never 0.
    inverse_squares = np.roots([1.0, *_padded(distortion) * [3, 5, 7, 9]])
    is_real = np.abs(inverse_squares.imag) <= TINY * np.abs(inverse_squares)
    turns = inverse_squares.real[is_real & (inverse_squares.real > 1 / np.pi**2)]
    return float(1 / np.sqrt(turns.max())) if len(turns) else np.pi


def fisheye_project(directions: Array, distortion: Array) -> Array:
    """Map directions in camera coordinates, (..., 3), to distorted slopes, (..., 2); NaN beyond the lens.

    Args:
        directions: of any length but zero; z may be negative, since a fisheye lens can see sideways and behind.
        distortion: k1, k2, k3, k4, or none; (4,) or (0,).
    """
    across = np.linalg.norm(directions[..., :2], axis=-1)
    angles = np.arctan2(across, directions[..., 2])
    angles = np.where(angles <= fisheye_limit(distortion), angles, np.nan)
    radii, _ = fisheye_radii(angles, distortion)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.where(across > 0, radii / across, np.where(angles == 0, 0.0, np.nan))
    return np.asarray(directions[..., :2] * shares[..., None])


def fisheye_directions(xy: Array, distortion: Array) -> Array:
    """Map distorted slopes, (..., 2), to unit directions in camera coordinates, (..., 3); NaN beyond the lens."""
    radii = np.linalg.norm(xy, axis=-1)
    limit = fisheye_limit(distortion)
    table = np.linspace(0.0, limit, _TABLE_SIZE)
    angles = np.interp(radii, fisheye_radii(table, distortion)[0], table, right=np.nan)
    for _ in range(_NEWTON_STEPS):
        found, slopes = fisheye_radii(angles, distortion)
        # At the limit the polynomial is flat, and the interpolation is as good as it gets.
        angles = np.clip(angles - (found - radii) / np.maximum(slopes, TINY), 0.0, limit)
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = np.where(radii > 0, np.sin(angles) / radii, 1.0)
    return np.concatenate([xy * shares[..., None], np.cos(angles)[..., None]], axis=-1)


def fisheye_radii(angles: Array, distortion: Array) -> tuple[Array, Array]:
    """Return the distances from the axis at angles from it, rad, and their derivatives by the angles."""
    k1, k2, k3, k4 = _padded(distortion)
    a2 = angles * angles
    radii = angles * (1 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))))
    return radii, 1 + a2 * (3 * k1 + a2 * (5 * k2 + a2 * (7 * k3 + a2 * 9 * k4)))


def _padded(distortion: Array) -> Array:
    return np.pad(distortion, (0, 4 - distortion.size))
