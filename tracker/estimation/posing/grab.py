"""Grab a point of a body in a view: which degrees of freedom follow it, and which points are held meanwhile."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics
from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody
from tracker.errors import TrackerError
from tracker.estimation.fitting.gauss_newton import NormalEquations, normal_equations
from tracker.estimation.posing.picking import point_on_part
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.cameras import Camera
from tracker.geometry.triangulation import PointObservation

Role: TypeAlias = Literal["body", "heading", "lean", "trunk", "limb"]
"""Parts that a dragged point moves: the whole body, its heading (a turn about the vertical), its lean (any turn), the
bend of the trunk, or one limb."""
_UP = (0.0, 0.0, 1.0)
"""The vertical where none is stated."""


@dataclass(frozen=True)
class Constraints:
    """Points and angles that a drag leaves alone."""

    active_dofs: NDArray[np.bool_] | None = None
    """Degrees of freedom that may change, (n_dofs,); None: all."""
    held: Mapping[str, Sequence[Camera]] = field(default_factory=dict)
    """Points that stay where they are in space as far as the drag allows (see `holdable_points`), with the views in
    which they were placed. A point that was placed in one view may still move along its line of sight."""
    seen: tuple[PointObservation, ...] = ()
    """Points that the user placed in the views, undistorted px. A fit, not a drag, draws the held ones there."""
    up_world: tuple[float, float, float] = _UP
    """The vertical, a unit vector in the world."""


@dataclass(frozen=True, eq=False)
class Holds:
    """Points of a body that are held at positions in space; a residual block of their distances."""

    points: IntArray
    """Indices into `BodyModel.point_names`, (N,)."""
    targets_world: Array
    """Their positions, (N, 3), metres."""
    weights: Array
    """Weight of the distance in each direction, (N, 3, 3), per metre: the residual is this times the distance."""

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        places, by_dofs = model.points_with_jacobian(kinematics, self.points)
        J = self.weights @ by_dofs
        r = np.einsum("nij,nj->ni", self.weights, places - self.targets_world)
        return normal_equations(r.ravel(), J.reshape(-1, model.n_dofs))

    def of(self, chosen: NDArray[np.bool_]) -> "Holds":
        """Return some of them, (N,) bool."""
        return Holds(self.points[chosen], self.targets_world[chosen], self.weights[chosen])

    def joined(self, other: "Holds") -> "Holds":
        """Return both."""
        return Holds(
            np.concatenate([self.points, other.points]),
            np.concatenate([self.targets_world, other.targets_world]),
            np.concatenate([self.weights, other.weights]),
        )

    def scaled(self, factor: float) -> "Holds":
        """Return them with other weights."""
        return replace(self, weights=factor * self.weights)

    def moved_by(self, model: BodyModel, dofs: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return which of them some degrees of freedom, (n_dofs,) bool, move, (N,)."""
        return np.any(model.moves[np.ix_(dofs, model.point_parts[self.points])], axis=0)

    def distances(self, model: BodyModel, pose: Array) -> Array:
        """Return how far each is from its position in a pose, in directions in which it is held, (N,), metres."""
        off = model.points_at(model.kinematics(pose), self.points) - self.targets_world
        return np.linalg.norm(np.einsum("nij,nj->ni", self.weights, off), axis=1)


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
    role: Role
    """Parts that the point moves."""
    active_dofs: NDArray[np.bool_]
    """Degrees of freedom that follow the point, (n_dofs,)."""
    unlocked_dofs: NDArray[np.bool_]
    """Degrees of freedom that may change at all, (n_dofs,)."""
    holds: Holds
    """Other points that are held."""
    placed_elsewhere: Holds | None
    """The grabbed point, known across the lines of sight of other views in which it was placed; None without any."""
    up_world: Array
    """The vertical, (3,), a unit vector."""

    def point_world(self, pose: Array) -> Array:
        """Return the grabbed point in a pose, (3,), metres."""
        return rigid.apply(self.model.kinematics(pose).Ts_world_part[self.part], self.point_part)

    def target_world(self, pointer_px: Array) -> Array:
        """Return where the pointer, (2,), wants the point: under it, at the depth of the grab, (3,), metres."""
        return self.camera.back_project(np.asarray(pointer_px) + self.offset_px, self.depth_m)

    def miss_m(self, pointer_px: Array, pose: Array) -> float:
        """Return the distance between the point in a pose and the line of sight of the pointer, (2,), metres."""
        ray = self.target_world(pointer_px) - self.camera.center_world
        ray = ray / np.linalg.norm(ray)
        point = self.point_world(pose) - self.camera.center_world
        return float(np.linalg.norm(point - (point @ ray) * ray))


class _Handle(NamedTuple):
    """A point that can be grabbed."""

    part: int
    """Index of the part that carries it."""
    point_part: Array
    """The point in the frame of that part, (3,), metres."""
    movers: NDArray[np.bool_]
    """Degrees of freedom that move it, (n_dofs,)."""
    name: str
    """Name for messages."""
    point: int | None
    """Index of the point; None for a surface."""


def minor_points(model: BodyModel) -> tuple[str, ...]:
    """Return the joints that a user rarely drags: rigid ones, and those that bend the trunk a little (waist, neck,
    collarbones).

    A stiff joint at the end of a limb, such as a wrist, is none of them: it places the limb.
    """
    stiff = [bool(np.all(np.isfinite(model.spreads[model.dof_joint == i]))) for i in range(len(model.joints))]
    of_limb = model.limb_dofs @ model.moves  # whether a part moves with a limb
    return tuple(j.name for i, j in enumerate(model.joints) if stiff[i] and not of_limb[i])


@lru_cache(maxsize=32)
def limb_points(model: BodyModel) -> tuple[str, ...]:
    """Return the points that a limb can keep in place while the trunk moves: elbows, wrists, knees, ankles."""
    return tuple(n for i, n in enumerate(model.point_names) if np.any(_movers(model, i) & model.limb_dofs))


@lru_cache(maxsize=32)
def holdable_points(model: BodyModel) -> tuple[str, ...]:
    """Return the points that are held once they are placed: those of limbs, the root, shoulders and hips."""
    return (model.point_names[0], *heading_points(model), *limb_points(model))


@lru_cache(maxsize=32)
def heading_points(model: BodyModel) -> tuple[str, ...]:
    """Return the points by which a drag turns the body about the vertical: shoulders, hips, collarbones."""
    handles = (_handle_of(model, name) for name in model.point_names)
    return tuple(h.name for h in handles if _role(model, h) == "heading")


def grab(
    model: BodyModel, pose: Array, camera: Camera, point: str, pointer_px: Array, constraints: Constraints | None = None
) -> Grab:
    """Grab a point of a body.

    The root point moves the whole body. A point of a limb moves that limb alone, and a head on a bending neck its neck.
    A shoulder or a hip turns the body about the vertical. A point between chest and pelvis bends the trunk.

    Args:
        model: the body.
        pose: its pose, (n_values,).
        camera: the view.
        point: name of the point.
        pointer_px: position of the pointer, undistorted px, (2,).
        constraints: locked degrees of freedom, held points and the vertical; none and +z by default.

    Raises:
        TrackerError: everything that moves the point is locked.
    """
    return _grab_handle(model, pose, camera, _handle_of(model, point), pointer_px, constraints)


def grab_part(
    model: BodyModel, pose: Array, camera: Camera, part: int, pointer_px: Array, constraints: Constraints | None = None
) -> Grab:
    """Grab a part of a body where the pointer touches its surface.

    The root part moves the whole body. Any other part follows by the touched point.

    Args:
        model: the body.
        pose: its pose, (n_values,).
        camera: the view.
        part: index of the part.
        pointer_px: position of the pointer, undistorted px, (2,).
        constraints: as for `grab`.

    Raises:
        TrackerError: everything that moves the part is locked.
    """
    point_part = point_on_part(PosedBody(model, pose), camera, part, pointer_px)
    handle = _Handle(part, point_part, model.moves[:, part], model.parts[part].name, None)
    return _grab_handle(model, pose, camera, handle, pointer_px, constraints)


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


def _grab_handle(
    model: BodyModel, pose: Array, camera: Camera, handle: _Handle, pointer_px: Array, constraints: Constraints | None
) -> Grab:
    """Choose the degrees of freedom that follow a handle."""
    constraints = constraints or Constraints()
    kinematics = model.kinematics(pose)
    point_world = rigid.apply(kinematics.Ts_world_part[handle.part], handle.point_part)
    unlocked = np.ones(model.n_dofs, dtype=bool) if constraints.active_dofs is None else constraints.active_dofs
    role = _role(model, handle)
    follows = _followers(model, handle, role) & unlocked
    # If the whole limb is locked, nothing else moves in its place: the lock is meant to hold the dragged point too.
    if not np.any(follows):
        raise TrackerError(
            f"expected a point that something moves, found {handle.name} with all of that locked; unlock it"
        )
    holds = holds_at(model, pose, {n: views for n, views in constraints.held.items() if n != handle.name})
    others = [v for v in constraints.held.get(handle.name, ()) if not _is_same_view(v, camera)]
    elsewhere = holds_at(model, pose, {handle.name: others}) if others else None
    pointer_px = np.asarray(pointer_px, dtype=np.float64)
    return Grab(
        model, camera.pinhole, handle.part, handle.point_part, np.array(pose), pointer_px,
        float(camera.depths(point_world)), camera.pinhole.project(point_world) - pointer_px, role, follows, unlocked,
        holds, elsewhere, np.array(constraints.up_world, dtype=np.float64),
    )  # fmt: skip


def holds_at(model: BodyModel, pose: Array, held: Mapping[str, Sequence[Camera]]) -> Holds:
    """Return points, given by name with the views in which they were placed, held where they are in a pose,
    (n_values,)."""
    names = [name for name in holdable_points(model) if name in held]
    points = np.array([model.point_names.index(name) for name in names], dtype=np.int64)
    places = model.points_at(model.kinematics(pose), points)
    weights = [
        _across(held[name], place) if held[name] else np.eye(3) for name, place in zip(names, places, strict=True)
    ]
    return Holds(points, places, np.array(weights).reshape(-1, 3, 3))


def _is_same_view(view: Camera, other: Camera) -> bool:
    return np.array_equal(view.T_world_camera, other.T_world_camera)


def _across(views: Sequence[Camera], point_world: Array) -> Array:
    """Return the weights, (3, 3), of a point that is known across the lines of sight of some views."""
    information = np.zeros((3, 3))
    for view in views:
        ray = point_world - view.center_world
        ray = ray / np.linalg.norm(ray)
        information += np.eye(3) - np.outer(ray, ray)
    values, axes = np.linalg.eigh(information)
    return np.asarray(np.sqrt(np.clip(values, 0.0, 1.0))[:, None] * axes.T)


def _role(model: BodyModel, handle: _Handle) -> Role:
    """Return what a handle moves."""
    own = handle.movers & (model.dof_joint != 0)
    carries_others = handle.part in model.parents
    if handle.part == 0:
        return "body"
    if np.any(own & model.limb_dofs) or (np.any(own) and not carries_others):
        return "limb"
    if any(handle.part in limb.parts and np.any(limb.dofs & model.limb_dofs) for limb in limbs(model)):
        return "heading"
    if np.any(own):
        return "trunk"
    return "body" if carries_others else "lean"


def _followers(model: BodyModel, handle: _Handle, role: Role) -> NDArray[np.bool_]:
    """Return the degrees of freedom that follow a handle, (n_dofs,)."""
    of_root = model.dof_joint == 0
    own = handle.movers & ~of_root
    match role:
        case "body":
            return of_root & model.dof_is_length
        case "limb":
            free = own & model.limb_dofs
            return free if np.any(free) else own
        case "trunk":
            return own
        case _:
            return of_root & ~model.dof_is_length


def _handle_of(model: BodyModel, point: str) -> _Handle:
    """Return the handle of a point."""
    index = model.point_names.index(point)
    return _Handle(int(model.point_parts[index]), model.points_part[index], _movers(model, index), point, index)


def _movers(model: BodyModel, point: int) -> NDArray[np.bool_]:
    """Return the degrees of freedom that move a point, (n_dofs,): a joint's own rotation does not."""
    movers = model.moves[:, model.point_parts[point]].copy()
    return movers & (model.dof_joint != point) if point < len(model.joints) else movers
