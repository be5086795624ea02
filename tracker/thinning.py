"""Which points of edges and outlines are matched: few enough to be fast, close enough to lose nothing."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

FloatArray = NDArray[np.float32]

SCENE_SPACING_PX = 4
"""One point is matched in so many pixels of an edge's length, as the model's contours have one piece in as many."""


@njit(nogil=True, cache=True)
def at_intervals(points: FloatArray) -> NDArray[np.int64]:
    """Index of those of linked pixels (N, 2) that are the scene spacing apart along their line, (M,).

    The count runs on from one line to the next, so that many short ones give as many points as one that is as long.
    """
    kept = np.empty(points.shape[0], np.int64)
    n, way = 0, 0.5 * SCENE_SPACING_PX
    for i in range(points.shape[0]):
        if i > 0:
            u, v = abs(points[i, 0] - points[i - 1, 0]), abs(points[i, 1] - points[i - 1, 1])
            way += np.sqrt(2.0) if u == 1.0 and v == 1.0 else 1.0
        if way >= SCENE_SPACING_PX:
            way -= SCENE_SPACING_PX
            kept[n] = i
            n += 1
    return kept[:n].copy()


@njit(nogil=True, cache=True)
def first_in_cells(points: FloatArray, height: int, width: int) -> NDArray[np.int64]:
    """Index of the first of the points (N, 2) in each cell of the scene spacing, (M,), where they are not linked."""
    columns = width // SCENE_SPACING_PX + 1
    taken = np.zeros((height // SCENE_SPACING_PX + 1) * columns, np.bool_)
    first = np.empty(points.shape[0], np.int64)
    n = 0
    for i in range(points.shape[0]):
        cell = (int(points[i, 1]) // SCENE_SPACING_PX) * columns + int(points[i, 0]) // SCENE_SPACING_PX
        if not taken[cell]:
            taken[cell] = True
            first[n] = i
            n += 1
    return first[:n].copy()
