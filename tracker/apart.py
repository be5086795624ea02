"""Parts of one body do not pass through each other: a residual block that pushes them apart.

Flesh gives way and shapes are coarse, so only what lies deep within another part counts. Where two limbs claim one
outline in the images this is what tells that one of them belongs elsewhere.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.body import BodyModel
from tracker.fit import Normal, normal_of
from tracker.kinematics import IntArray, Kinematics
from tracker.rigid import Array
from tracker.surfaces import surfaces_of

_SAMPLES = 5
"""Points along the axis of each part that are asked whether they lie within another part."""


@dataclass(frozen=True, eq=False)
class KeepApart:
    """Pushes points on the axes of parts out of the other parts that do not adjoin theirs; see `fit.Block`."""

    sigma_m: float = 0.02
    """Depth that is as unlikely as one standard deviation, metres."""
    softness: float = 0.6
    """Share of a part's radius that may be pressed in without cost."""

    def normal(self, model: BodyModel, values: Array, kinematics: Kinematics) -> Normal:
        """See `fit.Block`."""
        depths, points, normals, own, other = _contacts(
            model, kinematics, may_touch(model, self.softness), self.softness
        )
        if not len(depths):
            n = model.n_dofs
            return Normal(0.0, np.zeros(n), np.zeros((n, n)))
        # The two parts move against each other at the point where they touch.
        relative = model.point_jacobian(kinematics, own, points) - model.point_jacobian(kinematics, other, points)
        weight = 1 / (self.sigma_m * np.sqrt(_SAMPLES))
        return normal_of(weight * depths, -weight * np.einsum("ni,nik->nk", normals, relative))


def _contacts(
    model: BodyModel, kinematics: Kinematics, apart: NDArray[np.bool_], softness: float
) -> tuple[Array, Array, Array, IntArray, IntArray]:
    """Depth (n,), place and outward normal in the world (n, 3), and the two parts (n,) of each contact."""
    room = len(model.parts) ** 2 * _SAMPLES
    rows, parts = np.empty((room, 7)), np.empty((room, 2), np.int64)
    half_axes = surfaces_of((model,)).half_axes
    n = _touch(kinematics.Ts_world_part, model.centers_part, half_axes, apart, softness, rows, parts)
    return rows[:n, 0], rows[:n, 1:4], rows[:n, 4:], parts[:n, 0], parts[:n, 1]


@lru_cache(maxsize=32)
def may_touch(model: BodyModel, softness: float) -> NDArray[np.bool_]:
    """Which parts are apart in a body that stands at ease: neither adjoining nor overlapping then, (P, P)."""
    everything = ~np.eye(len(model.parts), dtype=bool)
    *_, own, other = _contacts(model, model.kinematics(model.neutral()), everything, softness)
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
