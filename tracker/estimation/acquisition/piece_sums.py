"""Normal equations of pieces of contour by corrections of cameras, sizes of a body, and its pose.

Residuals are summed by the motions of each part first, and then converted to all unknowns.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel
from tracker.estimation.acquisition.part_motions import N_MOTIONS, shape_derivatives
from tracker.estimation.acquisition.piece_kernels import OF_PART, sum_of_camera, sum_pieces
from tracker.estimation.fitting.contour_residuals import PieceSums
from tracker.estimation.fitting.gauss_newton import NormalEquations
from tracker.geometry.arrays import Array
from tracker.geometry.camera_correction import N_CORRECTIONS, ROTATION
from tracker.geometry.cameras import Camera
from tracker.geometry.rigid import so3_exp


class SeenPieces(NamedTuple):
    """Residuals of a person in one view."""

    camera: int
    shown_by: Camera
    """With its correction."""
    delay_s: float
    """Time by which the picture was taken later than the frame, seconds."""
    pieces: PieceSums


class PartSums(NamedTuple):
    """Residuals summed by the columns of the parts, see `piece_kernels`."""

    b: Array
    """Gradients, (n_parts, k)."""
    M: Array
    """Normal matrices, (n_parts, k, k)."""


def sums_of_views(
    views: Sequence[tuple[Camera, PieceSums]], body: BodyModel, kinematics: Kinematics, n_motions: int
) -> list[PartSums]:
    """Sum the residuals of each view.

    Args:
        views: camera with its correction, and residuals.
        body: at its present sizes.
        kinematics: of its pose.
        n_motions: number of motions of a part, with or without its shape.
    """
    with_shapes, shapes, k = n_motions == N_MOTIONS, body.shapes, n_motions + OF_PART.start
    pieces = [p.pulled if with_shapes else p for _, p in views]
    parts, units = (np.concatenate(own) for own in zip(*((p.parts, p.unit_points) for p in pieces), strict=True))
    by_shapes = shape_derivatives(shapes, parts, units, with_shapes)
    ends = np.cumsum([len(p.parts) for p in pieces])
    half_axes, out = np.array([s.half_axes for s in shapes]), list[PartSums]()
    for (camera, _), own, by_shape in zip(views, pieces, np.split(by_shapes, ends), strict=False):
        out.append(PartSums(np.zeros((len(shapes), k)), np.zeros((len(shapes), k, k))))
        sum_pieces(
            *(own.parts, own.unit_points, by_shape, own.gradients, own.hessians, kinematics.Ts_world_part),
            *(body.centers_part, half_axes, camera.T_camera_world, camera.K, *out[-1]),
        )
    return out


class GroupSums(NamedTuple):
    """Normal equations of a person on a frame, by all corrections and then the unknowns of the body.

    Sums over the motions of parts are converted to the unknowns of the body once for all views, which takes most time.
    """

    gradient: Array
    """(n,)."""
    hessian: Array
    """(n, n); the block of body by corrections is filled by `equations`."""
    n_cameras: int
    """Number of corrections of all cameras."""

    @classmethod
    def zeros(cls, n_cameras: int, n_body: int) -> "GroupSums":
        """Return empty sums."""
        n = n_cameras + n_body
        return cls(np.zeros(n), np.zeros((n, n)), n_cameras)

    def add_camera(
        self, view: SeenPieces, sums: PartSums, correction: Array, moving: Array, time_s: float, by_parts: Array
    ) -> None:
        """Add what a view says of its own camera.

        Args:
            view: its camera.
            sums: of the view.
            correction: (N_CORRECTIONS,).
            moving: motions of the parts in a second, (n_parts, n_motions).
            time_s: time of the frame, seconds.
            by_parts: filled with the second derivatives by corrections and the motions of parts, for `add_body`.
        """
        at = slice(view.camera * N_CORRECTIONS, (view.camera + 1) * N_CORRECTIONS)
        turn = so3_exp(correction[ROTATION]) if correction[ROTATION].any() else np.eye(3)
        sum_of_camera(
            *sums, view.shown_by.T_camera_world, turn, moving, time_s, self.gradient[at], self.hessian[at, at],
            by_parts[at],
        )  # fmt: skip

    def add_body(self, of_views: Sequence[PartSums], J: Array, by_parts: Array) -> None:
        """Add the sums of some views, and convert what they say of their cameras.

        Args:
            of_views: sums of each view.
            J: derivatives of the motions of the parts by the unknowns of the body, (n_parts, n_motions, n_body).
            by_parts: second derivatives by corrections and the motions of parts, (n_cameras, n_parts * n_motions).
        """
        n, flat = self.n_cameras, J.reshape(-1, J.shape[2])
        b, M = (np.sum(own, axis=0) for own in zip(*of_views, strict=True))
        weighted = (M[:, OF_PART, OF_PART] @ J).reshape(flat.shape)
        self.gradient[n:] += flat.T @ b[:, OF_PART].ravel()
        self.hessian[:, n:] += np.concatenate([by_parts, weighted.T]) @ flat

    def equations(self, cost: float) -> NormalEquations:
        """Return the normal equations."""
        n = self.n_cameras
        self.hessian[n:, :n] = self.hessian[:n, n:].T
        return NormalEquations(cost, self.gradient, self.hessian)
