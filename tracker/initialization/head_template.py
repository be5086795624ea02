"""Find the head of a figure by a spherical crust template (MTHC01 Sect. 3).

The paper counts the surface voxels within the crust. A trunk may hold as many. A head also has nothing around it but
the neck, so that the occupied voxels in a shell around the crust are subtracted.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Array
from tracker.voxels.voxel_grid import Voxels

INNER_M, OUTER_M = 0.07, 0.135
"""Radii of the crust: half the smallest and half the largest dimension of a head, metres."""
SURROUNDING_M = 0.20
"""Outer radius of the shell in which a head has only its neck, metres."""
MIN_SCORE = 0.25
"""Smallest score of a head: the surface voxels in the crust less the voxels around it, as a share of the surface voxels
of a sphere of the crust's mean radius."""


class Head(NamedTuple):
    """The head of a figure."""

    center: Array
    """Centre of its voxels, (3,), metres."""
    neck: Array
    """Mean of its voxels that touch the rest of the body, (3,), metres."""
    is_head: NDArray[np.bool_]
    """Whether each voxel of the figure belongs to it, (N,)."""
    score: float
    """See `MIN_SCORE`."""


def find_head(figure: Voxels) -> Head | None:
    """Return the head of a figure; None if no place scores enough or nothing is beside it.

    Args:
        figure: voxels of one person, at most about 5 cm each.
    """
    score, center = _best_center(figure)
    if score < MIN_SCORE:
        return None
    points = figure.points_world
    is_head = np.linalg.norm(points - center, axis=1) <= OUTER_M
    neck = _neck(figure, is_head)
    if neck is None:
        return None
    return Head(points[is_head].mean(axis=0), neck, is_head, score)


def _best_center(figure: Voxels) -> tuple[float, Array]:
    from scipy.signal import fftconvolve  # imported lazily: loading it takes 0.5 s

    size = figure.grid.size_m
    reach = int(np.ceil(SURROUNDING_M / size))
    distance = size * np.sqrt(np.sum(np.square(np.indices((2 * reach + 1,) * 3) - reach), axis=0))
    crust = ((distance >= INNER_M) & (distance <= OUTER_M)).astype(np.float64)
    around = ((distance > OUTER_M + size / 2) & (distance <= SURROUNDING_M)).astype(np.float64)
    surface = np.zeros(figure.grid.shape)
    surface[tuple(figure.indices[figure.is_surface].T)] = 1.0
    counts = fftconvolve(surface, crust, mode="same")
    counts -= fftconvolve(figure.occupied.astype(np.float64), around, mode="same")
    counts[~figure.occupied] = -np.inf
    best = np.unravel_index(int(np.argmax(counts)), counts.shape)
    expected = np.pi * (INNER_M + OUTER_M) ** 2 / size**2
    return float(counts[best] / expected), figure.grid.centers(np.array(best))


def _neck(figure: Voxels, is_head: NDArray[np.bool_]) -> Array | None:
    from scipy.ndimage import binary_dilation

    rest = np.zeros(figure.grid.shape, bool)
    rest[tuple(figure.indices[~is_head].T)] = True
    beside = binary_dilation(rest, np.ones((3, 3, 3), dtype=bool))[tuple(figure.indices.T)]
    touching = is_head & beside
    return figure.points_world[touching].mean(axis=0) if touching.any() else None
