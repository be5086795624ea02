"""Drag a grabbed point: it follows the pointer, turns its part, goes nearer or farther, or bends the trunk as well."""

import numpy as np
from numpy.typing import NDArray

from tracker.body.limbs import limbs
from tracker.body.model import BodyModel
from tracker.estimation.fitting.gauss_newton import solve
from tracker.estimation.posing.grab import Grab, Holds, limb_points
from tracker.estimation.posing.orient import orient
from tracker.estimation.posing.reaching import QUICK, WEIGHTS, PointerTarget, as_other_views_placed, reach, restore_held
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import NEAR_PLANE_M

_ON_JOINT_PX = 8.0
"""Largest distance of a grabbed point from its joint at which turning works like a knob, px."""
_KNOB_M = 0.3
"""Distance to the right by which the pointer turns a knob by one radian, at the joint's depth, metres."""
_PUSH_GAIN = 2.0
"""Motion in depth of a pushed point, in motions of the pointer at the point's depth."""

_HEADINGS_RAD = (np.radians(np.arange(-90.0, 91.0)), np.radians(np.linspace(-1.0, 1.0, 41)))
"""Turns about the vertical that one move tries, against the last move, coarse and fine."""
_NEAR_HEADING_M = 0.02
"""Distance in the view that outweighs one radian of turn from the grab or from the last move, metres. A shoulder at
the outline turns far for little, so that an aim that is slightly off does not turn the body. Of two headings that look
alike the nearer is taken."""
_NEAR_SIDE_M = 3e-4
"""Squared distance in the view that outweighs one metre of depth, metres. It decides which way a shoulder at the
outline is drawn inwards: towards the camera."""


def drag(grabbed: Grab, pointer_px: Array, pose: Array) -> Array:
    """Let the grabbed point follow the pointer, as near to its depth as the limb's lengths allow.

    Args:
        grabbed: from `grab` or `grab_part`.
        pointer_px: position of the pointer, undistorted px, (2,).
        pose: pose after the last move, (n_values,).

    Returns:
        The new pose, (n_values,), the nearest that limits and lengths allow. Held points stay in place.
    """
    return _follow(grabbed, grabbed.target_world(pointer_px), pose, None)


def bend(grabbed: Grab, pointer_px: Array, pose: Array) -> Array:
    """Let the grabbed point follow the pointer with the help of the trunk.

    A limb also bends the trunk, and the other limbs stay where they are in space. A shoulder or a hip leans the body
    and bends the trunk. Any other point does what `drag` does.

    Args:
        grabbed: from `grab` or `grab_part`.
        pointer_px: position of the pointer, undistorted px, (2,).
        pose: pose after the last move, (n_values,).
    """
    model = grabbed.model
    if grabbed.role not in ("limb", "heading"):
        return drag(grabbed, pointer_px, pose)
    active, holds = grabbed.active_dofs | (model.moves[:, grabbed.part] & np.isfinite(model.spreads)), grabbed.holds
    if grabbed.role == "limb":
        trunk, bases = _trunk_beyond(model, grabbed.part)
        if np.any(trunk):  # an arm: the chest leans, and hips stay below it
            active |= trunk | ((model.dof_joint == 0) & ~model.dof_is_length)
        holds = _held_at(grabbed, np.concatenate([_of_other_limbs(model, grabbed.part), bases]))
    bent = reach(grabbed, grabbed.target_world(pointer_px), pose, active & grabbed.unlocked_dofs, holds)
    return restore_held(model, bent, holds, grabbed.unlocked_dofs)


def turn(grabbed: Grab, pointer_px: Array, pose: Array) -> Array:
    """Turn the grabbed part about the line of sight through its joint by the angle that the pointer goes round the
    joint.

    The turned joint is the active one next to the grabbed point. The body turns if it is grabbed as a whole, or by a
    shoulder or a hip; that tilts it. With the pointer on the joint itself, the part turns like a knob by the pointer's
    motion to the right. A joint that cannot turn about the line of sight turns so that the point comes near to its
    target.

    Args:
        grabbed: from `grab` or `grab_part`.
        pointer_px: position of the pointer, undistorted px, (2,).
        pose: pose after the last move, (n_values,).
    """
    model, camera = grabbed.model, grabbed.camera
    part = (
        0
        if grabbed.role in ("body", "heading")
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
    return solve(model, pose, [PointerTarget(grabbed, target)], active_dofs=own, **QUICK).pose


def push(grabbed: Grab, pointer_px: Array, pose: Array) -> Array:
    """Move the grabbed point away from the camera as the pointer goes up, or towards it; its position in the view
    stays.

    Args:
        grabbed: from `grab` or `grab_part`.
        pointer_px: position of the pointer, undistorted px, (2,).
        pose: pose after the last move, (n_values,).
    """
    camera = grabbed.camera
    up_m = float(grabbed.pointer_px[1] - np.asarray(pointer_px)[1]) * grabbed.depth_m / camera.K[1, 1]
    depth = max(NEAR_PLANE_M, grabbed.depth_m + _PUSH_GAIN * up_m)
    target = camera.back_project(grabbed.pointer_px + grabbed.offset_px, depth)
    return _follow(grabbed, target, pose, WEIGHTS.hold)


def _follow(grabbed: Grab, target_world: Array, pose: Array, depth_weight: float | None) -> Array:
    """Return the pose in which the grabbed point is nearest to a target, by the joints of its role.

    Args:
        grabbed: the grab.
        target_world: target of the point, (3,), metres.
        pose: pose after the last move, (n_values,).
        depth_weight: weight of the target's depth, against 1 across the line of sight; None: the usual one.
    """
    match grabbed.role:
        case "limb":
            return reach(grabbed, target_world, pose, grabbed.active_dofs, grabbed.holds, depth_weight)
        case "body":
            placed = target_world if depth_weight else as_other_views_placed(grabbed, target_world)[0]
            moved = _moved_body(grabbed, placed, pose)
        case "heading":
            moved = _turned_about_vertical(grabbed, target_world, pose, depth_weight or 0.0)
        case _:
            moved = reach(grabbed, target_world, pose, grabbed.active_dofs, grabbed.holds, depth_weight)
    return restore_held(grabbed.model, moved, grabbed.holds, grabbed.unlocked_dofs)


def _moved_body(grabbed: Grab, target_world: Array, pose: Array) -> Array:
    """Return a pose, (n_values,), translated so that the grabbed point comes to a position, (3,), metres."""
    step = np.zeros(grabbed.model.n_dofs)
    step[:3] = target_world - grabbed.point_world(pose)
    return grabbed.model.retract(pose, np.where(grabbed.active_dofs, step, 0.0))


def _turned_about_vertical(grabbed: Grab, target_world: Array, pose: Array, depth_weight: float) -> Array:
    """Return a pose with the body turned about the vertical through its root, so that the point is nearest to a target.

    The point runs on a level circle, which has two places for most positions in the view. Continuity decides between
    them; at the outline of the circle, the side that the camera sees.
    """
    model, camera, up = grabbed.model, grabbed.camera, grabbed.up_world
    kinematics = model.kinematics(grabbed.pose)
    T_root = kinematics.Ts_world_part[0]
    R_last = model.kinematics(pose).Ts_world_part[0, :3, :3] @ T_root[:3, :3].T
    angle = last = float(rigid.so3_log(R_last) @ up)
    placed = grabbed.holds.of(~grabbed.holds.moved_by(model, model.limb_dofs))
    if grabbed.placed_elsewhere is not None:
        placed = placed.joined(grabbed.placed_elsewhere)
    placed = placed.scaled(WEIGHTS.hold)
    arms = np.vstack([grabbed.point_world(grabbed.pose), placed.targets_world]) - T_root[:3, 3]
    level, across = arms - (arms @ up)[:, None] * up, np.cross(up, arms)
    target = rigid.apply(camera.T_camera_world, target_world)
    for turns in _HEADINGS_RAD:
        tried = angle + turns
        c, s = np.cos(tried)[:, None, None] - 1, np.sin(tried)[:, None, None]
        moves = c * level + s * across  # (n_tried, 1 + n_placed, 3)
        seen = rigid.apply(camera.T_camera_world, T_root[:3, 3] + arms[0] + moves[:, 0])
        missed = grabbed.depth_m * (seen[:, :2] / seen[:, 2:] - target[:2] / target[2])
        cost = np.sum(missed**2, axis=1) + (depth_weight * (seen[:, 2] - target[2])) ** 2
        cost += np.sum(np.einsum("nij,tnj->tni", placed.weights, moves[:, 1:]) ** 2, axis=(1, 2))
        cost += (_NEAR_HEADING_M * tried) ** 2 + _NEAR_SIDE_M * seen[:, 2] + (_NEAR_HEADING_M * (tried - last)) ** 2
        angle = float(tried[np.argmin(cost)])
    return orient(model, pose, 0, rigid.so3_exp(angle * up) @ T_root[:3, :3], grabbed.unlocked_dofs)


def _trunk_beyond(model: BodyModel, part: int) -> tuple[NDArray[np.bool_], IntArray]:
    """Return the degrees of freedom of the trunk that do not move a part, (n_dofs,), and the joints that hang on it.

    For a forearm these are spine and waist, and the hips.
    """
    in_limbs = {int(p) for limb in limbs(model) for p in limb.parts}
    beyond = [p for p in range(1, len(model.parts)) if p not in in_limbs]
    dofs = np.isin(model.dof_joint, beyond) & ~model.moves[:, part]
    if not np.any(dofs):
        return dofs, np.zeros(0, dtype=np.int64)
    return dofs, np.array([i for i, parent in enumerate(model.parents) if parent in beyond and i in in_limbs])


def _of_other_limbs(model: BodyModel, part: int) -> IntArray:
    """Return the points that can be held, by index, of all limbs but that of a part."""
    own = next(limb.parts for limb in limbs(model) if part in limb.parts)
    points = np.array([model.point_names.index(name) for name in limb_points(model)], dtype=np.int64)
    return points[~np.isin(model.point_parts[points], own)]


def _held_at(grabbed: Grab, points: IntArray) -> Holds:
    """Return points, given by index, held where they are at the grab, in all directions."""
    places = grabbed.model.points_at(grabbed.model.kinematics(grabbed.pose), points)
    return Holds(points, places, np.tile(np.eye(3), (len(points), 1, 1)))
