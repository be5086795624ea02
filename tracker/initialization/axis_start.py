"""Search the twist and the limbs of a body on its axis, coarse to fine, by the chamfer measure (GD96 Sect. 4.1).

The outlines of the silhouettes are the scene. At each of some twists the limbs are searched one after the other among
poses spread over their joint limits. The best twists are searched on at ever smaller spreads, the trunk too at the end.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tracker.body.limbs import Limb, limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.evidence.view_evidence import ViewEvidence
from tracker.fitting.gauss_newton import fit_to_points
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.initialization.body_axis import SHOULDERS, BodyAxis
from tracker.initialization.outline_evidence import REACH
from tracker.search.best_first import SearchSettings, search
from tracker.search.chamfer_cost import ChamferCost

_TRUNK = ("neck", "left_shoulder", "right_shoulder", "left_hip", "right_hip")
_N_TWISTS = 12
_PROPOSALS = 128
"""Poses of a limb that are tried at each twist; a power of two, so that they fill the space evenly."""
_USUAL_RAD = np.radians(60)
"""Largest angle from hanging of half of these poses, rad: most limbs hang more or less."""
_FINER_RAD = tuple(np.radians([30.0, 15.0, 8.0]).tolist())
"""Spreads of the poses that are tried around the best one, rad, round by round."""
_N_KEPT = 3
"""Twists that are searched on."""
_APART_RAD = np.radians(80)
"""Twists of returned starts differ by more, so that both ways of facing are among them, rad."""
_LAST = SearchSettings(
    bound_rad=float(np.radians(30)), step_rad=float(np.radians(8)), step_m=0.04, passes=(1.0, 0.5), patience=2,
    max_expansions=20, limbs_apart=True,
)  # fmt: skip


class AxisStart(NamedTuple):
    """A start pose on the axis of a body."""

    axis: BodyAxis
    pose: Array
    """(n_values,)."""
    forward: Array
    """Unit direction in which the trunk faces, (3,)."""
    cost_px: float
    """Chamfer distance between the outlines of the silhouettes and of the body, working px."""


def search_on_axes(model: BodyModel, views: Sequence[ViewEvidence], axes: Sequence[BodyAxis]) -> list[AxisStart]:
    """Return start poses of a body on one of some axes, the cheapest first, at most one for each way of facing.

    Args:
        model: the body.
        views: outlines of the silhouettes.
        axes: places of the head that are tried; at least one.
    """
    coarse = [_Coarse(axis, *start) for axis in axes for start in _coarse(model, views, axis)]
    coarse.sort(key=lambda c: c.cost_px)
    chosen = coarse[:_N_KEPT]
    # A body looks nearly the same from behind: the best twist that faces the other way is searched on too.
    chosen += [c for c in coarse[_N_KEPT:] if c.forward @ coarse[0].forward < np.cos(_APART_RAD)][:1]
    cost, found = _cost(model, views, coarse[0].pose), []
    for start in chosen:
        pose, _ = _searched(cost, model, start.pose, _FINER_RAD)
        *_, last = search(cost, [pose], _LAST)
        found.append(AxisStart(start.axis, last.best[0], start.forward, last.best_px))
    found.sort(key=lambda f: f.cost_px)
    kept: list[AxisStart] = []
    for own in found:
        if all(own.forward @ other.forward < np.cos(_APART_RAD) for other in kept):
            kept.append(own)
    return kept


class _Coarse(NamedTuple):
    axis: BodyAxis
    pose: Array
    forward: Array
    cost_px: float


def _coarse(model: BodyModel, views: Sequence[ViewEvidence], axis: BodyAxis) -> list[tuple[Array, Array, float]]:
    """Return for each twist on an axis the best pose among a few, its direction forwards and its cost, px."""
    found, near, cost = [], None, None
    for i in range(_N_TWISTS):
        R = _frame(axis.up, 2 * np.pi * i / _N_TWISTS)
        near = _trunk(model, axis, R, near)
        cost = cost or _cost(model, views, near)
        pose, px = _searched(cost, model, near, (None,))
        found.append((pose, R[:, 0], px))
    return found


def _cost(model: BodyModel, views: Sequence[ViewEvidence], pose: Array) -> ChamferCost:
    """Return the chamfer measure with all points of the outlines, however far from a pose they are."""
    reach = max(REACH * max(v.camera.size) for v in views)
    return ChamferCost(views, [PosedBody(model, pose)], reach)


def _frame(up: Array, twist: float) -> Array:
    """Return axes as columns, (3, 3): forwards, to the left and upwards along the body's axis, turned about it."""
    aside = np.eye(3)[int(np.argmin(np.abs(up)))]
    a = np.cross(up, aside)
    a /= np.linalg.norm(a)
    forward = np.cos(twist) * a + np.sin(twist) * np.cross(up, a)
    return np.column_stack([forward, np.cross(up, forward), up])


def _trunk(model: BodyModel, axis: BodyAxis, R: Array, near: Array | None) -> Array:
    """Return the pose with a straight trunk in a frame and hanging limbs, (n_values,).

    Args:
        model: the body.
        axis: where the head is.
        R: the frame, (3, 3).
        near: pose at a twist nearby, (n_values,), if there is one.
    """
    own = dict(zip(model.point_names, model.points_world(model.neutral()), strict=True))
    middle = (own["left_shoulder"] + own["right_shoulder"]) / 2
    place = rigid.transform(R, axis.top - SHOULDERS * model.height_m * axis.up)
    known = {n: rigid.apply(place, p - middle) for n, p in own.items()}
    start = near if near is not None else fit_to_points(model, {n: known[n] for n in _TRUNK if n in known}).pose
    return fit_to_points(model, known, start).pose


def _searched(cost: ChamferCost, model: BodyModel, pose: Array, spreads: Sequence[float | None]) -> tuple[Array, float]:
    """Search the limbs one after the other, round by round; return the best pose and its cost, px.

    Args:
        cost: to minimize.
        model: the body.
        pose: start, (n_values,).
        spreads: of the poses that are tried in each round, rad; None for the whole joint limits.
    """
    best_px = cost([pose]).total_px
    for spread in spreads:
        for limb in _searched_limbs(model):
            candidates = _proposals(model, limb, pose, spread)
            costs, _ = cost.of_person(0, candidates, [pose])
            i = int(np.argmin(costs))
            if costs[i] < best_px:
                pose, best_px = candidates[i], float(costs[i])
    return pose, best_px


def _searched_limbs(model: BodyModel) -> list[Limb]:
    """Return the legs, then the arms: legs are larger, and what they explain no arm needs to."""
    own = [limb for limb in limbs(model) if "head" not in limb.name]
    return sorted(own, key=lambda limb: not any(n in limb.name for n in ("calf", "foot", "leg")))


def _proposals(model: BodyModel, limb: Limb, pose: Array, spread: float | None) -> Array:
    """Return poses with the limb elsewhere, (n, n_values): around the pose, or within the joint limits if None."""
    dofs = np.flatnonzero(limb.dofs)
    even, normal = _even(_PROPOSALS, len(dofs))
    if spread is None:
        low, high = model.limits[dofs].T
        steps = np.maximum(low, -np.pi) + even * (np.minimum(high, np.pi) - np.maximum(low, -np.pi))
        steps[::2] = np.clip(steps[::2], -_USUAL_RAD, _USUAL_RAD)
        steps -= model.difference(pose, model.neutral())[dofs]
    else:
        steps = normal * spread
    # Joints of little spread, such as collarbones, stay near their usual angles.
    held = np.isfinite(model.spreads[dofs])
    steps[:, held] = 0.25 * normal[:, held] * model.spreads[dofs][held]
    changes = np.zeros((len(steps), model.n_dofs))
    changes[:, dofs] = steps
    return np.array([model.clip(model.retract(pose, change)) for change in changes])


@lru_cache(maxsize=16)
def _even(n: int, dims: int) -> tuple[Array, Array]:
    """Return points that fill the unit cube evenly, (n, dims), and the same normally distributed (Sobol sequence)."""
    # Imported lazily: these take 0.3 s to load.
    from scipy.special import ndtri
    from scipy.stats import qmc

    even = np.asarray(qmc.Sobol(dims, seed=7).random(n))
    return even, np.asarray(ndtri(0.002 + 0.996 * even))
