"""Points of people that are replaced in a file of key points, and their places among the people of the file."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.geometry.arrays import Array, Mask

PersonChanges: TypeAlias = Sequence[tuple[int, Array]]
"""Number of a person among those of the picture, or -1 for one who was not found, and x, y, confidence of all points,
(n_points, 3); rows of NaN stay, confidence 0 makes a point absent."""
Changes: TypeAlias = Mapping[int, PersonChanges]
"""By row of a table, from 0."""
Places: TypeAlias = Callable[[int, PersonChanges], tuple[Sequence[int], Sequence[int]]]
"""Returns the places of the people of a row, by their numbers, and those that are free for others."""


class PlacedPoint(NamedTuple):
    """A point that is replaced."""

    row: int
    person: int
    """Place of the person in the file."""
    point: int
    xyc: tuple[float, float, float]
    """x, y and confidence; NaN, NaN and 0 for an absent point."""


def placed_points(
    changes: Changes, places: Places, problem: str, numbers: Sequence[int] | None = None
) -> Iterator[PlacedPoint]:
    """Yield the points that are replaced; people who were not found get the first free places.

    Args:
        changes: of the table.
        places: of the people in each row.
        problem: sentence on a row without places for them; it may hold `{}`, the number of the row.
        numbers: of the rows, if the sentence holds them.

    Raises:
        FormatError: no places are left.
    """
    for row, people in changes.items():
        present, free = places(row, people)
        if sum(k < 0 for k, _ in people) > len(free):
            raise FormatError(problem.format(numbers[row] if numbers else row), Remedy("export_other_format"))
        left = iter(free)
        for k, values in people:
            person = present[k] if k >= 0 else next(left)
            for point, (x, y, confidence) in enumerate(values.tolist()):
                if confidence == confidence:
                    xyc = (x, y, confidence) if confidence else (np.nan, np.nan, 0.0)
                    yield PlacedPoint(row, person, point, xyc)


def places_by_presence(is_present: Mask) -> Places:
    """Return the places of people in a file with one for each, (n_rows, n_places), whether or not they are present."""

    def places(row: int, _: PersonChanges) -> tuple[Sequence[int], Sequence[int]]:
        return np.flatnonzero(is_present[row]).tolist(), np.flatnonzero(~is_present[row]).tolist()

    return places
