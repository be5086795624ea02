"""True joints and silhouettes of a person of ellipsoids who swings arms and legs, unlike any body model."""

import numpy as np
from solids import cameras_around, ellipsoid, silhouettes_of

from tracker.estimation.voxel.figure import FigureJoints, chain_centers, point_shares
from tracker.geometry import rigid

SHARES = np.array(
    [[0, 0, 0], [0, 0, 1], [0, 1, 0.85], [0, -1, 0.85], [0, 0.6, -0.95], [0, -0.6, -0.95], *[[0, 0, -1]] * 4], float
)
OWN = np.array([[0, 0, 0], [0, 0, -1], *[[0, 0, 1]] * 8], float)
ENDS = np.array([[np.nan] * 3, [0, 0, 0.2], *[[np.nan] * 3] * 4, *[[0, 0, -0.55]] * 2, *[[0, 0, -0.8]] * 2])
ADULT = np.array([
    [0.11, 0.18, 0.29], [0.09, 0.08, 0.13], *[[0.05, 0.05, 0.15]] * 2, *[[0.08, 0.08, 0.22]] * 2,
    *[[0.042, 0.042, 0.18]] * 2, *[[0.06, 0.06, 0.24]] * 2,
])  # fmt: skip
CHILD = 0.62 * ADULT * np.array([[1.1], [1.75], *[[0.95]] * 8])
"""A child: short limbs, and a head three quarters larger than an adult's of that height."""
FIGURE = FigureJoints(SHARES, OWN, ENDS, np.ones(10, bool), np.argsort(ADULT, axis=1))


def cameras():
    """Eight cameras around a person at the origin."""
    return cameras_around(8, focal=150.0, size=(160, 120))


def pose_at(seconds, swing_deg=35.0):
    """Rotations of the parts, (10, 3, 3), and the torso's centre, (3,), of a person who walks along x."""
    phase, R = 2 * np.pi * 0.8 * seconds, np.tile(np.eye(3), (10, 1, 1))
    swing = np.radians(swing_deg) * np.sin(phase)
    for part, sign, out in ((2, 1, 0.35), (3, -1, -0.35), (4, -0.7, 0.1), (5, 0.7, -0.1)):
        R[part] = rigid.so3_exp(np.array([0, -sign * swing, 0])) @ rigid.so3_exp(np.array([out, 0, 0]))
    for lower, upper, bend in ((6, 2, -0.5), (7, 3, -0.5), (8, 4, 0.3), (9, 5, 0.3)):
        R[lower] = R[upper] @ rigid.so3_exp(np.array([0, bend, 0]))
    return R, np.array([0.4 * seconds - 0.2, 0.0, 0.1])


def joint_points(figure, sizes, rotations, centers):
    """Joints of a figure and ends of its limbs by name, (3,) each, metres."""
    points = zip(*point_shares(figure), strict=True)
    return {name: centers[part] + rotations[part] @ (share * sizes[part]) for name, part, share in points}


def joints_at(seconds, sizes=ADULT):
    """True joints by name, (3,) each, metres."""
    R, center = pose_at(seconds)
    return joint_points(FIGURE, sizes, R, chain_centers(FIGURE, sizes, R, center))


def views_at(seconds, sizes=ADULT, views=None):
    """Silhouettes in all views."""
    R, center = pose_at(seconds)
    centers = chain_centers(FIGURE, sizes, R, center)
    solids = [ellipsoid(c, s, r) for c, s, r in zip(centers, sizes, R, strict=True)]
    return silhouettes_of(solids, views or cameras())
