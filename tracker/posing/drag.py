"""Drag a point of a body in one view: the point follows the pointer, and its kinematic chain follows the point."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, TypedDict

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel, PosedBody
from tracker.errors import TrackerError
from tracker.fitting.gauss_newton import NormalEquations, PosePrior, ResidualBlock, normal_equations, solve
from tracker.geometry import rigid
from tracker.geometry.arrays import Array
from tracker.geometry.cameras import NEAR_PLANE_M, Camera
from tracker.posing.orient import orient
from tracker.posing.picking import point_on_part


class _Solving(TypedDict):
    max_iterations: int
    tolerance: float


_REST_WEIGHT = 0.003
"""Weight of keeping the chain at its pose at the grab, per rad, against 1 per metre for the dragged point. It
determines what the pointer does not, and holds the point back by some 0.1 mm."""
_STIFF_WEIGHT = 0.015
"""The same for joints that bend little, such as the waist: a drag of the trunk turns the body before it bends it."""
_DEPTH_WEIGHT = 0.1
"""Weight of keeping the point's depth, against 1 for being under the pointer. If the limb's lengths allow only one of
the two, the point follows the pointer."""

_ON_JOINT_PX = 8.0
"""Largest distance of a grabbed point from its joint at which turning works like a knob, px."""
_KNOB_M = 0.3
"""Distance to the right by which the pointer turns a knob by one radian, at the joint's depth, metres."""
_PUSH_GAIN = 2.0
"""Motion in depth of a pushed point, in motions of the pointer at the point's depth."""
_PUSH_DEPTH_WEIGHT = 0.5
"""Weight of a pushed point's depth, against 1 for keeping its position in the view."""
_MIN_PUSH_DEPTH_M = 0.3
"""Smallest depth of a pushed point, metres."""

_REACHED_M, _REACHED_DEPTH_M = 0.002, 0.02
"""Tolerances across the line of sight and along it within which a point has reached its target, metres. The pull to the
rest pose holds a point back in depth by some 4 mm."""
_BEND_RAD = 0.35
"""Angle by which the last joint of a chain is bent to leave the singularity of a straight limb, rad."""
_STRETCHED = 0.999
"""Share of the full length of a chain from which it counts as stretched; an elbow then bends by 5 degrees."""

_QUICK: _Solving = {"max_iterations": 15, "tolerance": 1e-4}
"""Solver settings of a move: dozens a second, each from the result of the last one."""
_BENT: _Solving = {"max_iterations": 6, "tolerance": 1e-4}
"""Solver settings of a test whether a bent limb comes nearer."""


@dataclass(frozen=True, eq=False)
class Grab:
    """A grabbed point of a body in one view, from press to release."""

    model: BodyModel
    camera: Camera
    """View of the drag; positions are in its undistorted pixels."""
    part: int
    """Index of the part that carries the point."""
    point_part: Array
    """The point in the frame of that part, (3,), metres."""
    pose: Array
    """Pose at the grab, (n_values,)."""
    pointer_px: Array
    """Pointer at the grab, (2,), px."""
    depth_m: float
    """Depth of the point along the optical axis, kept during the drag, metres."""
    offset_px: Array
    """From the pointer to the point at the grab, (2,), px; kept, so that the point does not jump."""
    active_dofs: NDArray[np.bool_]
    """Degrees of freedom that follow the point, (n_dofs,)."""
    unlocked_dofs: NDArray[np.bool_]
    """Degrees of freedom that may change at all, (n_dofs,)."""
    moves_body: bool
    """Whether the whole body moves parallel to the image."""

    def point_world(self, pose: Array) -> Array:
        """Return the grabbed point in a pose, (3,), metres."""
        return rigid.apply(self.model.kinematics(pose).Ts_world_part[self.part], self.point_part)


class _Handle(NamedTuple):
    """A point that can be grabbed."""

    part: int
    """Index of the part that carries it."""
    point_part: Array
    """The point in the frame of that part, (3,), metres."""
    movers: NDArray[np.bool_]
    """Degrees of freedom that move it, (n_dofs,)."""
    moves_body: bool
    """Whether it moves the whole body."""
    name: str
    """Name for messages."""


def minor_points(model: BodyModel) -> tuple[str, ...]:
    """Return the joints that a user rarely drags: rigid ones, and those that bend the trunk a little (waist, neck,
    collarbones).

    Dragging them turns the body about its root, like hips, shoulders and head, and also bends these joints.
    """
    stiff = [np.all(np.isfinite(model.spreads[model.dof_joint == i])) for i in range(len(model.joints))]
    return tuple(j.name for j, is_stiff in zip(model.joints, stiff, strict=True) if is_stiff)


def grab(
    model: BodyModel,
    pose: Array,
    camera: Camera,
    point: str,
    pointer_px: Array,
    active_dofs: NDArray[np.bool_] | None = None,
) -> Grab:
    """Grab a point of a body.

    The root point moves the whole body. A point of a limb moves that limb alone, and a head on a bending neck its neck.
    A point of the trunk, a shoulder or a hip turns the body about its root and bends the trunk.

    Args:
        model: the body.
        pose: its pose, (n_values,).
        camera: the view.
        point: name of the point.
        pointer_px: position of the pointer, undistorted px, (2,).
        active_dofs: degrees of freedom that may change, (n_dofs,); all by default.

    Raises:
        TrackerError: everything that moves the point is locked.
    """
    index = model.point_names.index(point)
    movers = model.moves[:, model.point_parts[index]].copy()
    if index < len(model.joints):
        movers &= model.dof_joint != index  # a joint's own rotation does not move it
    handle = _Handle(int(model.point_parts[index]), model.points_part[index], movers, index == 0, point)
    return _grab_handle(model, pose, camera, handle, pointer_px, active_dofs)


def grab_part(
    model: BodyModel,
    pose: Array,
    camera: Camera,
    part: int,
    pointer_px: Array,
    active_dofs: NDArray[np.bool_] | None = None,
) -> Grab:
    """Grab a part of a body where the pointer touches its surface.

    The root part moves the whole body. Any other part follows by the touched point.

    Args:
        model: the body.
        pose: its pose, (n_values,).
        camera: the view.
        part: index of the part.
        pointer_px: position of the pointer, undistorted px, (2,).
        active_dofs: degrees of freedom that may change, (n_dofs,); all by default.

    Raises:
        TrackerError: everything that moves the part is locked.
    """
    point_part = point_on_part(PosedBody(model, pose), camera, part, pointer_px)
    handle = _Handle(part, point_part, model.moves[:, part], part == 0, model.parts[part].name)
    return _grab_handle(model, pose, camera, handle, pointer_px, active_dofs)


def _grab_handle(
    model: BodyModel,
    pose: Array,
    camera: Camera,
    handle: _Handle,
    pointer_px: Array,
    active_dofs: NDArray[np.bool_] | None,
) -> Grab:
    """Choose the degrees of freedom that follow a handle."""
    point_world = rigid.apply(model.kinematics(pose).Ts_world_part[handle.part], handle.point_part)
    unlocked = np.ones(model.n_dofs, dtype=bool) if active_dofs is None else active_dofs
    of_root = model.dof_joint == 0
    own = handle.movers & ~of_root
    carries_others = handle.part in model.parents
    if handle.moves_body:
        follows = of_root & model.dof_is_length
    elif np.any(own & ~np.isfinite(model.spreads)):
        follows = own & ~np.isfinite(model.spreads)
    elif np.any(own) and not carries_others:
        follows = own
    else:
        follows = handle.movers & ~model.dof_is_length
    follows = follows & unlocked
    # If the whole limb is locked, nothing else moves in its place: the lock is meant to hold the dragged point too.
    if not np.any(follows):
        raise TrackerError(
            f"expected a point that something moves, found {handle.name} with all of that locked; unlock it"
        )
    pointer_px = np.asarray(pointer_px, dtype=np.float64)
    return Grab(
        model, camera.pinhole, handle.part, handle.point_part, np.array(pose), pointer_px,
        float(camera.depths(point_world)), camera.pinhole.project(point_world) - pointer_px, follows, unlocked,
        handle.moves_body,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _PointerTarget:
    """Residuals of the grabbed point: across the line of sight and, with less weight, in depth; see `ResidualBlock`."""

    grabbed: Grab
    target_world: Array
    """Target of the point, (3,), metres: under the pointer, at the depth."""
    depth_weight: float = _DEPTH_WEIGHT

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


def drag(grabbed: Grab, pointer_px: Array, pose: Array) -> Array:
    """Let the grabbed point follow the pointer, as near to its depth as the limb's lengths allow.

    Args:
        grabbed: from `grab` or `grab_part`.
        pointer_px: position of the pointer, undistorted px, (2,).
        pose: pose after the last move, (n_values,).

    Returns:
        The new pose, (n_values,), the nearest that limits and lengths allow.
    """
    model = grabbed.model
    target = grabbed.camera.back_project(np.asarray(pointer_px) + grabbed.offset_px, grabbed.depth_m)
    if grabbed.moves_body:
        return _moved_body(grabbed, target)
    blocks: list[ResidualBlock] = [
        _PointerTarget(grabbed, target),
        _rest_prior(grabbed),
    ]
    fit = solve(model, pose, blocks, active_dofs=grabbed.active_dofs, **_QUICK)
    joint, first = model.dof_joint[grabbed.active_dofs][[-1, 0]]
    if (
        joint == first
        or _has_reached(grabbed, fit.pose, target)
        or _is_stretched(grabbed, fit.pose, int(first), target)
    ):
        return fit.pose
    # At a straight limb the gradient of bending is 0: restart with its joint bent, either way.
    for bend in (_BEND_RAD, -_BEND_RAD):
        start = model.clip(model.retract(pose, np.where(grabbed.active_dofs & (model.dof_joint == joint), bend, 0.0)))
        bent = solve(model, start, blocks, active_dofs=grabbed.active_dofs, **_BENT)
        if bent.cost < fit.cost:
            fit = solve(model, bent.pose, blocks, active_dofs=grabbed.active_dofs, **_QUICK)
    return fit.pose


def _has_reached(grabbed: Grab, pose: Array, target_world: Array) -> bool:
    """Return whether the grabbed point is at its target, within visible tolerances."""
    seen = rigid.apply(grabbed.camera.T_camera_world, np.stack([grabbed.point_world(pose), target_world]))
    across = grabbed.depth_m * np.diff(seen[:, :2] / np.maximum(seen[:, 2:], NEAR_PLANE_M), axis=0)
    return bool(np.linalg.norm(across) < _REACHED_M and abs(seen[1, 2] - seen[0, 2]) < _REACHED_DEPTH_M)


def _is_stretched(grabbed: Grab, pose: Array, first: int, target_world: Array) -> bool:
    """Return whether the chain from a joint on has its full length and its target is farther away."""
    model, part = grabbed.model, grabbed.part
    places = [grabbed.point_world(pose)]
    Ts_world_part = model.kinematics(pose).Ts_world_part
    while part != first:
        places.append(Ts_world_part[part, :3, 3])
        part = int(model.parents[part])
    places.append(Ts_world_part[first, :3, 3])
    length = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
    return bool(min(np.linalg.norm(p - places[-1]) for p in (places[0], target_world)) > _STRETCHED * length)


def regrab(grabbed: Grab, pose: Array, pointer_px: Array) -> Grab:
    """Return the same grab of the same point in another pose, (n_values,), with the pointer elsewhere, (2,)."""
    place = grabbed.point_world(pose)
    return replace(
        grabbed,
        pose=np.array(pose),
        pointer_px=np.asarray(pointer_px, dtype=np.float64),
        depth_m=float(grabbed.camera.depths(place)),
        offset_px=grabbed.camera.project(place) - pointer_px,
    )


def turn(grabbed: Grab, pointer_px: Array, pose: Array) -> Array:
    """Turn the grabbed part about the line of sight through its joint by the angle that the pointer goes round the
    joint.

    The turned joint is the active one next to the grabbed point; if the whole body is grabbed, the body turns. With the
    pointer on the joint itself, the part turns like a knob by the pointer's motion to the right. A joint that cannot
    turn about the line of sight turns so that the point comes near to its target.

    Args:
        grabbed: from `grab` or `grab_part`.
        pointer_px: position of the pointer, undistorted px, (2,).
        pose: pose after the last move, (n_values,).
    """
    model, camera = grabbed.model, grabbed.camera
    part = (
        0
        if grabbed.moves_body
        else int(model.dof_joint[np.flatnonzero(grabbed.active_dofs & ~model.dof_is_length)[-1]])
    )
    T_world_part = model.kinematics(grabbed.pose).Ts_world_part[part]
    pivot_px = camera.project(T_world_part[:3, 3])
    start, now = (
        grabbed.pointer_px + grabbed.offset_px - pivot_px,
        np.asarray(pointer_px) + grabbed.offset_px - pivot_px,
    )
    if np.linalg.norm(start) < _ON_JOINT_PX:
        angle = float(now[0] - start[0]) * grabbed.depth_m / camera.K[0, 0] / _KNOB_M
    else:
        angle = float(np.arctan2(start[0] * now[1] - start[1] * now[0], start @ now))
    sight = T_world_part[:3, 3] - camera.center_world
    R_turn = rigid.so3_exp(angle * sight / np.linalg.norm(sight))
    own = (model.dof_joint == part) & ~model.dof_is_length & grabbed.unlocked_dofs
    if model.joints[part].kind == "ball" or np.count_nonzero(own) >= 3:
        return orient(model, pose, part, R_turn @ T_world_part[:3, :3], grabbed.unlocked_dofs)
    target = T_world_part[:3, 3] + R_turn @ (grabbed.point_world(grabbed.pose) - T_world_part[:3, 3])
    return solve(model, pose, [_PointerTarget(grabbed, target)], active_dofs=own, **_QUICK).pose


def push(grabbed: Grab, pointer_px: Array, pose: Array) -> Array:
    """Move the grabbed point away from the camera as the pointer goes up, or towards it; its position in the view
    stays.

    Args:
        grabbed: from `grab` or `grab_part`.
        pointer_px: position of the pointer, undistorted px, (2,).
        pose: pose after the last move, (n_values,).
    """
    model, camera = grabbed.model, grabbed.camera
    up_m = float(grabbed.pointer_px[1] - np.asarray(pointer_px)[1]) * grabbed.depth_m / camera.K[1, 1]
    depth = max(_MIN_PUSH_DEPTH_M, grabbed.depth_m + _PUSH_GAIN * up_m)
    target = camera.back_project(grabbed.pointer_px + grabbed.offset_px, depth)
    if grabbed.moves_body:
        return _moved_body(grabbed, target)
    blocks: list[ResidualBlock] = [_PointerTarget(grabbed, target, _PUSH_DEPTH_WEIGHT), _rest_prior(grabbed)]
    return solve(model, pose, blocks, active_dofs=grabbed.active_dofs, **_QUICK).pose


def _moved_body(grabbed: Grab, target_world: Array) -> Array:
    """Return the pose at the grab, translated so that the grabbed point comes to a position, (3,), metres."""
    step = np.zeros(grabbed.model.n_dofs)
    step[:3] = target_world - grabbed.point_world(grabbed.pose)
    return grabbed.model.retract(grabbed.pose, np.where(grabbed.active_dofs, step, 0.0))


def _rest_prior(grabbed: Grab) -> PosePrior:
    """Return the prior that keeps the chain near its pose at the grab."""
    return PosePrior(grabbed.pose, np.where(np.isfinite(grabbed.model.spreads), _STIFF_WEIGHT, _REST_WEIGHT))
