"""Posing a body by hand: a point of it follows a place in an image, the rest of the chain gives way."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypedDict

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
from tracker.posing.picking import place_on_part


class _Solving(TypedDict):
    max_iterations: int
    tolerance: float


_REST_WEIGHT = 0.003
"""Pull of the rest of the chain to its pose at the grab, per rad, against 1 per metre for the dragged point: it
decides what the pointer leaves open and holds the point back by some 0.1 mm."""
_STIFF_WEIGHT = 0.015
"""The same for joints that people bend little, as the waist: limbs move first, the trunk gives way where they end."""
_DEPTH_WEIGHT = 0.1
"""Weight of keeping the point's depth, against 1 for being under the pointer: where the limb's lengths allow only one
of the two, the point goes where the hand sees it go."""

_ON_JOINT_PX = 8.0
"""A point grabbed this near to the joint that it turns about does not go round it."""
_KNOB_M = 0.3
"""A pointer on the joint turns it by one radian where it goes this far to the right, at the joint's distance."""
_PUSH_GAIN = 2.0
"""How far a pushed point goes in depth, in ways of the pointer at its distance."""
_PUSH_DEPTH_WEIGHT = 0.5
"""Weight of a pushed point's depth, against 1 for staying where the view shows it."""
_NEAREST_PUSH_M = 0.3
"""A point is not pulled nearer to the camera than this."""

_REACHED_M, _REACHED_DEPTH_M = 0.002, 0.02
"""A point this near to where it should be, as its view sees it and along its depth, has followed the pointer: the pull
of the rest holds it back in depth by some 4 mm."""
_BEND_RAD = 0.35
"""How far the last joint of a chain is bent to leave a straight limb's dead point."""
_STRETCHED = 0.999
"""A chain has its full length when the point is this share of it away: an elbow bends by 5 degrees there."""

_QUICK: _Solving = {"max_iterations": 15, "tolerance": 1e-4}
"""A hand makes dozens of moves a second, each from where the last one ended."""
_BENT: _Solving = {"max_iterations": 6, "tolerance": 1e-4}
"""So many show whether a limb that was bent comes nearer."""


@dataclass(frozen=True, eq=False)
class Grab:
    """A hand on a point of a body in one view, from press to release."""

    model: BodyModel
    camera: Camera
    """The view in which it is dragged; positions are in its undistorted pixels."""
    part: int
    """Index of the part that carries the point."""
    place_part: Array
    """Where the point is in the frame of that part, (3,), metres."""
    values: Array
    """Pose when it was grabbed, (n_values,)."""
    pointer_px: Array
    """Where the pointer was when it was grabbed, (2,), px."""
    depth_m: float
    """Distance of the point along the optical axis, kept during the drag, metres."""
    offset_px: Array
    """From the pointer to the point when it was grabbed, (2,), px; kept, so that nothing jumps."""
    free: NDArray[np.bool_]
    """Degrees of freedom that give way, (n_dofs,)."""
    unlocked: NDArray[np.bool_]
    """Degrees of freedom that may move at all, (n_dofs,)."""
    moves_body: bool
    """Whether the whole body moves parallel to the image."""

    def place_world(self, values: Array) -> Array:
        """Where the point is in a pose, (3,), metres."""
        return rigid.apply(self.model.kinematics(values).Ts_world_part[self.part], self.place_part)


def minor_points(model: BodyModel) -> tuple[str, ...]:
    """Joints that a hand hardly needs: rigid ones, and those that bend the trunk a little (waist, neck, collarbones).

    Dragged, they turn the body about its root, as hips, shoulders and head do; and these bend them too.
    """
    stiff = [np.all(np.isfinite(model.spreads[model.dof_joint == i])) for i in range(len(model.joints))]
    return tuple(j.name for j, is_stiff in zip(model.joints, stiff, strict=True) if is_stiff)


def grab(
    model: BodyModel,
    values: Array,
    camera: Camera,
    point: str,
    pointer_px: Array,
    free: NDArray[np.bool_] | None = None,
) -> Grab:
    """Take hold of a point of a body.

    The root point moves the whole body. A point of a limb, or of a head on a neck that bends, moves its chain up to the
    trunk; a point of the trunk turns the body about its root, and bends what of the trunk can bend.

    Args:
        model: the body.
        values: its pose, (n_values,).
        camera: the view.
        point: name of the point.
        pointer_px: where the pointer is, undistorted px, (2,).
        free: which degrees of freedom may give way, (n_dofs,); all by default.

    Raises:
        TrackerError: whatever moves the point is locked.
    """
    index = model.point_names.index(point)
    moving = model.moves[:, model.point_parts[index]].copy()
    if index < len(model.joints):
        moving &= model.dof_joint != index  # a joint turns about itself: that does not move it
    part = int(model.point_parts[index])
    return _take_hold(
        model, values, camera, part, model.points_part[index], pointer_px, free, moving, index == 0, point
    )


def grab_part(
    model: BodyModel,
    values: Array,
    camera: Camera,
    part: int,
    pointer_px: Array,
    free: NDArray[np.bool_] | None = None,
) -> Grab:
    """Take hold of a part of a body where a pointer touches its surface.

    The root part moves the whole body; any other part follows by that place, as a point of its does.

    Args:
        model: the body.
        values: its pose, (n_values,).
        camera: the view.
        part: index of the part.
        pointer_px: where the pointer is, undistorted px, (2,).
        free: which degrees of freedom may give way, (n_dofs,); all by default.

    Raises:
        TrackerError: whatever moves the part is locked.
    """
    place = place_on_part(PosedBody(model, values), camera, part, pointer_px)
    name, moving = model.parts[part].name, model.moves[:, part]
    return _take_hold(model, values, camera, part, place, pointer_px, free, moving, part == 0, name)


def _take_hold(
    model: BodyModel,
    values: Array,
    camera: Camera,
    part: int,
    place_part: Array,
    pointer_px: Array,
    free: NDArray[np.bool_] | None,
    moving: NDArray[np.bool_],
    moves_body: bool,
    name: str,
) -> Grab:
    """Decide what gives way where a place of a part is held, which some degrees of freedom move."""
    place = rigid.apply(model.kinematics(values).Ts_world_part[part], place_part)
    unlocked = np.ones(model.n_dofs, dtype=bool) if free is None else free
    of_root = model.dof_joint == 0
    own = moving & ~of_root
    carries_others = part in model.parents
    if moves_body:
        gives = of_root & model.dof_is_length
    elif np.any(own & ~np.isfinite(model.spreads)) or (np.any(own) and not carries_others):
        gives = own
    else:
        gives = moving & ~model.dof_is_length
    gives = gives & unlocked
    # Where the limb is locked as a whole nothing else is moved in its place: a lock is meant to hold the hand too.
    if not np.any(gives):
        raise TrackerError(f"expected a point that something moves, found {name} with all of that locked; unlock it")
    pointer_px = np.asarray(pointer_px, dtype=np.float64)
    return Grab(
        model, camera.pinhole, part, place_part, np.array(values), pointer_px, float(camera.depths(place)),
        camera.pinhole.project(place) - pointer_px, gives, unlocked, moves_body,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _UnderPointer:
    """A `ResidualBlock` that draws the grabbed point to a line of sight and, more weakly, to a depth."""

    hand: Grab
    target_world: Array
    """Where the point should be, (3,), metres: under the pointer, at the depth."""
    depth_weight: float = _DEPTH_WEIGHT

    def linearize(self, model: BodyModel, values: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        hand, (target_px, m_per_px, depth_axis) = self.hand, self._image
        point_world = rigid.apply(kinematics.Ts_world_part[hand.part], hand.place_part)
        points_px, px_by_point = hand.camera.project_with_jacobian(point_world[None])
        r, by_point = np.empty(3), np.empty((3, 3))
        r[:2], by_point[:2] = m_per_px @ (points_px[0] - target_px), m_per_px @ px_by_point[0]
        r[2], by_point[2] = depth_axis @ (point_world - self.target_world), depth_axis
        J_world = model.point_jacobian(kinematics, np.array([hand.part]), point_world[None])[0]  # (3, n_dofs)
        return normal_equations(r, by_point @ J_world)

    @cached_property
    def _image(self) -> tuple[Array, Array, Array]:
        """The target's pixel, (2,), metres at the grab's depth per pixel, (2, 2), and the weighted depth axis, (3,)."""
        camera = self.hand.camera
        target_px = camera.project_with_jacobian(self.target_world[None])[0][0]
        m_per_px = np.asarray(self.hand.depth_m * np.linalg.inv(camera.K[:2, :2]), dtype=np.float64)
        return target_px, m_per_px, self.depth_weight * camera.T_camera_world[2, :3]


def drag(hand: Grab, pointer_px: Array, values: Array) -> Array:
    """Let the grabbed point follow the pointer, as near to the depth it had as the limb's lengths allow.

    Args:
        hand: from `grab`.
        pointer_px: where the pointer is now, undistorted px, (2,).
        values: the pose of the last call, from which to go on, (n_values,).

    Returns:
        The new pose, (n_values,); the nearest that limits and lengths allow.
    """
    model = hand.model
    target = hand.camera.back_project(np.asarray(pointer_px) + hand.offset_px, hand.depth_m)
    if hand.moves_body:
        return _moved_body(hand, target)
    blocks: list[ResidualBlock] = [
        _UnderPointer(hand, target),
        _rest(hand),
    ]
    fit = solve(model, values, blocks, free=hand.free, **_QUICK)
    joint, first = model.dof_joint[hand.free][[-1, 0]]
    if joint == first or _has_reached(hand, fit.pose, target) or _is_stretched(hand, fit.pose, int(first), target):
        return fit.pose
    # A straight limb cannot see that bending would bring the point nearer: begin with its joint bent, either way.
    for bend in (_BEND_RAD, -_BEND_RAD):
        start = model.clip(model.retract(values, np.where(hand.free & (model.dof_joint == joint), bend, 0.0)))
        bent = solve(model, start, blocks, free=hand.free, **_BENT)
        if bent.cost < fit.cost:
            fit = solve(model, bent.pose, blocks, free=hand.free, **_QUICK)
    return fit.pose


def _has_reached(hand: Grab, values: Array, target_world: Array) -> bool:
    """Whether the grabbed point is where it should be, as far as a hand can tell."""
    seen = rigid.apply(hand.camera.T_camera_world, np.stack([hand.place_world(values), target_world]))
    across = hand.depth_m * np.diff(seen[:, :2] / np.maximum(seen[:, 2:], NEAR_PLANE_M), axis=0)
    return bool(np.linalg.norm(across) < _REACHED_M and abs(seen[1, 2] - seen[0, 2]) < _REACHED_DEPTH_M)


def _is_stretched(hand: Grab, values: Array, first: int, target_world: Array) -> bool:
    """Whether the chain from a joint on is stretched to its full length, and what it should reach is farther away."""
    model, part = hand.model, hand.part
    places = [hand.place_world(values)]
    Ts_world_part = model.kinematics(values).Ts_world_part
    while part != first:
        places.append(Ts_world_part[part, :3, 3])
        part = int(model.parents[part])
    places.append(Ts_world_part[first, :3, 3])
    length = np.linalg.norm(np.diff(places, axis=0), axis=1).sum()
    return bool(min(np.linalg.norm(p - places[-1]) for p in (places[0], target_world)) > _STRETCHED * length)


def regrab(hand: Grab, values: Array, pointer_px: Array) -> Grab:
    """The same hand on the same place, taken anew in another pose, (n_values,), with the pointer elsewhere, (2,)."""
    place = hand.place_world(values)
    return replace(
        hand,
        values=np.array(values),
        pointer_px=np.asarray(pointer_px, dtype=np.float64),
        depth_m=float(hand.camera.depths(place)),
        offset_px=hand.camera.project(place) - pointer_px,
    )


def turn(hand: Grab, pointer_px: Array, values: Array) -> Array:
    """Turn the grabbed part about the line of sight through its joint, as far as the pointer goes round the joint.

    Of the joints that give way it is the one next to the grabbed point; where the whole body is held, the body turns.
    Where the pointer is on the joint itself it turns as a knob does, by the way to the right. A joint that cannot turn
    about the line of sight turns so that the point comes near to its place there.

    Args:
        hand: from `grab` or `grab_part`.
        pointer_px: where the pointer is now, undistorted px, (2,).
        values: the pose of the last call, from which to go on, (n_values,).
    """
    model, camera = hand.model, hand.camera
    part = 0 if hand.moves_body else int(model.dof_joint[np.flatnonzero(hand.free & ~model.dof_is_length)[-1]])
    T_world_part = model.kinematics(hand.values).Ts_world_part[part]
    pivot_px = camera.project(T_world_part[:3, 3])
    start, now = hand.pointer_px + hand.offset_px - pivot_px, np.asarray(pointer_px) + hand.offset_px - pivot_px
    if np.linalg.norm(start) < _ON_JOINT_PX:
        angle = float(now[0] - start[0]) * hand.depth_m / camera.K[0, 0] / _KNOB_M
    else:
        angle = float(np.arctan2(start[0] * now[1] - start[1] * now[0], start @ now))
    sight = T_world_part[:3, 3] - camera.center_world
    R_turn = rigid.so3_exp(angle * sight / np.linalg.norm(sight))
    own = (model.dof_joint == part) & ~model.dof_is_length & hand.unlocked
    if model.joints[part].kind == "ball" or np.count_nonzero(own) >= 3:
        return orient(model, values, part, R_turn @ T_world_part[:3, :3], hand.unlocked)
    target = T_world_part[:3, 3] + R_turn @ (hand.place_world(hand.values) - T_world_part[:3, 3])
    return solve(model, values, [_UnderPointer(hand, target)], free=own, **_QUICK).pose


def push(hand: Grab, pointer_px: Array, values: Array) -> Array:
    """Move the grabbed point away from the camera, as the pointer goes up, or towards it; in the view it stays.

    Args:
        hand: from `grab` or `grab_part`.
        pointer_px: where the pointer is now, undistorted px, (2,).
        values: the pose of the last call, from which to go on, (n_values,).
    """
    model, camera = hand.model, hand.camera
    up_m = float(hand.pointer_px[1] - np.asarray(pointer_px)[1]) * hand.depth_m / camera.K[1, 1]
    depth = max(_NEAREST_PUSH_M, hand.depth_m + _PUSH_GAIN * up_m)
    target = camera.back_project(hand.pointer_px + hand.offset_px, depth)
    if hand.moves_body:
        return _moved_body(hand, target)
    blocks: list[ResidualBlock] = [_UnderPointer(hand, target, _PUSH_DEPTH_WEIGHT), _rest(hand)]
    return solve(model, values, blocks, free=hand.free, **_QUICK).pose


def _moved_body(hand: Grab, target_world: Array) -> Array:
    """The pose at the grab, moved as a whole so that the grabbed point comes to a place, (3,), metres."""
    step = np.zeros(hand.model.n_dofs)
    step[:3] = target_world - hand.place_world(hand.values)
    return hand.model.retract(hand.values, np.where(hand.free, step, 0.0))


def _rest(hand: Grab) -> PosePrior:
    """What keeps the chain near its pose at the grab."""
    return PosePrior(hand.values, np.where(np.isfinite(hand.model.spreads), _STIFF_WEIGHT, _REST_WEIGHT))
