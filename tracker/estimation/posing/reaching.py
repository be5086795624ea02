"""Inverse kinematics of a dragged point: damped least squares towards the pointer, with held points and a rest pose."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics
from tracker.body.limbs import BENT_RAD, limbs
from tracker.body.model import BodyModel
from tracker.estimation.fitting.gauss_newton import (
    CLOSE_ENOUGH,
    Fit,
    NormalEquations,
    PosePrior,
    ResidualBlock,
    normal_equations,
    solve,
    value_mask,
)
from tracker.estimation.fitting.hypothesis import SAME_POSE_M
from tracker.estimation.posing.grab import Grab, Holds
from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array
from tracker.geometry.cameras import NEAR_PLANE_M


class _Solving(TypedDict):
    max_iterations: int
    tolerance: float


class _Weights(NamedTuple):
    """Weights of the residuals of a drag, per metre or rad, against 1 per metre for being under the pointer."""

    hold: float
    """Of a held point of the dragged limb, or a pushed point's depth."""
    depth: float
    """Of the dragged point's depth. If the limb's lengths allow only one of the two, the point follows the pointer."""
    rest: float
    """Of the chain's pose at the grab. It determines what the pointer does not, and holds the point back by some
    0.1 mm."""
    stiff: float
    """The same for joints that bend little, such as the waist: a drag of the trunk turns the body before it bends
    it."""
    middle: float
    """Of an elbow or knee that was not placed and moves farther than the wrist or ankle is dragged."""
    twist: float
    """Of the twist of such a limb."""


WEIGHTS = _Weights(hold=0.5, depth=0.1, rest=0.003, stiff=0.015, middle=0.35, twist=0.1)
"""The weights of `reach` and `restore_held`."""
_BOW = 0.35
"""Share of its distance from the line between base and end that such an elbow or knee may move besides."""
_AXIAL = 0.1
"""Motion of the elbow or knee, in lengths of the upper bone, below which a degree of freedom counts as a twist."""


class _Tolerances(NamedTuple):
    """Distances from its target within which a point has reached it, metres."""

    across_m: float
    """Across the line of sight."""
    depth_m: float
    """Along it. The pull to the rest pose holds a point back in depth by some 4 mm."""


_REACHED = _Tolerances(across_m=0.002, depth_m=0.02)
"""The tolerances of `_has_reached` and `restore_held`."""
_NEAR_M = 0.05
"""Distance in space from the target beyond which the other sides of a limb are tried, metres."""
_STRETCHED = 0.999
"""Share of the full length of a chain from which it counts as stretched; an elbow then bends by 5 degrees."""
QUICK: _Solving = {"max_iterations": 15, "tolerance": 1e-4}
"""Solver settings of a move: dozens a second, each from the result of the last one."""
_BENT: _Solving = {"max_iterations": 6, "tolerance": CLOSE_ENOUGH}
"""Solver settings of a test whether a bent limb, or its other side, comes nearer."""


@dataclass(frozen=True, eq=False)
class PointerTarget:
    """Residuals of the grabbed point: across the line of sight and, with less weight, in depth; see `ResidualBlock`."""

    grabbed: Grab
    target_world: Array
    """Target of the point, (3,), metres: under the pointer, at the depth."""
    depth_weight: float = WEIGHTS.depth

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        grabbed, (target_px, m_per_px, depth_axis) = self.grabbed, self._image
        point_world = rigid.apply(kinematics.Ts_world_part[grabbed.part], grabbed.point_part)
        points_px, px_by_point = grabbed.camera.project_with_jacobian(point_world[None])
        r, by_point = np.empty(3), np.empty((3, 3))
        r[:2], by_point[:2] = m_per_px @ (points_px[0] - target_px), m_per_px @ px_by_point[0]
        r[2], by_point[2] = depth_axis @ (point_world - self.target_world), depth_axis
        J_world = model.point_jacobian(kinematics, np.array([grabbed.part]), point_world[None])[0]  # (3, n_dofs)
        return normal_equations(r, by_point @ J_world)

    @cached_property
    def _image(self) -> tuple[Array, Array, Array]:
        """Target in the image, (2,), px; metres per pixel at the depth of the grab, (2, 2); weighted depth axis,
        (3,)."""
        camera = self.grabbed.camera
        target_px = camera.project_with_jacobian(self.target_world[None])[0][0]
        m_per_px = np.asarray(self.grabbed.depth_m * np.linalg.inv(camera.K[:2, :2]), dtype=np.float64)
        return target_px, m_per_px, self.depth_weight * camera.T_camera_world[2, :3]


@dataclass(frozen=True, eq=False)
class MiddleJoint:
    """Residual of an elbow or knee that moves much farther than the wrist or ankle is dragged; see `ResidualBlock`.

    At a straight limb, a short drag of its end towards the base folds it far. The end rather gives way in depth.
    """

    grabbed: Grab
    active_dofs: NDArray[np.bool_]
    """Degrees of freedom of the limb that follow the point, (n_dofs,)."""
    target_world: Array
    """Target of the grabbed point, (3,), metres."""

    @classmethod
    def between(cls, grabbed: Grab, active_dofs: NDArray[np.bool_], target_world: Array) -> "MiddleJoint | None":
        """Return the residual of the joint between the limb's base and the grabbed point; None without any."""
        of_limb = active_dofs & grabbed.model.limb_dofs
        moving = grabbed.model.dof_joint[of_limb]
        if grabbed.role != "limb" or grabbed.part not in moving or grabbed.model.parents[grabbed.part] != moving[0]:
            return None
        return cls(grabbed, of_limb, target_world)

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        place, J = self._derivatives(kinematics)
        start, allowed_m = self._start_and_reach
        moved = float(np.linalg.norm(place - start))
        if moved <= allowed_m:
            return normal_equations(np.zeros(1), np.zeros((1, model.n_dofs)))
        way = (place - start) / moved
        return normal_equations(np.array([WEIGHTS.middle * (moved - allowed_m)]), WEIGHTS.middle * way[None] @ J)

    def is_exceeded(self, pose: Array) -> bool:
        """Return whether the joint moved farther than is allowed."""
        start, allowed_m = self._start_and_reach
        place = self.grabbed.model.kinematics(pose).Ts_world_part[self._part, :3, 3]
        return float(np.linalg.norm(place - start)) > allowed_m

    def prior(self) -> PosePrior:
        """Return the rest prior with a firm twist of the limb: else the limb turns to its side before it gives way."""
        grabbed = self.grabbed
        kinematics = grabbed.model.kinematics(grabbed.pose)
        first = grabbed.model.dof_joint == grabbed.model.dof_joint[self.active_dofs][0]
        place, J = self._derivatives(kinematics)
        length_m = np.linalg.norm(place - kinematics.Ts_world_part[grabbed.model.parents[self._part], :3, 3])
        is_twist = first & self.active_dofs & (np.linalg.norm(J, axis=0) < _AXIAL * length_m)
        weights = _rest_prior(grabbed.model, grabbed.pose).weights
        return PosePrior(grabbed.pose, np.where(is_twist, WEIGHTS.twist, weights))

    @property
    def _part(self) -> int:
        """Index of the joint and of the part that it carries."""
        return self.grabbed.part

    def _derivatives(self, kinematics: Kinematics) -> tuple[Array, Array]:
        """Return the joint's position, (3,), metres, and its Jacobian, (3, n_dofs)."""
        place = kinematics.Ts_world_part[self._part, :3, 3]
        return place, self.grabbed.model.point_jacobian(kinematics, np.array([self._part]), place[None])[0]

    @cached_property
    def _start_and_reach(self) -> tuple[Array, float]:
        """Position of the joint at the grab, (3,), and how far it may move, metres.

        That is the length of the drag. A bent limb has a share of its bend more, because it folds no faster.
        """
        base, start, end = _chain(self.grabbed, self.grabbed.pose, self.active_dofs)[0][::-1]
        along = (end - base) / np.linalg.norm(end - base)
        bow_m = np.linalg.norm(np.cross(along, start - base))
        return start, float(np.linalg.norm(self.target_world - end) + _BOW * bow_m)


def reach(
    grabbed: Grab,
    target_world: Array,
    pose: Array,
    active_dofs: NDArray[np.bool_],
    holds: Holds,
    depth_weight: float | None = None,
) -> Array:
    """Let the chain of the grabbed point follow it to a target.

    Held points of the moved limb stay as far as the target allows: with a held wrist, an elbow turns about the line
    from shoulder to wrist; with a held elbow, a wrist turns about it.

    Args:
        grabbed: the grab.
        target_world: target of the point, (3,), metres.
        pose: pose after the last move, (n_values,).
        active_dofs: degrees of freedom that follow the point, (n_dofs,).
        holds: points that are held.
        depth_weight: weight of the target's depth, against 1 across the line of sight; None: the usual one.
    """
    model = grabbed.model
    holds = holds.of(holds.moved_by(model, active_dofs))
    if depth_weight is None:
        target_world, depth_weight = as_other_views_placed(grabbed, target_world)
        depth_weight = max(depth_weight, WEIGHTS.depth)
    # For a held wrist to stay while the elbow is dragged, the elbow must bend: joints beyond the point follow too.
    beyond = np.any(model.moves[:, model.point_parts[holds.points]], axis=1) & model.limb_dofs
    active = active_dofs | (beyond & grabbed.unlocked_dofs)
    blocks: list[ResidualBlock] = [PointerTarget(grabbed, target_world, depth_weight), _rest_prior(model, grabbed.pose)]
    if len(holds.points):
        blocks.append(holds.scaled(WEIGHTS.hold))

    def is_done(found: Array) -> bool:
        return _has_reached(grabbed, found, target_world) or _is_stretched(grabbed, found, active_dofs, target_world)

    fit = _solve_bending(model, pose, blocks, active, is_done)
    middle = MiddleJoint.between(grabbed, active_dofs, target_world)
    if middle is not None and grabbed.part not in holds.points and middle.is_exceeded(fit.pose):
        blocks[1:2] = [middle.prior(), middle]
        fit = solve(model, fit.pose, blocks, active, **QUICK)
    if _is_near(grabbed, fit.pose, active_dofs, target_world):
        return fit.pose
    # Descent along the view does not cross between the two depths at which a limb is seen, nor around a limit. A first
    # solution in space does, from here or from the limb at rest.
    at_rest = np.where(value_mask(model, active & model.limb_dofs), _relaxed(model), pose)
    depths_m = grabbed.camera.depths(np.stack([grabbed.point_world(fit.pose), target_world]))
    if abs(depths_m[0] - depths_m[1]) > _NEAR_M:
        starts = [pose, at_rest]
    else:
        starts = [at_rest] if _is_at_limit(model, fit.pose, active) else []
    best = fit
    for start in starts:
        in_space = solve(model, start, [PointerTarget(grabbed, target_world, 1.0), *blocks[1:]], active, **_BENT)
        other = solve(model, in_space.pose, blocks, active, **_BENT)
        if other.cost < best.cost:
            best = other
    return best.pose if best is fit else solve(model, best.pose, blocks, active, **QUICK).pose


def as_other_views_placed(grabbed: Grab, target_world: Array) -> tuple[Array, float]:
    """Return the target at the depth at which other views see the grabbed point where they placed it.

    That is the point of the pointer's line of sight nearest to those of the other views. The farther these pass, the
    less they count: by half where the lines of sight are `SAME_POSE_M` apart. The point then moves away from where they
    saw it.

    Args:
        grabbed: the grab.
        target_world: target under the pointer, (3,), metres.

    Returns:
        The target, (3,), metres, and the weight of its depth; 0 where no other view placed the point.
    """
    own = grabbed.placed_elsewhere
    if own is None:
        return target_world, 0.0
    sight = target_world - grabbed.camera.center_world
    sight = sight / np.linalg.norm(sight)
    across, off = own.weights[0] @ sight, own.weights[0] @ (target_world - own.targets_world[0])
    information = float(across @ across)
    step = -float(across @ off) / (information + WEIGHTS.depth**2)
    trust = 1 / (1 + (float(np.linalg.norm(off + step * across)) / SAME_POSE_M) ** 2)
    return target_world + trust * step * sight, WEIGHTS.hold * trust * information**0.5


def restore_held(model: BodyModel, pose: Array, holds: Holds, unlocked_dofs: NDArray[np.bool_]) -> Array:
    """Return a pose whose limbs bring held points back to their positions, as far as they reach.

    Args:
        model: the body.
        pose: pose in which the trunk has moved, (n_values,).
        holds: the held points.
        unlocked_dofs: degrees of freedom that may change, (n_dofs,).
    """
    for limb in limbs(model):
        own = limb.dofs & model.limb_dofs
        of_limb = holds.of(holds.moved_by(model, own))
        if not len(of_limb.points) or not np.any(own & unlocked_dofs):
            continue

        def is_done(found: Array, of_limb: Holds = of_limb) -> bool:
            return bool(np.all(of_limb.distances(model, found) < _REACHED.across_m))

        if np.any(of_limb.distances(model, pose) > TINY):
            blocks: list[ResidualBlock] = [of_limb, _rest_prior(model, pose)]
            pose = _solve_bending(model, pose, blocks, own & unlocked_dofs, is_done).pose
    return pose


def _rest_prior(model: BodyModel, pose: Array) -> PosePrior:
    """Return the prior that keeps the chain near a pose, (n_values,)."""
    return PosePrior(pose, np.where(np.isfinite(model.spreads), WEIGHTS.stiff, WEIGHTS.rest))


def _solve_bending(
    model: BodyModel,
    pose: Array,
    blocks: Sequence[ResidualBlock],
    active_dofs: NDArray[np.bool_],
    is_done: Callable[[Array], bool],
) -> Fit:
    """Solve, and solve again with the last joint of the chain bent if that comes nearer.

    At a straight limb the gradient of bending is 0.

    Args:
        model: the body.
        pose: initial pose, (n_values,).
        blocks: the residuals.
        active_dofs: degrees of freedom of the chain, (n_dofs,).
        is_done: whether a pose needs no second solution.
    """
    fit = solve(model, pose, blocks, active_dofs=active_dofs, **QUICK)
    joint, first = model.dof_joint[active_dofs][[-1, 0]]
    if joint == first or is_done(fit.pose):
        return fit
    for bend in (BENT_RAD, -BENT_RAD):
        start = model.move(pose, np.where(active_dofs & (model.dof_joint == joint), bend, 0.0))
        bent = solve(model, start, blocks, active_dofs=active_dofs, **_BENT)
        if bent.cost < fit.cost:
            fit = solve(model, bent.pose, blocks, active_dofs=active_dofs, **QUICK)
    return fit


def _is_at_limit(model: BodyModel, pose: Array, active_dofs: NDArray[np.bool_]) -> bool:
    """Return whether a limb's joint that turns about several axes is at a limit."""
    several = np.array([len(joint.axes) > 1 for joint in model.joints])[model.dof_joint] & active_dofs & model.limb_dofs
    values, (low, high) = pose[model.dof_value[several]], model.limits[several].T
    return bool(np.any((values <= low + TINY) | (values >= high - TINY)))


@lru_cache(maxsize=32)
def _relaxed(model: BodyModel) -> Array:
    """Return the neutral pose with elbows and knees slightly bent, (n_values,)."""
    hinges = np.array([len(joint.axes) == 1 for joint in model.joints])[model.dof_joint]
    return model.move(model.neutral(), np.where(hinges, BENT_RAD, 0.0))


def _is_near(grabbed: Grab, pose: Array, active_dofs: NDArray[np.bool_], target_world: Array) -> bool:
    """Return whether the grabbed point is so near its target that no other side of the limb is tried.

    A target beyond the chain's full length counts at that length.
    """
    places, length = _chain(grabbed, pose, active_dofs)
    way = target_world - places[-1]
    reachable = places[-1] + min(1.0, length / max(float(np.linalg.norm(way)), TINY)) * way
    return float(np.linalg.norm(places[0] - reachable)) < _NEAR_M


def _chain(grabbed: Grab, pose: Array, active_dofs: NDArray[np.bool_]) -> tuple[Array, float]:
    """Return the positions of the grabbed point and of the joints up to the first that follows it, (n, 3), and the
    length of that chain, metres."""
    model, part, first = grabbed.model, grabbed.part, int(grabbed.model.dof_joint[active_dofs][0])
    places = [grabbed.point_world(pose)]
    Ts_world_part = model.kinematics(pose).Ts_world_part
    while part != first:
        places.append(Ts_world_part[part, :3, 3])
        part = model.parents[part]
    found = np.array([*places, Ts_world_part[first, :3, 3]])
    return found, float(np.linalg.norm(np.diff(found, axis=0), axis=1).sum())


def _has_reached(grabbed: Grab, pose: Array, target_world: Array) -> bool:
    """Return whether the grabbed point is at its target, within visible tolerances."""
    seen = rigid.apply(grabbed.camera.T_camera_world, np.stack([grabbed.point_world(pose), target_world]))
    across = grabbed.depth_m * np.diff(seen[:, :2] / np.maximum(seen[:, 2:], NEAR_PLANE_M), axis=0)
    return bool(np.linalg.norm(across) < _REACHED.across_m and abs(seen[1, 2] - seen[0, 2]) < _REACHED.depth_m)


def _is_stretched(grabbed: Grab, pose: Array, active_dofs: NDArray[np.bool_], target_world: Array) -> bool:
    """Return whether the chain of the point has its full length and its target is farther away."""
    places, length = _chain(grabbed, pose, active_dofs)
    return bool(min(np.linalg.norm(p - places[-1]) for p in (places[0], target_world)) > _STRETCHED * length)
