"""`gauss_newton.solve` in one compiled call, where all that speaks for a pose is the tracker's own blocks.

A descent takes a dozen steps of a tenth of a millisecond. Taken one by one, what leads from kernel to kernel takes as
long as the kernels, and keeps the interpreter's lock from the threads that work on other poses.
`gauss_newton.solve` is the readable version of what is done here, and solves what this does not know.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tracker.body.kinematics import Kinematics, Tree, forward_kinematics
from tracker.body.model import BodyModel
from tracker.compute.numba_options import NO_REFCOUNT
from tracker.fitting import gauss_newton
from tracker.fitting.contour_kernels import WITH_JACOBIAN, ContourTerm, accumulate_normal_equations
from tracker.fitting.contour_residuals import ContourResiduals
from tracker.fitting.gauss_newton import (
    AT_LIMIT,
    FELT_DAMPING,
    FIRST_DAMPING,
    LEAST_DAMPING,
    MOST_DAMPING,
    Fit,
    PosePrior,
    ResidualBlock,
)
from tracker.fitting.interpenetration import (
    NO_PENETRATION,
    BodyPenetration,
    PenetrationTerm,
    SelfPenetration,
    add_penetration,
)
from tracker.fitting.twists import twists_to_dofs
from tracker.geometry.arrays import Array, IntArray

_KNOWN = (ContourResiduals, PosePrior, SelfPenetration, BodyPenetration)


class _Blocks(NamedTuple):
    """What speaks for a pose of a body whose values are its degrees of freedom."""

    tree: Tree
    is_length: NDArray[np.bool_]
    """Its `BodyModel.dof_is_length`, (n_dofs,)."""
    parts: IntArray
    """Its `dof_joint`, (n_dofs,)."""
    moves: NDArray[np.bool_]
    """(n_dofs, n_parts)."""
    limits: Array
    """(n_dofs, 2)."""
    contours: ContourTerm
    """The residuals of the contours."""
    expected: Array
    """Poses to stay near, (S, n_dofs)."""
    weights: Array
    """Their weights, see `PosePrior`, (S, n_dofs)."""
    within: PenetrationTerm
    """What keeps the parts of the body apart."""
    between: PenetrationTerm
    """What keeps several bodies apart."""


class _Linear(NamedTuple):
    """The normal equations at a pose, and room for where it puts everything."""

    gradient: Array
    """(n_dofs,)."""
    hessian: Array
    """(n_dofs, n_dofs)."""
    axes: Array
    """As the next see `Kinematics`, (n_dofs, 3)."""
    origins: Array
    """(n_dofs, 3)."""


def solve_compiled(
    model: BodyModel,
    values: Array,
    blocks: Sequence[ResidualBlock],
    free: NDArray[np.bool_] | None = None,
    max_iterations: int = 50,
    tolerance: float = 1e-6,
    gain: float = 0.0,
) -> Fit:
    """Minimize the summed cost of all blocks within the joint limits, as `gauss_newton.solve` does, to rounding."""
    compiled = _compiled(model, blocks)
    if compiled is None:
        return gauss_newton.solve(model, values, blocks, free, max_iterations, tolerance, gain)
    may_move = np.ones(model.n_dofs, dtype=bool) if free is None else free
    found, hessian = np.where(may_move, model.clip(values), values), np.empty((model.n_dofs, model.n_dofs))
    cost, iterations = _descend(compiled, found, may_move, max_iterations, tolerance, gain, hessian)
    return Fit(found, cost, iterations, hessian)


def _compiled(model: BodyModel, blocks: Sequence[ResidualBlock]) -> _Blocks | None:
    """The blocks as arrays; None where they or the body are of other kinds."""
    if any(type(b) not in _KNOWN for b in blocks) or len(model.value_names) != model.n_dofs:
        return None
    contours = [b.term(model) for b in blocks if isinstance(b, ContourResiduals)]
    priors = [b for b in blocks if isinstance(b, PosePrior)]
    within = [b.term(model) for b in blocks if isinstance(b, SelfPenetration)]
    between = [b.term(model) for b in blocks if isinstance(b, BodyPenetration)]
    if len(contours) != 1 or len(within) > 1 or len(between) > 1:
        return None
    return _Blocks(
        model.tree, model.dof_is_length, model.dof_joint, model.moves, model.limits, contours[0],
        np.array([p.values for p in priors], np.float64).reshape(-1, model.n_dofs),
        np.array([p.weights for p in priors], np.float64).reshape(-1, model.n_dofs),
        within[0] if within else NO_PENETRATION, between[0] if between else NO_PENETRATION,
    )  # fmt: skip


@njit(nogil=True, cache=True)
def _descend(
    blocks: _Blocks, values: Array, may_move: NDArray[np.bool_], max_iterations: int, tolerance: float, gain: float,
    hessian: Array,
) -> tuple[float, int]:  # fmt: skip
    """Move a pose, (n_dofs,), to where the cost is least and fill the Hessian there; the cost and the iterations.

    The same step by step as `gauss_newton.solve`.
    """
    n, damping, iterations = values.shape[0], FIRST_DAMPING, 0
    here, there = _room(n), _room(n)
    trial, step, moving, L = values.copy(), np.empty(n), np.empty(n, np.int64), np.empty((n, n))
    cost = _linearize(blocks, values, here)
    while iterations < max_iterations:
        iterations += 1
        n_moving = _list_moving(values, here.gradient, may_move, blocks.limits, moving)
        if n_moving == 0:
            break
        while True:
            promised = _damped_step(here.gradient, here.hessian, moving[:n_moving], damping, L, step)
            moved = _move(values, step, moving[:n_moving], blocks.limits, trial)
            worth = promised > gain
            cost_there = _linearize(blocks, trial, there) if worth else cost
            if cost_there < cost or not worth or moved < tolerance or damping > MOST_DAMPING:
                break
            damping = max(10.0 * damping, FELT_DAMPING)
        if cost_there >= cost:
            break
        gained, cost = cost - cost_there, cost_there
        values[:] = trial
        here, there = there, here
        damping = max(LEAST_DAMPING, damping / 10.0)
        if moved < tolerance or gained < gain:
            break
    hessian[:] = here.hessian
    return cost, iterations


@njit(nogil=True, cache=True)
def _room(n: int) -> _Linear:
    return _Linear(np.empty(n), np.empty((n, n)), np.empty((n, 3)), np.empty((n, 3)))


@njit(inline="always", nogil=True, cache=True)
def _linearize(blocks: _Blocks, values: Array, out: _Linear) -> float:
    """Fill the normal equations of all blocks at a pose, (n_dofs,); returns the cost."""
    term, n = blocks.contours, values.shape[0]
    first, last, sums = term.first, term.last, term.sums
    Ts = term.Ts[first:last]
    forward_kinematics(values, blocks.tree, Ts, out.axes, out.origins)
    cost = accumulate_normal_equations(term, WITH_JACOBIAN)
    twists_to_dofs(
        sums.M[first:last], sums.b[first:last], out.axes, out.origins, blocks.is_length, blocks.parts,
        blocks.tree.parents, blocks.moves, out.gradient, out.hessian,
    )  # fmt: skip
    for s in range(blocks.expected.shape[0]):
        for k in range(n):
            w = blocks.weights[s, k]
            r = w * (values[k] - blocks.expected[s, k])
            cost += 0.5 * r * r
            out.gradient[k] += w * r
            out.hessian[k, k] += w * w
    kinematics = Kinematics(Ts, out.axes, out.origins)
    for apart in (blocks.within, blocks.between):
        cost += add_penetration(apart, kinematics, blocks.is_length, blocks.moves, out.gradient, out.hessian)
    return cost


@njit(**NO_REFCOUNT)
def _list_moving(
    values: Array, gradient: Array, may_move: NDArray[np.bool_], limits: Array, moving: IntArray
) -> int:  # fmt: skip
    """List what may move and is not pressed against its limit, (n_dofs,); the number."""
    n = 0
    for k in range(values.shape[0]):
        low, high = values[k] <= limits[k, 0] + AT_LIMIT, values[k] >= limits[k, 1] - AT_LIMIT
        if may_move[k] and not (low and gradient[k] > 0.0) and not (high and gradient[k] < 0.0):
            moving[n] = k
            n += 1
    return n


@njit(**NO_REFCOUNT)
def _damped_step(gradient: Array, hessian: Array, moving: IntArray, damping: float, L: Array, step: Array) -> float:
    """Fill the step of what moves, indices (m,), (m,), by Cholesky's factor L (room); the decrease that it promises."""
    m, trace = moving.shape[0], 0.0
    for i in range(m):
        trace += hessian[moving[i], moving[i]]
    floor = 1e-6 * max(1e-12, trace / m)
    if _factor(hessian, moving, damping, floor, L):
        _substitute(L, gradient, moving, step)
    else:
        for i in range(m):
            own = hessian[moving[i], moving[i]]
            step[i] = -gradient[moving[i]] / (own + damping * (own + floor))
    promised = 0.0
    for i in range(m):
        force = 0.0
        for j in range(m):
            force += hessian[moving[i], moving[j]] * step[j]
        promised -= (gradient[moving[i]] + 0.5 * force) * step[i]
    return promised


@njit(**NO_REFCOUNT)
def _factor(hessian: Array, moving: IntArray, damping: float, floor: float, L: Array) -> bool:
    """Fill Cholesky's factor of the damped Hessian of what moves, the lower triangle of (m, m); False where it is not
    definite to the last digit."""
    for i in range(moving.shape[0]):
        for j in range(i + 1):
            total = hessian[moving[i], moving[j]]
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
def _substitute(L: Array, gradient: Array, moving: IntArray, step: Array) -> None:
    """Fill the step, (m,), that a factor, (m, m), takes against the gradient of what moves."""
    m = moving.shape[0]
    for i in range(m):
        total = -gradient[moving[i]]
        for k in range(i):
            total -= L[i, k] * step[k]
        step[i] = total / L[i, i]
    for i in range(m - 1, -1, -1):
        total = step[i]
        for k in range(i + 1, m):
            total -= L[k, i] * step[k]
        step[i] = total / L[i, i]


@njit(**NO_REFCOUNT)
def _move(values: Array, step: Array, moving: IntArray, limits: Array, out: Array) -> float:
    """Fill a pose, (n_dofs,), after a step (m,) of what moves, within the limits; the largest change."""
    farthest = 0.0
    for k in range(values.shape[0]):
        out[k] = values[k]
    for i in range(moving.shape[0]):
        k = moving[i]
        out[k] = min(max(values[k] + step[i], limits[k, 0]), limits[k, 1])
        farthest = max(farthest, abs(out[k] - values[k]))
    return farthest
