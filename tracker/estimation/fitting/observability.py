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
from tracker.estimation.fitting.gauss_newton import JOINT_SHARE, UNKNOWN
from tracker.estimation.fitting.twists import twists_to_dofs
from tracker.evidence.contours import occluding_contours
from tracker.geometry.arrays import TINY, Array, IntArray
from tracker.geometry.cameras import Camera

OBSERVABLE_RAD, OBSERVABLE_M = float(np.radians(10.0)), 0.03
"""Largest standard deviation of an observable degree of freedom, rad and metres."""
_SHARE_OF_PRIOR = 0.8
"""Largest standard deviation of an observable degree of freedom, in that without any view."""


@dataclass(frozen=True)
class ContourNoise:
    """Noise of image contours against the contours of the true pose."""

    sigma_px: float = 1.0
    """Standard deviation across the contour, working px."""
    length_px: float = 120.0
    """Length of contour along which the error is the same, working px: edges of clothes and wrong shapes are. It is
    calibrated on five simulated people, and checked on five others (docs/measurements.md)."""
    joint_share: float = JOINT_SHARE
    """Standard deviation of the place of a joint on its parent along each axis, fraction of the body height, as in
    `acquisition.size_parameters.SizePriors`; of the root, in its own part. 0 if the body is exactly that of the
    person."""

    @property
    def information_per_px(self) -> float:
        """Information of a pixel of contour, 1/px^3."""
        return 1.0 / (self.sigma_px**2 * self.length_px)


class ViewInformation(NamedTuple):
    """Information of each view on a person's pose, and the contours that it sees."""

    cameras: tuple[str, ...]
    matrices: Array
    """Normal matrix of the degrees of freedom, and then of the places of joints on their parents, in each view,
    (V, n_dofs + n_places, n_dofs + n_places), 1/rad^2 and 1/m^2. Places of joints are unknown, but not estimated."""
    lengths_px: Array
    """Visible length of contour of each part in each view, (V, n_parts), working px."""


@dataclass(frozen=True, eq=False)
class Observability:
    """Standard deviations of the degrees of freedom of one pose, from the contours in its views."""

    model: BodyModel
    information: ViewInformation
    prior: Array
    """Information before any view is seen, (n_dofs + n_places,): that of the spreads, and next to nothing elsewhere."""

    @cached_property
    def covariance(self) -> Array:
        """Covariance with all views, (n_dofs, n_dofs), rad and metres."""
        return self._covariance(self.information.matrices.sum(axis=0))

    @cached_property
    def sigmas(self) -> Array:
        """Standard deviation with all views, (n_dofs,), rad or metres."""
        return np.sqrt(np.diag(self.covariance))

    @cached_property
    def sigmas_alone(self) -> Array:
        """Standard deviation if everything else were known, (n_dofs,), rad or metres."""
        total = np.diagonal(self.information.matrices.sum(axis=0)) + self.prior
        return 1.0 / np.sqrt(total[: self.model.n_dofs])

    @cached_property
    def sigmas_without(self) -> Array:
        """Standard deviation without each view, (V, n_dofs), rad or metres."""
        total = self.information.matrices.sum(axis=0)
        return np.array([np.sqrt(np.diag(self._covariance(total - m))) for m in self.information.matrices])

    def _covariance(self, information: Array) -> Array:
        n = self.model.n_dofs
        return np.asarray(np.linalg.inv(information + np.diag(self.prior))[:n, :n], dtype=np.float64)

    @cached_property
    def best_views(self) -> NDArray[np.int64]:
        """Index of the view that constrains each degree of freedom most, (n_dofs,): the one that is missed most."""
        return self.sigmas_without.argmax(axis=0)

    @cached_property
    def is_observable(self) -> NDArray[np.bool_]:
        """Whether the views determine a degree of freedom, (n_dofs,), and not its spread alone."""
        limits = np.where(self.model.dof_is_length, OBSERVABLE_M, OBSERVABLE_RAD)
        return self.sigmas <= np.minimum(limits, _SHARE_OF_PRIOR / np.sqrt(self.prior[: self.model.n_dofs]))

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
        n = self.model.n_dofs
        total = self.information.matrices[:, :n, :n].sum(axis=0)
        scale = np.sqrt(np.maximum(np.diag(total), np.finfo(np.float64).tiny))
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
    model, noise = bodies[person].model, noise or ContourNoise()
    return Observability(model, view_information(bodies, cameras, person, noise), prior_information(model, noise))


def prior_information(model: BodyModel, noise: ContourNoise) -> Array:
    """Return the information before any view is seen, (n_dofs + n_places,), 1/rad^2 or 1/m^2; see `ViewInformation`."""
    places_m = np.full(_n_places(model, noise), noise.joint_share * model.height_m)
    return 1.0 / np.concatenate([np.minimum(model.spreads, UNKNOWN), places_m]) ** 2


def view_information(
    bodies: Sequence[PosedBody], cameras: Sequence[Camera], person: int, noise: ContourNoise
) -> ViewInformation:
    """Return the normal matrix of a person's visible contours in each view.

    The row of a piece is `normal . J_I A J_H` (KRH08 Eq. 55). The sliding term is left out, because a contour slides
    along itself.
    """
    model = bodies[person].model
    own, motions = parts_of([b.model for b in bodies], person), _motions(bodies[person], noise)
    n = len(motions.order)
    gradient, hessian, matrices, lengths = np.empty(n), np.empty((n, n)), [], []
    for camera in cameras:
        twists, length_px = _part_twists(bodies, camera, own, noise)
        twists_to_dofs(
            twists, np.zeros(twists.shape[:2]), motions.axes, motions.origins, motions.is_length, motions.parts,
            model.tree.parents, motions.moves, gradient, hessian,
        )  # fmt: skip
        matrices.append(hessian[np.ix_(motions.order, motions.order)])
        lengths.append(length_px)
    return ViewInformation(tuple(c.name for c in cameras), np.array(matrices), np.array(lengths))


class _Motions(NamedTuple):
    """Degrees of freedom and places of joints in the order of the parts that they move, as `twists_to_dofs` wants."""

    axes: Array
    origins: Array
    is_length: NDArray[np.bool_]
    parts: IntArray
    moves: NDArray[np.bool_]
    order: IntArray
    """Index into these of each degree of freedom, then of each place of a joint."""


def _n_places(model: BodyModel, noise: ContourNoise) -> int:
    return 3 * len(model.parts) if noise.joint_share else 0


def _motions(body: PosedBody, noise: ContourNoise) -> _Motions:
    model, kinematics = body.model, body.kinematics
    joints = np.repeat(np.arange(len(model.parts)), 3)[: _n_places(model, noise)]
    # A joint moves along the axes of its parent, and all that it carries with it; the root within its own part.
    parents = np.maximum(np.array(model.parents)[joints], 0)
    along = kinematics.Ts_world_part[parents, :3, np.tile(np.arange(3), len(parents) // 3)]
    carried = _carried(model)[joints]
    parts = np.concatenate([model.dof_joint, joints])
    sorted_ = np.argsort(parts, kind="stable")
    return _Motions(
        np.concatenate([kinematics.axes_world, along])[sorted_],
        np.concatenate([kinematics.origins_world, np.zeros_like(along)])[sorted_],
        np.concatenate([model.dof_is_length, np.ones(len(joints), bool)])[sorted_],
        parts[sorted_],
        np.concatenate([model.moves, carried])[sorted_],
        np.argsort(sorted_, kind="stable"),
    )


def _carried(model: BodyModel) -> NDArray[np.bool_]:
    """Return whether a joint carries a part, (n_parts, n_parts)."""
    out = np.eye(len(model.parts), dtype=bool)
    for part, parent in enumerate(model.parents):
        if parent >= 0:
            out[:, part] |= out[:, parent]
    return out


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
    normals = np.stack([-steps[:, 1], steps[:, 0]], axis=1) / np.maximum(lengths, TINY)[:, None]
    _, J = camera.project_with_jacobian(points)
    gradients = np.einsum("ni,nij->nj", normals, J)
    rows = np.concatenate([np.cross(points, gradients), gradients], axis=1)
    out = np.zeros((n_parts, 6, 6))
    weights = noise.information_per_px * lengths
    np.add.at(out, parts, weights[:, None, None] * rows[:, :, None] * rows[:, None, :])
    return out, np.bincount(parts, lengths, n_parts).astype(np.float64)
