"""Residuals of pins: image positions that a user assigns to points of the body.

Positions are undistorted pixels here; the store holds original pixels.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel
from tracker.estimation.fitting.gauss_newton import NormalEquations, normal_equations
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import Camera, project_with_jacobian
from tracker.geometry.triangulation import PointObservation, sigma_px


@dataclass(frozen=True, eq=False)
class PinBlock:
    """Points of the body drawn to their pins; see `ResidualBlock`.

    The residual of a pin is its distance in the image in standard deviations, component by component. It is not robust:
    a user's pin counts fully, and a wrong one is then easy to see.
    """

    cameras: tuple[Camera, ...]
    """Camera of each pin, without its lens, (N,)."""
    points: IntArray
    """Indices into `BodyModel.point_names`, (N,)."""
    positions_px: Array
    """Positions of the pins, undistorted px, (N, 2)."""
    sigmas_px: Array
    """Standard deviation of each pin, (N,), px."""

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        r, by_points = self.residuals(model, kinematics)
        rows = by_points @ model.points_with_jacobian(kinematics, self.points)[1]
        return normal_equations(r.ravel(), rows.reshape(-1, model.n_dofs))

    def widened(self, factor: float) -> "PinBlock":
        """Return the same pins with standard deviations that are larger by a factor."""
        return replace(self, sigmas_px=self.sigmas_px * factor)

    def residuals(self, model: BodyModel, kinematics: Kinematics) -> tuple[Array, Array]:
        """Return the weighted residuals, (N, 2), and their derivatives by the points, (N, 2, 3), per metre."""
        points_px, px_by_point = project_with_jacobian(*self._projections, model.points_at(kinematics, self.points))
        r = (points_px - self.positions_px) / self.sigmas_px[:, None]
        return r, px_by_point / self.sigmas_px[:, None, None]

    @cached_property
    def _projections(self) -> tuple[Array, Array]:
        """Inverse pose, (N, 4, 4), and camera matrix, (N, 3, 3), of each pin's camera."""
        return np.stack([c.T_camera_world for c in self.cameras]), np.stack([c.K for c in self.cameras])


def pin_block(model: BodyModel, cameras: Sequence[Camera], pins: Sequence[PointObservation]) -> PinBlock:
    """Return the residual block of the pins of one person.

    Args:
        model: the person's body.
        cameras: all views; their distortion is ignored.
        pins: at least one.
    """
    seen_by = [cameras[p.camera] for p in pins]
    points = np.array([model.point_names.index(p.point) for p in pins], dtype=np.int64)
    return PinBlock(
        tuple(c.pinhole for c in seen_by),
        points,
        np.array([p.position_px for p in pins]),
        np.array([sigma_px(c) for c in seen_by]),
    )
