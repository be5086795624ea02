"""Least squares over unknowns that all observations share, and own unknowns of each of many groups of observations.

Sizes of a body or corrections of cameras are shared; poses on single frames, or free points, are own. The normal matrix
has the shape of an arrow: own unknowns of different groups never meet. They are eliminated by the Schur complement, as
in bundle adjustment (Triggs, McLauchlan, Hartley and Fitzgibbon 2000, Sect. 6). All groups have as many own unknowns.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from tracker.compute.threads import one_blas_thread
from tracker.estimation.fitting.gauss_newton import DAMPING, MAX_ITERATIONS, NormalEquations, damped_step
from tracker.geometry.arrays import Array

S = TypeVar("S")
ROUGH, USUAL = 1e-2, 1e-4
"""Relative decreases of the cost at which fits end: fits that are compared or go on, and fits whose state is used."""


class ArrowEquations(NamedTuple):
    """Normal equations of n shared unknowns and of G groups with m own unknowns each."""

    cost: float
    """Half the sum of weighted squared residuals; of robust residuals, half their robust squares."""
    gradient: Array
    """Derivative of the cost by the shared unknowns, (n,)."""
    hessian: Array
    """Gauss-Newton's second derivative by them, (n, n)."""
    own_gradients: Array
    """Derivative by the own unknowns, (G, m)."""
    own_hessians: Array
    """Second derivative by them, (G, m, m)."""
    cross: Array
    """Second derivative by own and shared unknowns, (G, m, n)."""

    @classmethod
    def zeros(cls, n: int, groups: int, m: int) -> "ArrowEquations":
        """Return empty equations, whose arrays may be filled; the cost is 0."""
        own = np.zeros((groups, m)), np.zeros((groups, m, m))
        return cls(0.0, np.zeros(n), np.zeros((n, n)), *own, np.zeros((groups, m, n)))

    def add(self, group: int, found: NormalEquations) -> None:
        """Add the normal equations of some residuals of a group, by the shared unknowns and then its own ones.

        Their cost is not added.
        """
        n = len(self.gradient)
        self.gradient[:] += found.gradient[:n]
        self.hessian[:] += found.hessian[:n, :n]
        self.own_gradients[group] += found.gradient[n:]
        self.own_hessians[group] += found.hessian[n:, n:]
        self.cross[group] += found.hessian[n:, :n]

    def held(self, shared: NDArray[np.bool_], own: NDArray[np.bool_]) -> "ArrowEquations":
        """Return the equations in which some unknowns cannot move, nor own ones that no residual depends on.

        Args:
            shared: which shared unknowns may move, (n,).
            own: which own unknowns may move, (G, m).
        """
        own = own & (np.einsum("gii->gi", self.own_hessians) > 0)
        hessian = self.hessian * np.outer(shared, shared) + np.diag(~shared)
        own_hessians = self.own_hessians * (own[:, :, None] & own[:, None, :])
        at = np.arange(own.shape[1])
        own_hessians[:, at, at] += ~own
        cross = self.cross * (own[:, :, None] & shared)
        return self._replace(
            gradient=self.gradient * shared, hessian=hessian, own_gradients=self.own_gradients * own,
            own_hessians=own_hessians, cross=cross,
        )  # fmt: skip

    def reduced(self) -> tuple[Array, Array]:
        """Eliminate the own unknowns: the gradient, (n,), and the Hessian, (n, n), where these are at their best."""
        gradients, hessians = self.reductions()
        return self.gradient - gradients.sum(axis=0), self.hessian - hessians.sum(axis=0)

    def reductions(self) -> tuple[Array, Array]:
        """Return the share of each group that `reduced` takes off: gradients, (G, n), and Hessians, (G, n, n)."""
        solved = np.linalg.solve(self.own_hessians, np.concatenate([self.cross, self.own_gradients[..., None]], axis=2))
        found = self.cross.transpose(0, 2, 1) @ solved
        return found[..., -1], found[..., :-1]

    def step(self, damping: float) -> tuple[Array, Array]:
        """Return the step of the shared unknowns, (n,), and of the own ones, (G, m).

        Args:
            damping: share of each unknown's second derivative that is added to it (Marquardt 1963).
        """
        n, m = len(self.gradient), self.own_gradients.shape[1]
        own = self.own_hessians.copy()
        at = np.arange(m)
        own[:, at, at] *= 1 + damping
        right = np.concatenate([self.cross, self.own_gradients[..., None]], axis=2)
        solved = np.asarray(np.linalg.solve(own, right), dtype=np.float64).reshape(-1, n + 1)
        taken = self.cross.reshape(len(solved), n).T @ solved
        H, g = self.hessian - taken[:, :-1], self.gradient - taken[:, -1]
        shared = damped_step(H, g, damping * np.diag(self.hessian)) if n else g
        return shared, -(solved @ np.append(shared, 1.0)).reshape(-1, m)

    def promised(self, shared: Array, own: Array, damping: float) -> float:
        """Return the decrease of the cost that the step of a damping promises."""
        damped = np.sum(shared**2 * np.diag(self.hessian)) + np.sum(own**2 * np.einsum("gii->gi", self.own_hessians))
        return 0.5 * float(damping * damped - self.gradient @ shared - np.sum(self.own_gradients * own))


class BundleProblem(Protocol[S]):
    """A problem for `solve_bundle`; its state holds all unknowns."""

    def linearize(self, state: S, below: float = ..., /) -> ArrowEquations:
        """Return the normal equations at a state; where the cost is not below a bound, the rest of them may be 0."""
        ...

    def moved(self, state: S, shared: Array, own: Array, /) -> S:
        """Return the state after a step of the shared unknowns, (n,), and of the own ones, (G, m)."""
        ...

    def free(self, state: S, equations: ArrowEquations, /) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return which shared unknowns, (n,), and which own ones, (G, m), may move from there."""
        ...


@dataclass(frozen=True)
class BundleFit(Generic[S]):
    """State at which the cost is least."""

    state: S
    equations: ArrowEquations
    """Normal equations there."""
    evaluations: int
    """Number of evaluations of all residuals."""

    @property
    def cost(self) -> float:
        """Cost of the state."""
        return self.equations.cost


def solve_bundle(
    problem: BundleProblem[S],
    state: S,
    max_iterations: int = MAX_ITERATIONS,
    tolerance: float = USUAL,
    report: Callable[[int], None] = lambda iteration: None,
    least_gain: float = 0.0,
    known: ArrowEquations | None = None,
) -> BundleFit[S]:
    """Minimize the cost of a problem (Levenberg-Marquardt).

    Args:
        problem: gives the normal equations.
        state: initial state.
        max_iterations: largest number of steps.
        tolerance: smallest relative decrease of the cost that a step must promise.
        report: is given the number of each iteration before it begins. An exception that it raises ends the fit.
        least_gain: smallest decrease that a step must promise, in units of the cost.
        known: normal equations at the initial state, if they were calculated before.
    """
    with one_blas_thread():
        here = BundleFit(state, problem.linearize(state) if known is None else known, int(known is None))
        return _solve(problem, here, max_iterations, lambda cost: max(tolerance * cost, least_gain), report)


def settle_bundle(problem: BundleProblem[S], state: S, max_iterations: int, least_gain: float) -> BundleFit[S]:
    """Take Gauss-Newton steps to where the gradient vanishes, for a cost that is rough.

    The cost of contours jumps where points change their piece and pieces appear or vanish. Near its minimum no step
    lowers it, though the gradient leads further. A step is therefore also taken if the next one promises less (natural
    monotonicity test; Deuflhard 2004, Newton Methods for Nonlinear Problems).

    Args:
        problem: gives the normal equations.
        state: initial state.
        max_iterations: largest number of steps.
        least_gain: smallest decrease that a step must promise, in units of the cost.
    """
    with one_blas_thread():
        here = BundleFit(state, problem.linearize(state), 1)
        step, promise = _promising(problem, here)
        for _ in range(max_iterations):
            if promise <= least_gain:
                break
            trial = problem.moved(here.state, *step)
            there = BundleFit(trial, problem.linearize(trial), here.evaluations + 1)
            step, further = _promising(problem, there)
            if further >= promise and there.cost >= here.cost:
                break
            here, promise = there, further
        return here


def _promising(problem: BundleProblem[S], fit: BundleFit[S]) -> tuple[tuple[Array, Array], float]:
    """Return the next step, and the decrease of the cost that it promises."""
    equations = fit.equations.held(*problem.free(fit.state, fit.equations))
    step = equations.step(DAMPING.first)
    return step, equations.promised(*step, DAMPING.first)


def _solve(
    problem: BundleProblem[S], start: BundleFit[S], max_iterations: int, enough: Callable[[float], float],
    report: Callable[[int], None],
) -> BundleFit[S]:  # fmt: skip
    state, here, evaluations, damping = start.state, start.equations, start.evaluations, DAMPING.first
    for iteration in range(max_iterations):
        report(iteration)
        equations = here.held(*problem.free(state, here))
        while True:
            step = equations.step(damping)
            if equations.promised(*step, damping) <= enough(here.cost):
                return BundleFit(state, here, evaluations)
            trial = problem.moved(state, *step)
            there = problem.linearize(trial, here.cost)
            evaluations += 1
            if there.cost < here.cost:
                break
            if damping > DAMPING.most:
                return BundleFit(state, here, evaluations)
            damping = max(10 * damping, DAMPING.least_again)
        state, here, damping = trial, there, max(DAMPING.least, damping / 10)
    return BundleFit(state, here, evaluations)
