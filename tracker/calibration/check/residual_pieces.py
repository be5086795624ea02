"""The residuals of a diagnosis where they are in the pictures: how far the edges lie from the contours."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.calibration.check.judged_frames import JudgedFrame, seen_people
from tracker.estimation.acquisition.contour_bundle import RigState, views_of
from tracker.estimation.acquisition.size_parameters import SizeParameters
from tracker.geometry.arrays import Array


class ResidualPieces(NamedTuple):
    """The pieces of contour of some frames in one view. A piece says something along its normal only: of many, the
    shift d that brings contours onto edges solves (sum of hessians) d = -(sum of gradients)."""

    points_px: Array
    """Middle of each piece, (N, 2), undistorted px."""
    gradients: Array
    """Derivative of the cost by the image of the piece, (N, 2), per undistorted px."""
    hessians: Array
    """Gauss-Newton's second derivative by it, (N, 2, 2), per px^2."""


def residual_pieces(
    frames: Sequence[JudgedFrame], parameters: Sequence[SizeParameters], state: RigState
) -> tuple[ResidualPieces, ...]:
    """Return the residuals of each view with its present camera and clock.

    Args:
        frames: of a diagnosis.
        parameters: sizes of each person's body.
        state: cameras, sizes and poses that fit the contours. The evidence is what they accept: a camera that is off
            shows by how much, and the others are not blamed.
    """
    nothing = np.zeros_like(state.corrections)
    found: list[list[ResidualPieces]] = [[] for _ in state.corrections]
    for seen, pose in zip(seen_people(frames, state), state.poses, strict=True):
        body = parameters[seen.person].body(state.sizes[seen.person])
        for camera, evidence, residuals in views_of(seen, nothing):
            then = body.retract(pose, seen.path.step(seen.ahead_s[camera]))
            pieces = residuals.piece_sums(body.kinematics(then), residuals.resized(body))[1].pulled
            # Resizing keeps the borders of pixels, not their centres.
            points_px = (pieces.points_px + evidence.corner_px + 0.5) / evidence.scale - 0.5
            scaled = evidence.scale * pieces.gradients, evidence.scale**2 * pieces.hessians
            found[camera].append(ResidualPieces(points_px, *scaled))
    return tuple(_together(own) for own in found)


def _together(pieces: Sequence[ResidualPieces]) -> ResidualPieces:
    """Return the pieces of several frames as those of one."""
    if not pieces:
        return ResidualPieces(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros((0, 2, 2)))
    return ResidualPieces(*(np.concatenate(column) for column in zip(*pieces, strict=True)))
