"""How the points of a body move: their accelerations follow Student's t, with a scale for each limb.

A Gaussian would smooth a fast arm away: most of the time a limb hardly accelerates, and then much. Student's t with few
degrees of freedom has room for both (K. L. Lange, R. J. A. Little, J. M. G. Taylor 1989, J. Am. Stat. Assoc. 84:881,
who recommend four where they are not estimated).

Points outnumber the degrees of freedom that move them. The squares of all points of a limb together therefore count as
those of its degrees of freedom: their sum in units of the scale has the mean d.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tracker.body.dimensions import main_axis
from tracker.body.kinematics import Kinematics, place_points
from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.geometry.arrays import Array, IntArray, Mask

FREEDOM = 4.0
"""Degrees of freedom of Student's t, ν."""
_RADIUS_M = 0.05
"""Distance from the axis of a part of the points that show its twist, metres: turning an outstretched limb moves none
of its joints. It is the radius of gyration of a limb about its own axis."""
LEARNING_ROUNDS = 10
"""Rounds of expectation maximization. With three and with thirty, the mean error of joints differs by 0.04 mm on `walk`
and on a simulated child."""
FLOOR_M2 = 1e-9
"""Smallest square of a scale, m² or rad²: that of 0.03 mm, below all that cameras of people resolve. With 0 matrices
would be singular."""


class Group(NamedTuple):
    """Points that accelerate together: those of a limb, or of the trunk."""

    points: Mask
    """Which of the points belong to it, (P,)."""
    n_dofs: float
    """Number of degrees of freedom of the limb, or of the rest of the body."""


@dataclass(frozen=True, eq=False)
class MotionPoints:
    """Points of a body whose motion shows that of all its degrees of freedom: joints, landmarks, and two points beside
    the axis of each part."""

    model: BodyModel
    parts: IntArray
    """Index of the part of each, (P,)."""
    points_part: Array
    """Their places in the frames of these parts, (P, 3), metres."""
    groups: tuple[Group, ...]

    def at(self, kinematics: Kinematics) -> Array:
        """Return their places at a pose, (P, 3), metres, world."""
        Ts = kinematics.Ts_world_part[self.parts]
        return np.asarray(np.einsum("pij,pj->pi", Ts[:, :3, :3], self.points_part) + Ts[:, :3, 3])

    def linearized(self, poses: Array) -> tuple[Array, Array]:
        """Return their places in poses, (T, n_values), (T, P, 3), and the derivatives, (T, 3 P, n_dofs), metres per rad
        or metre."""
        model, places = self.model, np.empty((len(poses), len(self.parts), 3))
        J = np.empty((*places.shape, model.n_dofs))
        place_points(poses, model.tree, model.dof_is_length, model.moves, self.parts, self.points_part, places, J)
        return places, J.reshape(len(J), -1, model.n_dofs)


@lru_cache(maxsize=16)
def motion_points(model: BodyModel) -> MotionPoints:
    """Return the points of a body that show its motion."""
    parts, local = [*model.point_parts.tolist()], [*model.points_part]
    for i, center in enumerate(model.centers_part):
        for axis in set(range(3)) - {main_axis(model, i)}:
            parts.append(i)
            local.append(center + _RADIUS_M * np.eye(3)[axis])
    of_limbs = [np.isin(parts, limb.parts) for limb in limbs(model)]
    n_dofs = [float(np.count_nonzero(limb.dofs)) for limb in limbs(model)]
    rest = ~np.any(of_limbs, axis=0) if of_limbs else np.ones(len(parts), bool)
    groups = [Group(*own) for own in zip(of_limbs, n_dofs, strict=True)]
    return MotionPoints(model, np.array(parts), np.array(local), (*groups, Group(rest, model.n_dofs - sum(n_dofs))))


@dataclass(frozen=True, eq=False)
class MotionModel:
    """Student's t of the accelerations of the groups of points of a body."""

    groups: tuple[Group, ...]
    scales_m2: Array
    """Squared scale of each group, square metres a frame⁴, (G,)."""
    freedom: float = FREEDOM
    """Degrees of freedom of Student's t; infinite for a Gaussian."""

    @classmethod
    def learned(
        cls, groups: tuple[Group, ...], squares_m2: Array, before: "MotionModel | None" = None
    ) -> "MotionModel":
        """Return the model under which accelerations are likeliest, by a step of expectation maximization.

        Args:
            groups: of the body.
            squares_m2: expected squared acceleration of each point, (T, P), square metres a frame⁴.
            before: the model of the step before; None begins with medians over time.
        """
        known = np.median(squares_m2, axis=0)[None] if before is None else squares_m2 * before.weights(squares_m2)
        scales = [known[:, g.points].sum(axis=1).mean() / max(1.0, g.n_dofs) for g in groups]
        return cls(groups, np.maximum(scales, FLOOR_M2))

    def _sums(self, squares_m2: Array) -> Array:
        """Return the sum of squares of each group in units of its scale, (T, G)."""
        sums = [squares_m2[:, g.points].sum(axis=1) for g in self.groups]
        return np.stack(sums, axis=1) / self.scales_m2

    @property
    def _n_dofs(self) -> Array:
        return np.array([g.n_dofs for g in self.groups])

    def weights(self, squares_m2: Array) -> Array:
        """Return the weights by which Student's t counts squared accelerations, (T, P)."""
        if np.isinf(self.freedom):
            return np.ones_like(squares_m2)
        of_groups = (self.freedom + self._n_dofs) / (self.freedom + self._sums(squares_m2))
        out = np.zeros_like(squares_m2)
        for i, group in enumerate(self.groups):
            out[:, group.points] = of_groups[:, i, None]
        return out

    def point_scales_m2(self) -> Array:
        """Return the squared scale of each point, square metres a frame⁴, (P,)."""
        out = np.empty(len(self.groups[0].points))
        for group, scale in zip(self.groups, self.scales_m2, strict=True):
            out[group.points] = scale
        return out

    def nats(self, squares_m2: Array) -> float:
        """Return the cost of squared accelerations, (T, P), nats, but for a constant of the scales."""
        return float(np.sum(self.nats_of_sums(self._sums(squares_m2))))

    def nats_of_sums(self, sums: Array) -> Array:
        """Return the cost of sums of squares of each group in units of its scale, (..., G), nats, (...)."""
        if np.isinf(self.freedom):
            return np.asarray(np.sum(sums, axis=-1) / 2)
        return np.asarray(np.sum((self.freedom + self._n_dofs) / 2 * np.log1p(sums / self.freedom), axis=-1))


def acceleration(times_s: Array) -> Array:
    """Return the coefficients of three places in a row that give their acceleration per usual step², (T - 2, 3)."""
    steps = np.diff(times_s)
    if len(steps) < 2:
        return np.zeros((0, 3))
    before, after = steps[:-1], steps[1:]
    usual = float(np.median(steps))
    out = np.stack([1 / before, -1 / before - 1 / after, 1 / after], axis=1)
    return np.asarray(out * (2 * usual**2 / (before + after))[:, None])
