"""`gauss_newton.solve` in one compiled call, for contours, key points, known points, priors and penetration terms.

A descent takes a dozen steps of a tenth of a millisecond each. In Python the calls between kernels take as long as the
kernels, and hold the interpreter's lock. `gauss_newton.solve` is the readable version, for any blocks and for ball
joints; `solve_compiled_or_plain` calls the one that a body needs.
"""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics, Tree, forward_kinematics, place_point
from tracker.body.model import BodyModel
from tracker.compute.jit import FAST_MATH, NO_REFCOUNT, njit
from tracker.estimation.fitting import gauss_newton
from tracker.estimation.fitting.clocked_residuals import ClockedResiduals
from tracker.estimation.fitting.contour_arrays import no_contours
from tracker.estimation.fitting.contour_kernels import WITH_JACOBIAN, ContourTerm, accumulate_normal_equations
from tracker.estimation.fitting.contour_residuals import ContourResiduals
from tracker.estimation.fitting.gauss_newton import (
    DAMPING,
    MAX_ITERATIONS,
    TOLERANCE,
    Fit,
    PointTargets,
    PosePrior,
    ResidualBlock,
)
from tracker.estimation.fitting.interpenetration import (
    NO_PENETRATION,
    BodyPenetration,
    PenetrationTerm,
    SelfPenetration,
    add_penetration,
)
from tracker.estimation.fitting.keypoints import NO_KEYPOINTS, KeypointBlock, KeypointTerm, add_keypoints
from tracker.estimation.fitting.twists import twists_to_dofs
from tracker.geometry.arrays import TINY, Array, IntArray

_KNOWN = (ContourResiduals, PosePrior, SelfPenetration, BodyPenetration, KeypointBlock, PointTargets)


class _TargetTerm(NamedTuple):
    """`PointTargets` of points of parts as arrays."""

    parts: IntArray
    """Part that each point moves with, (N,)."""
    points_part: Array
    """Place of each in its part, (N, 3), metres."""
    targets_world: Array
    """Place that each is drawn to, (N, 3), metres."""
    weights: Array
    """See `PointTargets`, (N,)."""


_NO_TARGETS = _TargetTerm(*NO_KEYPOINTS[:2], NO_KEYPOINTS.points_part, NO_KEYPOINTS.precisions)
"""A term that adds nothing."""


class _Blocks(NamedTuple):
    """Residual blocks as arrays, for a body whose pose values are its degrees of freedom."""

    tree: Tree
    is_length: NDArray[np.bool_]
    """`BodyModel.dof_is_length`, (n_dofs,)."""
    parts: IntArray
    """`BodyModel.dof_joint`, (n_dofs,)."""
    moves: NDArray[np.bool_]
    """`BodyModel.moves`, (n_dofs, n_parts)."""
    limits: Array
    """Joint limits, (n_dofs, 2), rad or metres."""
    contours: ContourTerm
    """Contour residuals."""
    means: Array
    """Means of the priors, (S, n_dofs)."""
    weights: Array
    """Their weights, see `PosePrior`, (S, n_dofs)."""
    within: PenetrationTerm
    """Penetration between parts of the body."""
    between: PenetrationTerm
    """Penetration between bodies."""
    keypoints: KeypointTerm
    """Key points."""
    targets: _TargetTerm
    """Known points."""


class _Linear(NamedTuple):
    """Normal equations at a pose, and the kinematics there."""

    gradient: Array
    """(n_dofs,)."""
    hessian: Array
    """(n_dofs, n_dofs)."""
    axes: Array
    """See `Kinematics.axes_world`, (n_dofs, 3)."""
    origins: Array
    """See `Kinematics.origins_world`, (n_dofs, 3), metres."""


def solve_compiled(
    model: BodyModel,
    pose: Array,
    blocks: Sequence[ResidualBlock],
    active_dofs: NDArray[np.bool_] | None = None,
    max_iterations: int = MAX_ITERATIONS,
    tolerance: float = TOLERANCE,
    gain: float = 0.0,
) -> Fit:
    """Minimize the summed cost of all blocks within the joint limits, as `gauss_newton.solve` does, up to rounding.

    Residuals of views of different times are handed to `gauss_newton.solve`.

    Raises:
        TypeError: the kernel does not cover the body or the blocks.
    """
    if any(isinstance(b, ClockedResiduals) for b in blocks):
        return gauss_newton.solve(model, pose, blocks, active_dofs, max_iterations, tolerance, gain)
    compiled = _compiled(model, blocks)
    is_active = np.ones(model.n_dofs, dtype=bool) if active_dofs is None else active_dofs
    found, hessian = np.where(is_active, model.clip(pose), pose), np.empty((model.n_dofs, model.n_dofs))
    cost, iterations = _descend(compiled, found, is_active, max_iterations, tolerance, gain, hessian)
    return Fit(found, cost, iterations, hessian)


def solve_compiled_or_plain(
    model: BodyModel,
    pose: Array,
    blocks: Sequence[ResidualBlock],
    active_dofs: NDArray[np.bool_] | None = None,
    max_iterations: int = MAX_ITERATIONS,
    tolerance: float = TOLERANCE,
    gain: float = 0.0,
) -> Fit:
    """Call `solve_compiled`, or `gauss_newton.solve` for a body with ball joints, which no kernel covers."""
    solve = solve_compiled if len(model.value_names) == model.n_dofs else gauss_newton.solve
    return solve(model, pose, blocks, active_dofs, max_iterations, tolerance, gain)


def _compiled(model: BodyModel, blocks: Sequence[ResidualBlock]) -> _Blocks:
    """Return the blocks as arrays.

    Raises:
        TypeError: see `solve_compiled`.
    """
    if len(model.value_names) != model.n_dofs:
        ball = next(j.name for j in model.joints if j.kind == "ball")
        raise TypeError(f"expected joints with axes, found the ball joint '{ball}'; call gauss_newton.solve")
    unknown = sorted({type(b).__name__ for b in blocks if type(b) not in _KNOWN})
    if unknown:
        raise TypeError(f"expected blocks that the kernel covers, found {', '.join(unknown)}; call gauss_newton.solve")
    contours = [b.term(model) for b in blocks if isinstance(b, ContourResiduals)]
    priors = [b for b in blocks if isinstance(b, PosePrior)]
    within = [b.term(model) for b in blocks if isinstance(b, SelfPenetration)]
    between = [b.term(model) for b in blocks if isinstance(b, BodyPenetration)]
    keypoints = [b.arrays for b in blocks if isinstance(b, KeypointBlock)]
    targets = [_target_term(model, b) for b in blocks if isinstance(b, PointTargets)]
    kinds = Counter(type(b).__name__ for b in blocks if not isinstance(b, PosePrior))
    if several := [f"{n} {kind}" for kind, n in kinds.items() if n > 1]:
        found = " and ".join(several)
        raise TypeError(f"expected at most one block of each kind but priors, found {found}; call gauss_newton.solve")
    return _Blocks(
        model.tree, model.dof_is_length, model.dof_joint, model.moves, model.limits,
        contours[0] if contours else no_contours(model),
        np.array([p.pose for p in priors], np.float64).reshape(-1, model.n_dofs),
        np.array([p.weights for p in priors], np.float64).reshape(-1, model.n_dofs),
        within[0] if within else NO_PENETRATION, between[0] if between else NO_PENETRATION,
        keypoints[0] if keypoints else NO_KEYPOINTS, targets[0] if targets else _NO_TARGETS,
    )  # fmt: skip


def _target_term(model: BodyModel, block: PointTargets) -> _TargetTerm:
    """Return points as arrays. A centre is fixed to the part that has the joint at its end, as the joint itself is."""
    parts, local = model.point_parts[block.points], model.points_part[block.points]
    if block.centers:
        kinematics, parts = model.kinematics(model.neutral()), model.proximal_parts[block.points]
        T = kinematics.Ts_world_part[parts]
        local = np.einsum("nji,nj->ni", T[:, :3, :3], model.joint_centers_at(kinematics, block.points) - T[:, :3, 3])
    return _TargetTerm(parts, local, block.targets_world, block.weights)


@njit(nogil=True, cache=True)
def _descend(
    blocks: _Blocks, pose: Array, is_active: NDArray[np.bool_], max_iterations: int, tolerance: float, gain: float,
    hessian: Array,
) -> tuple[float, int]:  # fmt: skip
    """Move a pose, (n_dofs,), to a minimum and fill the Hessian there; return the cost and the number of iterations.

    The steps are those of `gauss_newton.solve`.
    """
    n, damping, iterations = pose.shape[0], DAMPING.first, 0
    here, there = _room(n), _room(n)
    trial, step, active, L = pose.copy(), np.empty(n), np.empty(n, np.int64), np.empty((n, n))
    cost = _linearize(blocks, pose, here)
    while iterations < max_iterations:
        iterations += 1
        n_active = _list_active(pose, here.gradient, is_active, blocks.limits, active)
        if n_active == 0:
            break
        while True:
            promised = _damped_step(here.gradient, here.hessian, active[:n_active], damping, L, step)
            moved = _move(pose, step, active[:n_active], blocks.limits, trial)
            worth = promised > gain
            cost_there = _linearize(blocks, trial, there) if worth else cost
            if cost_there < cost or not worth or moved < tolerance or damping > DAMPING.most:
                break
            damping = max(10.0 * damping, DAMPING.least_again)
        if cost_there >= cost:
            break
        gained, cost = cost - cost_there, cost_there
        for k in range(n):  # an assignment to a slice takes a second to compile
            pose[k] = trial[k]
        here, there = there, here
        damping = max(DAMPING.least, damping / 10.0)
        if moved < tolerance or gained < gain:
            break
    for i in range(n):
        for k in range(n):
            hessian[i, k] = here.hessian[i, k]
    return cost, iterations


@njit(nogil=True, cache=True)
def _room(n: int) -> _Linear:
    return _Linear(np.empty(n), np.empty((n, n)), np.empty((n, 3)), np.empty((n, 3)))


@njit(nogil=True, cache=True)
def _linearize(blocks: _Blocks, pose: Array, out: _Linear) -> float:
    """Fill the normal equations of all blocks at a pose, (n_dofs,); return the cost."""
    term, n = blocks.contours, pose.shape[0]
    first, last, sums = term.first, term.last, term.sums
    Ts = term.Ts[first:last]
    forward_kinematics(pose, blocks.tree, Ts, out.axes, out.origins)
    cost = accumulate_normal_equations(term, WITH_JACOBIAN)
    cost += add_keypoints(blocks.keypoints, Ts, sums.M[first:last], sums.b[first:last])
    cost += _add_targets(blocks.targets, Ts, sums.M[first:last], sums.b[first:last])
    twists_to_dofs(
        sums.M[first:last], sums.b[first:last], out.axes, out.origins, blocks.is_length, blocks.parts,
        blocks.tree.parents, blocks.moves, out.gradient, out.hessian,
    )  # fmt: skip
    for s in range(blocks.means.shape[0]):
        for k in range(n):
            w = blocks.weights[s, k]
            r = w * (pose[k] - blocks.means[s, k])
            cost += 0.5 * r * r
            out.gradient[k] += w * r
            out.hessian[k, k] += w * w
    kinematics = Kinematics(Ts, out.axes, out.origins)
    for apart in (blocks.within, blocks.between):
        cost += add_penetration(apart, kinematics, blocks.is_length, blocks.moves, out.gradient, out.hessian)
    return cost


@njit(**NO_REFCOUNT)
def _add_targets(term: _TargetTerm, Ts: Array, M: Array, b: Array) -> float:
    """Add the normal equations of known points to those of the parts' twists, as `add_keypoints`; return the cost."""
    cost = 0.0
    for n in range(term.parts.shape[0]):
        p, target, weight = term.parts[n], term.targets_world[n], term.weights[n] ** 2
        X, Y, Z = place_point(Ts[p], term.points_part[n])
        off = (X - target[0], Y - target[1], Z - target[2])
        rows = ((0.0, Z, -Y, 1.0, 0.0, 0.0), (-Z, 0.0, X, 0.0, 1.0, 0.0), (Y, -X, 0.0, 0.0, 0.0, 1.0))
        for r, row in zip(off, rows):  # noqa: B905, numba knows no strict
            cost += 0.5 * weight * r * r
            for i in range(6):
                b[p, i] += weight * r * row[i]
                for j in range(i, 6):
                    M[p, i, j] += weight * row[i] * row[j]
    return cost


@njit(**NO_REFCOUNT)
def _list_active(
    pose: Array, gradient: Array, is_active: NDArray[np.bool_], limits: Array, active: IntArray
) -> int:  # fmt: skip
    """List the active degrees of freedom that are not pressed against a limit; return their number."""
    n = 0
    for k in range(pose.shape[0]):
        low, high = pose[k] <= limits[k, 0] + TINY, pose[k] >= limits[k, 1] - TINY
        if is_active[k] and not (low and gradient[k] > 0.0) and not (high and gradient[k] < 0.0):
            active[n] = k
            n += 1
    return n


@njit(**NO_REFCOUNT)
def _damped_step(gradient: Array, hessian: Array, active: IntArray, damping: float, L: Array, step: Array) -> float:
    """Fill the damped step, (m,), of the listed degrees of freedom, (m,); return the decrease that it predicts.

    L is scratch for the Cholesky factor, (m, m).
    """
    m, trace = active.shape[0], 0.0
    for i in range(m):
        trace += hessian[active[i], active[i]]
    floor = DAMPING.floor * max(TINY, trace / m)
    if _factor(hessian, active, damping, floor, L):
        _substitute(L, gradient, active, step)
    else:
        for i in range(m):
            own = hessian[active[i], active[i]]
            step[i] = -gradient[active[i]] / (own + damping * (own + floor))
    promised = 0.0
    for i in range(m):
        force = 0.0
        for j in range(m):
            force += hessian[active[i], active[j]] * step[j]
        promised -= (gradient[active[i]] + 0.5 * force) * step[i]
    return promised


@njit(**FAST_MATH)
def _factor(hessian: Array, active: IntArray, damping: float, floor: float, L: Array) -> bool:
    """Fill the Cholesky factor of the damped Hessian, the lower triangle of (m, m); return False if it is not
    definite."""
    for i in range(active.shape[0]):
        for j in range(i + 1):
            total = hessian[active[i], active[j]]
            if i == j:
                total += damping * (total + floor)
            for k in range(j):
                total -= L[i, k] * L[j, k]
            if i > j:
                L[i, j] = total / L[j, j]
            elif total > 0.0:
                L[i, i] = np.sqrt(total)
            else:
                return False
    return True


@njit(**NO_REFCOUNT)
def _substitute(L: Array, gradient: Array, active: IntArray, step: Array) -> None:
    """Fill the step, (m,), by substitution in a Cholesky factor, (m, m)."""
    m = active.shape[0]
    for i in range(m):
        total = -gradient[active[i]]
        for k in range(i):
            total -= L[i, k] * step[k]
        step[i] = total / L[i, i]
    for i in range(m - 1, -1, -1):
        total = step[i]
        for k in range(i + 1, m):
            total -= L[k, i] * step[k]
        step[i] = total / L[i, i]


@njit(**NO_REFCOUNT)
def _move(pose: Array, step: Array, active: IntArray, limits: Array, out: Array) -> float:
    """Fill a pose, (n_dofs,), after a step, (m,), within the limits; return the largest change."""
    farthest = 0.0
    for k in range(pose.shape[0]):
        out[k] = pose[k]
    for i in range(active.shape[0]):
        k = active[i]
        out[k] = min(max(pose[k] + step[i], limits[k, 0]), limits[k, 1])
        farthest = max(farthest, abs(out[k] - pose[k]))
    return farthest
