"""Articulated bodies: a tree of joints that carry parts, and the kinematics of a pose.

A pose is a flat array of *values*: one per revolute axis or translation, four per ball joint (a unit quaternion
w, x, y, z). Steps, Jacobians and limits are in *degrees of freedom* (dofs). A ball joint has three of them: a rotation
vector in the frame of its child part. Without ball joints, values and dofs coincide.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.parts import Joint, Landmark, Part, SearchGroup
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.shapes import Shape

if TYPE_CHECKING:  # imported lazily elsewhere: compiled kernels take 0.2 s to load
    from tracker.body.kinematics import Kinematics, Tree


class _Ball(NamedTuple):
    """The position of a ball joint in the arrays of a pose."""

    joint: Joint
    dofs: slice
    """Its three degrees of freedom."""
    values: slice
    """Its quaternion."""


@dataclass(frozen=True, eq=False)
class BodyModel:
    """An articulated body of fixed size. Joints come parent first; joint i moves part i."""

    name: str
    height_m: float
    """Body height by which all fractions are scaled, metres."""
    joints: tuple[Joint, ...]
    parts: tuple[Part, ...]
    """In the order of the joints that move them."""
    landmarks: tuple[Landmark, ...]
    search_groups: tuple[SearchGroup, ...]
    joint_sigma_m: float | None = None
    """Standard deviation along each axis with which a person's sizes determine the joints, metres; None where the sizes
    are nobody's own."""
    height_sigma: float | None = None
    """Standard deviation of the logarithm of the height where somebody has stated it; None elsewhere."""

    def with_height(self, height_m: float) -> "BodyModel":
        """Return the same proportions at another body height."""
        return replace(self, height_m=height_m)

    @cached_property
    def part_index(self) -> Mapping[str, int]:
        """Index of each part by name."""
        return {p.name: i for i, p in enumerate(self.parts)}

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """Index of each part's parent, -1 for the root."""
        return tuple(self.part_index[j.parent] if j.parent else -1 for j in self.joints)

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """Shape of each part at this body's size, metres."""
        return tuple(p.shape(self.height_m) for p in self.parts)

    @cached_property
    def centers_part(self) -> Array:
        """Centre of each part's shape in the part's frame, (n_parts, 3), metres."""
        return np.array([p.center for p in self.parts]) * self.height_m

    @cached_property
    def dof_names(self) -> tuple[str, ...]:
        """Names of all degrees of freedom, e.g. `left_shoulder.abduction`."""
        return tuple(n for j in self.joints for n in j.dof_names)

    @cached_property
    def n_dofs(self) -> int:
        """Number of degrees of freedom."""
        return len(self.dof_names)

    @cached_property
    def dof_is_length(self) -> NDArray[np.bool_]:
        """Whether a degree of freedom is a length in metres (else an angle in radians), (n_dofs,)."""
        kinds = [[True] * 3 * j.free + [False] * (len(j.dof_names) - 3 * j.free) for j in self.joints]
        return np.array([k for joint in kinds for k in joint])

    @cached_property
    def dof_joint(self) -> IntArray:
        """Index of the joint (and so of the part) that each degree of freedom belongs to, (n_dofs,)."""
        return np.array([i for i, j in enumerate(self.joints) for _ in j.dof_names], dtype=np.int64)

    @cached_property
    def dof_value(self) -> IntArray:
        """Index into the values of each degree of freedom, (n_dofs,); the quaternion's start for a ball joint."""
        out, value = [], 0
        for j in self.joints:
            n = len(j.dof_names)
            if j.kind == "ball":
                out += [value + i for i in range(n - 3)] + [value + n - 3] * 3
                value += n + 1
            else:
                out += [value + i for i in range(n)]
                value += n
        return np.array(out, dtype=np.int64)

    @cached_property
    def value_names(self) -> tuple[str, ...]:
        """Names of the values; as the dofs, but `joint.qw`, `qx`, `qy`, `qz` for a ball joint."""
        names: list[str] = []
        for j in self.joints:
            rest = list(j.dof_names)
            if j.kind == "ball":
                rest = rest[:-3] + [f"{j.name}.{q}" for q in ("qw", "qx", "qy", "qz")]
            names += rest
        return tuple(names)

    @cached_property
    def limits(self) -> Array:
        """Lowest and highest value of each degree of freedom, (n_dofs, 2); infinite where there is none."""
        rows = []
        for j in self.joints:
            rows += [(-np.inf, np.inf)] * (len(j.dof_names) - len(j.axes))
            rows += [a.limits for a in j.axes]
        return np.array(rows, dtype=np.float64).reshape(-1, 2)

    @cached_property
    def spreads(self) -> Array:
        """Standard deviation of each degree of freedom from 0, (n_dofs,), rad; infinite if unknown."""
        rows = []
        for j in self.joints:
            rows += [np.inf] * (len(j.dof_names) - len(j.axes)) + [a.spread for a in j.axes]
        return np.array(rows, dtype=np.float64)

    @cached_property
    def limb_dofs(self) -> NDArray[np.bool_]:
        """Whether a degree of freedom bends a limb freely, (n_dofs,): neither of the root nor with a spread."""
        return (self.dof_joint != 0) & ~np.isfinite(self.spreads)

    @cached_property
    def moves(self) -> NDArray[np.bool_]:
        """Whether a degree of freedom moves a part, (n_dofs, n_parts)."""
        ancestors = np.zeros((len(self.parts), len(self.parts)), dtype=bool)  # [joint, part]
        for part, parent in enumerate(self.parents):
            if parent >= 0:
                ancestors[:, part] = ancestors[:, parent]
            ancestors[part, part] = True
        return ancestors[self.dof_joint]

    @cached_property
    def point_names(self) -> tuple[str, ...]:
        """Names of the body's points: its joints, then its landmarks."""
        return tuple(j.name for j in self.joints) + tuple(m.name for m in self.landmarks)

    @cached_property
    def point_parts(self) -> IntArray:
        """Index of the part that carries each point, (n_points,)."""
        landmarks = [self.part_index[m.part] for m in self.landmarks]
        return np.array([*range(len(self.joints)), *landmarks], dtype=np.int64)

    @cached_property
    def points_part(self) -> Array:
        """Each point in the frame of the part that carries it, (n_points, 3), metres."""
        landmarks = [m.position for m in self.landmarks]
        return np.array([(0.0, 0.0, 0.0)] * len(self.joints) + landmarks) * self.height_m

    @cached_property
    def proximal_parts(self) -> IntArray:
        """Index of the part at whose distal end each point lies, (n_points,): a joint's parent, a landmark's own part.

        Anatomical joint centres are stated there, as regression equations do: the hip in the pelvis, the knee in the
        thigh.
        """
        joints = [max(parent, 0) for parent in self.parents]
        return np.array([*joints, *(self.part_index[m.part] for m in self.landmarks)], dtype=np.int64)

    @cached_property
    def center_offsets(self) -> Array:
        """From each point to its anatomical joint centre in its proximal part's frame, (n_points, 3), metres."""
        offsets = [j.center_offset for j in self.joints] + [m.center_offset for m in self.landmarks]
        return np.array(offsets) * self.height_m

    @cached_property
    def bones(self) -> tuple[tuple[str, str], ...]:
        """Pairs of points that a stick figure connects: each point and the joint that carries its part."""
        pairs = []
        for i, name in enumerate(self.point_names):
            part = int(self.point_parts[i])
            joint = self.joints[part]
            if i != part:
                pairs.append((joint.name, name))  # a landmark is connected to its part's joint
            elif joint.parent:
                pairs.append((self.joints[self.part_index[joint.parent]].name, name))
        return tuple(pairs)

    @cached_property
    def tree(self) -> "Tree":
        """The joint tree as arrays, for `forward_kinematics`."""
        from tracker.body.kinematics import Operation, Tree

        ops, axes = [], []
        for i, j in enumerate(self.joints):
            if j.free:
                ops.append((Operation.TRANSLATE, i))
                axes.append((0.0, 0.0, 0.0))
            if j.kind == "ball":
                ops.append((Operation.BALL, i))
                axes.append((0.0, 0.0, 0.0))
            for a in j.axes:
                ops.append((Operation.REVOLVE, i))
                axes.append(a.direction)
        return Tree(
            np.array(self.parents, dtype=np.int64),
            np.array([j.position for j in self.joints]) * self.height_m,
            np.array(ops, dtype=np.int64),
            np.array(axes, dtype=np.float64),
        )

    def neutral(self) -> Array:
        """Return the values of the default pose: upright at the world's origin, arms hanging, angles within limits."""
        values = np.zeros(len(self.value_names))
        for i, name in enumerate(self.value_names):
            if name.endswith(".qw"):
                values[i] = 1.0
        return self.clip(values)

    def kinematics(self, values: Array) -> "Kinematics":
        """Compute the kinematics of a pose, (n_values,)."""
        import tracker.body.kinematics  # this form costs a tenth of the call; `from` costs a third

        n_parts, n_dofs, kernels = len(self.parts), self.n_dofs, tracker.body.kinematics
        out = kernels.Kinematics(np.empty((n_parts, 4, 4)), np.empty((n_dofs, 3)), np.empty((n_dofs, 3)))
        kernels.forward_kinematics(np.array(values, dtype=np.float64), self.tree, *out)
        return out

    def points_world(self, values: Array) -> Array:
        """Return the positions of the body's points (see `point_names`), (n_points, 3), metres."""
        return PosedBody(self, values).points_world

    def named_points_world(self, values: Array) -> dict[str, Array]:
        """Return the positions of the body's points by name, (3,) each, metres."""
        return PosedBody(self, values).named_points_world

    def points_at(self, kinematics: "Kinematics", points: IntArray) -> Array:
        """Return the positions of some points, given by index (N,), from known kinematics, (N, 3), metres."""
        T = kinematics.Ts_world_part[self.point_parts[points]]
        return np.einsum("nij,nj->ni", T[:, :3, :3], self.points_part[points]) + T[:, :3, 3]

    def joint_centers_at(self, kinematics: "Kinematics", points: IntArray) -> Array:
        """Return the anatomical joint centres of some points, given by index (N,), (N, 3), metres."""
        offsets, R = self.center_offsets[points], kinematics.Ts_world_part[self.proximal_parts[points], :3, :3]
        return self.points_at(kinematics, points) + np.einsum("nij,nj->ni", R, offsets)

    def joint_centers_world(self, values: Array) -> Array:
        """Return the anatomical joint centres of a pose in the order of `point_names`, (n_points, 3), metres.

        They are what other programs call joints. A point without an offset is its own joint centre.
        """
        return PosedBody(self, values).joint_centers_world

    def point_jacobian(self, kinematics: "Kinematics", parts: IntArray, points_world: Array) -> Array:
        """Differentiate points fixed to parts by the degrees of freedom.

        A rotation about axis a through o moves x at `a x (x - o)`, a translation at `a` (the columns of the
        geometric Jacobian; cf. KRH08 Eq. 24 with spatial twists).

        Args:
            kinematics: of the pose at which to differentiate.
            parts: index of the part that carries each point, (N,).
            points_world: the points, (N, 3), metres.

        Returns:
            (N, 3, n_dofs), metres per radian or per metre.
        """
        from tracker.body.kinematics import point_jacobian

        J = np.empty((len(parts), 3, self.n_dofs))
        points = np.array(points_world, dtype=np.float64, order="C")  # one form of the argument: compiled once
        point_jacobian(kinematics, self.dof_is_length, self.moves, parts, points, J)
        return J

    def points_with_jacobian(
        self, kinematics: "Kinematics", points: IntArray, centers: bool = False
    ) -> tuple[Array, Array]:
        """Return `points_at`, or `joint_centers_at`, (N, 3), and their `point_jacobian`, (N, 3, n_dofs)."""
        parts, places = self.point_parts[points], self.points_at(kinematics, points)
        if centers and self.center_offsets.any():
            parts = np.where(self.center_offsets[points].any(axis=1), self.proximal_parts[points], parts)
            places = self.joint_centers_at(kinematics, points)
        return places, self.point_jacobian(kinematics, parts, places)

    def retract(self, values: Array, step: Array) -> Array:
        """Move poses, (..., n_values), by steps in their degrees of freedom, (..., n_dofs), to (..., n_values).

        Angles and lengths add; ball joints rotate.
        """
        out = np.empty((*step.shape[:-1], values.shape[-1]))
        out[:] = values
        dofs, at = self._plain
        out[..., at] += step[..., dofs]
        for ball in self._balls:
            turn = rigid.quaternion_exp(step[..., ball.dofs])
            out[..., ball.values] = rigid.quaternion_multiply(out[..., ball.values], turn)
        return out

    def move(self, values: Array, step: Array) -> Array:
        """Move a pose as `retract` does, but within the joint limits; see `clip`."""
        return self.clip(self.retract(values, step))

    def difference(self, values_to: Array, values_from: Array) -> Array:
        """Return the steps in the degrees of freedom, (..., n_dofs), by which `retract` gets from poses to others, each
        (..., n_values)."""
        to, start = np.asarray(values_to, dtype=np.float64), np.asarray(values_from, dtype=np.float64)
        step = np.empty((*to.shape[:-1], self.n_dofs))
        dofs, at = self._plain
        step[..., dofs] = to[..., at] - start[..., at]
        for ball in self._balls:
            back = start[..., ball.values] * (1.0, -1.0, -1.0, -1.0)
            step[..., ball.dofs] = rigid.quaternion_log(rigid.quaternion_multiply(back, to[..., ball.values]))
        return step

    def clip(self, values: Array) -> Array:
        """Clip poses, (..., n_values), to the joint limits: angles to a range, ball joints to a cone and a twist."""
        out = np.array(values, dtype=np.float64)
        low, high = self._plain_limits
        if not self._balls:  # then the values are the degrees of freedom
            return np.minimum(np.maximum(out, low, out=out), high, out=out)
        at = self._plain[1]
        out[..., at] = np.minimum(np.maximum(out[..., at], low), high)
        for ball in self._balls:
            joint = ball.joint
            out[..., ball.values] = np.apply_along_axis(
                rigid.clip_swing_twist, -1, out[..., ball.values], joint.cone, joint.twist
            )
        return out

    @cached_property
    def _plain(self) -> tuple[IntArray, IntArray]:
        """The degrees of freedom that are values themselves, and the index of each into the values."""
        dofs = np.setdiff1d(np.arange(self.n_dofs), np.concatenate([[], *(np.r_[b.dofs] for b in self._balls)]))
        return dofs.astype(np.int64), self.dof_value[dofs.astype(np.int64)]

    @cached_property
    def _plain_limits(self) -> tuple[Array, Array]:
        """Lower and upper limits of the degrees of freedom of `_plain`."""
        low, high = self.limits[self._plain[0]].T
        return low.copy(), high.copy()

    @cached_property
    def _balls(self) -> tuple["_Ball", ...]:
        """The positions of the ball joints in the degrees of freedom and in the values."""
        out = []
        for i, joint in enumerate(self.joints):
            if joint.kind == "ball":
                last = int(np.flatnonzero(self.dof_joint == i)[-1])
                at = int(self.dof_value[last])
                out.append(_Ball(joint, slice(last - 2, last + 1), slice(at, at + 4)))
        return tuple(out)


@dataclass(frozen=True, eq=False)
class PosedBody:
    """A body model in a pose. Synthesis, occlusion and scoring take lists of these."""

    model: BodyModel
    values: Array
    """Pose, (n_values,)."""
    velocity: Array | None = None
    """Change of the pose from one frame to the next, (n_dofs,), rad or metres; None: unknown, or not needed."""

    def ahead(self, frames: float) -> "PosedBody":
        """Return the body some frames later, or earlier if negative, by its velocity; as it is if that is unknown."""
        if frames == 0.0 or self.velocity is None:
            return self
        return PosedBody(self.model, self.poses_ahead(self.values[None], frames)[0])

    def poses_ahead(self, poses: Array, frames: float) -> Array:
        """Return other poses of the body, (n, n_values), some frames later by the velocity of this one; see `ahead`."""
        if frames == 0.0 or self.velocity is None:
            return poses
        return np.array([self.model.retract(pose, frames * self.velocity) for pose in poses])

    @cached_property
    def kinematics(self) -> "Kinematics":
        """The poses of its parts."""
        return self.model.kinematics(self.values)

    @cached_property
    def points_world(self) -> Array:
        """Positions of its points, (n_points, 3), metres."""
        return self.model.points_at(self.kinematics, np.arange(len(self.model.point_parts)))

    @property
    def named_points_world(self) -> dict[str, Array]:
        """Positions of its points by name, (3,) each, metres."""
        return dict(zip(self.model.point_names, self.points_world, strict=True))

    @cached_property
    def joint_centers_world(self) -> Array:
        """Its anatomical joint centres, (n_points, 3), metres; see `BodyModel.joint_centers_world`."""
        return self.model.joint_centers_at(self.kinematics, np.arange(len(self.model.point_parts)))


def ahead(bodies: Sequence[PosedBody], frames: float) -> Sequence[PosedBody]:
    """Return bodies some frames later, see `PosedBody.ahead`; the same ones for 0."""
    return bodies if frames == 0.0 else [b.ahead(frames) for b in bodies]


def parts_of(models: Sequence[BodyModel], person: int) -> slice:
    """Return the slice of one person's parts among the parts of all people, concatenated."""
    first = sum(len(m.parts) for m in models[:person])
    return slice(first, first + len(models[person].parts))
