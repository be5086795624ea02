"""Statistics of agreement: limits of agreement, intraclass correlation, typical error.

Sources: Bland & Altman 1999, "Measuring agreement in method comparison studies"; McGraw & Wong 1996, "Forming
inferences about some intraclass correlation coefficients"; Hopkins 2000, "Measures of reliability in sports medicine
and science"; Hotelling 1931, "The generalization of Student's ratio"; Johnson & Wichern 2007, "Applied multivariate
statistical analysis".
"""

from typing import NamedTuple

import numpy as np

from tracker.geometry.arrays import Array

Interval = tuple[float, float]
_OUTSIDE = 0.05
"""Probability beyond 95% limits and confidence intervals."""
_UPPER = 1 - _OUTSIDE / 2
"""Probability below the upper one."""


class Limits(NamedTuple):
    """Bias and 95% limits of agreement of differences, in their unit, each with its 95% confidence interval.

    A value that too few differences determine is NaN.
    """

    bias: float
    lower: float
    upper: float
    bias_interval: Interval
    lower_interval: Interval
    upper_interval: Interval


class MeanSquares(NamedTuple):
    """Mean squares of a two-way analysis of variance without replication."""

    rows: float
    """Between subjects."""
    columns: float
    """Between annotators."""
    error: float
    """Residual."""
    n: int
    """Number of subjects."""
    k: int
    """Number of annotators."""

    @property
    def typical_error(self) -> float:
        """Within-subject standard deviation; of two annotators the SD of differences over sqrt 2 (Hopkins 2000)."""
        return float(np.sqrt(self.error))


class Icc(NamedTuple):
    """An intraclass correlation with its 95% confidence interval; NaN where the values do not determine it."""

    value: float
    interval: Interval


def limits_of_agreement(differences: Array, dimensions: int = 1, chosen_of: int = 1) -> Limits:
    """Return bias and limits of agreement, bias +- 1.96 SD (Bland & Altman 1999, Sect. 2).

    The variance of a limit is s^2 (1/n + 1.96^2 / (2 (n - 1))) (Sect. 2.4). Student's t with n - 1 degrees of freedom
    turns it into an interval.

    A line that was chosen by its own bias needs a wider interval, or copies without a systematic difference would
    show one. For differences along any line in p dimensions, t gives way to the root of p (n - 1) / (n - p) F with p
    and n - p degrees of freedom. Hotelling's T^2 has this distribution, and the interval holds for all lines at once
    (Hotelling 1931; Johnson & Wichern 2007, Sect. 5.4). For p = 1 it is t itself. The limits take the same factor.

    The pair with the largest bias of m pairs has the level 1 - 0.05 / m (Bonferroni; Johnson & Wichern, Sect. 5.4).

    Args:
        differences: signed, (n,).
        dimensions: of the space in which the differences choose their line; 1 for a line that is given.
        chosen_of: number of pairs of annotators of which this one was chosen by its bias.
    """
    from scipy.special import fdtri, ndtri  # imported lazily: the command's help needs none

    n = len(differences)
    bias = float(np.mean(differences)) if n else np.nan
    if n < 2:
        unknown = (np.nan, np.nan)
        return Limits(bias, np.nan, np.nan, unknown, unknown, unknown)
    z, sd, freedom = float(ndtri(_UPPER)), float(np.std(differences, ddof=1)), n - dimensions
    t_squared = np.nan
    if freedom > 0:
        t_squared = dimensions * (n - 1) / freedom * float(fdtri(dimensions, freedom, 1 - _OUTSIDE / chosen_of))
    of_bias, of_limit = sd * np.sqrt(t_squared / n), sd * np.sqrt(t_squared * (1 / n + z**2 / (2 * (n - 1))))
    lower, upper = bias - z * sd, bias + z * sd
    return Limits(bias, lower, upper, _around(bias, of_bias), _around(lower, of_limit), _around(upper, of_limit))


def mean_squares(values: Array) -> MeanSquares:
    """Return the mean squares of values, (n, k) for n subjects and k annotators, or (n, k, d) for vectors.

    Sums of squares of vectors are summed over their components, so that the axes of the world do not matter.
    """
    n, k = values.shape[:2]
    values = values.reshape(n, k, -1)
    mean = values.mean(axis=(0, 1))
    of_rows, of_columns = values.mean(axis=1), values.mean(axis=0)
    rest = values - of_rows[:, None] - of_columns[None] + mean
    rows, columns, error = (
        float((count * x**2).sum()) / freedom if freedom > 0 else np.nan
        for count, x, freedom in (
            (k, of_rows - mean, n - 1),
            (n, of_columns - mean, k - 1),
            (1, rest, (n - 1) * (k - 1)),
        )
    )
    return MeanSquares(rows, columns, error, n, k)


def icc_agreement(of: MeanSquares) -> Icc:
    """Return ICC(A,1): two-way random effects, absolute agreement, single annotator (McGraw & Wong 1996, Table 4).

    The interval is that of their Table 7, case 2A. For vectors it has the degrees of freedom of one component, and is
    therefore wide rather than narrow.
    """
    from scipy.special import fdtri

    rows, columns, error, n, k = of
    whole = rows + (k - 1) * error + k / n * (columns - error)
    if not whole > 0:
        return Icc(np.nan, (np.nan, np.nan))
    icc = (rows - error) / whole
    if icc >= 1 or error + columns == 0:
        return Icc(1.0, (1.0, 1.0))
    a, b = k * icc / (n * (1 - icc)), 1 + k * icc * (n - 1) / (n * (1 - icc))
    denominator = (a * columns) ** 2 / (k - 1) + (b * error) ** 2 / ((n - 1) * (k - 1))
    v = (a * columns + b * error) ** 2 / denominator if denominator > 0 else np.nan
    above, below = fdtri(n - 1, v, _UPPER), fdtri(v, n - 1, _UPPER)
    between = k * columns + (k * n - k - n) * error
    lower = n * (rows - above * error) / (above * between + n * rows)
    upper = n * (below * rows - error) / (between + n * below * rows)
    return Icc(icc, (float(lower), float(upper)))


def _around(middle: float, half: float) -> Interval:
    return float(middle - half), float(middle + half)
