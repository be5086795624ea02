"""Find the torso of a figure by a template anchored at the neck: iterated, shrunk and grown (MTHC01 Sect. 3)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.errors import Remedy, TrackerError
from tracker.estimation.initialization.generators.standing_body import typical_person
from tracker.evidence.voxels.part_size import principal_axes
from tracker.evidence.voxels.voxel_grid import Voxels
from tracker.geometry.arrays import Array

_MIN_FILLED = 0.75
"""Smallest share of occupied voxels in a layer that is added; a lower one meets empty voxels."""


class Torso(NamedTuple):
    """The torso of a figure: an elliptical cylinder below the neck."""

    neck: Array
    """Centre of its upper base, (3,), metres."""
    neck_joint: Array
    """Joint of the neck below it, (3,), metres."""
    axes: Array
    """Unit directions as columns, (3, 3): across the narrow side, across the wide side, and from the legs to the
    neck; right-handed."""
    half_axes: Array
    """Half its depth, width and length, (3,), metres."""
    is_torso: NDArray[np.bool_]
    """Whether each voxel of the figure belongs to it, (N,)."""

    @property
    def center(self) -> Array:
        """Centre of the cylinder, (3,), metres."""
        return np.asarray(self.neck - self.half_axes[2] * self.axes[:, 2])

    def scaled(self, factor: float) -> "Torso":
        """Return it in a figure that is larger by a factor about the world's origin."""
        return self._replace(
            neck=self.neck * factor, neck_joint=self.neck_joint * factor, half_axes=self.half_axes * factor
        )

    def turned_round(self) -> "Torso":
        """Return it facing the other way: forwards and left are exchanged with backwards and right."""
        return self._replace(axes=self.axes * np.array([-1.0, -1.0, 1.0]))

    def local(self, points: Array) -> Array:
        """Return points, (N, 3), in its frame about its centre, (N, 3), metres."""
        return np.asarray((points - self.center) @ self.axes)


def find_torso(figure: Voxels, neck: Array, joint_below_m: float, is_head: NDArray[np.bool_]) -> Torso:
    """Return the torso of a figure whose head is known.

    Args:
        figure: voxels of one person.
        neck: base of the head, (3,), metres.
        joint_below_m: depth of the joint of the neck below it, metres.
        is_head: which voxels belong to the head, (N,).

    Raises:
        TrackerError: nothing is below the head.
    """
    points, others = figure.points_world, ~is_head
    up = _axis(points[others], neck)
    # The shoulder girdle is wide where arms hang at a trunk's sides.
    girdle = others & _in_cylinder(points, neck, up, _trunk_m() / 2, typical_person().half_breadth_m)
    if not girdle.any():
        raise TrackerError(
            "expected a trunk below the head in the silhouettes, found none", Remedy("another_frame_or_place")
        )
    axes = _across(points[girdle], figure.grid.size_m, up)
    half = _grown(figure, neck, axes)
    local = (points - neck) @ axes
    within = np.sum(np.square(local[:, :2] / half[:2]), axis=1) <= 1.0
    is_torso = others & within & (local[:, 2] <= 0) & (local[:, 2] >= -2 * half[2])
    return Torso(neck, neck - joint_below_m * axes[:, 2], axes, half, is_torso)


def _trunk_m() -> float:
    """Return the length of an adult's trunk from the neck to the hips, metres."""
    return -float(typical_person().from_neck("left_hip")[2])


def _axis(points: Array, neck: Array) -> Array:
    """Return the direction from the torso to the neck, (3,): the template turns to the centroid of its voxels.

    It turns until it holds the same voxels as before.
    """
    length, radius = _trunk_m(), float(typical_person().half_trunk_m.mean())
    down = points.mean(axis=0) - neck
    down /= np.linalg.norm(down)
    before = set[bytes]()
    inside = _in_cylinder(points, neck, -down, length, radius)
    while inside.any() and inside.tobytes() not in before:
        before.add(inside.tobytes())
        down = points[inside].mean(axis=0) - neck
        down /= np.linalg.norm(down)
        inside = _in_cylinder(points, neck, -down, length, radius)
    return np.asarray(-down)


def _in_cylinder(points: Array, neck: Array, up: Array, length_m: float, radius_m: float) -> NDArray[np.bool_]:
    along = (points - neck) @ up
    across = np.linalg.norm(points - neck - along[:, None] * up, axis=1)
    return np.asarray((along <= 0) & (along >= -length_m) & (across <= radius_m))


def _across(points: Array, size_m: float, up: Array) -> Array:
    """Return the axes of a torso, (3, 3): the wide one is that of the largest spread across `up`."""
    flat = points - np.outer(points @ up, up)
    wide = principal_axes(flat, size_m).axes[:, 2]
    wide = wide - (wide @ up) * up
    wide /= np.linalg.norm(wide)
    return np.column_stack([np.cross(wide, up), wide, up])


def _grown(figure: Voxels, neck: Array, axes: Array) -> Array:
    """Shrink the template and grow it until further growth meets empty voxels; return half its axes, (3,), metres.

    It grows across both axes first, then towards the legs, until they part. It begins as a rod through half a trunk.
    It ends where the thighs of an adult have parted, and within the breadth over the arms.
    """
    size, adult = figure.grid.size_m, typical_person()
    crotch_m = _trunk_m() + adult.thickness_m("leg")
    half, largest = np.array([size, size, _trunk_m() / 4]), np.array([*[adult.half_breadth_m] * 2, crotch_m / 2])
    growing = [0, 1, 2]
    while growing:
        for axis in list(growing):
            larger = half.copy()
            larger[axis] += size / (2 if axis == 2 else 1)
            if larger[axis] > largest[axis] or _filled(figure, neck, axes, half, larger) < _MIN_FILLED:
                growing.remove(axis)
            else:
                half = larger
    return half


def _filled(figure: Voxels, neck: Array, axes: Array, half: Array, larger: Array) -> float:
    """Return the share of occupied voxels in the growth of a template."""
    step = figure.grid.size_m / 2
    x, y = (np.arange(-h, h + step / 2, step) for h in larger[:2])
    z = np.arange(-2 * larger[2], step / 2, step)
    local = np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)

    def within(axes_m: Array) -> NDArray[np.bool_]:
        across = np.sum(np.square(local[:, :2] / axes_m[:2]), axis=1) <= 1.0
        return np.asarray(across & (local[:, 2] >= -2 * axes_m[2]))

    added = within(larger) & ~within(half)
    if not added.any():
        return 1.0
    at = np.round((neck + local[added] @ axes.T - figure.grid.origin) / figure.grid.size_m).astype(int)
    valid = np.all((at >= 0) & (at < figure.grid.shape), axis=1)
    return float(figure.occupied[tuple(at[valid].T)].sum() / len(at))
