"""Express the points of a file in the axes of a session."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import permutations, product

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array


def remap_axes(table: MarkerTable, axes: str, may_mirror: bool = False) -> MarkerTable:
    """Express a file's points in the session's axes.

    Args:
        table: the points in the file's axes.
        axes: which of the file's axes are the session's x, y and z, e.g. `x,-z,y` for a file whose y points up.
        may_mirror: whether axes that mirror the world are accepted: of a file in left-handed axes, whose points are
            examined afterwards.

    Raises:
        FormatError: not three different axes, or they mirror the world.
    """
    if is_mirrored(axes) and not may_mirror:
        raise FormatError(f"the axes {axes} would mirror the world, left to right", Remedy("turn_axis"))
    return replace(table, points=table.points @ axes_matrix(axes).T)


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


def axis_conventions() -> Iterator[str]:
    """Yield the 48 ways to map axes to axes as words such as `x,-z,y`; half of them mirror."""
    for order, signs in product(permutations("xyz"), product(("", "-"), repeat=3)):
        yield ",".join(f"{sign}{axis}" for sign, axis in zip(signs, order, strict=True))


def is_mirrored(axes: str) -> bool:
    """Return whether axes such as `x,z,y` mirror the world, left to right."""
    return bool(np.linalg.det(axes_matrix(axes)) < 0)
