"""Derivatives of points by the motions of their part and by a camera, with numpy: the oracle of `piece_sums`."""

import numpy as np

from tracker.estimation.acquisition.part_derivatives import shape_derivatives
from tracker.geometry.camera_correction import POSITION, ROTATION, TIME
from tracker.geometry.camera_derivatives import project_with_columns
from tracker.geometry.rigid import skew, so3_exp


def motions_of_points(shapes, parts, Ts_world_part, points_world, unit_points, with_shapes=True):
    """Differentiate points on the surface of parts by the motions of their part.

    Args:
        shapes: of all parts.
        parts: index of the part of each point, (N,).
        Ts_world_part: pose of the part of each point, (N, 4, 4).
        points_world: the points, (N, 3), metres.
        unit_points: the same in the unit coordinates of their part, (N, 3).
        with_shapes: whether to differentiate by tapers and exponents.

    Returns:
        (N, 3, 9 or 13), metres per radian, metre, or 1.
    """
    Rs = Ts_world_part[:, :3, :3]
    by_shapes = Rs @ shape_derivatives(shapes, parts, unit_points, with_shapes)
    still = np.broadcast_to(np.eye(3), Rs.shape)
    return np.concatenate([-skew(points_world), still, Rs * unit_points[:, None], by_shapes], axis=2)


def sums_of_rows(pieces, rows, n_parts):
    """Gradients, (n_parts, k), and normal matrices, (n_parts, k, k), of pieces with rows, (N, 2, k)."""
    b, M = np.zeros((n_parts, rows.shape[2])), np.zeros((n_parts, rows.shape[2], rows.shape[2]))
    np.add.at(b, pieces.parts, np.einsum("ni,nik->nk", pieces.gradients, rows))
    np.add.at(M, pieces.parts, rows.transpose(0, 2, 1) @ pieces.hessians @ rows)
    return b, M


def columns(camera, correction, points_world):
    """Derivatives of the images of points by a further step of a correction, but that of the clock, (N, 2, TIME)."""
    out = project_with_columns(camera, points_world).by_camera[:, :, :TIME]
    out[:, :, POSITION] = out[:, :, POSITION] @ so3_exp(correction[ROTATION])
    return out
