"""Steps between poses in degrees of freedom, the shorter way round; velocities and predictions that follow from them.

Two sets of angles give a joint of three axes, each orthogonal to the one before, the same rotation: `a, b, c` and `a +
180, 180 - b, c + 180` degrees, with `-b` where the third axis is the first. A search may find either. Numbers that jump
from one to the other (an Euler flip) look like a fast turn that nobody made.

By its velocity a body is shown to cameras whose pictures were taken between frames.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel, PosedBody
from tracker.body.parts import Joint
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array, IntArray

MAX_ORDER = 2
"""Highest degree of a motion model: GD96 Sect. 4.2 predicts with constant acceleration."""


@dataclass(frozen=True)
class PredictSettings:
    """Settings of the motion model."""

    order: int = 1
    """Degree of the polynomial: 0 stays, 1 is constant velocity, 2 is constant acceleration, as in the paper. On noisy
    poses a parabola overshoots and tracks worse than constant velocity."""
    window: int = 3
    """Number of past poses it is fitted to."""
    full_window: bool = False
    """Whether the pose stays until there are as many past poses; else fewer are fitted, with a lower degree."""
    bound_rad: float = float(np.radians(25))
    """Largest predicted change of an angle from one frame to the next, rad."""
    bound_m: float = 0.10
    """Largest predicted change of a position from one frame to the next, metres."""

    def __post_init__(self) -> None:
        """Check the settings; raise a TrackerError for values that predict nothing."""
        if not 0 <= self.order <= MAX_ORDER or self.window < 1:
            raise TrackerError(
                f"expected a prediction of order 0 to {MAX_ORDER} over at least 1 past pose, found order "
                f"{self.order} over {self.window}"
            )


def predict(model: BodyModel, past: Sequence[Array], settings: PredictSettings) -> Array:
    """Extrapolate the past poses by one frame.

    The polynomial is fitted to the shortest steps from the last pose, so that a rotation continues through half a
    turn. With too few poses for the order, the order is reduced.

    Args:
        model: the body.
        past: its poses, one frame apart, the last one last, (n_values,) each; at least one.
        settings: degree, window and bounds.

    Returns:
        The predicted pose within the joint limits, (n_values,).
    """
    last, recent = past[-1], past[-settings.window :]
    short = settings.full_window and len(recent) < settings.window
    order = 0 if short else min(settings.order, len(recent) - 1)
    if order == 0:
        return model.clip(last)
    steps = np.array([shortest_step(model, p, last) for p in recent])
    times = np.arange(1.0 - len(recent), 1.0)
    coefficients = np.linalg.lstsq(np.vander(times, order + 1), steps, rcond=None)[0]
    step = coefficients.sum(axis=0)  # the polynomial at time 1
    bound = np.where(model.dof_is_length, settings.bound_m, settings.bound_rad)
    return model.move(last, np.clip(step, -bound, bound))


class _EulerJoints(NamedTuple):
    """The joints of a body whose rotations have two sets of angles each."""

    dofs: IntArray
    """Their degrees of freedom, (J, 3)."""
    values: IntArray
    """Indices of their angles in a pose, (J, 3)."""
    middle_sums: Array
    """Sum of the middle angles of both sets, (J,), rad."""
    low: Array
    """Lowest of each angle, (J, 3), rad."""
    high: Array
    """Highest of each angle, (J, 3), rad."""
    centers: Array
    """Angles in the middle between both limits, (J, 3), rad; NaN without limits."""

    def other(self, angles: Array, near: Array) -> Array:
        """Return the other angles of the same rotations, (..., J, 3), each by the turn nearest to another, rad."""
        first, middle, last = np.moveaxis(angles, -1, 0)
        out = np.stack([first + np.pi, self.middle_sums - middle, last + np.pi], axis=-1)
        return np.asarray(out - 2 * np.pi * np.round((out - near) / (2 * np.pi)))


def shortest_step(model: BodyModel, to: Array, start: Array) -> Array:
    """Return the shortest step, (n_dofs,), by which `BodyModel.retract` gets from one pose to another.

    The numbers that it leads to may be others than those of `to`, and beyond the joint limits: unlimited angles go the
    shorter way round, and joints to the nearer of their two sets of angles.
    """
    return _step_and_flips(model, to, start)[0]


def nearest_equivalent(
    model: BodyModel, poses: Array, reference: Array, active_dofs: NDArray[np.bool_] | None = None
) -> Array:
    """Return the same poses by numbers that are nearer to those of a reference.

    Args:
        model: the body.
        poses: (..., n_values).
        reference: (n_values,), or one for each pose.
        active_dofs: degrees of freedom that may change, (n_dofs,); None: all.

    Returns:
        Of the two sets of angles of each joint the nearer one, among those within the limits, (..., n_values).
    """
    out, joints = np.array(poses), _euler_joints(model)
    near, own = reference[..., joints.values], out[..., joints.values]
    other = joints.other(own, np.where(np.isnan(joints.centers), near, joints.centers))
    within = [np.clip(x, joints.low, joints.high) for x in (own, other)]
    own_fits, other_fits = (np.isclose(*pair).all(axis=-1) for pair in zip((own, other), within, strict=True))
    is_nearer = ((other - near) ** 2).sum(axis=-1) < ((own - near) ** 2).sum(axis=-1)
    is_free = True if active_dofs is None else active_dofs[joints.dofs].all(axis=-1)
    is_other = other_fits & (is_nearer | ~own_fits) & is_free
    out[..., joints.values] = np.where(is_other[..., None], within[1], own)
    return out


def _step_and_flips(model: BodyModel, to: Array, start: Array) -> tuple[Array, list[int]]:
    """Return the shortest step, and the middle degrees of freedom of joints that go to their other set of angles."""
    step, joints = model.difference(to, start), _euler_joints(model)
    winds = ~model.dof_is_length & np.isinf(model.limits).all(axis=1)
    step = np.where(winds, np.remainder(step + np.pi, 2 * np.pi) - np.pi, step)
    begins, rotations = start[joints.values], step[joints.dofs]
    others = joints.other(np.asarray(to)[joints.values], begins) - begins
    # To the other set, both outer angles go by 180 degrees less.
    lengths, shorter = (rotations**2).sum(axis=1), (others**2).sum(axis=1)
    is_other = (lengths > np.pi**2 / 2) & (shorter < lengths)
    step[joints.dofs[is_other]] = others[is_other]
    return step, joints.dofs[is_other, 1].tolist()


@lru_cache(maxsize=16)
def _euler_joints(model: BodyModel) -> _EulerJoints:
    sums = [middle_angle_sum(joint) for joint in model.joints]
    known = [i for i, middle in enumerate(sums) if middle is not None]
    dofs = [np.flatnonzero((model.dof_joint == i) & ~model.dof_is_length) for i in known]
    at = np.array(dofs, dtype=np.int64).reshape(-1, 3)
    limits = model.limits[at]
    centers = np.where(np.isfinite(limits), limits, np.nan).mean(axis=-1)
    middle_sums = np.array([sums[i] for i in known], dtype=np.float64)
    return _EulerJoints(at, model.dof_value[at], middle_sums, limits[..., 0], limits[..., 1], centers)


def middle_angle_sum(joint: Joint) -> float | None:
    """Return the sum of the middle angles of both sets of a joint, rad.

    None without three axes, each orthogonal to the one before: such a joint does not reach every orientation.
    """
    if joint.kind != "revolute" or len(joint.axes) != 3:
        return None
    first, second, third = (np.array(a.direction) for a in joint.axes)
    if not np.allclose([first @ second, second @ third], 0):
        return None
    return float(-2 * np.arctan2(second @ np.cross(first, third), first @ third))


NEAR = (-2, -1, 0, 1, 2)
"""Frames whose poses a velocity depends on, from its own."""


def velocity(model: BodyModel, poses: Mapping[int, Array], frame: int) -> Array | None:
    """Return the change of a pose from one frame to the next, (n_dofs,), rad or metres; None without a neighbour.

    It is the central difference, averaged over three frames where the poses of two frames to both sides are known. At
    the end of known poses it is the difference from the only neighbour.

    Args:
        model: the body of all poses.
        poses: by frame, (n_values,) each.
        frame: a frame with a pose.
    """
    known = {i: poses[frame + i] for i in range(-2, 3) if frame + i in poses}
    if len(known) == 5:
        return np.asarray(sum(shortest_step(model, known[i + 1], known[i - 1]) for i in (-1, 0, 1)) / 6)
    before, after = (-1 if -1 in known else 0), (1 if 1 in known else 0)
    if 0 not in known or before == after:
        return None
    return shortest_step(model, known[after], known[before]) / (after - before)


def moving_bodies(
    models: Sequence[BodyModel], poses: Mapping[int, Sequence[Array]], frame: int
) -> tuple[PosedBody, ...]:
    """Return all people on a frame, with their velocities by the frames around.

    Args:
        models: the body of each person.
        poses: of all people by frame, (n_values,) each.
        frame: a frame with poses.
    """
    near = {k: poses[k] for k in (frame + n for n in NEAR) if k in poses}
    speeds = [velocity(m, {k: own[i] for k, own in near.items()}, frame) for i, m in enumerate(models)]
    return tuple(map(PosedBody, models, poses[frame], speeds))
