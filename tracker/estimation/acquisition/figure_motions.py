"""Derivatives of the ten measured parts of a figure (MTHC01 Fig. 5) by the sizes and the pose of its body."""

from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.acquisition.part_motions import motions_by_pose
from tracker.estimation.acquisition.size_parameters import DIFFERENCE, SizeParameters
from tracker.estimation.voxel.figure import N_PARTS, PARTS, ROOTS, TORSO, figure_of
from tracker.estimation.voxel.state import FilterState
from tracker.geometry import rigid
from tracker.geometry.arrays import Array

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
