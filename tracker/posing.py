"""Posing a body by hand: a point of it follows a place in an image, the rest of the chain gives way."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from tracker import rigid
from tracker.body import BodyModel
from tracker.cameras import Camera, viewed_point
from tracker.errors import TrackerError
from tracker.fit import Block, Normal, StayNear, fit_to_points, normal_of, solve
from tracker.kinematics import Kinematics
from tracker.rigid import Array


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
_NEAREST_M = 0.05
"""Depths below this count as this: a point is not dragged through the camera."""

_REACHED_M = 0.002
"""A point this near to where it should be has followed the pointer."""
_BEND_RAD = 0.35
"""How far the last joint of a chain is bent to leave a straight limb's dead point."""

_QUICK: _Solving = {"max_iterations": 15, "tolerance": 1e-4}
"""A hand makes dozens of moves a second, each from where the last one ended."""

UP_ROTATIONS = {
    "z": np.eye(3),
    "-z": np.diag([1.0, -1.0, -1.0]),
    "y": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "-y": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
    "x": np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]]),
    "-x": np.array([[0, 0, -1.0], [0, 1, 0], [1, 0, 0]]),
}
"""Rotations that turn the body's z axis to the world axis that points up."""


@dataclass(frozen=True, eq=False)
class Grab:
    """A hand on a point of a body in one view, from press to release."""

    model: BodyModel
    camera: Camera
    """The view in which it is dragged; positions are in its undistorted pixels."""
    point: int
    """Index of the point into `BodyModel.point_names`."""
    values: Array
    """Pose when it was grabbed, (n_values,)."""
    depth_m: float
    """Distance of the point along the optical axis, kept during the drag, metres."""
    offset_px: Array
    """From the pointer to the point when it was grabbed, (2,), px; kept, so that nothing jumps."""
    free: NDArray[np.bool_]
    """Degrees of freedom that give way, (n_dofs,)."""

    @property
    def moves_body(self) -> bool:
        """Whether the whole body moves parallel to the image."""
        return self.point == 0


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
    place = model.points_world(values)[index]
    moving = model.moves[:, model.point_parts[index]].copy()
    if index < len(model.joints):
        moving &= model.dof_joint != index  # a joint turns about itself: that does not move it
    of_root = model.dof_joint == 0
    own = moving & ~of_root
    carries_others = model.point_parts[index] in model.parents
    if index == 0:
        gives = of_root & model.dof_is_length
    elif np.any(own & ~np.isfinite(model.spreads)) or (np.any(own) and not carries_others):
        gives = own
    else:
        gives = moving & ~model.dof_is_length
    if free is not None:
        gives &= free
        # Where the limb is locked as a whole nothing else is moved in its place: a lock is meant to hold the hand too.
        if not np.any(gives):
            raise TrackerError(
                f"expected a point that something moves, found {point} with all of that locked; unlock it"
            )
    offset = camera.pinhole.project(place) - pointer_px
    return Grab(model, camera.pinhole, index, np.array(values), float(camera.depths(place)), offset, gives)


@dataclass(frozen=True, eq=False)
class _UnderPointer:
    """A `Block` that draws the grabbed point to a line of sight and, more weakly, to its depth at the grab."""

    hand: Grab
    target_world: Array
    """Where the point should be, (3,), metres: under the pointer, at the depth."""

    def normal(self, model: BodyModel, values: Array, kinematics: Kinematics) -> Normal:
        """See `Block`."""
        hand, T_camera_world = self.hand, self.hand.camera.T_camera_world
        parts = model.point_parts[[hand.point]]
        point_world = rigid.apply(kinematics.Ts_world_part[parts[0]], model.points_part[hand.point])
        x = rigid.apply(T_camera_world, point_world)
        target = rigid.apply(T_camera_world, self.target_world)
        J = T_camera_world[:3, :3] @ model.point_jacobian(kinematics, parts, point_world[None])[0]  # (3, n_dofs)
        z = max(x[2], _NEAREST_M)
        # Angles times depth, so that both are in metres.
        across = hand.depth_m * (x[:2] / z - target[:2] / target[2])
        J_across = hand.depth_m / z * (J[:2] - np.outer(x[:2] / z, J[2]))  # (2, n_dofs)
        r = np.append(across, _DEPTH_WEIGHT * (x[2] - hand.depth_m))
        return normal_of(r, np.concatenate([J_across, _DEPTH_WEIGHT * J[2:]]))


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
        step = np.zeros(model.n_dofs)
        step[:3] = target - model.points_world(hand.values)[0]
        return model.retract(hand.values, np.where(hand.free, step, 0.0))
    blocks: list[Block] = [
        _UnderPointer(hand, target),
        StayNear(hand.values, np.where(np.isfinite(model.spreads), _STIFF_WEIGHT, _REST_WEIGHT)),
    ]
    fit = solve(model, values, blocks, free=hand.free, **_QUICK)
    joint, first = model.dof_joint[hand.free][[-1, 0]]
    if joint == first or np.linalg.norm(model.points_world(fit.values)[hand.point] - target) < _REACHED_M:
        return fit.values
    # A straight limb cannot see that bending would bring the point nearer: begin with its joint bent, either way.
    for bend in (_BEND_RAD, -_BEND_RAD):
        start = model.clip(model.retract(values, np.where(hand.free & (model.dof_joint == joint), bend, 0.0)))
        bent = solve(model, start, blocks, free=hand.free, **_QUICK)
        fit = bent if bent.cost < fit.cost else fit
    return fit.values


def standing_pose(model: BodyModel, cameras: Sequence[Camera], up: str = "z") -> Array:
    """Upright pose where the cameras look: where a model stands before anybody has placed it.

    Args:
        model: the body.
        cameras: the views.
        up: world axis that points up.
    """
    points = model.points_world(model.neutral()) @ UP_ROTATIONS[up].T + viewed_point(cameras)
    return fit_to_points(model, dict(zip(model.point_names, points, strict=True))).values
