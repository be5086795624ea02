"""Parts do not pass through each other, those of one body or of several: residual blocks that push them apart.

Flesh gives way and shapes are coarse, so only what lies deep within another part counts. Where two limbs claim one
outline in the images this is what tells that one of them belongs elsewhere.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.body import Body, BodyModel
from tracker.fit import Normal, normal_of
from tracker.kinematics import IntArray, Kinematics
from tracker.rigid import Array
from tracker.surfaces import surfaces_of

_SAMPLES = 5
"""Points along the axis of each part that are asked whether they lie within another part."""
SIGMA_M = 0.02
"""Depth that is as unlikely as one standard deviation, metres."""
SOFTNESS = 0.6
"""Share of a part's radius that may be pressed in without cost."""


@dataclass(frozen=True, eq=False)
class KeepApart:
    """Pushes points on the axes of parts out of the other parts that do not adjoin theirs; see `fit.Block`."""

    sigma_m: float = SIGMA_M
    """Depth that is as unlikely as one standard deviation, metres."""
    softness: float = SOFTNESS
    """Share of a part's radius that may be pressed in without cost."""

    def normal(self, model: BodyModel, values: Array, kinematics: Kinematics) -> Normal:
        """See `fit.Block`."""
        depths, points, normals, own, other = _contacts(
            (model,), kinematics.Ts_world_part, may_touch(model, self.softness), self.softness
        )
        if not len(depths):
            return _nothing(model)
        # The two parts move against each other at the point where they touch.
        relative = model.point_jacobian(kinematics, own, points) - model.point_jacobian(kinematics, other, points)
        weight = 1 / (self.sigma_m * np.sqrt(_SAMPLES))
        return normal_of(weight * depths, -weight * np.einsum("ni,nik->nk", normals, relative))


class KeepBodiesApart:
    """Pushes one person's parts out of those of the others, who stand where they are; see `fit.Block`.

    Points on the axes of both count: a thin part may lie within a thick one whoever's it is.
    """

    def __init__(
        self, bodies: Sequence[Body], person: int, weight: float, sigma_m: float = SIGMA_M, softness: float = SOFTNESS
    ) -> None:
        """Take the others' parts where they are.

        Args:
            bodies: everybody.
            person: index of the body that is fitted.
            weight: of the squared depths; 1 takes `sigma_m` at its word.
            sigma_m: depth that is as unlikely as one standard deviation, metres.
            softness: share of a part's radius that may be pressed in without cost.
        """
        self._models = tuple(b.model for b in bodies)
        self._Ts = np.concatenate([b.model.kinematics(b.values).Ts_world_part for b in bodies])
        first = sum(len(m.parts) for m in self._models[:person])
        self._own = slice(first, first + len(self._models[person].parts))
        mine = np.zeros(len(self._Ts), dtype=bool)
        mine[self._own] = True
        self._apart = mine[:, None] != mine
        self._weight, self._softness = np.sqrt(weight) / (sigma_m * np.sqrt(_SAMPLES)), softness

    def normal(self, model: BodyModel, values: Array, kinematics: Kinematics) -> Normal:
        """See `fit.Block`."""
        self._Ts[self._own] = kinematics.Ts_world_part
        depths, points, normals, parts, others = _contacts(self._models, self._Ts, self._apart, self._softness)
        if not len(depths):
            return _nothing(model)
        # Of each pair one part is the person's: that of the point, which leaves along the normal, or the other.
        first, last = self._own.start, self._own.stop
        of_point = (parts >= first) & (parts < last)
        outward = np.where(of_point[:, None], normals, -normals)
        moves = model.point_jacobian(kinematics, np.where(of_point, parts, others) - first, points)
        return normal_of(self._weight * depths, -self._weight * np.einsum("ni,nik->nk", outward, moves))


def _nothing(model: BodyModel) -> Normal:
    n = model.n_dofs
    return Normal(0.0, np.zeros(n), np.zeros((n, n)))


def _contacts(
    models: tuple[BodyModel, ...], Ts: Array, apart: NDArray[np.bool_], softness: float
) -> tuple[Array, Array, Array, IntArray, IntArray]:
    """Depth (n,), place and outward normal in the world (n, 3), and the two parts (n,) of each contact.

    Args:
        models: all bodies.
        Ts: world poses of all their parts, (P, 4, 4).
        apart: which of these are to be apart, (P, P).
        softness: see `KeepApart`.
    """
    room = int(np.count_nonzero(apart)) * _SAMPLES
    rows, parts = np.empty((room, 7)), np.empty((room, 2), np.int64)
    surfaces = surfaces_of(models)
    n = _touch(Ts, surfaces.centers, surfaces.half_axes, apart, softness, rows, parts)
    return rows[:n, 0], rows[:n, 1:4], rows[:n, 4:], parts[:n, 0], parts[:n, 1]


@lru_cache(maxsize=32)
def may_touch(model: BodyModel, softness: float) -> NDArray[np.bool_]:
    """Which parts are apart in a body that stands at ease: neither adjoining nor overlapping then, (P, P)."""
    everything = ~np.eye(len(model.parts), dtype=bool)
    *_, own, other = _contacts((model,), model.kinematics(model.neutral()).Ts_world_part, everything, softness)
    for part, parent in enumerate(model.parents):
        if parent >= 0:
            everything[part, parent] = everything[parent, part] = False
    everything[own, other] = everything[other, own] = False
    return everything


@njit(nogil=True, cache=True)
def _touch(
    Ts: Array, centers: Array, half_axes: Array, apart: NDArray[np.bool_], softness: float, rows: Array, parts: IntArray
) -> int:
    """List the contacts: depth, point, outward normal of the other part; the part of the point and the other one.

    A part counts as the elliptic cylinder about its axis, the distance to it along the line from the axis.
    """
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
                from_axis = max(1e-6, np.sqrt(local[0] ** 2 + local[1] ** 2))
                rho = max(1e-6, np.sqrt((local[0] / a1) ** 2 + (local[1] / a2) ** 2))
                depth = radius - (from_axis - from_axis / rho) - (1.0 - softness) * min(a1, a2)
                if depth <= 0.0:
                    continue
                nx, ny = local[0] / from_axis, local[1] / from_axis
                if from_axis <= 1e-6:
                    nx, ny = 1.0, 0.0
                rows[n, 0] = depth
                for i in range(3):
                    rows[n, 1 + i] = X[i]
                    rows[n, 4 + i] = Ts[other, i, 0] * nx + Ts[other, i, 1] * ny
                parts[n, 0], parts[n, 1] = own, other
                n += 1
    return n
