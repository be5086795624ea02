"""Poses of a limb to try: all over its joint limits, or around a pose."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import chain_poses
from tracker.body.limbs import Limb, limb_display_name, limbs
from tracker.body.model import BodyModel
from tracker.compute.sampling import even_points
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray

_N_POSES = {"leg": 1024, "arm": 2048}
"""Poses of a limb over its joint limits; powers of two, so that they fill the space evenly. Legs turn less."""
_USUAL_RAD = np.radians(60)
"""Largest angle from hanging of half of these poses, rad: most limbs hang more or less."""
_HELD = 0.3
"""Share of the spread that joints of little spread take, such as collarbones."""


def moving_limbs(model: BodyModel) -> tuple[Limb, ...]:
    """Return the legs, then the arms: legs are larger, and no arm needs to explain their part of the silhouettes."""
    own = [limb for limb in limbs(model) if "head" not in limb.name]
    return tuple(sorted(own, key=lambda limb: _kind(limb) == "arm"))


def trunk_parts(model: BodyModel) -> IntArray:
    """Return the indices of the parts of trunk and head."""
    return np.setdiff1d(np.arange(len(model.parts)), np.concatenate([limb.parts for limb in moving_limbs(model)]))


@lru_cache(maxsize=8)
def changes_within_limits(model: BodyModel) -> tuple[Array, ...]:
    """Return for each of `moving_limbs` changes from the neutral pose all over its joint limits, (n, n_dofs).

    Poses in which the limb ends in the trunk are left out.
    """
    return tuple(_within_limits(model, limb) for limb in moving_limbs(model))


def changes_around(model: BodyModel, dofs: IntArray, n: int, spread: float, spread_m: float = 0.0) -> Array:
    """Return normally distributed changes of some degrees of freedom, (n, n_dofs).

    Args:
        model: the body.
        dofs: the degrees of freedom.
        n: number of changes, a power of two.
        spread: standard deviation of angles, rad; that of joints of little spread is smaller.
        spread_m: standard deviation of lengths, metres.
    """
    _, normal = even_points(n, len(dofs))
    sigmas = np.where(np.isfinite(model.spreads[dofs]), _HELD * spread, spread)
    return _of_dofs(model, dofs, normal * np.where(model.dof_is_length[dofs], spread_m, sigmas))


def _within_limits(model: BodyModel, limb: Limb) -> Array:
    dofs = np.flatnonzero(limb.dofs)
    even, normal = even_points(_N_POSES[_kind(limb)], len(dofs))
    low, high = model.limits[dofs].T
    low, high = np.maximum(low, -np.pi), np.minimum(high, np.pi)
    steps = low + even * (high - low)
    # Either half of the sequence fills the space evenly; every other point would not.
    half = len(steps) // 2
    steps[:half] = np.clip(steps[:half], -_USUAL_RAD, _USUAL_RAD)
    held = np.isfinite(model.spreads[dofs])
    steps[:, held] = _HELD * normal[:, held] * model.spreads[dofs][held]
    changes = _of_dofs(model, dofs, steps)
    return changes[~_in_trunk(model, limb, model.move(model.neutral(), changes))]


def _kind(limb: Limb) -> str:
    return "leg" if limb_display_name(limb.name).endswith("leg") else "arm"


def _of_dofs(model: BodyModel, dofs: IntArray, steps: Array) -> Array:
    changes = np.zeros((len(steps), model.n_dofs))
    changes[:, dofs] = steps
    return changes


def _in_trunk(model: BodyModel, limb: Limb, poses: Array) -> NDArray[np.bool_]:
    """Return for which poses, (n,), the lower half of a limb lies in the trunk or head of the neutral pose."""
    rest, inside = model.kinematics(model.neutral()), np.zeros(len(poses), bool)
    last = int(limb.parts[-1])
    ends = model.shapes[last].half_axes[2] * np.linspace(-1, 1, 3)
    Ts = chain_poses(model.tree, rest, limb.parts, poses)[:, -1]
    for end in ends:
        points = Ts[:, :3, :3] @ (model.centers_part[last] + np.array([0.0, 0.0, end])) + Ts[:, :3, 3]
        for part in trunk_parts(model):
            local = rigid.apply(rigid.inverse(rest.Ts_world_part[part]), points) - model.centers_part[part]
            inside |= model.shapes[part].inside_outside(local) < 1
    return inside
