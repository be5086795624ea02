"""How well the contours in the views constrain each degree of freedom of a pose.

The normal matrix of the contours is that of `contour_residuals` where every visible contour lies on an edge. It needs
no image: a posed body and the cameras suffice, so that cameras that do not exist can be judged too. KRH08 Sect. 5.4
asks for its rank; here the standard deviations that follow from it answer for each degree of freedom.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody, parts_of
from tracker.contours import occluding_contours
from tracker.fitting.twists import twists_to_dofs
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import Camera

OBSERVABLE_RAD, OBSERVABLE_M = float(np.radians(10.0)), 0.03
"""Largest standard deviation of an observable degree of freedom, rad and metres."""
_SHARE_OF_PRIOR = 0.8
"""Largest standard deviation of an observable degree of freedom, in that without any view."""
_UNKNOWN = 1.0
"""Standard deviation of a degree of freedom before any view is seen, rad or metres."""


@dataclass(frozen=True)
class ContourNoise:
    """Noise of image contours against the contours of the true pose."""

    sigma_px: float = 1.0
    """Standard deviation across the contour, working px."""
    length_px: float = 80.0
    """Length of contour along which the error is the same, working px: edges of clothes and wrong shapes are."""

    @property
    def information_per_px(self) -> float:
        """Information of a pixel of contour, 1/px^3."""
        return 1.0 / (self.sigma_px**2 * self.length_px)


class ViewInformation(NamedTuple):
    """What each view sees of a person's contours."""

    cameras: tuple[str, ...]
    matrices: Array
    """Normal matrix of the degrees of freedom in each view, (V, n_dofs, n_dofs), 1/rad^2 and 1/m^2."""
    lengths_px: Array
    """Visible length of contour of each part in each view, (V, n_parts), working px."""


@dataclass(frozen=True, eq=False)
class Observability:
    """Standard deviations of the degrees of freedom of one pose, from the contours in its views."""

    model: BodyModel
    information: ViewInformation
    prior: Array
    """Information before any view is seen, (n_dofs,): that of the spreads, and next to nothing elsewhere."""

    @cached_property
    def covariance(self) -> Array:
        """Covariance with all views, (n_dofs, n_dofs), rad and metres."""
        return _inverse(self.information.matrices.sum(axis=0), self.prior)

    @cached_property
    def sigmas(self) -> Array:
        """Standard deviation with all views, (n_dofs,), rad or metres."""
        return np.sqrt(np.diag(self.covariance))

    @cached_property
    def sigmas_alone(self) -> Array:
        """Standard deviation if all other degrees of freedom were known, (n_dofs,), rad or metres."""
        return 1.0 / np.sqrt(np.diagonal(self.information.matrices.sum(axis=0)) + self.prior)

    @cached_property
    def sigmas_without(self) -> Array:
        """Standard deviation without each view, (V, n_dofs), rad or metres."""
        total = self.information.matrices.sum(axis=0)
        return np.array([np.sqrt(np.diag(_inverse(total - m, self.prior))) for m in self.information.matrices])

    @cached_property
    def best_views(self) -> NDArray[np.int64]:
        """Index of the view that constrains each degree of freedom most, (n_dofs,): the one that is missed most."""
        return self.sigmas_without.argmax(axis=0)

    @cached_property
    def is_observable(self) -> NDArray[np.bool_]:
        """Whether the views determine a degree of freedom, (n_dofs,), and not its spread alone."""
        limits = np.where(self.model.dof_is_length, OBSERVABLE_M, OBSERVABLE_RAD)
        return self.sigmas <= np.minimum(limits, _SHARE_OF_PRIOR / np.sqrt(self.prior))

    @cached_property
    def correlations(self) -> Array:
        """Correlations of the degrees of freedom, (n_dofs, n_dofs)."""
        return self.covariance / np.outer(self.sigmas, self.sigmas)

    @property
    def rank(self) -> int:
        """Rank of the normal matrix of all views, scaled to unit diagonal (KRH08 Sect. 5.4)."""
        return int(np.sum(self._eigenvalues > len(self._eigenvalues) * np.finfo(np.float32).eps))

    @property
    def condition(self) -> float:
        """Condition number of the same matrix; infinite where it is singular."""
        values = self._eigenvalues
        return float(values[-1] / values[0]) if values[0] > 0 else np.inf

    @cached_property
    def _eigenvalues(self) -> Array:
        total = self.information.matrices.sum(axis=0)
        scale = np.sqrt(np.maximum(np.diag(total), 1e-300))
        return np.linalg.eigvalsh(total / np.outer(scale, scale))


def observe_pose(
    bodies: Sequence[PosedBody], cameras: Sequence[Camera], person: int = 0, noise: ContourNoise | None = None
) -> Observability:
    """Return how well some views constrain the pose of a person.

    Args:
        bodies: all people in their poses; the others occlude.
        cameras: the views, in working pixels.
        person: index of the person.
        noise: of the contours.
    """
    model = bodies[person].model
    return Observability(model, view_information(bodies, cameras, person, noise), prior_information(model))


def prior_information(model: BodyModel) -> Array:
    """Return the information on a pose before any view is seen, (n_dofs,), 1/rad^2 or 1/m^2."""
    return 1.0 / np.minimum(model.spreads, _UNKNOWN) ** 2


def view_information(
    bodies: Sequence[PosedBody], cameras: Sequence[Camera], person: int = 0, noise: ContourNoise | None = None
) -> ViewInformation:
    """Return the normal matrix of a person's visible contours in each view.

    The row of a piece is `normal . J_I A J_H` (KRH08 Eq. 55). The sliding term is left out, because a contour slides
    along itself.
    """
    noise, body = noise or ContourNoise(), bodies[person]
    model, kinematics = body.model, body.kinematics
    own = parts_of([b.model for b in bodies], person)
    matrices, lengths = [], []
    for camera in cameras:
        twists, length_px = _part_twists(bodies, camera, own, noise)
        gradient, hessian = np.empty(model.n_dofs), np.empty((model.n_dofs, model.n_dofs))
        twists_to_dofs(
            twists, np.zeros(twists.shape[:2]), kinematics.axes_world, kinematics.origins_world, model.dof_is_length,
            model.dof_joint, model.tree.parents, model.moves, gradient, hessian,
        )  # fmt: skip
        matrices.append(hessian)
        lengths.append(length_px)
    return ViewInformation(tuple(c.name for c in cameras), np.array(matrices), np.array(lengths))


def _part_twists(bodies: Sequence[PosedBody], camera: Camera, own: slice, noise: ContourNoise) -> tuple[Array, Array]:
    """Return the normal matrix of each part's twist in a view, (n_parts, 6, 6), and its visible contour, (n_parts,)."""
    seen, n_parts = occluding_contours.trace(bodies, camera), own.stop - own.start
    ends = seen.pieces_px.astype(np.float64).reshape(-1, 2, 2)
    middles = ends.mean(axis=1)
    inside = np.all((middles >= 0) & (middles <= np.array(camera.size) - 1), axis=1)
    at = ~seen.occluded & inside & (seen.parts >= own.start) & (seen.parts < own.stop)
    parts, points, steps = (
        seen.parts[at] - own.start,
        seen.points_world[at].astype(np.float64),
        np.diff(ends[at], axis=1)[:, 0],
    )
    lengths = np.linalg.norm(steps, axis=1)
    normals = np.stack([-steps[:, 1], steps[:, 0]], axis=1) / np.maximum(lengths, 1e-9)[:, None]
    _, J = camera.project_with_jacobian(points)
    gradients = np.einsum("ni,nij->nj", normals, J)
    rows = np.concatenate([np.cross(points, gradients), gradients], axis=1)
    out = np.zeros((n_parts, 6, 6))
    weights = noise.information_per_px * lengths
    np.add.at(out, parts, weights[:, None, None] * rows[:, :, None] * rows[:, None, :])
    return out, np.bincount(parts, lengths, n_parts).astype(np.float64)


def _inverse(information: Array, prior: Array) -> Array:
    return np.asarray(np.linalg.inv(information + np.diag(prior)))
