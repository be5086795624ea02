"""Derivatives of points on the surface of a posed body by its sizes and its pose.

The occluding contour moves across its tangent as the surface point under it does (KRH08 Sect. 4). So the derivative of
a contour by a size is that of the surface point with the same unit coordinates.

Whatever the parameter, a point of a part moves by the part's twist, and within the part by its half-axes and shape.
These are the part's `N_MOTIONS` motions: a spatial rotation and translation, the half-axes, the tapers, the exponents.
Residuals are summed by the motions of each part first, and then converted to all unknowns.

Derivatives of the ten measured parts of a figure (MTHC01 Fig. 5) by the sizes and the pose of its body.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.acquisition.size_parameters import DIFFERENCE, SizeArrays, SizeParameters
from tracker.estimation.voxel.figure import N_PARTS, PARTS, ROOTS, TORSO, figure_of
from tracker.estimation.voxel.state import FilterState
from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array, IntArray
from tracker.geometry.rigid import skew
from tracker.geometry.shapes import EllipticalCone, Shape, TaperedSuperquadric

N_MOTIONS = 13
"""Number of motions of a part: 3 of rotation, 3 of translation, 3 half-axes, 2 tapers, 2 exponents."""


def points_by_sizes(model: BodyModel, kinematics: Kinematics, by_sizes: SizeArrays) -> Array:
    """Differentiate the body's points (`BodyModel.point_names`) by the sizes, (n_points, 3, n_sizes), metres."""
    origins, carriers = _origins_by_sizes(model, kinematics, by_sizes), model.point_parts[len(model.joints) :]
    landmarks = origins[carriers] + kinematics.Ts_world_part[carriers, :3, :3] @ by_sizes.landmarks
    return np.concatenate([origins, landmarks])


def part_jacobian(model: BodyModel, kinematics: Kinematics, by_sizes: SizeArrays, with_shapes: bool = True) -> Array:
    """Differentiate the motions of all parts by the sizes and then the pose, (n_parts, N_MOTIONS, n_sizes + n_dofs).

    Without shapes, tapers and exponents are left out of the motions.
    """
    own = part_size_jacobian(model, kinematics, by_sizes, with_shapes)
    return np.concatenate([own, motions_by_pose(model, kinematics)[:, : own.shape[1]]], axis=2)


def part_size_jacobian(
    model: BodyModel, kinematics: Kinematics, by_sizes: SizeArrays, with_shapes: bool = True
) -> Array:
    """Differentiate the motions of all parts by the sizes, (n_parts, N_MOTIONS, n_sizes); see `part_jacobian`."""
    Rs, origins = kinematics.Ts_world_part[:, :3, :3], _origins_by_sizes(model, kinematics, by_sizes)
    still = np.zeros_like(origins)
    shapes = [by_sizes.tapers, by_sizes.exponents] if with_shapes else []
    return np.concatenate([still, origins + Rs @ by_sizes.centers, by_sizes.half_axes, *shapes], axis=1)


def motions_by_pose(model: BodyModel, kinematics: Kinematics) -> Array:
    """Differentiate the motions of all parts by the degrees of freedom, (n_parts, N_MOTIONS, n_dofs)."""
    axes, origins = kinematics.axes_world, kinematics.origins_world
    turns = ~model.dof_is_length[:, None]
    crossed = (skew(origins) @ axes[..., None])[..., 0]
    twists = np.concatenate([turns * axes, np.where(turns, crossed, axes)], axis=1)  # (n_dofs, 6)
    out = np.zeros((len(model.parts), N_MOTIONS, model.n_dofs))
    out[:, :6] = twists.T * model.moves.T[:, None, :]
    return out


def shape_derivatives(shapes: Sequence[Shape], parts: IntArray, unit_points: Array, with_shapes: bool = True) -> Array:
    """Differentiate points on the surface of parts by tapers and exponents, in the frame of their part.

    Args:
        shapes: of all parts.
        parts: index of the part of each point, (N,).
        unit_points: the points in the unit coordinates of their part, (N, 3).
        with_shapes: whether to differentiate; else there is no column.

    Returns:
        (N, 3, 4), metres per 1; (N, 3, 0) without shapes.
    """
    out = np.zeros((len(parts), 3, 4 if with_shapes else 0))
    for part in np.unique(parts) if with_shapes else ():
        out[parts == part] = _shape_derivatives(shapes[part], unit_points[parts == part])
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
    steepness = np.maximum(np.sum(gradient**2, axis=1), TINY)
    out = np.empty((*points.shape, 2))
    for k, (s1, s2) in enumerate(DIFFERENCE * np.eye(2)):
        e1, e2 = shape.exponents
        after, before = (
            TaperedSuperquadric((1.0, 1.0, 1.0), (e1 + s * s1, e2 + s * s2), shape.taper).inside_outside(points)
            for s in (1, -1)
        )
        out[:, :, k] = -gradient * ((after - before) / (2 * DIFFERENCE) / steepness)[:, None]
    return out


TIPS = np.array([0, 1, 0, 0, 0, 0, -1, -1, -1, -1])
"""Direction of the free end of each part along its axis: top of the head, fingers and toes; 0 for parts without one."""


class FigureSizes(NamedTuple):
    """Derivatives of a figure in its own frames by the sizes of its body, with a last axis of n_sizes."""

    half_sizes: Array
    """Of the half sizes of its parts, (10, 3, n_sizes), metres."""
    centers: Array
    """Of each part's centre about the joint at which it begins, (10, 3, n_sizes), metres; 0 for the torso."""


def figure_by_sizes(parameters: SizeParameters, sizes: Array) -> FigureSizes:
    """Differentiate a figure by the sizes of its body, by differences.

    Args:
        parameters: the sizes.
        sizes: where to differentiate, (n_sizes,).

    Raises:
        TrackerError: the body lacks the joints of ten parts.
    """
    here = _lengths(parameters.body(sizes))
    out = np.zeros((len(sizes), *here.shape))
    for k in np.flatnonzero(parameters.of_kinds("height", "build", "length", "girth", "joint", "end", "free_end")):
        moved = sizes.copy()
        moved[k] += DIFFERENCE
        out[k] = (_lengths(parameters.body(moved)) - here) / DIFFERENCE
    return FigureSizes(*np.moveaxis(out, 0, -1))


def parts_by_unknowns(body: PosedBody, state: FilterState, by_sizes: FigureSizes, points: Array) -> Array:
    """Differentiate centre, turn and half sizes of all parts by the sizes and then the pose, (10, 9, n_sizes + n_dofs).

    Centres are in the world, turns in the frame of the part, half sizes along its axes.

    Args:
        body: the posed body.
        state: its figure.
        by_sizes: derivatives of the figure in its own frames.
        points: those of the body's points by the sizes, see `points_by_sizes`.
    """
    model, n = body.model, by_sizes.half_sizes.shape[-1]
    names = {name: i for i, name in enumerate(model.point_names)}
    twists = motions_by_pose(model, body.kinematics)[:, :6]
    out = np.zeros((N_PARTS, 9, n + model.n_dofs))
    firsts = [int(m[0]) for m in figure_of(model).members]
    for i in range(1, N_PARTS):
        R, turn = state.rotations[i], twists[firsts[i], :3]
        out[i, :3, :n] = points[names[ROOTS[PARTS[i]]]] + R @ by_sizes.centers[i]
        out[i, :3, n:] = twists[firsts[i], 3:] - rigid.skew(state.centers[i]) @ turn
        out[i, 3:6, n:] = R.T @ turn
    moved = np.concatenate(
        [points, model.point_jacobian(body.kinematics, model.point_parts, body.points_world)], axis=2
    )
    by_name = {name: moved[i] for name, i in names.items()}
    out[TORSO, :3] = by_name["neck"] / 2 + (by_name["left_hip"] + by_name["right_hip"]) / 4
    out[TORSO, 3:6] = _torso_turn(body, by_name, state.rotations[TORSO])
    out[:, 6:, :n] = by_sizes.half_sizes
    return out


def _torso_turn(body: PosedBody, moved: dict[str, Array], R: Array) -> Array:
    """Differentiate the torso's turn, whose axes lead from point to point, (3, n), by the derivatives of the points."""
    at = body.named_points_world

    def up_of(p: dict[str, Array]) -> Array:
        return np.asarray(p["neck"] - (p["left_hip"] + p["right_hip"]) / 2)

    def left_of(p: dict[str, Array]) -> Array:
        return np.asarray(p["left_shoulder"] - p["right_shoulder"] + p["left_hip"] - p["right_hip"])

    forward, left, up = R.T
    by_up, by_left = up_of(moved) / np.linalg.norm(up_of(at)), left_of(moved) / (left_of(at) @ left)
    along = float(left_of(at) @ up / (left_of(at) @ left))
    # The up axis turns about x and y, the left one about z once it is orthogonal to it.
    return np.array([-left @ by_up, forward @ by_up, -forward @ by_left + along * (forward @ by_up)])


def _lengths(model: BodyModel) -> Array:
    """Return half sizes and centres about the joints, (2, 10, 3), metres."""
    of = figure_of(model)
    return np.array([of.sizes, -of.figure.own_shares * of.sizes])
