"""Key points of people in the pictures of one camera, as a file has them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tracker.formats.number_rows import check_size
from tracker.geometry.arrays import Array, IntArray, Mask


@dataclass(frozen=True, eq=False)
class PictureTable:
    """Key points by picture."""

    names: tuple[str, ...]
    """Names of the points, (n_points,); empty if the file has none."""
    numbers: IntArray
    """Number of each picture in the file, (n,), ascending."""
    points: Array
    """x, y (pixels) and confidence, (n, n_people, n_points, 3); x and y are NaN where absent, confidence is NaN where
    the file has none."""
    size: tuple[int, int] | None = None
    """Width and height of the pictures, px; None if unknown."""
    rate: float | None = None
    """Pictures per second; None if unknown."""
    notes: tuple[str, ...] = ()
    """Sentences on what is odd about the file."""
    tracks: NDArray[np.str_] | None = None
    """Name that the file gives each person, (n, n_people), the same in all its pictures; empty for one without a name.
    None if it names nobody."""

    @property
    def is_found(self) -> Mask:
        """Whether each point has a position, (n, n_people, n_points)."""
        return np.asarray(np.isfinite(self.points[..., :2]).all(axis=-1))

    @property
    def has_confidence(self) -> bool:
        """Whether the file states the confidence of any point that was found; without points it needs none."""
        confidence = self.points[..., 2][self.is_found]
        return not len(confidence) or bool((confidence > 0).any())


def stack_pictures(people: list[list[Array]], n_points: int, where: str) -> Array:
    """Stack the people of pictures, each (n_points, 3), to (n, n_people, n_points, 3); NaN, NaN, 0 where there is none.

    Raises:
        FormatError: the array would be too large; `where` names the file.
    """
    most = max(map(len, people), default=0)
    check_size((len(people), max(most, 1), n_points, 3), where)
    out = np.full((len(people), max(most, 1), n_points, 3), np.nan)
    out[..., 2] = 0.0
    for row, found in zip(out, people, strict=True):
        for k, points in enumerate(found):
            row[k] = points
    return out


def stack_tracks(names: Sequence[Sequence[str]]) -> NDArray[np.str_] | None:
    """Stack the names of the people of pictures, as `stack_pictures` stacks their points; None without any name."""
    most = max([1, *map(len, names)])
    rows = [[*row, *[""] * (most - len(row))] for row in names]
    return np.array(rows, dtype=np.str_) if any(map(any, rows)) else None
