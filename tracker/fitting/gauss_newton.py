"""The one Gauss-Newton of the project: poses from residual blocks.

A block turns a pose into the normal equations of its weighted residuals. Whatever speaks for a pose is one: joints
known in space, contours and edges (`refine`), a prior. The solver is damped (Levenberg-Marquardt) and holds the joint
limits.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array, IntArray

FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-9, 1e8
FELT_DAMPING = 1e-2
"""Damping after a step that was refused, at least: less would hardly change it."""
AT_LIMIT = 1e-9
"""How near to a limit is at it, rad or metres."""
_UNKNOWN = 1.0
"""Variance of a degree of freedom that nothing is known of, rad^2 or m^2."""
_PLACE_M = 0.02
"""How well joints go with the places they are known at (one standard deviation): a body is of other sizes, metres."""


class NormalEquations(NamedTuple):
    """The normal equations of some residuals at a pose."""

    cost: float
    """Half the sum of the weighted squared residuals; of robust ones, what half the squares are bent to."""
    gradient: Array
    """Derivative of the cost by the degrees of freedom, (n_dofs,)."""
    hessian: Array
    """Gauss-Newton's second derivative, (n_dofs, n_dofs), positive semi-definite."""


class ResidualBlock(Protocol):
    """One kind of evidence for the pose of one person.

    A block hands over its normal equations and not its residuals, so that thousands of image residuals can be summed
    where they arise.
    """

    def linearize(self, model: BodyModel, values: Array, kinematics: Kinematics) -> NormalEquations:
        """Linearize the weighted residuals at a pose."""
        ...


def normal_equations(residuals: Array, jacobian: Array) -> NormalEquations:
    """Normal equations of weighted residuals (N,) with their derivative by the degrees of freedom, (N, n_dofs)."""
    return NormalEquations(0.5 * float(residuals @ residuals), jacobian.T @ residuals, jacobian.T @ jacobian)


@dataclass(frozen=True, eq=False)
class PointTargets:
    """Points of the body drawn to known places in the world."""

    points: IntArray
    """Indices into `BodyModel.point_names`, (N,)."""
    targets_world: Array
    """Where they should be, (N, 3), metres."""
    weights: Array
    """Weight of each point's distance, (N,), per metre."""

    def linearize(self, model: BodyModel, values: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        parts = model.point_parts[self.points]
        points_world = model.points_at(kinematics, self.points)
        J = model.point_jacobian(kinematics, parts, points_world) * self.weights[:, None, None]
        r = (points_world - self.targets_world) * self.weights[:, None]
        return normal_equations(r.ravel(), J.reshape(-1, model.n_dofs))


@dataclass(frozen=True, eq=False)
class PosePrior:
    """A prior that keeps a pose near another one; what the evidence leaves open stays as it was."""

    values: Array
    """The pose to stay near, (n_values,)."""
    weights: Array
    """Weight of each degree of freedom, (n_dofs,), per radian or metre."""

    def linearize(self, model: BodyModel, values: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        # d(difference)/d(step) is the identity to first order, for balls up to the curvature of the rotation.
        r = model.difference(values, self.values) * self.weights
        return NormalEquations(0.5 * float(r @ r), self.weights * r, self._hessian)

    @cached_property
    def _hessian(self) -> Array:
        return np.diag(self.weights**2)


class Fit(NamedTuple):
    """What the solver found."""

    pose: Array
    """Pose, (n_values,), within the joint limits."""
    cost: float
    """Half the sum of squared residuals."""
    iterations: int
    hessian: Array
    """Second derivative of the cost at the pose, (n_dofs, n_dofs); `covariance` takes it from there."""


def solve(
    model: BodyModel,
    values: Array,
    blocks: Sequence[ResidualBlock],
    free: NDArray[np.bool_] | None = None,
    max_iterations: int = 50,
    tolerance: float = 1e-6,
    gain: float = 0.0,
) -> Fit:
    """Minimize the summed cost of all blocks within the joint limits (Levenberg-Marquardt with an active set).

    Args:
        model: the body.
        values: where to start, (n_values,).
        blocks: the evidence.
        free: which degrees of freedom may move, (n_dofs,); all by default.
        max_iterations: how often to take a step at most.
        tolerance: smallest step that is worth another iteration, rad or metres.
        gain: smallest decrease of the cost that is worth another iteration, promised or found. Costs of image
            residuals are rough at their bottom, where steps are refused over and over.
    """
    may_move = np.ones(model.n_dofs, dtype=bool) if free is None else free
    start = values  # what may not move stays as it is there, even outside of the limits
    values = with_locked_dofs(model, model.clip(start), start, free)
    here = _sum(model, values, blocks)
    damping, iterations = FIRST_DAMPING, 0
    while iterations < max_iterations:
        iterations += 1
        moving = np.flatnonzero(may_move & ~_pressed_against_limit(model, values, here.gradient))
        if not len(moving):
            break
        g, H = here.gradient[moving], here.hessian[moving[:, None], moving]
        # Damping by the diagonal leaves metres and radians to themselves; the floor serves dofs nothing speaks of.
        scale = np.diag(H) + 1e-6 * max(1e-12, float(np.trace(H)) / len(H))
        while True:
            step = damped_step(H, g, damping * scale)
            worth = -(g + 0.5 * H @ step) @ step > gain
            change = np.zeros(model.n_dofs)
            change[moving] = step
            trial = with_locked_dofs(model, model.clip(model.retract(values, change)), start, free)
            moved = float(np.abs(model.difference(trial, values)).max())
            there = _sum(model, trial, blocks) if worth else here
            if there.cost < here.cost or not worth or moved < tolerance or damping > MOST_DAMPING:
                break
            damping = max(10 * damping, FELT_DAMPING)
        if there.cost >= here.cost:
            break
        gained = here.cost - there.cost
        values, here = trial, there
        damping = max(LEAST_DAMPING, damping / 10)
        if moved < tolerance or gained < gain:
            break
    return Fit(values, here.cost, iterations, here.hessian)


def with_locked_dofs(model: BodyModel, values: Array, still: Array, free: NDArray[np.bool_] | None) -> Array:
    """A pose, (n_values,), but for what is not `free`, (n_dofs,), to move: that is as in another pose."""
    return values if free is None else np.where(value_mask(model, ~free), still, values)


def value_mask(model: BodyModel, of_dofs: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """What is said of degrees of freedom, (n_dofs,), said of the values; of a quaternion where any turn of it is."""
    out = np.zeros(len(model.value_names), dtype=bool)
    np.logical_or.at(out, model.dof_value, of_dofs)
    for i, joint in enumerate(model.joints):
        if joint.kind == "ball":
            first = model.dof_value[np.flatnonzero(model.dof_joint == i)[-1]]
            out[first : first + 4] = out[first]
    return out


def damped_step(H: Array, g: Array, damping: Array) -> Array:
    """The step from a Hessian (n, n), whose diagonal is raised by a damping (n,), and a gradient (n,)."""
    from scipy.linalg.lapack import dposv  # takes a sixth of a second, which who opens a session need not wait

    raised = H.copy()
    raised.flat[:: len(g) + 1] += damping
    _, step, info = dposv(raised, -g)
    return np.asarray(step) if info == 0 else -g / (np.diag(H) + damping)  # not definite to the last digit


def covariance(model: BodyModel, fit: Fit) -> Array:
    """Covariance of a fitted pose, (n_dofs, n_dofs), rad and metres, from the normal matrix.

    It is as true as the blocks' weights are inverse standard deviations. What nothing speaks of has a variance of
    `_UNKNOWN`; joint limits are not counted as knowledge.
    """
    return np.asarray(np.linalg.inv(fit.hessian + np.eye(model.n_dofs) / _UNKNOWN), dtype=np.float64)


def fit_to_points(model: BodyModel, targets_world: dict[str, Array], near: Array | None = None) -> Fit:
    """Pose a body so that its points come close to known places (triangulated or measured joints).

    Without a pose to start from, the body is put at the targets' mean, upright, lying and upside down, facing each
    of eight ways; the best of the fits counts.

    Args:
        model: the body; its sizes stay.
        targets_world: place of each known point by name, (3,), metres; NaN is passed over.
        near: pose to start from, (n_values,).

    Raises:
        TrackerError: fewer than four of the body's points are known.
    """
    known = {n: t for n, t in targets_world.items() if n in model.point_names and np.all(np.isfinite(t))}
    if len(known) < 4:
        raise TrackerError(
            f"expected the places of at least 4 of the body's points, found {len(known)} "
            f"({', '.join(sorted(known)) or 'none'}); known names are {', '.join(model.point_names)}"
        )
    indices = np.array([model.point_names.index(n) for n in known])
    targets = np.stack(list(known.values()))
    block = PointTargets(indices, targets, np.full(len(indices), 1 / _PLACE_M))
    if near is not None:
        starts = [near]
    else:
        base = model.neutral()
        step = np.zeros(model.n_dofs)
        step[:3] = targets.mean(axis=0) - model.points_world(base)[indices].mean(axis=0)
        turns = np.flatnonzero((model.dof_joint == 0) & ~model.dof_is_length)
        starts = []
        for tilt, turn in itertools.product(range(4), range(8)):
            step[turns[0]], step[turns[-1]] = tilt * np.pi / 2, turn * np.pi / 4
            starts.append(model.retract(base, step))
    # Where a body of other sizes could reach the places better by a bend that people do not make, it is not bent so.
    usual = PosePrior(model.neutral(), 1 / model.spreads)
    # A weak pull to the start decides what the points leave open, such as the twist of a straight arm.
    rest = np.full(model.n_dofs, 1e-3 / _PLACE_M)

    def fitted(start: Array) -> Fit:
        return solve(model, start, [block, usual, PosePrior(start if near is None else near, rest)], max_iterations=100)

    best = min(map(fitted, starts), key=lambda f: f.cost)
    # Descent cannot lead a limb that is pressed against a limit around to where it belongs: begin again from there.
    # Measured on random poses: one in eight was 1 to 10 cm off without; a second round mends the last.
    limbs = [i for i, j in enumerate(model.joints) if len(j.axes) == 3 and not j.free]
    for joint in 2 * limbs:
        best = min(best, fitted(_by_other_angles(model, best.pose, joint)), key=lambda f: f.cost)
    return best


def _by_other_angles(model: BodyModel, values: Array, joint: int) -> Array:
    """The same pose by the other three angles that turn a joint alike, put within its limits.

    Where a joint's three axes are at right angles, (a, b, c) and (a + pi, pi - b, c + pi) are one rotation.
    """
    out = np.array(values)
    at = model.dof_value[model.dof_joint == joint]
    a, b, c = values[at]
    # Of the angles that differ by whole turns those within (-pi, pi], where the limits are.
    out[at] = np.remainder([a, -b, c], 2 * np.pi) - np.pi
    return model.clip(out)


def _sum(model: BodyModel, values: Array, blocks: Sequence[ResidualBlock]) -> NormalEquations:
    kinematics = model.kinematics(values)
    parts = [b.linearize(model, values, kinematics) for b in blocks]
    return NormalEquations(sum(p.cost for p in parts), sum(p.gradient for p in parts), sum(p.hessian for p in parts))  # type: ignore[arg-type]


def _pressed_against_limit(model: BodyModel, values: Array, gradient: Array) -> NDArray[np.bool_]:
    """Degrees of freedom that stand at a limit which descent would cross."""
    at = values[model.dof_value]
    low, high = model.limits[:, 0], model.limits[:, 1]
    return ((at <= low + AT_LIMIT) & (gradient > 0)) | ((at >= high - AT_LIMIT) & (gradient < 0))
