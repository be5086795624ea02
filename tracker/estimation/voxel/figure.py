"""The figure of ten parts that the filter estimates, and its joints as functions of the part sizes (MTHC01 Fig. 5)."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.errors import TrackerError
from tracker.evidence.voxels.part_size import CYLINDER, ELLIPSOID
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.shapes import Ellipsoid

PARTS = (
    "torso", "head", "left_upper_arm", "right_upper_arm", "left_thigh", "right_thigh",
    "left_forearm", "right_forearm", "left_calf", "right_calf",
)  # fmt: skip
"""Names of the parts: 0, 1, 2a, 2b, 3a, 3b, 4a, 4b, 5a, 5b of the paper."""
N_PARTS = len(PARTS)
TORSO, HEAD = PARTS.index("torso"), PARTS.index("head")
LIMBS = {
    f"{side}_{limb}": (PARTS.index(f"{side}_{upper}"), PARTS.index(f"{side}_{lower}"))
    for limb, upper, lower in (("arm", "upper_arm", "forearm"), ("leg", "thigh", "calf"))
    for side in ("left", "right")
}
"""Indices of the upper and the lower part of each limb."""
PARENTS = tuple(next((upper for upper, lower in LIMBS.values() if lower == i), TORSO) for i in range(N_PARTS))
"""Index of the part that each part hangs on; the torso hangs on itself."""
ROOTS = {
    "head": "neck", "left_upper_arm": "left_shoulder", "right_upper_arm": "right_shoulder", "left_thigh": "left_hip",
    "right_thigh": "right_hip", "left_forearm": "left_elbow", "right_forearm": "right_elbow",
    "left_calf": "left_knee", "right_calf": "right_knee",
}  # fmt: skip
"""Joint at which each part begins in the bodies of a session."""
_ENDS = {"left_forearm": "left_wrist", "right_forearm": "right_wrist", "left_calf": "left_ankle",
         "right_calf": "right_ankle", "head": "head"}  # fmt: skip
"""Point that is followed on a part without a part beyond it."""


class FigureJoints(NamedTuple):
    """The structure of a figure. Joints lie at fixed shares of the half sizes of their parts."""

    parent_shares: Array
    """Position of each part's joint in its parent's frame, in half sizes of the parent, (10, 3); 0 for the torso."""
    own_shares: Array
    """Position of the same joint in the part's own frame, in its half sizes, (10, 3)."""
    end_shares: Array
    """Position of the point that is followed on each part (`_ENDS`), in its half sizes, (10, 3); NaN where none is."""
    is_ellipsoid: NDArray[np.bool_]
    """Whether a part is an ellipsoid, else an elliptical cylinder, (10,)."""
    order: IntArray
    """Axes of each part by ascending size, (10, 3), as the paper orders them."""

    @property
    def sigma_shares(self) -> Array:
        """Standard deviation of the voxels of a part along its axes, in half sizes, (10, 3)."""
        return np.where(self.is_ellipsoid[:, None], 1 / ELLIPSOID, 1 / CYLINDER)


class FigureOfBody(NamedTuple):
    """A figure with the sizes of a body of a session, and how the parts of that body belong to it."""

    figure: FigureJoints
    sizes: Array
    """Half sizes along x, y, z of each part, (10, 3), metres."""
    members: tuple[IntArray, ...]
    """Indices of the body's parts that each part of the figure stands for; the first one carries its frame."""
    offsets: Array
    """Centre of each part in the frame of its first member, (10, 3), metres."""


@lru_cache(maxsize=32)
def figure_of(model: BodyModel) -> FigureOfBody:
    """Return the figure of a body.

    Raises:
        TrackerError: the body lacks the joints of ten parts.
    """
    needed = {*ROOTS.values(), *_ENDS.values()}
    if not needed <= set(model.point_names):
        missing = ", ".join(sorted(needed - set(model.point_names)))
        raise TrackerError(
            f"expected a body with the joints of ten parts, found {model.name} without {missing}; choose another body "
            "or another tracking method"
        )
    body = PosedBody(model, np.where([n.endswith(".qw") for n in model.value_names], 1.0, 0.0))
    points = body.named_points_world
    members = _members(model)
    boxes = np.array([_box(body, m) for m in members])
    joints = np.array([points[ROOTS[n]] if n in ROOTS else np.zeros(3) for n in PARTS])
    _between_joints(boxes, joints)
    centers, sizes = boxes.mean(axis=1), (boxes[:, 1] - boxes[:, 0]) / 2
    ends = np.array([points[_ENDS[n]] if n in _ENDS else np.full(3, np.nan) for n in PARTS])
    at_parent = (joints - centers[list(PARENTS)]) / sizes[list(PARENTS)]
    at_parent[TORSO] = 0.0
    own = (joints - centers) / sizes
    own[TORSO] = 0.0
    figure = FigureJoints(
        at_parent, own, (ends - centers) / sizes,
        np.array([isinstance(model.shapes[m[0]], Ellipsoid) or k == HEAD for k, m in enumerate(members)]),
        np.argsort(sizes, axis=1, kind="stable"),
    )  # fmt: skip
    firsts = [int(m[0]) for m in members]
    return FigureOfBody(figure, sizes, members, centers - body.kinematics.Ts_world_part[firsts, :3, 3])


def part_rotations(body: PosedBody, of: FigureOfBody) -> Array:
    """Return the rotations of the figure's parts in a pose of the body, (10, 3, 3).

    The torso's z axis points from between the hips to the neck, whatever joints its trunk has.
    """
    points = body.named_points_world
    R = body.kinematics.Ts_world_part[[int(m[0]) for m in of.members], :3, :3].copy()
    up = points["neck"] - (points["left_hip"] + points["right_hip"]) / 2
    up /= np.linalg.norm(up)
    left = points["left_shoulder"] - points["right_shoulder"] + points["left_hip"] - points["right_hip"]
    left -= (left @ up) * up
    left /= np.linalg.norm(left)
    R[TORSO] = np.column_stack([np.cross(left, up), left, up])
    return R


def torso_center(body: PosedBody, of: FigureOfBody, rotation: Array) -> Array:
    """Return the centre of the figure's torso, (3,), metres, that brings its neck and hips closest to the body's."""
    points = body.named_points_world
    neck, left_hip, right_hip = (
        points[ROOTS[PARTS[part]]] - rotation @ (of.figure.parent_shares[part] * of.sizes[TORSO]) for part in (1, 4, 5)
    )
    return np.asarray((neck + (left_hip + right_hip) / 2) / 2)


def with_shoulders_of(of: FigureOfBody, body: PosedBody, rotation: Array, center: Array) -> FigureJoints:
    """Return the figure with its shoulders where a pose of the body has them.

    Collarbones are no parts of a figure. They move its shoulders by more than its arms are thick, and keep them there.

    Args:
        of: the figure of the body.
        body: in the pose.
        rotation: of the torso in the world, (3, 3).
        center: of the torso, (3,), metres.
    """
    points, shares = body.named_points_world, of.figure.parent_shares.copy()
    for part in (upper for limb, (upper, _) in LIMBS.items() if limb.endswith("arm")):
        shares[part] = rotation.T @ (points[ROOTS[PARTS[part]]] - center) / of.sizes[TORSO]
    return of.figure._replace(parent_shares=shares)


def chain_centers(figure: FigureJoints, sizes: Array, rotations: Array, center: Array) -> Array:
    """Return the centres of all parts, (10, 3), metres, by their kinematic chains (MTHC01 Eq. 3).

    Args:
        figure: its structure.
        sizes: half sizes, (10, 3), metres.
        rotations: of the parts in the world, (10, 3, 3).
        center: of the torso, (3,), metres.
    """
    out = np.empty((N_PARTS, 3))
    out[TORSO] = center
    for i in range(1, N_PARTS):
        p = PARENTS[i]
        joint = out[p] + rotations[p] @ (figure.parent_shares[i] * sizes[p])
        out[i] = joint - rotations[i] @ (figure.own_shares[i] * sizes[i])
    return out


class PointShares(NamedTuple):
    """Joints of a figure, and ends of its limbs."""

    names: tuple[str, ...]
    """(N,)."""
    parts: IntArray
    """Index of the part of each, (N,)."""
    shares: Array
    """Position of each in half sizes of its part, (N, 3)."""


def point_shares(figure: FigureJoints) -> PointShares:
    """Return where the joints and the ends of the limbs lie on the parts."""
    roots, ends = list(range(1, N_PARTS)), [i for i, n in enumerate(PARTS) if n in _ENDS]
    names = [ROOTS[PARTS[i]] for i in roots] + [_ENDS[PARTS[i]] for i in ends]
    shares = np.concatenate([figure.own_shares[roots], figure.end_shares[ends]])
    return PointShares(tuple(names), np.array(roots + ends), shares)


def _members(model: BodyModel) -> tuple[IntArray, ...]:
    """Return the parts of a body that each part of the figure stands for, the first one at its joint."""
    begins = {model.joints[j].child: PARTS.index(n) for n, root in ROOTS.items()
              for j in [[x.name for x in model.joints].index(root)]}  # fmt: skip
    of = np.zeros(len(model.parts), dtype=np.int64)
    for i, part in enumerate(model.parts):
        parent = model.parents[i]
        of[i] = begins.get(part.name, TORSO if parent < 0 else of[parent])
    return tuple(np.flatnonzero(of == k) for k in range(N_PARTS))


def _box(body: PosedBody, members: IntArray) -> tuple[Array, Array]:
    """Return the lowest and highest corner of some parts of a body in its zero pose, (3,) each, metres.

    Across the axis only the largest part counts: a foot does not widen its calf, nor a collar the trunk.
    """
    model = body.model
    centers = body.kinematics.Ts_world_part[members, :3, 3] + model.centers_part[members]
    half_axes = np.array([model.shapes[i].half_axes for i in members])
    lows, highs = centers - half_axes, centers + half_axes
    largest = int(np.argmax(half_axes.prod(axis=1)))
    low, high = lows[largest].copy(), highs[largest].copy()
    low[2], high[2] = lows[:, 2].min(), highs[:, 2].max()
    return low, high


def _between_joints(boxes: Array, joints: Array) -> None:
    """Let parts end at their joints, as in MTHC01 Fig. 5, so that they do not overlap as the solids of a body do."""
    boxes[TORSO, :, 2] = joints[[4, 5], 2].mean(), joints[HEAD, 2]
    boxes[HEAD, 0, 2] = joints[HEAD, 2]
    for upper, lower in LIMBS.values():
        boxes[upper, :, 2] = joints[lower, 2], joints[upper, 2]
        boxes[lower, 1, 2] = joints[lower, 2]
