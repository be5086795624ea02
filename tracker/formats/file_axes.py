"""Express the points of a file in the axes of a session."""

from dataclasses import replace

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array


def remap_axes(table: MarkerTable, axes: str) -> MarkerTable:
    """Express a file's points in the session's axes.

    Args:
        table: the points in the file's axes.
        axes: which of the file's axes are the session's x, y and z, e.g. `x,-z,y` for a file whose y points up.

    Raises:
        FormatError: not three different axes, or they mirror the world.
    """
    matrix = axes_matrix(axes)
    if np.linalg.det(matrix) < 0:
        raise FormatError(f"the axes {axes} would mirror the world, left to right", Remedy("turn_axis"))
    return replace(table, points=table.points @ matrix.T)


def axes_matrix(axes: str) -> Array:
    """Return the matrix, (3, 3), that maps a file's coordinates to axes such as `x,-z,y`; it may mirror.

    Raises:
        FormatError: not three different axes.
    """
    matrix = np.zeros((3, 3))
    words = [w.strip() for w in axes.split(",")]
    for row, word in enumerate(words[:3]):
        if word.lstrip("+-") in ("x", "y", "z"):
            matrix[row, "xyz".index(word[-1])] = -1.0 if word.startswith("-") else 1.0
    if len(words) != 3 or abs(np.linalg.det(matrix)) != 1:
        raise FormatError(f"expected three different axes such as x,-z,y, found '{axes}'", Remedy("name_axes"))
    return matrix
