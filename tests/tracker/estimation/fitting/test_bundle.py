"""Least squares with shared and own unknowns: against dense solvers, and against scipy."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from tracker.estimation.fitting.bundle import ArrowEquations, settle_bundle, solve_bundle
from tracker.estimation.fitting.gauss_newton import normal_equations

N, GROUPS, M = 4, 6, 3


class Curves:
    """Made-up residuals of each group: a bent function of the shared unknowns and its own ones."""

    def __init__(self, seed=0):
        random = np.random.default_rng(seed)
        self.A = random.normal(size=(GROUPS, 12, N + M))
        self.targets = np.tanh(self.A @ random.normal(size=N + M)) + 0.1 * random.normal(size=(GROUPS, 12))

    def residuals(self, state, group):
        x = self.A[group] @ np.concatenate([state[0], state[1][group]])
        return np.tanh(x) - self.targets[group], self.A[group] / np.cosh(x)[:, None] ** 2

    def linearize(self, state, below=np.inf):
        out = ArrowEquations.zeros(N, GROUPS, M)
        found = [normal_equations(*self.residuals(state, g)) for g in range(GROUPS)]
        for g, own in enumerate(found):
            out.add(g, own)
        return out._replace(cost=sum(own.cost for own in found))

    def moved(self, state, shared, own):
        return state[0] + shared, state[1] + own

    def free(self, state, equations):
        return np.ones(N, bool), np.ones((GROUPS, M), bool)


def dense(equations):
    """The whole normal matrix and gradient."""
    n = N + GROUPS * M
    H, g = np.zeros((n, n)), np.zeros(n)
    H[:N, :N], g[:N] = equations.hessian, equations.gradient
    for k in range(GROUPS):
        at = slice(N + k * M, N + (k + 1) * M)
        H[at, at], H[at, :N], H[:N, at] = equations.own_hessians[k], equations.cross[k], equations.cross[k].T
        g[at] = equations.own_gradients[k]
    return H, g


class Rough(Curves):
    """The same with a cost that jumps up wherever the state moves away from where it was."""

    def __init__(self, jump):
        super().__init__()
        self.jump = jump

    def linearize(self, state, below=np.inf):
        found = super().linearize(state)
        return found._replace(cost=found.cost + self.jump * (np.abs(state[0]).max() > 0))


class Diverging(Curves):
    """A gradient that points the wrong way, so that each step promises more than the last one."""

    def linearize(self, state, below=np.inf):
        found = super().linearize(state)
        return found._replace(gradient=-found.gradient, own_gradients=-found.own_gradients)


START = np.zeros(N), np.zeros((GROUPS, M))


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_a_step_is_that_of_the_dense_system(damping):
    equations = Curves().linearize(START)
    H, g = dense(equations)
    expected = -np.linalg.solve(H + damping * np.diag(np.diag(H)), g)
    shared, own = equations.step(damping)
    np.testing.assert_allclose(np.concatenate([shared, own.ravel()]), expected, rtol=1e-8)


def test_the_reduced_system_has_the_covariance_of_the_shared_unknowns():
    equations = Curves().linearize(START)
    H, g = dense(equations)
    gradient, hessian = equations.reduced()
    np.testing.assert_allclose(np.linalg.inv(hessian), np.linalg.inv(H)[:N, :N], rtol=1e-8)
    np.testing.assert_allclose(np.linalg.solve(hessian, gradient), np.linalg.solve(H, g)[:N], rtol=1e-8)


def test_held_unknowns_do_not_move():
    equations = Curves().linearize(START)
    shared, own = np.array([True, False, True, True]), np.ones((GROUPS, M), bool)
    own[2, 1] = False
    moves = np.concatenate([shared, own.ravel()])
    H, g = dense(equations)
    expected = np.zeros(len(g))
    expected[moves] = -np.linalg.solve(H[np.ix_(moves, moves)], g[moves])
    found = equations.held(shared, own).step(0.0)
    np.testing.assert_allclose(np.concatenate([found[0], found[1].ravel()]), expected, rtol=1e-8, atol=1e-12)


def test_an_own_unknown_that_no_residual_depends_on_stays():
    curves = Curves()
    curves.A[2, :, N + 1] = 0.0  # as the angle of a limb that no view shows
    solution = solve_bundle(curves, START, tolerance=1e-9)
    gradient, hessian = solution.equations.held(*curves.free(None, None)).reduced()
    assert solution.state[1][2, 1] == 0
    assert np.abs(np.linalg.solve(hessian, gradient)).max() < 1e-3


def test_the_minimum_is_scipys():
    problem = Curves(1)

    def residuals(x):
        state = x[:N], x[N:].reshape(GROUPS, M)
        return np.concatenate([problem.residuals(state, g)[0] for g in range(GROUPS)])

    expected = least_squares(residuals, np.zeros(N + GROUPS * M), xtol=1e-12, ftol=1e-12)
    solution = solve_bundle(problem, START, tolerance=1e-12)
    assert solution.cost == pytest.approx(expected.cost, rel=1e-6)
    np.testing.assert_allclose(solution.state[0], expected.x[:N], atol=1e-4)
    assert solution.cost < 0.5 * problem.linearize(START).cost


def test_a_report_can_stop_it():
    def stop(iteration):
        if iteration == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        solve_bundle(Curves(1), START, report=stop)


def test_a_fit_settles_where_the_gradient_vanishes_though_its_cost_is_rough():
    smooth, rough = solve_bundle(Curves(), START), Rough(jump=1e3)
    assert solve_bundle(rough, START).evaluations > 3
    np.testing.assert_array_equal(solve_bundle(rough, START).state[0], START[0])
    solution = settle_bundle(rough, START, 50, 1e-6)
    np.testing.assert_allclose(solution.state[0], smooth.state[0], atol=1e-2)
    assert solution.cost == pytest.approx(smooth.cost + 1e3, rel=1e-4)


def test_a_fit_does_not_settle_where_steps_promise_more_and_more():
    solution = settle_bundle(Diverging(), START, 50, 1e-6)
    assert solution.cost <= Diverging().linearize(START).cost
    assert solution.evaluations == 1
