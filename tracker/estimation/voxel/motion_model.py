"""Predict a state over the time to the next frame (MTHC01 Eq. 4-5, and beyond)."""

from typing import NamedTuple

import numpy as np

from tracker.estimation.voxel.figure import N_PARTS
from tracker.estimation.voxel.kalman import product
from tracker.estimation.voxel.state import FilterState
from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array


class ProcessNoise(NamedTuple):
    """How a state may change by itself: densities of white noise."""

    turn: float
    """Random walk of rotations, rad/s^0.5; of each part in the paper's version."""
    turn_rate: float
    """Random walk of angular velocities, rad/s per s^0.5."""
    size: float
    """Random walk of half sizes, m/s^0.5."""
    center: float
    """Random walk of the torso's centre, m/s^0.5."""
    velocity: float
    """Random walk of its velocity, m/s per s^0.5."""
    damping: float
    """Rate at which velocities die away, 1/s; 0 keeps them, as in the paper."""


def predict(state: FilterState, dt: float, noise: ProcessNoise) -> FilterState:
    """Return the state and its covariance after a time; without velocities the transition is the identity.

    Args:
        state: of the frame before.
        dt: time to the next frame, s.
        noise: of the process.
    """
    F, step = transition(state, dt, noise.damping)
    moved = state.retract(step)
    P = product(product(F, state.covariance), F.T) + process_covariance(state, dt, noise)
    return moved.with_covariance((P + P.T) / 2)


def transition(state: FilterState, dt: float, damping: float = 0.0) -> tuple[Array, Array]:
    """Return the derivative of the predicted error state by the present one, (n, n), and the step, (n,).

    Rotations turn by exp(rate dt) on the right. The derivative by the rate has the right Jacobian.
    """
    at = state.layout
    F, step = np.eye(at.n), np.zeros(at.n)
    # The velocity dies away as exp(-damping t), so that the way is its integral.
    kept = float(np.exp(-damping * dt))
    effective = dt if damping * dt < TINY else (1.0 - kept) / damping
    if at.velocity:
        step[at.center_at] = effective * state.velocity
        step[at.velocity_at] = (kept - 1.0) * state.velocity
        F[at.center_at, at.velocity_at] = effective * np.eye(3)
        F[at.velocity_at, at.velocity_at] = kept * np.eye(3)
    if at.turn_rates:
        turns = effective * state.turn_rates
        step[at.turns_at] = turns.ravel()
        step[at.turn_rates_at] = (kept - 1.0) * state.turn_rates.ravel()
        back, by_rate = rigid.so3_exp(-turns), right_jacobian(turns)
        for i in range(N_PARTS):
            t, r = slice(3 * i, 3 * i + 3), slice(at.turn_rates_at.start + 3 * i, at.turn_rates_at.start + 3 * i + 3)
            F[t, t] = back[i]
            F[t, r] = effective * by_rate[i]
            F[r, r] = kept * np.eye(3)
    return F, step


def process_covariance(state: FilterState, dt: float, noise: ProcessNoise) -> Array:
    """Return the covariance that the process adds over a time, (n, n)."""
    at = state.layout
    Q = np.zeros((at.n, at.n))
    _add(Q, at.turns_at, at.turn_rates_at, dt, noise.turn, noise.turn_rate)
    _add(Q, at.center_at, at.velocity_at, dt, noise.center, noise.velocity)
    sizes = np.arange(at.sizes_at.start, at.sizes_at.stop)
    Q[sizes, sizes] = noise.size**2 * dt
    return Q


def _add(Q: Array, value: slice, rate: slice, dt: float, walk: float, rate_walk: float) -> None:
    """Add the noise of values and of their rates, which integrate to the values."""
    v, r = np.arange(value.start, value.stop), np.arange(rate.start, rate.stop)
    Q[v, v] += walk**2 * dt
    if len(r):
        Q[v, v] += rate_walk**2 * dt**3 / 3
        Q[v, r] += rate_walk**2 * dt**2 / 2
        Q[r, v] += rate_walk**2 * dt**2 / 2
        Q[r, r] += rate_walk**2 * dt


def right_jacobian(turns: Array) -> Array:
    """Return the right Jacobian of the exponential map at rotation vectors, (..., 3), (..., 3, 3).

    exp(a + b) = exp(a) exp(J b) to first order in b.
    """
    angle = np.linalg.norm(turns, axis=-1)[..., None, None]
    a = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    b = (1 - np.sinc(angle / np.pi)) / np.maximum(angle, TINY) ** 2  # near 0 the square of K outweighs lost digits
    K = rigid.skew(turns)
    return np.asarray(np.eye(3) - a * K + b * (K @ K))


def left_jacobian_inverse(turns: Array) -> Array:
    """Return the inverse of the left Jacobian of the exponential map at rotation vectors, (..., 3), (..., 3, 3).

    log(exp(b) exp(a)) = a + J^-1 b to first order in b.
    """
    return np.asarray(np.linalg.inv(right_jacobian(-turns)), np.float64)
