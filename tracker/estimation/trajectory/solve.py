"""All poses of a run by one least-squares solve: the evidence of every frame, and Student's t of the accelerations.

Levenberg-Marquardt over the whole path, with joint limits as an active set. The normal equations are banded by frames.
The scales of the accelerations are learnt by expectation maximization (R. H. Shumway, D. S. Stoffer 1982, J. Time
Series Anal. 3:253). The covariance of the path counts: without it the smoothest path makes itself ever smoother.
"""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from tracker.body.model import BodyModel
from tracker.compute.threads import map_parallel, one_blas_thread
from tracker.estimation.fitting.contour_residuals import MIN_DECREASE
from tracker.estimation.fitting.gauss_newton import (
    CLOSE_ENOUGH,
    DAMPING,
    UNKNOWN,
    ResidualBlock,
    linearize_all,
    pressed_against_limit,
    value_mask,
)
from tracker.estimation.trajectory.block_band import factor, product
from tracker.estimation.trajectory.motion_model import LEARNING_ROUNDS, MotionModel, acceleration, motion_points
from tracker.geometry.arrays import TINY, Array, Mask

_BLOCK_FRAMES, _OVERLAP_FRAMES = 120, 20
"""Frames are solved in blocks, because the evidence of one takes 5 to 10 MB. Frames that are seen beyond the overlap
hardly matter to a pose."""
FRAMES_AT_ONCE = _BLOCK_FRAMES + 2 * _OVERLAP_FRAMES
"""Largest number of frames whose evidence is held at once."""


@dataclass(frozen=True, eq=False)
class PosedPath:
    """The poses of one person over time, and the evidence of each."""

    model: BodyModel
    times_s: Array
    """Ascending, (T,), seconds."""
    poses: Array
    """First guesses, (T, n_values)."""
    evidence: Callable[[int], Sequence[ResidualBlock]]
    """Returns the residual blocks of a frame by its place in the path; none where nothing was seen."""
    fixed: Mask
    """Whether a pose is exact, (T,): a keyframe."""
    active_dofs: Mask | None = None
    """Degrees of freedom that may change, (n_dofs,); None: all."""


class SolvedPath(NamedTuple):
    """The most likely poses of a path."""

    poses: Array
    """Within the joint limits, (T, n_values)."""
    covariances: Array
    """Of each pose, (T, n_dofs, n_dofs), rad and metres; 0 of fixed poses and locked degrees of freedom."""


def solve_path(path: PosedPath) -> Generator[int, None, SolvedPath]:
    """Find the most likely poses of a path; fixed poses and locked degrees of freedom stay.

    Yields:
        The number of frames whose evidence was read so far, which takes most of the time.
    """
    n, n_read = path.model.n_dofs, 0
    poses, covariances = np.array(path.poses), np.zeros((len(path.poses), n, n))
    for own, used in even_blocks(len(path.poses)):
        solver = _Solver(path, used)
        for t in range(used.start, used.stop):
            solver.read(t)
            n_read += own.start <= t < own.stop
            yield n_read
        found, within = solver.solve(), slice(own.start - used.start, own.stop - used.start)
        poses[own], covariances[own] = found.poses[within], found.covariances[within]
    return SolvedPath(poses, covariances)


def even_blocks(n_frames: int) -> list[tuple[slice, slice]]:
    """Return the frames of each block of a run, and those that it is solved with: some more on both sides."""
    if n_frames <= FRAMES_AT_ONCE:
        return [(slice(0, n_frames), slice(0, n_frames))]
    bounds = np.linspace(0, n_frames, -(-n_frames // _BLOCK_FRAMES) + 1).round().astype(int).tolist()
    return [
        (slice(first, end), slice(max(0, first - _OVERLAP_FRAMES), min(n_frames, end + _OVERLAP_FRAMES)))
        for first, end in pairwise(bounds)
    ]


class _Evidence(NamedTuple):
    """Normal equations of the evidence of each frame, where they were linearized last."""

    poses: Array
    """There, (T, n_values)."""
    costs: Array
    """(T,)."""
    gradients: Array
    """(T, n_dofs)."""
    hessians: Array
    """(T, n_dofs, n_dofs)."""


class _State(NamedTuple):
    """A path and its normal equations."""

    poses: Array
    """(T, n_values)."""
    cost: float
    gradient: Array
    """(T, n_dofs)."""
    hessian: Array
    """As `block_band.factor` reads it, (3, T, n_dofs, n_dofs)."""
    squares_m2: Array
    """Squared accelerations of the points, (T - 2, P)."""
    jacobians: Array
    """Of the places of the points, (T, 3 P, n_dofs)."""
    evidence: _Evidence


class _Solver:
    """Solves some frames of a path."""

    def __init__(self, path: PosedPath, used: slice) -> None:
        """Prepare; `read` comes next."""
        model = path.model
        self.path, self.fixed = path, path.fixed[used]
        # The cost of each frame is rough on its own: their sum is rougher by the root of their number.
        self.min_decrease = MIN_DECREASE * np.sqrt(len(self.fixed))
        self.points = motion_points(model)
        self.coefficients = acceleration(path.times_s[used])
        active = np.ones(model.n_dofs, bool) if path.active_dofs is None else path.active_dofs
        self.locked = self.fixed[:, None] | ~active
        self.locked_values = value_mask(model, ~active)
        self.start = self._within_limits(path.poses[used], path.poses[used])
        self.evidence: list[Sequence[ResidualBlock]] = []
        self.motion: MotionModel | None = None
        self.reach = CLOSE_ENOUGH
        """Distance, rad or metres, up to which the evidence of a frame is taken from where it was linearized."""
        self.spread_m2 = np.zeros(1)
        """Variance of the accelerations by the uncertainty of the path, (T - 2, P), or zero."""

    def _within_limits(self, poses: Array, before: Array) -> Array:
        """Return poses within the limits, with fixed and locked ones as before, (T, n_values)."""
        return np.where(self.fixed[:, None] | self.locked_values, before, self.path.model.clip(poses))

    def read(self, t: int) -> None:
        """Read the evidence of the next frame, given by its place in the path."""
        self.evidence.append(() if self.path.fixed[t] else self.path.evidence(t))

    def solve(self) -> SolvedPath:
        """Return the most likely poses of the frames."""
        with one_blas_thread():
            first = here = self._linearized(self.start, None)
            if len(here.squares_m2):
                # A smooth first guess shows too little motion: each frame is taken to be as unsure as it is alone.
                self._learn(here, self._inverse(here._replace(hessian=here.hessian[:1])))
                self.reach = np.inf  # the evidence stays as it is linearized: learning takes many steps
                for _ in range(LEARNING_ROUNDS):
                    here = self._descended(self._linearized(here.poses, here))
                    self._learn(here, self._inverse(here))
                self.reach = CLOSE_ENOUGH
            found = self._descended(self._linearized(first.poses, first))
            covariances = np.where(self.locked[:, None] | self.locked[:, :, None], 0.0, self._inverse(found)[0])
            return SolvedPath(found.poses, covariances)

    def _learn(self, here: _State, inverse: Array) -> None:
        """Learn the motion from the path and its covariance; see `_inverse`."""
        c, J, n, free = self.coefficients, here.jacobians, len(here.squares_m2), ~self.locked
        variance = np.zeros((n, J.shape[1]))
        for i in range(3):
            Ji = J[i : i + n] * free[i : i + n, None, :]
            for k in range(max(0, i + 1 - len(inverse)), i + 1):
                Jk = J[k : k + n] * free[k : k + n, None, :]
                shared = np.einsum("tpa,tpa->tp", Ji @ inverse[i - k, k : k + n], Jk)
                variance += (1.0 if i == k else 2.0) * (c[:, i] * c[:, k])[:, None] * shared
        self.spread_m2 = variance.reshape(n, -1, 3).sum(axis=-1)
        self.motion = MotionModel.learned(self.points.groups, here.squares_m2 + self.spread_m2, self.motion)

    def _descended(self, here: _State) -> _State:
        """Return the path after steps that each lower its cost, until none is worth it."""
        damping, gain = DAMPING.first, np.inf
        while gain >= self.min_decrease:
            there, damping = self._better(here, damping)
            gain = here.cost - there.cost
            here = there
        return here

    def _better(self, here: _State, damping: float) -> tuple[_State, float]:
        """Return the path after a step that lowers its cost, the same if none is worth it, and the next damping."""
        held = self._held(here)
        while damping <= DAMPING.most:
            found = self._step(here, held, damping)
            if found is not None:
                there, promised = found
                if promised < self.min_decrease:
                    return here, damping
                if there.cost < here.cost:
                    return there, max(DAMPING.least, damping / 10)
            damping = max(10 * damping, DAMPING.least_again)
        return here, damping

    def _step(self, here: _State, held: Mask, damping: float) -> tuple[_State, float] | None:
        """Return the path after a step, and the gain that its equations promise; None if that is a loss.

        Degrees of freedom that the step takes to a limit stop there, and the others step again as that demands (D. P.
        Bertsekas 1982, SIAM J. Control Optim. 20:221). Clipped alone, they would leave the others on the wrong way.
        """
        model, stopped = self.path.model, np.zeros_like(here.gradient)
        while True:
            known = factor(self._held_equations(here, held, damping))
            if known is None:
                return None
            gradient = here.gradient + product(here.hessian, stopped)
            step = np.where(held, stopped, -known.solve(np.where(held, 0.0, gradient)))
            beyond = model.retract(here.poses, step)
            poses = self._within_limits(beyond, here.poses)
            crossed = ~held & (np.abs(model.difference(poses, beyond)) > TINY)
            if not crossed.any():
                break
            held, stopped = held | crossed, np.where(crossed, model.difference(poses, here.poses), stopped)
        promised = -float(np.vdot(here.gradient + product(here.hessian, step) / 2, step))
        if promised < self.min_decrease:
            return None if promised < 0 else (here, promised)
        return self._linearized(poses, here), promised

    def _held(self, here: _State) -> Mask:
        """Return the degrees of freedom that stay: locked ones, and those that press against a limit, (T, n_dofs)."""
        return self.locked | pressed_against_limit(self.path.model, here.poses, here.gradient)

    def _held_equations(self, here: _State, held: Mask, damping: float) -> Array:
        blocks = np.array(here.hessian)
        for d in range(len(blocks)):
            n = blocks.shape[1] - d
            blocks[d, :n] *= ~held[d:, :, None] & ~held[:n, None, :]
        diagonal = np.einsum("tii->ti", blocks[0])
        diagonal += np.where(held, 1.0, damping * diagonal + DAMPING.least / UNKNOWN**2)
        return blocks

    def _inverse(self, here: _State) -> Array:
        """Return the covariance of the path within the band; see `BlockFactor.inverse`. It knows no joint limits."""
        blocks = self._held_equations(here, self.locked, 0.0)
        np.einsum("tii->ti", blocks[0])[...] += np.where(self.locked, 0.0, 1 / UNKNOWN**2)
        known = factor(blocks)
        assert known is not None  # with an unknown's variance on the diagonal
        return known.inverse()

    def _linearized(self, poses: Array, before: _State | None) -> _State:
        """Return a path with its normal equations; frames that hardly moved keep those of their evidence."""
        model, T = self.path.model, len(poses)
        known = self._evidence(poses, None if before is None else before.evidence)
        gap = model.difference(poses, known.poses)
        slopes = np.einsum("tij,tj->ti", known.hessians, gap)
        cost = float(known.costs.sum() + np.vdot(gap, known.gradients + slopes / 2))
        gradient, hessian = known.gradients + slopes, np.zeros((3, T, model.n_dofs, model.n_dofs))
        hessian[0] = known.hessians
        places, jacobians = self.points.linearized(poses)
        n, c = len(self.coefficients), self.coefficients
        residuals = sum((c[:, i, None, None] * places[i : i + n] for i in range(3)), np.zeros((n, 1, 3)))
        squares = np.sum(np.square(residuals), axis=-1)
        if self.motion is not None and n:
            expected = squares + self.spread_m2
            cost += self.motion.nats(expected)
            weights = np.repeat(self.motion.weights(expected) / self.motion.point_scales_m2(), 3, axis=1)
            r = residuals.reshape(n, -1)
            for i in range(3):
                weighted = (c[:, i, None] * weights)[:, :, None] * jacobians[i : i + n]
                gradient[i : i + n] += np.einsum("tpn,tp->tn", weighted, r)
                for k in range(i + 1):
                    hessian[i - k, k : k + n] += weighted.transpose(0, 2, 1) @ (
                        c[:, k, None, None] * jacobians[k : k + n]
                    )
        return _State(poses, cost, gradient, hessian, squares, jacobians, known)

    def _evidence(self, poses: Array, before: _Evidence | None) -> _Evidence:
        """Return the equations of the evidence: at the poses, or before where these hardly moved since."""
        model, T = self.path.model, len(poses)
        moved = np.array([len(blocks) > 0 for blocks in self.evidence])
        if before is None:
            n = model.n_dofs
            out = _Evidence(poses.copy(), np.zeros(T), np.zeros((T, n)), np.zeros((T, n, n)))
        else:
            out = _Evidence(*map(np.copy, before))
            moved &= np.abs(model.difference(poses, before.poses)).max(axis=1) >= self.reach

        at = np.flatnonzero(moved).tolist()
        found = map_parallel(lambda t: linearize_all(model, poses[t], self.evidence[t]), at)
        for t, equations in zip(at, found, strict=True):
            out.poses[t], out.costs[t], out.gradients[t], out.hessians[t] = poses[t], *equations
        return out
