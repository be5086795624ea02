"""The update of an extended Kalman filter in Joseph's form, which keeps covariances positive definite."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from tracker.estimation.voxel.state import FilterState
from tracker.geometry.arrays import Array

_MAX_MULTIPLICATIONS = 2**17
"""Multiplications of a product that BLAS does on the calling thread. If all cores are busy, its other threads make a
product of two 96x96 matrices a hundred times slower."""


class LinearizedMeasurement(NamedTuple):
    """A measurement linearized at a state."""

    residual: Array
    """Measured less expected, (m,)."""
    jacobian: Array
    """Derivative of what is expected by the error state, (m, n)."""
    noise: Array
    """Covariance of the measurement, (m, m)."""


class Update(NamedTuple):
    """The result of an update."""

    state: FilterState
    normalized_innovation: float
    """Squared innovation in units of its covariance; chi-square distributed with `n_rows` degrees of freedom."""
    n_rows: int


def joined(*measurements: LinearizedMeasurement | None) -> LinearizedMeasurement | None:
    """Return independent measurements as one; None if there is none."""
    found = [m for m in measurements if m is not None]
    if len(found) < 2:
        return found[0] if found else None
    sizes = np.cumsum([0, *(len(m.residual) for m in found)])
    R = np.zeros((sizes[-1], sizes[-1]))
    for m, first, end in zip(found, sizes, sizes[1:], strict=False):
        R[first:end, first:end] = m.noise
    return LinearizedMeasurement(
        np.concatenate([m.residual for m in found]), np.concatenate([m.jacobian for m in found]), R
    )


def update(
    predicted: FilterState, measure: Callable[[FilterState], LinearizedMeasurement | None], iterations: int = 1
) -> Update:
    """Update a predicted state by a measurement.

    Several iterations linearize, and measure, at the state of the iteration before (iterated extended Kalman filter).
    The innovation is that of the first one.

    Args:
        predicted: the prediction, with its covariance.
        measure: returns the measurement at a state; None if there is none.
        iterations: number of linearizations.
    """
    P, state, innovation, n_rows = predicted.covariance, predicted, 0.0, 0
    for i in range(iterations):
        found = measure(state)
        if found is None or not len(found.residual):
            break
        H, HP = found.jacobian, product(found.jacobian, P)
        S = product(HP, H.T) + found.noise
        residual = found.residual if i == 0 else found.residual + H @ state.difference(predicted)
        solved = np.linalg.solve((S + S.T) / 2, np.column_stack([HP, residual]))
        gain = np.asarray(solved[:, :-1].T, dtype=np.float64)
        if i == 0:
            innovation, n_rows = float(residual @ solved[:, -1]), len(residual)
        state = predicted.retract(gain @ residual).with_covariance(joseph(P, gain, found))
    return Update(state, innovation, n_rows)


def joseph(P: Array, gain: Array, measurement: LinearizedMeasurement) -> Array:
    """Return the updated covariance, (n, n): (I - KH) P (I - KH)^T + K R K^T is positive definite for any gain."""
    rest = np.eye(len(P)) - product(gain, measurement.jacobian)
    out = product(product(rest, P), rest.T) + product(product(gain, measurement.noise), gain.T)
    return (out + out.T) / 2


def product(a: Array, b: Array) -> Array:
    """Return the product of matrices, (l, m) and (m, n), in blocks of rows."""
    n_rows = max(1, _MAX_MULTIPLICATIONS // max(1, a.shape[1] * b.shape[1]))
    out = np.empty((a.shape[0], b.shape[1]))
    for first in range(0, a.shape[0], n_rows):
        np.matmul(a[first : first + n_rows], b, out=out[first : first + n_rows])
    return out
