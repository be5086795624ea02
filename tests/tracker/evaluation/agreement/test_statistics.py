"""Limits of agreement and ICC against published figures and other formulas."""

import numpy as np
import pytest

from tracker.evaluation.agreement.statistics import icc_agreement, limits_of_agreement, mean_squares

SHROUT_FLEISS = np.array([[9, 2, 5, 8], [6, 1, 3, 2], [8, 4, 6, 8], [7, 1, 2, 6], [10, 5, 6, 9], [6, 2, 4, 7]], float)
"""Six subjects, four judges (Shrout & Fleiss 1979, Table 2)."""


def test_icc_is_that_of_the_published_example():
    icc = icc_agreement(mean_squares(SHROUT_FLEISS))
    assert icc.value == pytest.approx(0.2897638, abs=1e-6)  # ICC(2,1) there
    assert icc.interval == pytest.approx((0.018787, 0.761094), abs=1e-5)  # as R's psych prints it


def test_mean_squares_are_those_of_the_published_table():
    squares = mean_squares(SHROUT_FLEISS)
    assert (squares.rows, squares.columns, squares.error) == pytest.approx((11.241667, 32.486111, 1.019444), abs=1e-6)
    assert squares.typical_error == pytest.approx(np.sqrt(1.0194444))


@pytest.mark.parametrize(("n", "k"), [(30, 2), (12, 3), (5, 4)])
def test_icc_is_that_of_an_anova_by_least_squares(n, k):
    """Sums of squares by regression on indicators, and variance components instead of the closed form."""
    rng = np.random.default_rng(n)
    values = rng.normal(size=(n, 1)) * 3 + rng.normal(size=k) + rng.normal(size=(n, k))
    y, row, column = values.ravel(), np.repeat(np.arange(n), k), np.tile(np.arange(k), n)

    def rest(*factors):
        X = np.column_stack([np.ones(n * k), *(np.eye(f.max() + 1)[f][:, 1:] for f in factors)])
        return float(((y - X @ np.linalg.lstsq(X, y, rcond=None)[0]) ** 2).sum())

    error = rest(row, column) / ((n - 1) * (k - 1))
    rows, columns = (rest(column) - rest(row, column)) / (n - 1), (rest(row) - rest(row, column)) / (k - 1)
    of_rows, of_columns = (rows - error) / k, (columns - error) / n
    expected = of_rows / (of_rows + of_columns + error)
    assert icc_agreement(mean_squares(values)).value == pytest.approx(expected, abs=1e-6)


def test_icc_of_vectors_does_not_depend_on_the_axes():
    rng = np.random.default_rng(3)
    points = rng.normal(size=(20, 1, 3)) * (1.0, 2.0, 0.1) + 0.1 * rng.normal(size=(20, 2, 3))
    R, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    a, b = (icc_agreement(mean_squares(x)).value for x in (points, points @ R))
    assert a == pytest.approx(b, abs=1e-12)
    assert a != pytest.approx(icc_agreement(mean_squares(points[..., 2])).value, abs=1e-3)


def test_the_icc_interval_covers_the_truth():
    """Of 95% intervals of samples with a known ICC, about 95% hold it."""
    rng, truth, inside = np.random.default_rng(5), 4 / (4 + 0.25 + 1), 0
    for _ in range(400):
        values = 2 * rng.normal(size=(30, 1)) + 0.5 * rng.normal(size=6) + rng.normal(size=(30, 6))
        low, high = icc_agreement(mean_squares(values)).interval
        inside += low <= truth <= high
    assert 0.92 < inside / 400 < 0.985


def test_limits_of_agreement_and_their_intervals():
    """Bland & Altman 1986, lung function: bias -2.1 l/min, SD 38.8, n 17; the t value of 16 is 2.12."""
    raw = np.random.default_rng(0).normal(size=17)
    differences = -2.1 + 38.8 * (raw - raw.mean()) / raw.std(ddof=1)
    limits = limits_of_agreement(differences)
    assert (limits.bias, limits.lower, limits.upper) == pytest.approx((-2.1, -78.15, 73.95), abs=0.01)
    assert limits.bias_interval == pytest.approx((-22.0, 17.8), abs=0.1)
    half = 2.12 * 38.8 * np.sqrt(1 / 17 + 1.96**2 / 32)
    assert limits.lower_interval == pytest.approx((-78.15 - half, -78.15 + half), abs=0.05)


def test_too_few_or_equal_values():
    assert np.isnan(limits_of_agreement(np.array([1.0])).lower)
    assert limits_of_agreement(np.full(5, 2.0))[:3] == (2.0, 2.0, 2.0)
    equal = np.repeat(np.arange(5.0)[:, None], 2, axis=1)
    assert icc_agreement(mean_squares(equal)) == (1.0, (1.0, 1.0))
    assert np.isnan(icc_agreement(mean_squares(np.ones((5, 2)))).value)
    assert np.isnan(icc_agreement(mean_squares(np.ones((1, 2)))).value)
