"""Search the twist and the limbs of a body on its axis, coarse to fine, by the silhouettes (GD96 Sect. 4.1).

At each of some twists the limbs are searched among poses spread over their joint limits, one after the other. The best
twists are refined, trunk and limbs in turn, at ever smaller spreads.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import chain_poses
from tracker.body.limbs import Limb
from tracker.body.model import BodyModel, PosedBody
from tracker.estimation.fitting.gauss_newton import fit_to_points, value_mask
from tracker.estimation.fitting.gauss_newton_compiled import solve_compiled_or_plain
from tracker.estimation.fitting.hypothesis import Hypothesis, distinct
from tracker.estimation.initialization.generators import limb_poses
from tracker.estimation.initialization.generators.body_axis import BodyAxis
from tracker.estimation.initialization.generators.silhouette_overlap import SilhouetteOverlap
from tracker.estimation.initialization.generators.standing_body import typical_person
from tracker.evidence.voxels.voxel_grid import VOXEL_M
from tracker.formats.model_toml import DEFAULT_HEIGHT_M
from tracker.geometry import rigid
from tracker.geometry.arrays import Array

_TRUNK = ("neck", "left_shoulder", "right_shoulder", "left_hip", "right_hip")
_N_TWISTS = 12
"""Twists about the axis that are tried, 30 degrees apart."""
_N_FINER = 64
"""Poses that are tried around the best one of trunk and of each limb in each round, a power of two."""


def search_on_axes(model: BodyModel, overlap: SilhouetteOverlap, axes: Sequence[BodyAxis]) -> list[Hypothesis]:
    """Return distinct starts of a body on one of some axes, the best first; costs are those of `SilhouetteOverlap`.

    Args:
        model: the body.
        overlap: with the silhouettes of the person.
        axes: places of the head that are tried; at least one.
    """
    search = _Search(model, overlap)
    coarse = sorted((h for axis in axes for h in _coarse(search, axis)), key=lambda h: h.cost)
    # A body looks nearly the same from behind: as many twists are searched on as one axis has that face each way.
    ways = [[h for h in coarse if h.faces_away_from(coarse[0]) is away][: _N_TWISTS // 2] for away in (False, True)]
    found = []
    for start in (h for way in ways for h in way):
        pose, cost = search.refined(start.pose)
        found.append(replace(start.at(pose), cost=cost))
    return distinct(found)


@lru_cache(maxsize=1)
def _spreads() -> list[tuple[float, float, float]]:
    """Return the spreads of limbs and trunk, rad, and of its place, metres, that are tried round by round.

    They begin at the distance of two twists. They end where a hand moves less than a voxel. A turn of the trunk moves
    the feet as far as a turn of an arm moves the hand. Its place changes as far as the turn moves the shoulders.
    """
    adult = typical_person()
    arm_m, leg_m = adult.segments_m("arm").sum(), adult.segments_m("leg").sum()
    turn = arm_m / (leg_m - adult.from_neck("left_hip")[2])
    n_rounds = int(np.ceil(2 * np.log2(2 * np.pi / _N_TWISTS * arm_m / VOXEL_M)))
    limbs_rad = (2 * np.pi / _N_TWISTS / 2 ** (k / 2) for k in range(n_rounds))
    return [(own, turn * own, turn * own * adult.half_breadth_m) for own in limbs_rad]


def _coarse(search: "_Search", axis: BodyAxis) -> list[Hypothesis]:
    """Return for each twist on an axis the best pose among a few."""
    notes = (f"view {', '.join(axis.left_out)} was left out: its silhouette leans otherwise",) if axis.left_out else ()
    found, near = [], None
    for i in range(_N_TWISTS):
        near = _trunk(search.model, axis, _frame(axis.up, 2 * np.pi * i / _N_TWISTS), near)
        pose, cost = search.limbs_placed(near)
        found.append(Hypothesis(PosedBody(search.model, pose), cost=cost, notes=notes))
    return found


class _Search:
    """Search of the poses of a body, limb by limb."""

    def __init__(self, model: BodyModel, overlap: SilhouetteOverlap) -> None:
        self.model, self._overlap = model, overlap
        self._limbs, self._parts = limb_poses.moving_limbs(model), np.arange(len(model.parts))
        self._root = np.flatnonzero(model.dof_joint == 0)

    def limbs_placed(self, pose: Array) -> tuple[Array, float]:
        """Search the limbs all over their joint limits; return the pose and its cost."""
        model, trunk = self.model, limb_poses.trunk_parts(self.model)
        covered = self._overlap.nothing()
        Ts = model.kinematics(pose).Ts_world_part
        costs = 1 + self._overlap.cover(Ts[trunk], trunk, covered)
        for limb, changes in zip(self._limbs, limb_poses.changes_within_limits(model), strict=True):
            poses = self._with_limb(pose, limb, model.move(model.neutral(), changes))
            totals, view_costs = self._costs(pose, limb, poses, covered, costs)
            best = int(np.argmin(totals))
            pose, costs = poses[best], view_costs[best]
            self._overlap.cover(model.kinematics(pose).Ts_world_part[limb.parts], limb.parts, covered)
        return pose, float(self._total(pose[None])[0])

    def refined(self, pose: Array) -> tuple[Array, float]:
        """Search around a pose, trunk and limbs in turn; see `limbs_placed`."""
        model, best = self.model, self._total(pose[None])[0]
        for spread, trunk_rad, trunk_m in _spreads():
            steps = limb_poses.changes_around(model, self._root, _N_FINER, trunk_rad, trunk_m)
            poses = model.move(pose, steps)
            totals = self._total(poses)
            if totals.min() < best:
                pose, best = poses[int(np.argmin(totals))], totals.min()
            for limb in self._limbs:
                steps = limb_poses.changes_around(model, np.flatnonzero(limb.dofs), _N_FINER, spread)
                near, cost = self._best_of_limb(pose, limb, model.move(pose, steps))
                if cost < best:
                    pose, best = near, cost
        return pose, float(best)

    def _with_limb(self, pose: Array, limb: Limb, poses: Array) -> Array:
        """Return the pose with one limb as in each of some poses, (n, n_values)."""
        return np.where(value_mask(self.model, limb.dofs), poses, pose)

    def _best_of_limb(self, pose: Array, limb: Limb, poses: Array) -> tuple[Array, float]:
        """Return the best of poses that differ from a pose in one limb only, and its cost."""
        others = np.setdiff1d(self._parts, limb.parts)
        Ts, covered = self.model.kinematics(pose).Ts_world_part, self._overlap.nothing()
        costs = 1 + self._overlap.cover(Ts[others], others, covered)
        totals, _ = self._costs(pose, limb, poses, covered, costs)
        i = int(np.argmin(totals))
        return poses[i], float(totals[i])

    def _costs(
        self, pose: Array, limb: Limb, poses: Array, covered: NDArray[np.bool_], costs: Array
    ) -> tuple[Array, Array]:
        """Return the costs of a limb in many poses, (n,), and those of each view, (n, V).

        Args:
            pose: that differs from the others in this limb only.
            limb: the limb.
            poses: (n, n_values).
            covered: cells that the rest of the body covers.
            costs: of each view without the limb, (V,).
        """
        Ts = chain_poses(self.model.tree, self.model.kinematics(pose), limb.parts, poses)
        view_costs = costs + self._overlap.added(Ts, limb.parts, covered)
        return self._overlap.total(view_costs), view_costs

    def _total(self, poses: Array) -> Array:
        """Return the costs of whole bodies, (n,)."""
        Ts = np.stack([self.model.kinematics(p).Ts_world_part for p in poses])
        return self._overlap.total(1 + self._overlap.added(Ts, self._parts, self._overlap.nothing()))


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
    own = model.named_points_world(model.neutral())
    middle = (own["left_shoulder"] + own["right_shoulder"]) / 2
    person = typical_person(model.height_m / DEFAULT_HEIGHT_M)
    place = rigid.transform(R, axis.top - person.below_crown_m("left_shoulder") * axis.up)
    known = {n: rigid.apply(place, p - middle) for n, p in own.items()}
    trunk = {n: known[n] for n in _TRUNK if n in known}
    start = near if near is not None else fit_to_points(model, trunk, solver=solve_compiled_or_plain).pose
    return fit_to_points(model, known, start, solver=solve_compiled_or_plain).pose
