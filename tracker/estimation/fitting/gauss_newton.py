"""Gauss-Newton with damping and joint limits (Levenberg-Marquardt with an active set), over residual blocks.

A residual block returns the normal equations of its weighted residuals at a pose: known joints, contours and edges
(`contour_residuals`), pins, priors.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics
from tracker.body.model import BodyModel
from tracker.errors import TrackerError
from tracker.geometry.arrays import TINY, Array, IntArray


class _Damping(NamedTuple):
    """Damping of the steps, as a share of the diagonal (Marquardt 1963)."""

    first: float
    """Of the first step."""
    least: float
    """Of any step."""
    most: float
    """Beyond it no step lowers the cost."""
    least_again: float
    """Smallest after a refused step; less would hardly change the step."""
    floor: float
    """Share of the mean diagonal that is added to it, for degrees of freedom that nothing shows."""


DAMPING = _Damping(first=1e-3, least=1e-9, most=1e8, least_again=1e-2, floor=1e-6)
"""It grows tenfold after a refused step, and falls to a tenth after one that is taken."""
UNKNOWN = 1.0
"""Standard deviation of a degree of freedom that nothing shows, such as the twist of a straight arm, rad or m."""
JOINT_SHARE = 0.012
"""Standard deviation of a joint's place in the flesh along each axis, and of the flesh across a part, as a fraction of
height (`tests/benchmarks/acquisition.py`)."""
JOINT_M = 0.005
"""Standard deviation of a known joint of the same body, metres: markers and rigs repeat a joint to some
millimetres."""
OTHER_BODY_M = 0.015
"""Standard deviation of a known joint of a body of other sizes, metres: joints of people and those of the built-in body
differ by 1 to 4 cm (docs/decisions/body.md, Offsets of joint centres)."""
MAX_ITERATIONS, TOLERANCE = 50, 1e-6
"""Largest number of iterations of a fit, and the step at which it ends, rad or metres, unless a caller gives others."""
CLOSE_ENOUGH = 1e-3
"""Step below which a pose that is shown or filtered is final, rad or m: no joint moves by more than a millimetre."""


class NormalEquations(NamedTuple):
    """Normal equations of some residuals at a pose."""

    cost: float
    """Half the sum of weighted squared residuals; of robust residuals, half their robust squares."""
    gradient: Array
    """Derivative of the cost by the degrees of freedom, (n_dofs,)."""
    hessian: Array
    """Gauss-Newton's second derivative, (n_dofs, n_dofs), positive semi-definite."""


class ResidualBlock(Protocol):
    """One kind of evidence for the pose of one person.

    A block returns normal equations instead of residuals, so that thousands of image residuals are summed where they
    arise.
    """

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """Return the normal equations of the weighted residuals at a pose."""
        ...


def normal_equations(residuals: Array, jacobian: Array) -> NormalEquations:
    """Return the normal equations of weighted residuals, (N,), with derivatives by the degrees of freedom, (N,
    n_dofs)."""
    return NormalEquations(0.5 * float(residuals @ residuals), jacobian.T @ residuals, jacobian.T @ jacobian)


@dataclass(frozen=True, eq=False)
class PointTargets:
    """Points of the body drawn to known positions in the world."""

    points: IntArray
    """Indices into `BodyModel.point_names`, (N,)."""
    targets_world: Array
    """Known positions, (N, 3), metres."""
    weights: Array
    """Weight of each point's distance, (N,), per metre."""
    centers: bool = False
    """Whether the positions are those of anatomical joint centres."""

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        places, J = model.points_with_jacobian(kinematics, self.points, self.centers)
        r = (places - self.targets_world) * self.weights[:, None]
        return normal_equations(r.ravel(), (J * self.weights[:, None, None]).reshape(-1, model.n_dofs))

    def residuals(self, model: BodyModel, kinematics: Kinematics) -> tuple[Array, Array]:
        """Return the weighted residuals, (N, 3), and their derivatives by the points, (N, 3, 3), per metre."""
        r = (model.points_at(kinematics, self.points) - self.targets_world) * self.weights[:, None]
        return r, self.weights[:, None, None] * np.eye(3)


@dataclass(frozen=True, eq=False)
class PosePrior:
    """Gaussian prior on a pose; unobserved degrees of freedom stay at its mean."""

    pose: Array
    """Mean of the prior, (n_values,)."""
    weights: Array
    """Weight of each degree of freedom, (n_dofs,), per radian or metre."""

    @classmethod
    @lru_cache(maxsize=32)  # of each body; asked for several times for each frame
    def of_spreads(cls, model: BodyModel) -> "PosePrior":
        """Return the prior by the joint spreads of a body, around its neutral pose."""
        return cls(model.neutral(), 1 / model.spreads)

    def linearize(self, model: BodyModel, pose: Array, kinematics: Kinematics) -> NormalEquations:
        """See `ResidualBlock`."""
        # d(difference)/d(step) is the identity to first order; for ball joints up to the curvature of the rotation.
        r = self._residual(model, pose)
        return NormalEquations(0.5 * float(r @ r), self.weights * r, self._hessian)

    def cost(self, model: BodyModel, pose: Array) -> float:
        """Return the cost of a pose, (n_values,)."""
        r = self._residual(model, pose)
        return 0.5 * float(r @ r)

    def _residual(self, model: BodyModel, pose: Array) -> Array:
        return model.difference(pose, self.pose) * self.weights

    @cached_property
    def _hessian(self) -> Array:
        return np.diag(self.weights**2)


class Fit(NamedTuple):
    """Result of the solver."""

    pose: Array
    """Pose, (n_values,), within the joint limits."""
    cost: float
    """Half the sum of squared residuals."""
    iterations: int
    hessian: Array
    """Second derivative of the cost at the pose, (n_dofs, n_dofs), for `covariance`."""

    def with_prior(self, model: BodyModel, old: PosePrior, new: PosePrior) -> "Fit":
        """Return the fit as if one prior were in the place of another, at the same pose."""
        return self._replace(
            cost=self.cost - old.cost(model, self.pose) + new.cost(model, self.pose),
            hessian=self.hessian + np.diag(new.weights**2 - old.weights**2),
        )


def solve(
    model: BodyModel,
    pose: Array,
    blocks: Sequence[ResidualBlock],
    active_dofs: NDArray[np.bool_] | None = None,
    max_iterations: int = MAX_ITERATIONS,
    tolerance: float = TOLERANCE,
    gain: float = 0.0,
) -> Fit:
    """Minimize the summed cost of all blocks within the joint limits (Levenberg-Marquardt with an active set).

    Args:
        model: the body.
        pose: initial pose, (n_values,).
        blocks: the residual blocks.
        active_dofs: degrees of freedom that may change, (n_dofs,); all by default.
        max_iterations: largest number of steps.
        tolerance: smallest step for another iteration, rad or metres.
        gain: smallest decrease of the cost, predicted or found, for another iteration. Costs of image residuals are
            rough near their minimum, where steps are refused repeatedly.
    """
    *_, last = iterate(model, pose, blocks, active_dofs, max_iterations, tolerance, gain)
    return last


def iterate(
    model: BodyModel,
    pose: Array,
    blocks: Sequence[ResidualBlock],
    active_dofs: NDArray[np.bool_] | None = None,
    max_iterations: int = MAX_ITERATIONS,
    tolerance: float = TOLERANCE,
    gain: float = 0.0,
) -> Iterator[Fit]:
    """Minimize as `solve`, one iteration at a time.

    Yields:
        The start, then the pose after each iteration that lowers the cost. If the last iteration does not, the pose
        before it comes once more, with that iteration counted.
    """
    is_active = np.ones(model.n_dofs, dtype=bool) if active_dofs is None else active_dofs
    start, is_locked = pose, value_mask(model, ~is_active)  # locked values stay, even outside the limits
    pose = np.where(is_locked, start, model.clip(start))
    here = linearize_all(model, pose, blocks)
    damping, iterations = DAMPING.first, 0
    yield Fit(pose, here.cost, iterations, here.hessian)
    while iterations < max_iterations:
        iterations += 1
        active = np.flatnonzero(is_active & ~pressed_against_limit(model, pose, here.gradient))
        if not len(active):
            yield Fit(pose, here.cost, iterations, here.hessian)
            return
        g, H = here.gradient[active], here.hessian[active[:, None], active]
        # Damping by the diagonal is independent of units; the floor keeps unobserved dofs well conditioned.
        scale = np.diag(H) + DAMPING.floor * max(TINY, float(np.trace(H)) / len(H))
        while True:
            step = damped_step(H, g, damping * scale)
            worth = -(g + 0.5 * H @ step) @ step > gain
            change = np.zeros(model.n_dofs)
            change[active] = step
            trial = np.where(is_locked, start, model.move(pose, change))
            moved = float(np.abs(model.difference(trial, pose)).max())
            there = linearize_all(model, trial, blocks) if worth else here
            if there.cost < here.cost or not worth or moved < tolerance or damping > DAMPING.most:
                break
            damping = max(10 * damping, DAMPING.least_again)
        if there.cost >= here.cost:
            yield Fit(pose, here.cost, iterations, here.hessian)
            return
        gained = here.cost - there.cost
        pose, here = trial, there
        damping = max(DAMPING.least, damping / 10)
        yield Fit(pose, here.cost, iterations, here.hessian)
        if moved < tolerance or gained < gain:
            return


def with_locked_dofs(model: BodyModel, pose: Array, locked: Array, active_dofs: NDArray[np.bool_] | None) -> Array:
    """Return poses with the locked degrees of freedom of another pose.

    Args:
        model: the body.
        pose: (..., n_values).
        locked: pose from which the locked degrees of freedom are taken, (n_values,).
        active_dofs: degrees of freedom that are not locked, (n_dofs,); None: all.
    """
    return pose if active_dofs is None else np.where(value_mask(model, ~active_dofs), locked, pose)


def value_mask(model: BodyModel, of_dofs: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Expand a mask over degrees of freedom, (n_dofs,), to pose values, (n_values,).

    A quaternion is set if any of its axes is.
    """
    out = np.zeros(len(model.value_names), dtype=bool)
    np.logical_or.at(out, model.dof_value, of_dofs)
    for i, joint in enumerate(model.joints):
        if joint.kind == "ball":
            first = model.dof_value[np.flatnonzero(model.dof_joint == i)[-1]]
            out[first : first + 4] = out[first]
    return out


def damped_step(H: Array, g: Array, damping: Array) -> Array:
    """Return the step for a Hessian, (n, n), with damping added to its diagonal, (n,), and a gradient, (n,)."""
    from scipy.linalg.lapack import dposv  # imported lazily: loading LAPACK takes 0.17 s

    raised = H.copy()
    raised.flat[:: len(g) + 1] += damping
    _, step, info = dposv(raised, -g)
    return np.asarray(step) if info == 0 else -g / (np.diag(H) + damping)  # numerically not definite


def covariance(model: BodyModel, fit: Fit) -> Array:
    """Return the covariance of a fitted pose, (n_dofs, n_dofs), rad and metres, from its normal matrix.

    It is valid if the blocks' weights are inverse standard deviations. Unobserved degrees of freedom have variance
    `UNKNOWN`. Joint limits are not taken into account.
    """
    return np.asarray(np.linalg.inv(fit.hessian + np.eye(model.n_dofs) / UNKNOWN**2), dtype=np.float64)


def weak_pull(model: BodyModel, pose: Array) -> PosePrior:
    """Return a weak prior on a pose: it determines what points do not show, such as the twist of a straight arm."""
    return PosePrior(pose, np.full(model.n_dofs, 1e-3 / OTHER_BODY_M))


def fit_to_points(
    model: BodyModel, targets_world: dict[str, Array], near: Array | None = None, centers: bool = False,
    solver: Callable[..., Fit] = solve,
) -> Fit:  # fmt: skip
    """Fit a pose to known positions of points of the body (triangulated or measured joints).

    Without an initial pose the body starts at the mean of the targets: upright, lying and upside down, in each of eight
    directions. The best fit is returned.

    Args:
        model: the body; its sizes stay.
        targets_world: position of each known point by name, (3,), metres; NaN is ignored.
        near: initial pose, (n_values,).
        centers: whether the positions are those of anatomical joint centres.
        solver: `solve`, or `gauss_newton_compiled.solve_compiled_or_plain` where kernels are needed anyway.

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
    block = PointTargets(indices, targets, np.full(len(indices), 1 / OTHER_BODY_M), centers)
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
    # Without this prior a body of other sizes would bend unnaturally to come closer to the positions.
    usual = PosePrior.of_spreads(model)

    def fitted(start: Array) -> Fit:
        pull = weak_pull(model, start if near is None else near)
        return solver(model, start, [block, usual, pull], max_iterations=100)

    best = min(map(fitted, starts), key=lambda f: f.cost)
    # Descent cannot lead a limb at a limit around to the right angles: restart from the equivalent angles. Without
    # this one random pose in eight ended 1 to 10 cm off; a second round corrects the rest.
    limbs = [i for i, j in enumerate(model.joints) if len(j.axes) == 3 and not j.free]
    for joint in 2 * limbs:
        best = min(best, fitted(_by_other_angles(model, best.pose, joint)), key=lambda f: f.cost)
    return best


def _by_other_angles(model: BodyModel, pose: Array, joint: int) -> Array:
    """Return the same pose by the other three angles of a joint that give the same rotation, within its limits.

    About three axes at right angles, (a, b, c) and (a + pi, pi - b, c + pi) are one rotation.
    """
    out = np.array(pose)
    at = model.dof_value[model.dof_joint == joint]
    a, b, c = pose[at]
    # Angles within (-pi, pi], where the limits are.
    out[at] = np.remainder([a, -b, c], 2 * np.pi) - np.pi
    return model.clip(out)


def linearize_all(model: BodyModel, pose: Array, blocks: Sequence[ResidualBlock]) -> NormalEquations:
    """Return the normal equations of all blocks together, one or more, at a pose, (n_values,)."""
    kinematics = model.kinematics(pose)
    first, *others = (b.linearize(model, pose, kinematics) for b in blocks)
    cost, gradient, hessian = first
    for p in others:
        cost, gradient, hessian = cost + p.cost, gradient + p.gradient, hessian + p.hessian
    return NormalEquations(cost, gradient, hessian)


def pressed_against_limit(model: BodyModel, pose: Array, gradient: Array) -> NDArray[np.bool_]:
    """Return the degrees of freedom at a limit that descent would cross, of poses, (..., n_values), (..., n_dofs)."""
    at = pose[..., model.dof_value]
    low, high = model.limits[:, 0], model.limits[:, 1]
    return ((at <= low + TINY) & (gradient > 0)) | ((at >= high - TINY) & (gradient < 0))
