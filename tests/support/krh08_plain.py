"""Rulings of cones of KRH08, and its Eq. 55 and 61 over all visible contour points, in numpy, to check kernels with."""

from typing import NamedTuple

import numpy as np
from contour_oracle import bilinear

from tracker.body.model import PosedBody
from tracker.estimation.fitting.twists import SINGULAR
from tracker.evidence.contours import occluding_contours
from tracker.geometry.shapes import EllipticalCone

_ON_SIDE = 0.999


class Linearization(NamedTuple):
    """Distances of all visible contour points, and their derivatives."""

    distances: np.ndarray
    """(m,), px."""
    jacobian: np.ndarray
    """(m, n_dofs), px per radian or metre."""
    lengths: np.ndarray
    """Length of the piece of contour around each point, (m,), px."""


def linearize(model, pose, views, sliding):
    """Return the chamfer distances of all visible contour points (Eq. 59) and their derivatives (Eq. 55, 61)."""
    body = PosedBody(model, pose)
    kinematics = body.kinematics
    lever = np.cross(kinematics.origins_world, kinematics.axes_world)
    angular = np.where(model.dof_is_length[:, None], 0.0, kinematics.axes_world)
    linear = np.where(model.dof_is_length[:, None], kinematics.axes_world, lever)
    twists = np.hstack([angular, linear])  # spatial, the columns of J_H
    distances, rows, parts, lengths = [], [], [], []
    for view in views:
        seen = occluding_contours.trace([body], view.camera)
        at = ~seen.occluded
        points, of = seen.points_world[at].astype(np.float64), seen.parts[at].astype(np.int64)
        x, J_I = view.camera.project_with_jacobian(points)
        inside = np.all((x >= 0) & (x < np.array(view.camera.size) - 1), axis=1)
        points, of, J_I = points[inside], of[inside], J_I[inside]
        d, slope = bilinear(view.distance, x[inside])
        spatial = np.einsum("ni,nij->nj", slope, J_I)
        row = np.hstack([np.cross(points, spatial), spatial])  # slope . J_I A
        if sliding:
            row += _sliding_rows(body, of, points, view.camera.center_world, spatial)
        distances.append(d)
        rows.append(row)
        parts.append(of)
        ends = seen.pieces_px[at][inside].astype(np.float64)
        lengths.append(np.linalg.norm(ends[:, 2:] - ends[:, :2], axis=1))
    moves = model.moves[:, np.concatenate(parts)].T
    jacobian = np.where(moves, np.concatenate(rows) @ twists.T, 0.0)
    return Linearization(np.concatenate(distances), jacobian, np.concatenate(lengths))


def _sliding_rows(body, parts, points, eye, spatial):
    """Return the sliding part of the derivatives of distances by spatial twists, `spatial . B` of Eq. 31, (N, 6).

    Points on the rim of an end do not slide. Where the two rulings of a cone nearly meet, the weight falls to 0.

    Args:
        body: in its pose.
        parts: index of the part of each point, (N,).
        points: on contour generators, (N, 3), metres, world.
        eye: camera centre, (3,).
        spatial: derivative of each distance by its point, (N, 3).
    """
    out = np.zeros((len(points), 6))
    for part, shape in enumerate(body.model.shapes):
        at = np.flatnonzero(parts == part)
        if not isinstance(shape, EllipticalCone) or not len(at):
            continue
        T, (a, b, half) = body.kinematics.Ts_world_part[part], shape.half_axes
        R, center = T[:3, :3], T[:3, :3] @ body.model.centers_part[part] + T[:3, 3]
        own, k = (points[at] - center) @ R, shape.taper / half
        theta = np.arctan2(own[:, 1] / b, own[:, 0] / a)
        c, s, zero, w = np.cos(theta), np.sin(theta), np.zeros(len(at)), 1 + k * own[:, 2]
        normal = np.stack([b * c, a * s, zero - a * b * k], axis=1)
        normal_by_theta = np.stack([-b * s, a * c, zero], axis=1)
        point_by_theta = np.stack([-a * s * w, b * c * w, zero], axis=1)
        sight = own + (center - eye) @ R
        slope = np.sum(sight * normal_by_theta, axis=1)  # b of Eq. 31
        least = SINGULAR * np.linalg.norm(sight, axis=1) * np.linalg.norm(normal_by_theta, axis=1)
        inverse = np.where(np.abs(slope) >= least, 1 / np.where(slope == 0, 1.0, slope), slope / least**2)
        inverse[np.abs(own[:, 2]) > _ON_SIDE * half] = 0.0
        n = normal @ R.T
        weight = inverse * np.sum((point_by_theta @ R.T) * spatial[at], axis=1)
        out[at] = weight[:, None] * np.hstack([np.cross(n, eye), -n])
    return out


def surface_point(cone, theta, z):
    """X(theta, z) of Eq. 12 in the cone's own frame, (3,)."""
    a, b, half = cone.half_axes
    w = 1 + cone.taper / half * z
    return np.array([a * np.cos(theta) * w, b * np.sin(theta) * w, z])


def normal_of(cone, theta):
    """alpha' x beta, the direction of Eq. 9, which does not vanish for a cylinder, (3,)."""
    a, b, half = cone.half_axes
    return np.array([b * np.cos(theta), a * np.sin(theta), -a * b * cone.taper / half])


def grazing_angles(cone, eye):
    """Solve F cos(theta) + G sin(theta) + H = 0 (Eq. 11, 13) for an eye in the cone's own frame.

    Returns:
        Two angles, or none where the eye is inside the cone or its extension. They come from atan2 and acos, which lose
        no root.
    """
    a, b, half = cone.half_axes
    F, G, H = -eye[0] * b, -eye[1] * a, a * b * (1 + cone.taper / half * eye[2])
    radius = np.hypot(F, G)
    if radius <= abs(H):
        return ()
    middle, half_angle = np.arctan2(G, F), np.arccos(-H / radius)
    return middle - half_angle, middle + half_angle
