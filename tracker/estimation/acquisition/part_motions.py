"""Derivatives of points on the surface of a posed body by its sizes and its pose.

The occluding contour moves across its tangent as the surface point under it does (KRH08 Sect. 4). So the derivative of
a contour by a size is that of the surface point with the same unit coordinates.

Whatever the parameter, a point of a part moves by the part's twist, and within the part by its half-axes and shape.
These are the part's `N_MOTIONS` motions: a spatial rotation and translation, the half-axes, the tapers, the exponents.
Residuals are summed by the motions of each part first, and then converted to all unknowns.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel
from tracker.estimation.acquisition.size_parameters import DIFFERENCE, SizeArrays
from tracker.estimation.fitting.contour_residuals import PieceSums
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import Camera, project_with_jacobian
from tracker.geometry.rigid import skew
from tracker.geometry.shapes import EllipticalCone, Shape, TaperedSuperquadric

N_MOTIONS = 13
"""Number of motions of a part: 3 of rotation, 3 of translation, 3 half-axes, 2 tapers, 2 exponents."""


def sum_motions(
    views: Sequence[tuple[Camera, PieceSums]], body: BodyModel, kinematics: Kinematics, with_shapes: bool = True
) -> tuple[Array, Array]:
    """Sum the residuals of pieces by the motions of the parts.

    Args:
        views: camera of each view, in the pixels of its residuals, and these.
        body: the body at its present sizes.
        kinematics: of its pose.
        with_shapes: whether tapers and exponents are among the motions; else those columns stay 0.

    Returns:
        Gradients, (n_parts, N_MOTIONS), and normal matrices, (n_parts, N_MOTIONS, N_MOTIONS).
    """
    rows = rows_of_pieces(views, body, kinematics, with_shapes)
    return rows.sums(len(body.parts))


class PieceRows(NamedTuple):
    """Residuals at pieces of contour of several views, with derivatives of their images."""

    parts: IntArray
    """Index of the part of each piece, (N,)."""
    points_world: Array
    """Middle of each piece, (N, 3), metres."""
    px_by_point: Array
    """Derivative of its image by it, (N, 2, 3), px per metre."""
    gradients: Array
    """Derivative of the cost by the image, (N, 2), per px."""
    hessians: Array
    """Second derivative by it, (N, 2, 2), per px^2."""
    rows: Array
    """Derivative of the image by k motions, (N, 2, k)."""

    def sums(self, n_parts: int) -> tuple[Array, Array]:
        """Sum the residuals by part: gradients, (n_parts, k), and normal matrices, (n_parts, k, k)."""
        k = self.rows.shape[2]
        b, M = np.zeros((n_parts, k)), np.zeros((n_parts, k, k))
        order = np.argsort(self.parts, kind="stable")
        bounds = np.searchsorted(self.parts[order], np.arange(n_parts + 1))
        rows = self.rows[order]
        pulls = np.einsum("ni,nik->nk", self.gradients[order], rows)
        weighted = (self.hessians[order] @ rows).reshape(-1, k)
        rows = rows.reshape(-1, k)
        for part, (first, last) in enumerate(itertools.pairwise(bounds)):
            if first < last:
                b[part] = pulls[first:last].sum(axis=0)
                M[part] = rows[2 * first : 2 * last].T @ weighted[2 * first : 2 * last]
        return b, M


def rows_of_pieces(
    views: Sequence[tuple[Camera, PieceSums]], body: BodyModel, kinematics: Kinematics, with_shapes: bool = True
) -> PieceRows:
    """Differentiate the images of pieces by the motions of their parts; arguments as in `sum_motions`."""
    sums = [s.pulled for _, s in views]
    parts, _, unit_points, gradients, hessians = (np.concatenate(fields) for fields in zip(*sums, strict=True))
    half_axes, Ts = np.array([s.half_axes for s in body.shapes]), kinematics.Ts_world_part[parts]
    local = body.centers_part[parts] + unit_points * half_axes[parts]
    points = np.einsum("nij,nj->ni", Ts[:, :3, :3], local) + Ts[:, :3, 3]
    firsts = np.cumsum([0] + [len(s.parts) for s in sums])
    px_by_point = np.concatenate(
        [
            project_with_jacobian(camera.T_camera_world, camera.K, points[i:k])[1]
            for (camera, _), i, k in zip(views, firsts[:-1], firsts[1:], strict=True)
        ]
    )
    moved = motions_of_points(body.shapes, parts, Ts, points, unit_points, with_shapes)
    return PieceRows(parts, points, px_by_point, gradients, hessians, px_by_point @ moved)


def to_unknowns(J: Array, b: Array, M: Array) -> tuple[Array, Array]:
    """Convert sums over the motions of all parts, by the derivatives (n_parts, N_MOTIONS, n), to n unknowns.

    Returns:
        Gradient, (n,), and normal matrix, (n, n).
    """
    return np.einsum("pik,pi->k", J, b), np.sum(J.transpose(0, 2, 1) @ M @ J, axis=0)


def points_by_sizes(model: BodyModel, kinematics: Kinematics, by_sizes: SizeArrays) -> Array:
    """Differentiate the body's points (`BodyModel.point_names`) by the sizes, (n_points, 3, n_sizes), metres."""
    origins, carriers = _origins_by_sizes(model, kinematics, by_sizes), model.point_parts[len(model.joints) :]
    landmarks = origins[carriers] + kinematics.Ts_world_part[carriers, :3, :3] @ by_sizes.landmarks
    return np.concatenate([origins, landmarks])


def motions_by_unknowns(model: BodyModel, kinematics: Kinematics, by_sizes: SizeArrays) -> Array:
    """Differentiate the motions of all parts by the sizes and then the pose, (n_parts, N_MOTIONS, n_sizes + n_dofs)."""
    return np.concatenate([motions_by_sizes(model, kinematics, by_sizes), motions_by_pose(model, kinematics)], axis=2)


def motions_by_sizes(model: BodyModel, kinematics: Kinematics, by_sizes: SizeArrays) -> Array:
    """Differentiate the motions of all parts by the sizes, (n_parts, N_MOTIONS, n_sizes)."""
    Rs, origins = kinematics.Ts_world_part[:, :3, :3], _origins_by_sizes(model, kinematics, by_sizes)
    still = np.zeros_like(origins)
    parts = [still, origins + Rs @ by_sizes.centers, by_sizes.half_axes, by_sizes.tapers, by_sizes.exponents]
    return np.concatenate(parts, axis=1)


def motions_by_pose(model: BodyModel, kinematics: Kinematics) -> Array:
    """Differentiate the motions of all parts by the degrees of freedom, (n_parts, N_MOTIONS, n_dofs)."""
    axes, origins = kinematics.axes_world, kinematics.origins_world
    turns = ~model.dof_is_length[:, None]
    crossed = (skew(origins) @ axes[..., None])[..., 0]
    twists = np.concatenate([turns * axes, np.where(turns, crossed, axes)], axis=1)  # (n_dofs, 6)
    out = np.zeros((len(model.parts), N_MOTIONS, model.n_dofs))
    out[:, :6] = twists.T * model.moves.T[:, None, :]
    return out


def motions_of_points(
    shapes: Sequence[Shape], parts: IntArray, Ts_world_part: Array, points_world: Array, unit_points: Array,
    with_shapes: bool = True,
) -> Array:  # fmt: skip
    """Differentiate points on the surface of parts by the motions of their part.

    Args:
        shapes: of all parts.
        parts: index of the part of each point, (N,).
        Ts_world_part: pose of the part of each point, (N, 4, 4).
        points_world: the points, (N, 3), metres.
        unit_points: the same in the unit coordinates of their part, (N, 3).
        with_shapes: whether to differentiate by tapers and exponents; else these are 0.

    Returns:
        (N, 3, N_MOTIONS), metres per radian, metre, or 1.
    """
    out, Rs = np.zeros((len(points_world), 3, N_MOTIONS)), Ts_world_part[:, :3, :3]
    out[:, :, :3] = -skew(points_world)  # omega x X
    out[:, :, 3:6] = np.eye(3)
    out[:, :, 6:9] = Rs * unit_points[:, None, :]
    if with_shapes:
        for part in np.unique(parts):
            at = parts == part
            out[at, :, 9:] = Rs[at] @ _shape_derivatives(shapes[part], unit_points[at])
    return out


def _origins_by_sizes(model: BodyModel, kinematics: Kinematics, by_sizes: SizeArrays) -> Array:
    """Differentiate the joints by the sizes, (n_parts, 3, n_sizes), metres."""
    parents = np.array(model.parents)
    out = kinematics.Ts_world_part[parents, :3, :3] @ by_sizes.joints
    out[parents < 0] = 0.0
    for part, parent in enumerate(model.parents):  # parents come first
        if parent >= 0:
            out[part] += out[parent]
    return out


def _shape_derivatives(shape: Shape, points: Array) -> Array:
    """Differentiate points (N, 3) in unit coordinates by k_x, k_y, e1 and e2, (N, 3, 4), metres."""
    out = np.zeros((len(points), 3, 4))
    half_axes, z = np.array(shape.half_axes), points[:, 2]
    if isinstance(shape, EllipticalCone):
        shrunk = 1 + shape.taper * z
        out[:, 0, 0], out[:, 1, 1] = (half_axes[:2] * points[:, :2] * (z / shrunk)[:, None]).T
    if isinstance(shape, TaperedSuperquadric):
        shrunk = 1 + np.outer(z, shape.taper)
        out[:, 0, 0], out[:, 1, 1] = (half_axes[:2] * points[:, :2] * z[:, None] / shrunk).T
        out[:, :, 2:] = _by_exponents(shape, points)
    return out


def _by_exponents(shape: TaperedSuperquadric, points: Array) -> Array:
    """Differentiate surface points (N, 3) in unit coordinates by the exponents, across the surface, (N, 3, 2), metres.

    The implicit function of the shape stays 1 where a point moves along its gradient.
    """
    unit = TaperedSuperquadric((1.0, 1.0, 1.0), shape.exponents, shape.taper)
    gradient = np.stack(
        [unit.inside_outside(points + s) - unit.inside_outside(points - s) for s in DIFFERENCE * np.eye(3)], axis=1
    ) / (2 * DIFFERENCE * np.array(shape.half_axes))  # fmt: skip
    steepness = np.maximum(np.sum(gradient**2, axis=1), 1e-12)
    out = np.empty((*points.shape, 2))
    for k, (s1, s2) in enumerate(DIFFERENCE * np.eye(2)):
        e1, e2 = shape.exponents
        after, before = (
            TaperedSuperquadric((1.0, 1.0, 1.0), (e1 + s * s1, e2 + s * s2), shape.taper).inside_outside(points)
            for s in (1, -1)
        )
        out[:, :, k] = -gradient * ((after - before) / (2 * DIFFERENCE) / steepness)[:, None]
    return out
