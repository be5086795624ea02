"""Measure a figure by its labelled voxels: centre, orientation and sizes of its parts (MTHC01 Sect. 4)."""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.estimation.fitting.gauss_newton import UNKNOWN
from tracker.estimation.voxel.figure import N_PARTS
from tracker.estimation.voxel.kalman import LinearizedMeasurement, product
from tracker.estimation.voxel.labels import PartClouds
from tracker.estimation.voxel.motion_model import left_jacobian_inverse
from tracker.estimation.voxel.state import FilterState
from tracker.geometry import rigid
from tracker.geometry.arrays import TINY, Array, IntArray

MIN_VOXELS = 4
"""Fewest voxels of a part that is measured: fewer have no three principal axes."""
_ORDERS = np.array(list(itertools.permutations(range(3))))
"""All orders of three axes, (6, 3)."""
_SKIN_M = 0.01
"""Spread that the skin of a visual hull adds across a part, metres."""
_IMPROBABLE = 16.8
"""Normalized innovation of the six rows of a part that one in a hundred exceeds."""


class MeasurementNoise(NamedTuple):
    """Standard deviations of what voxels measure."""

    across_m: float
    """Centre of a part across its axis, metres."""
    along: float
    """Centre along its axis, as a share of its half size: labels end where the prediction has the joint."""
    turn: float
    """Angles, rad; beyond the paper those of distinct axes, see `independent`."""
    size_m: float
    """Half sizes, metres."""
    independent_m3: float | None
    """Volume of voxels whose errors are as one, cubic metres. From it follows how well axes of similar spread are told
    apart. None: all angles have the same noise."""


class PartAxes(NamedTuple):
    """Centres, turns and sizes of parts as measured, about the predicted parts."""

    is_measured: NDArray[np.bool_]
    """Whether a part has enough voxels, (10,)."""
    offsets: Array
    """From the predicted to the measured centre in the frame of the part, (10, 3), metres."""
    turns: Array
    """Rotation vector from the predicted to the measured axes, (10, 3), rad."""
    sizes: Array
    """Half sizes, (10, 3), metres."""
    variances: Array
    """Variances of the voxels along the measured axes, (10, 3), square metres."""
    volumes: Array
    """Volume of the voxels, (10,), cubic metres."""


def measure_parts(state: FilterState, clouds: PartClouds, size_m: float, by_size: bool) -> PartAxes:
    """Measure centre, axes and sizes of the parts from their voxels.

    Args:
        state: the state with which the voxels were labelled.
        clouds: the voxels of each part, (10,).
        size_m: edge of a voxel, metres.
        by_size: whether axes are told apart by their order of size, as in the paper; else each is the one closest to
            the predicted axis. Both turn an axis that points the wrong way.
    """
    variances, axes = np.linalg.eigh(clouds.covariances)
    order = np.argsort(state.figure.order, axis=1) if by_size else _closest_order(axes)
    axes = np.take_along_axis(axes, order[:, None, :], axis=2)
    variances = np.take_along_axis(variances, order, axis=1)
    axes = axes * np.where(np.einsum("mii->mi", axes) < 0, -1.0, 1.0)[:, None, :]
    odd = np.linalg.det(axes) < 0
    if odd.any():  # the axis that is farthest from the predicted one is turned
        worst = np.einsum("mii->mi", axes)[odd].argmin(axis=1)
        axes[np.flatnonzero(odd), :, worst] *= -1
    sizes = np.sqrt(np.maximum(variances, TINY)) / state.figure.sigma_shares
    return PartAxes(
        clouds.counts >= MIN_VOXELS,
        clouds.means,
        rigid.so3_log(axes),
        sizes,
        np.maximum(variances, TINY),
        clouds.counts * size_m**3,
    )


def linearize(
    state: FilterState, found: PartAxes, noise: MeasurementNoise, used: NDArray[np.bool_], with_sizes: bool
) -> LinearizedMeasurement | None:
    """Linearize the measurement of some parts at the state that they were measured with.

    Args:
        state: the state.
        found: the measured parts.
        noise: standard deviations.
        used: which parts count, (10,).
        with_sizes: whether measured sizes count; only where the state has them.
    """
    parts = np.flatnonzero(used & found.is_measured)
    if not len(parts):
        return None
    n, n_rows, n_states = len(parts), 9 if with_sizes else 6, state.layout.n
    residual, H, R = np.zeros((n, n_rows)), np.zeros((n, n_rows, n_states)), np.zeros((n, n_rows, n_rows))
    one, xyz = np.arange(n)[:, None], np.arange(3)
    rotations, sizes, columns = state.rotations[parts], state.sizes[parts], 3 * parts[:, None] + xyz
    doubt = _doubt(state, found)[parts] if noise.independent_m3 is not None else np.ones(n)
    residual[:, :3] = (rotations @ found.offsets[parts, :, None])[..., 0]
    residual[:, 3:6] = found.turns[parts]
    H[:, :3] = state.center_jacobian[parts]
    H[one[..., None], 3 + xyz[:, None], columns[:, None]] = left_jacobian_inverse(found.turns[parts])
    spreads = np.full((n, 3), noise.across_m)
    spreads[:, 2] = np.maximum(noise.across_m, noise.along * sizes[:, 2])
    R[:, :3, :3] = (rotations * (spreads**2 * doubt[:, None])[:, None]) @ np.swapaxes(rotations, 1, 2)
    turn_variances = _turn_variances(found, noise)[parts] * doubt[:, None]
    R[:, 3 + xyz, 3 + xyz] = np.minimum(turn_variances, UNKNOWN**2)
    if with_sizes:
        residual[:, 6:] = found.sizes[parts] - sizes
        H[one, 6 + xyz, state.layout.sizes_at.start + columns] = 1.0
        R[:, 6 + xyz, 6 + xyz] = noise.size_m**2 * doubt[:, None]
    if noise.independent_m3 is not None:
        R[:, :6, :6] *= _influence_limits(state, residual[:, :6], H[:, :6], R[:, :6, :6])[:, None, None]
    noises = np.zeros((n, n_rows, n, n_rows))
    noises[one[:, 0], :, one[:, 0]] = R
    return LinearizedMeasurement(residual.ravel(), H.reshape(-1, n_states), noises.reshape(n * n_rows, -1))


def linearize_rotations(state: FilterState, rotations: Array, sigma_rad: float) -> LinearizedMeasurement:
    """Linearize a measurement of the rotations of all parts, (10, 3, 3).

    Args:
        state: the state.
        rotations: as measured.
        sigma_rad: standard deviation of each angle, rad.
    """
    turns = rigid.so3_log(np.swapaxes(state.rotations, 1, 2) @ rotations)
    by_turn, H = left_jacobian_inverse(turns), np.zeros((3 * N_PARTS, state.layout.n))
    for i in range(N_PARTS):
        own = slice(3 * i, 3 * i + 3)
        H[own, own] = by_turn[i]
    return LinearizedMeasurement(turns.ravel(), H, np.eye(3 * N_PARTS) * sigma_rad**2)


def _closest_order(axes: Array) -> IntArray:
    """Return the index of the principal axis that is closest to each axis of the parts, (10, 3)."""
    # fits[m, k]: how well the axes of part m agree with its own in the k-th order
    fits = np.abs(axes[:, np.arange(3), _ORDERS]).sum(axis=2)
    return np.asarray(_ORDERS[fits.argmax(axis=1)])


def _doubt(state: FilterState, found: PartAxes) -> Array:
    """Return the factor by which the variances of each part grow, (10,), at least 1.

    A cloud that is thicker than its part is merged with another one; one with fewer voxels is only a piece of it.
    """
    expected = np.sum((state.figure.sigma_shares * state.sizes)[:, :2] ** 2, axis=1) + 2 * _SKIN_M**2
    thick = np.sum(found.variances[:, :2], axis=1) / expected
    volumes = np.pi * 2 * np.prod(state.sizes, axis=1) * np.where(state.figure.is_ellipsoid, 2 / 3, 1.0)
    missing = volumes / np.maximum(found.volumes, TINY)
    return np.asarray(np.clip(thick, 1.0, 3.0) ** 2 * np.clip(missing, 1.0, 10.0))


def _influence_limits(state: FilterState, residual: Array, H: Array, R: Array) -> Array:
    """Return the factor on the noise of each part, (M,), at least 1, that bounds the influence of its innovation.

    Args:
        state: the state.
        residual: innovation of each part, (M, 6).
        H: its derivative, (M, 6, n).
        R: its noise, (M, 6, 6).
    """
    HP = product(H.reshape(-1, H.shape[2]), state.covariance).reshape(H.shape)
    solved = np.linalg.solve(HP @ np.swapaxes(H, 1, 2) + R, residual[..., None])[..., 0]
    return np.maximum(np.sum(residual * solved, axis=1) / _IMPROBABLE, 1.0)


def _turn_variances(found: PartAxes, noise: MeasurementNoise) -> Array:
    """Return the variance of each measured angle, (10, 3), rad^2.

    The axes i and j of n independent points mix by an angle of variance s_i s_j / (n (s_i - s_j)^2), with the variances
    s along them: where both are alike, nothing tells them apart.
    """
    base = np.full((N_PARTS, 3), noise.turn**2)
    if noise.independent_m3 is None:
        return base
    s = found.variances
    one, other = s[:, [1, 2, 0]], s[:, [2, 0, 1]]
    n = np.maximum(found.volumes / noise.independent_m3, 1.0)[:, None]
    return np.asarray(np.minimum(base + one * other / (n * np.maximum((one - other) ** 2, TINY**2)), UNKNOWN**2))
