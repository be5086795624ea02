"""Penetration terms: residual blocks that push parts out of each other, within one body or between several.

Flesh gives way and shapes are coarse, so only deep penetration counts. If two limbs claim one contour in the images,
these terms show that one of them belongs elsewhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel, PosedBody, parts_of
from tracker.compute.jit import njit
from tracker.estimation.fitting.gauss_newton import NormalEquations
from tracker.evidence.contours.surfaces import surfaces_of
from tracker.geometry.arrays import TINY, Array, IntArray

_SAMPLES = 5
"""Sample points along the axis of each part that are tested against other parts."""
SIGMA_M = 0.02
"""Standard deviation of the depth, metres."""
SOFTNESS = 0.6
"""Share of a part's radius that may be pressed in without cost."""


@dataclass(frozen=True, eq=False)
class SelfPenetration:
    """Penetration between parts of one body that neither adjoin nor touch in the neutral pose; see `ResidualBlock`."""

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        return _linearized(self.term(model), model, kinematics)

    def term(self, model: BodyModel) -> "PenetrationTerm":
        """Return the arguments of `add_penetration` for a body."""
        Ts, apart = np.empty((len(model.parts), 4, 4)), separable_parts(model, SOFTNESS)
        return _penetration_term((model,), Ts, apart, SOFTNESS, 0, _weight(SIGMA_M))


class BodyPenetration:
    """Penetration between one person and the others, who are fixed; see `ResidualBlock`.

    Points on the axes of both count, because a thin part may lie within a thick one of either body.
    """

    def __init__(self, bodies: Sequence[PosedBody], person: int, weight: float) -> None:
        """Place the parts of the others.

        Args:
            bodies: all bodies.
            person: index of the body that is fitted.
            weight: weight of the squared depths; 1 is that of `SIGMA_M`.
        """
        self._models, self._person = tuple(b.model for b in bodies), person
        self._Ts = np.concatenate([b.kinematics.Ts_world_part for b in bodies])
        self._own = parts_of(self._models, person)
        mine = np.zeros(len(self._Ts), dtype=bool)
        mine[self._own] = True
        self._apart = mine[:, None] != mine
        self._weight = np.sqrt(weight) * _weight(SIGMA_M)

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        return _linearized(self.term(model), model, kinematics)

    def term(self, model: BodyModel) -> "PenetrationTerm":
        """Return the arguments of `add_penetration` for the person's model."""
        assert model is self._models[self._person]
        Ts = self._Ts.copy()  # several threads may call this
        return _penetration_term(self._models, Ts, self._apart, SOFTNESS, self._own.start, self._weight)


class PenetrationTerm(NamedTuple):
    """Arguments of `add_penetration`. The scratch makes it single-threaded."""

    Ts: Array
    """World poses of all parts, (P, 4, 4), metres; those of the fitted body are filled in."""
    first: int
    """Index of the first part of the fitted body."""
    centers: Array
    """Centres of all parts, see `Surfaces`, (P, 3), metres."""
    half_axes: Array
    """(P, 3), metres."""
    apart: NDArray[np.bool_]
    """Which pairs of parts must not penetrate, (P, P)."""
    softness: float
    """See `SelfPenetration`."""
    weight: float
    """Weight of the depth of one point, per metre."""
    rows: Array
    """Scratch for contacts, (room, 7), metres: depth, the point on a part's axis, and the outward normal of the other
    part there, in the world."""
    parts: IntArray
    """Index of the part of each contact's point, and of the other part, (room, 2)."""


NO_PENETRATION = PenetrationTerm(
    np.empty((0, 4, 4)), 0, np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 0), np.bool_), 0.0, 0.0,
    np.empty((0, 7)), np.empty((0, 2), np.int64),
)  # fmt: skip
"""A term that adds nothing."""


def _weight(sigma_m: float) -> float:
    """Return the weight of the depth of one point, per metre."""
    return float(1 / (sigma_m * np.sqrt(_SAMPLES)))


def _penetration_term(
    models: tuple[BodyModel, ...], Ts: Array, apart: NDArray[np.bool_], softness: float, first: int, weight: float
) -> PenetrationTerm:
    """Return a term with scratch for all possible contacts."""
    room, surfaces = int(np.count_nonzero(apart)) * _SAMPLES, surfaces_of(models)
    rows, parts = np.empty((room, 7)), np.empty((room, 2), np.int64)
    return PenetrationTerm(Ts, first, surfaces.centers, surfaces.half_axes, apart, softness, weight, rows, parts)


def _linearized(term: PenetrationTerm, model: BodyModel, kinematics: Kinematics) -> NormalEquations:
    """Return the normal equations of the depths for a body."""
    n = model.n_dofs
    gradient, hessian = np.zeros(n), np.zeros((n, n))
    cost = add_penetration(term, kinematics, model.dof_is_length, model.moves, gradient, hessian)
    return NormalEquations(cost, gradient, hessian)


@lru_cache(maxsize=32)
def separable_parts(model: BodyModel, softness: float) -> NDArray[np.bool_]:
    """Return which parts of a body must not penetrate, (P, P): neither adjoining nor overlapping in the neutral
    pose."""
    everything = ~np.eye(len(model.parts), dtype=bool)
    at_ease = _penetration_term((model,), model.kinematics(model.neutral()).Ts_world_part, everything, softness, 0, 0.0)
    own, other = at_ease.parts[: _list_contacts(at_ease)].T
    for part, parent in enumerate(model.parents):
        if parent >= 0:
            everything[part, parent] = everything[parent, part] = False
    everything[own, other] = everything[other, own] = False
    return everything


@njit(nogil=True, cache=True)
def _list_contacts(bodies: PenetrationTerm) -> int:
    """List the contacts: depth, point and normal of the other part; part of the point and the other part.

    A part is treated as the elliptic cylinder about its axis. The distance to it is measured along the line from the
    axis.
    """
    Ts, _, centers, half_axes, apart, softness, _, rows, parts = bodies
    n, n_parts = 0, Ts.shape[0]
    X, local = np.empty(3), np.empty(3)
    for own in range(n_parts):
        radius = softness * min(half_axes[own, 0], half_axes[own, 1])
        for sample in range(_SAMPLES):
            z = centers[own, 2] + half_axes[own, 2] * 0.9 * (2.0 * sample / (_SAMPLES - 1) - 1.0)
            for i in range(3):
                X[i] = Ts[own, i, 0] * centers[own, 0] + Ts[own, i, 1] * centers[own, 1] + Ts[own, i, 2] * z
                X[i] += Ts[own, i, 3]
            for other in range(n_parts):
                if not apart[own, other]:
                    continue
                a1, a2, a3 = half_axes[other, 0], half_axes[other, 1], half_axes[other, 2]
                for i in range(3):
                    local[i] = -centers[other, i]
                    for k in range(3):
                        local[i] += Ts[other, k, i] * (X[k] - Ts[other, k, 3])
                if abs(local[2]) > a3:
                    continue
                from_axis = max(TINY, np.sqrt(local[0] ** 2 + local[1] ** 2))
                rho = max(TINY, np.sqrt((local[0] / a1) ** 2 + (local[1] / a2) ** 2))
                depth = radius - (from_axis - from_axis / rho) - (1.0 - softness) * min(a1, a2)
                if depth <= 0.0:
                    continue
                nx, ny = local[0] / from_axis, local[1] / from_axis
                if from_axis <= TINY:
                    nx, ny = 1.0, 0.0
                rows[n, 0] = depth
                for i in range(3):
                    rows[n, 1 + i] = X[i]
                    rows[n, 4 + i] = Ts[other, i, 0] * nx + Ts[other, i, 1] * ny
                parts[n, 0], parts[n, 1] = own, other
                n += 1
    return n


@njit(nogil=True, cache=True)
def add_penetration(
    term: PenetrationTerm, kinematics: Kinematics, is_length: NDArray[np.bool_], moves: NDArray[np.bool_],
    gradient: Array, hessian: Array,
) -> float:  # fmt: skip
    """Add the normal equations of the weighted depths, (n_dofs,) and (n_dofs, n_dofs); return half their squares."""
    if term.Ts.shape[0] == 0:
        return 0.0
    own = kinematics.Ts_world_part
    for part in range(own.shape[0]):
        for i in range(4):
            for k in range(4):
                term.Ts[term.first + part, i, k] = own[part, i, k]
    n = _list_contacts(term)
    rows, parts = term.rows[:n], term.parts[:n]
    return _accumulate(rows, parts, term.first, term.weight, kinematics, is_length, moves, gradient, hessian)


@njit(nogil=True, cache=True)
def _accumulate(
    rows: Array, parts: IntArray, first: int, weight: float, kinematics: Kinematics, is_length: NDArray[np.bool_],
    moves: NDArray[np.bool_], gradient: Array, hessian: Array,
) -> float:  # fmt: skip
    """Add the normal equations of contacts, (n, 7) and (n, 2); return half their squares.

    A rotation about a through o moves a point X of a part by a x (X - o), hence along the normal n by a . (X - o) x n.
    Only the relative motion of the two parts counts.
    """
    n_dofs, n_parts, cost = moves.shape[0], moves.shape[1], 0.0
    row, felt = np.empty(n_dofs), np.empty(n_dofs, np.int64)
    for c in range(rows.shape[0]):
        r = weight * rows[c, 0]
        cost += 0.5 * r * r
        x, y, z, nx, ny, nz = rows[c, 1], rows[c, 2], rows[c, 3], rows[c, 4], rows[c, 5], rows[c, 6]
        own, other, n = parts[c, 0] - first, parts[c, 1] - first, 0
        for k in range(n_dofs):
            sign = 0.0
            if 0 <= own < n_parts and moves[k, own]:
                sign -= 1.0
            if 0 <= other < n_parts and moves[k, other]:
                sign += 1.0
            if sign == 0.0:
                continue
            a, o = kinematics.axes_world[k], kinematics.origins_world[k]
            slope = a[0] * nx + a[1] * ny + a[2] * nz
            if not is_length[k]:
                dx, dy, dz = x - o[0], y - o[1], z - o[2]
                slope = a[0] * (dy * nz - dz * ny) + a[1] * (dz * nx - dx * nz) + a[2] * (dx * ny - dy * nx)
            row[n], felt[n] = sign * weight * slope, k
            n += 1
        for i in range(n):
            gradient[felt[i]] += r * row[i]
            for j in range(n):
                hessian[felt[i], felt[j]] += row[i] * row[j]
    return cost
