"""Polygonise an implicit surface by naive surface nets (S. Gibson 1998, MERL TR-98-16)."""

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import Array, IntArray

_CORNERS = np.array([(i, j, k) for i in (0, 1) for j in (0, 1) for k in (0, 1)])
"""Corners of a cell, in cells."""
_EDGES = [(a, b) for a, b in combinations(range(len(_CORNERS)), 2) if np.abs(_CORNERS[a] - _CORNERS[b]).sum() == 1]
"""Its edges, as pairs of corners."""


def surface_nets(field: NDArray[np.float32], origin: Array, spacing: float) -> tuple[Array, IntArray]:
    """Mesh the zero level of a field sampled on a regular grid.

    Every cell that the surface crosses gets one vertex, at the mean of the crossings of its edges; every crossed
    grid edge gets one quad, split in two, between the four cells around it.

    Args:
        field: (X, Y, Z), negative inside; positive on the grid's border.
        origin: position of `field[0, 0, 0]`, (3,).
        spacing: distance of neighbouring samples.

    Returns:
        Vertices, (N, 3), and triangles that turn counter-clockwise seen from outside, (M, 3).
    """
    inside = field < 0
    shape = np.array(field.shape) - 1
    corners = [tuple(slice(c, c + n) for c, n in zip(corner, shape, strict=True)) for corner in _CORNERS]
    count = np.sum([inside[c] for c in corners], axis=0)
    cells = np.argwhere((count > 0) & (count < 8))
    number = np.full(shape, -1, dtype=np.int64)
    number[tuple(cells.T)] = np.arange(len(cells))
    vertices = origin + spacing * (cells + _mean_crossings(field, cells))
    faces = [_faces_across(inside, number, axis) for axis in range(3)]
    return vertices, np.concatenate(faces)


def _mean_crossings(field: NDArray[np.float32], cells: IntArray) -> Array:
    """Return the mean of the points where the surface crosses the edges of cells, in cell coordinates, (N, 3)."""
    at_corner = np.stack([field[tuple((cells + c).T)] for c in _CORNERS], axis=1).astype(np.float64)  # (N, 8)
    total, n = np.zeros((len(cells), 3)), np.zeros((len(cells), 1))
    for a, b in _EDGES:
        fa, fb = at_corner[:, a], at_corner[:, b]
        crossed = (fa < 0) != (fb < 0)
        t = np.where(crossed, fa / np.where(crossed, fa - fb, 1.0), 0.0)[:, None]
        total += np.where(crossed[:, None], _CORNERS[a] + t * (_CORNERS[b] - _CORNERS[a]), 0.0)
        n += crossed[:, None]
    return total / n


def _faces_across(inside: NDArray[np.bool_], number: IntArray, axis: int) -> IntArray:
    """Return the triangles around the crossed grid edges along one axis."""
    here, there = np.moveaxis(inside, axis, 0)[:-1], np.moveaxis(inside, axis, 0)[1:]
    around = np.moveaxis(number, axis, 0)
    edges = np.argwhere(here != there)
    i, j, k = edges.T
    quads = np.stack([around[i, j - 1, k - 1], around[i, j, k - 1], around[i, j, k], around[i, j - 1, k]], axis=-1)
    # Moving an axis to the front keeps the handedness for x and z, and reverses it for y.
    flip = ~here[i, j, k] ^ (axis == 1)
    quads[flip] = quads[flip][:, ::-1]
    return np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
