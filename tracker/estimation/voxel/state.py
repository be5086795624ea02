"""The state of the filter, and its error state: rotation vectors on quaternions, sizes, torso centre, velocities.

The state of MTHC01 Sect. 4 has a world quaternion and three sizes of each part, and the torso's centre and velocity.
Beyond the paper it may hold the angular velocity of each part. A quaternion has four numbers of which three are free.
Therefore the covariance is that of a rotation vector in the frame of the part: q (x) exp(error).
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tracker.body.dimensions import MIN_PART_M
from tracker.estimation.voxel.figure import N_PARTS, PARENTS, TORSO, FigureJoints, chain_centers
from tracker.geometry import rigid
from tracker.geometry.arrays import Array, IntArray

_COLUMNS = np.arange(N_PARTS * 3).reshape(N_PARTS, -1)
"""Columns of the error state that belong to each part, from the first of their kind, (10, 3)."""
_ON_CHAIN = np.diag([float(part != TORSO) for part in range(N_PARTS)])
"""Whether each part lies on the way from the torso to a part, (10, 10); the torso itself does not."""
for _part in range(1, N_PARTS):
    _ON_CHAIN[_part] += _ON_CHAIN[PARENTS[_part]]


@dataclass(frozen=True)
class Layout:
    """Which quantities the error state holds, and where."""

    sizes: bool
    """Whether part sizes are estimated."""
    velocity: bool
    """Whether the velocity of the torso's centre is."""
    turn_rates: bool
    """Whether the angular velocity of each part is."""

    @property
    def n(self) -> int:
        """Length of the error state."""
        return self.turn_rates_at.stop

    @property
    def turns_at(self) -> slice:
        """Rotation vectors of the parts, rad."""
        return slice(0, 3 * N_PARTS)

    @property
    def center_at(self) -> slice:
        """Centre of the torso, metres."""
        return slice(3 * N_PARTS, 3 * N_PARTS + 3)

    @property
    def sizes_at(self) -> slice:
        """Half sizes of the parts, metres."""
        first = self.center_at.stop
        return slice(first, first + 3 * N_PARTS * self.sizes)

    @property
    def velocity_at(self) -> slice:
        """Velocity of the torso's centre, m/s."""
        first = self.sizes_at.stop
        return slice(first, first + 3 * self.velocity)

    @property
    def turn_rates_at(self) -> slice:
        """Angular velocities of the parts in their own frames, rad/s."""
        first = self.velocity_at.stop
        return slice(first, first + 3 * N_PARTS * self.turn_rates)


@dataclass(frozen=True, eq=False)
class FilterState:
    """A state with its covariance."""

    figure: FigureJoints
    layout: Layout
    quaternions: Array
    """Rotation of each part in the world, (10, 4)."""
    sizes: Array
    """Half sizes of each part along its axes, (10, 3), metres."""
    center: Array
    """Centre of the torso, (3,), metres."""
    velocity: Array
    """Its velocity, (3,), m/s; 0 where the layout has none."""
    turn_rates: Array
    """Angular velocity of each part in its frame, (10, 3), rad/s; 0 where the layout has none."""
    covariance: Array
    """Covariance of the error state, (n, n)."""

    @cached_property
    def rotations(self) -> Array:
        """Rotation matrix of each part, (10, 3, 3)."""
        return rigid.matrix_from_quaternion(self.quaternions)

    @cached_property
    def centers(self) -> Array:
        """Centre of each part, (10, 3), metres (MTHC01 Eq. 3). Parts are connected whatever the state holds."""
        return chain_centers(self.figure, self.sizes, self.rotations, self.center)

    @cached_property
    def center_jacobian(self) -> Array:
        """Derivative of the centres of all parts by the error state, (10, 3, n) (MTHC01 Sect. 4)."""
        at, figure, sizes, parents = self.layout, self.figure, self.sizes, list(PARENTS)
        own, parent = self.rotations, self.rotations[parents]
        by_link = np.zeros((N_PARTS, at.n, 3))  # of the way from the parent's centre, transposed
        rows = np.arange(N_PARTS)[:, None]
        own_arm, parent_arm = figure.own_shares * sizes, figure.parent_shares * sizes[parents]
        by_link[rows, _COLUMNS] = np.swapaxes(own @ rigid.skew(own_arm), 1, 2)
        by_link[rows, _COLUMNS[parents]] -= np.swapaxes(parent @ rigid.skew(parent_arm), 1, 2)
        if at.sizes:
            first = at.sizes_at.start
            by_link[rows, first + _COLUMNS] = -np.swapaxes(own * figure.own_shares[:, None], 1, 2)
            by_link[rows, first + _COLUMNS[parents]] += np.swapaxes(parent * figure.parent_shares[:, None], 1, 2)
        out = (_ON_CHAIN @ by_link.reshape(N_PARTS, -1)).reshape(N_PARTS, at.n, 3)
        out[:, at.center_at] += np.eye(3)
        return np.ascontiguousarray(np.swapaxes(out, 1, 2))

    def retract(self, step: Array) -> "FilterState":
        """Return the state moved by an error state, (n,); the covariance stays."""
        at = self.layout
        turns = rigid.quaternion_exp(step[at.turns_at].reshape(-1, 3))
        quaternions = rigid.quaternion_multiply(self.quaternions, turns)
        sizes, velocity, turn_rates = self.sizes, self.velocity, self.turn_rates
        if at.sizes:
            sizes = np.maximum(sizes + step[at.sizes_at].reshape(-1, 3), MIN_PART_M)
        if at.velocity:
            velocity = velocity + step[at.velocity_at]
        if at.turn_rates:
            turn_rates = turn_rates + step[at.turn_rates_at].reshape(-1, 3)
        return FilterState(
            self.figure, at, quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True), sizes,
            self.center + step[at.center_at], velocity, turn_rates, self.covariance,
        )  # fmt: skip

    def difference(self, other: "FilterState") -> Array:
        """Return the error state, (n,), by which `retract` gets from another state to this one."""
        at = self.layout
        back = other.quaternions * (1.0, -1.0, -1.0, -1.0)
        step = np.empty(at.n)
        step[at.turns_at] = rigid.quaternion_log(rigid.quaternion_multiply(back, self.quaternions)).ravel()
        step[at.center_at] = self.center - other.center
        if at.sizes:
            step[at.sizes_at] = (self.sizes - other.sizes).ravel()
        if at.velocity:
            step[at.velocity_at] = self.velocity - other.velocity
        if at.turn_rates:
            step[at.turn_rates_at] = (self.turn_rates - other.turn_rates).ravel()
        return step

    def with_frozen_sizes(self) -> "FilterState":
        """Return the same state without sizes in the error state."""
        at = self.layout
        kept = np.delete(np.arange(at.n), np.r_[at.sizes_at])
        return replace(
            self, layout=replace(at, sizes=False), covariance=np.ascontiguousarray(self.covariance[kept[:, None], kept])
        )

    def with_covariance(self, covariance: Array) -> "FilterState":
        """Return the same state with another covariance, (n, n)."""
        return replace(self, covariance=covariance)


def point_jacobians(state: FilterState, parts: IntArray, shares: Array) -> Array:
    """Return the derivatives of points of parts by the error state, (N, 3, n).

    Args:
        state: the state.
        parts: index of the part of each point, (N,).
        shares: position of each point in half sizes of its part, (N, 3).
    """
    at, R = state.layout, state.rotations[parts]
    out, rows = state.center_jacobian[parts], np.arange(len(parts))[:, None, None]
    xyz = np.arange(3)[:, None]
    out[rows, xyz, _COLUMNS[parts][:, None]] -= R @ rigid.skew(shares * state.sizes[parts])
    if at.sizes:
        out[rows, xyz, at.sizes_at.start + _COLUMNS[parts][:, None]] += R * shares[:, None]
    return out
