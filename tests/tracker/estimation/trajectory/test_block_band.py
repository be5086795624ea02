import numpy as np
import pytest

from tracker.estimation.trajectory.block_band import factor, product


def band(T, n, m, seed=0):
    """A random positive definite matrix of T x T blocks of n x n with m beside the diagonal, and its blocks."""
    rng = np.random.default_rng(seed)
    rows = [np.zeros((n, T, n)) for _ in range(T)]
    for t, row in enumerate(rows):
        row[:, max(0, t - m) : t + 1] = rng.normal(size=(n, min(m, t) + 1, n))
        row[:, t] += 3 * np.eye(n)
    L = np.concatenate(rows).reshape(T * n, T * n)
    whole = L @ L.T
    blocks = np.zeros((m + 1, T, n, n))
    for d in range(m + 1):
        for t in range(T - d):
            blocks[d, t] = whole[(t + d) * n : (t + d + 1) * n, t * n : (t + 1) * n]
    return whole, blocks


@pytest.mark.parametrize(("T", "n", "m"), [(1, 3, 2), (2, 2, 2), (3, 4, 2), (9, 3, 2), (7, 2, 1), (6, 2, 3)])
def test_it_solves_inverts_and_multiplies_as_the_whole_matrix_does(T, n, m):
    whole, blocks = band(T, n, m)
    known, right = factor(blocks), np.random.default_rng(1).normal(size=(T, n))
    np.testing.assert_allclose(known.solve(right).ravel(), np.linalg.solve(whole, right.ravel()), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(product(blocks, right).ravel(), whole @ right.ravel())
    inverse, found = np.linalg.inv(whole), known.inverse()
    for d in range(m + 1):
        for t in range(T - d):
            expected = inverse[(t + d) * n : (t + d + 1) * n, t * n : (t + 1) * n]
            np.testing.assert_allclose(found[d, t], expected, rtol=1e-6, atol=1e-9)


def test_a_matrix_that_is_not_definite_has_no_factor():
    _, blocks = band(5, 2, 2)
    blocks[0, 3] -= 100 * np.eye(2)
    assert factor(blocks) is None
