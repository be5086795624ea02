"""Key points of people in the pictures of one camera, as a file has them, and changes of some of them."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tracker.errors import FormatError, Remedy
from tracker.formats.number_rows import check_size
from tracker.formats.text_files import TABLE_BYTES, TextKind
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
    """Width and height of the pictures, px; None if unknown, 1, 1 where x and y are shares of them."""
    notes: tuple[str, ...] = ()
    """Sentences on what is odd about the file."""
    tracks: NDArray[np.str_] | None = None
    """Name that the file gives each person, (n, n_people), the same in all its pictures; empty for one without a name.
    None if it names nobody."""
    is_by_hand: bool = False
    """Whether a person set the points: they are certain, and only some pictures have any."""
    is_of_video: bool = False
    """Whether numbers are those of the frames of a video, from 0, of which those with somebody are listed."""

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
    longest = max((len(name) for row in names for name in row), default=0)
    check_size((len(names), most, longest), "the names of people")
    rows = [[*row, *[""] * (most - len(row))] for row in names]
    return np.array(rows, dtype=np.str_) if any(map(any, rows)) else None


def text_of(program: str) -> TextKind:
    """Return the kind of the text files of a program."""
    return TextKind(f"{program} file", TABLE_BYTES, FormatError, "export it again")


class PicturePerson(NamedTuple):
    """A person in a picture."""

    points: Array
    """x, y (pixels) and confidence, (n_points, 3), as in `PictureTable`; nobody without any."""
    track: str = ""
    """Name that the file gives the person in all its pictures; empty without one."""


def table_of_people(
    people: Mapping[int, Sequence[PicturePerson]], where: str, names: tuple[str, ...] = (), **more: Any
) -> PictureTable:
    """Return a table of the people of each picture, by its number.

    Args:
        people: of each picture.
        where: names the file or folder in messages.
        names: of the points, if the file names them.
        more: further fields of the table.

    Raises:
        FormatError: people have different numbers of points, or the table would be too large.
    """
    kept = {number: [p for p in people[number] if len(p.points)] for number in sorted(people)}
    sizes = {len(p.points): number for number, found in kept.items() for p in found}
    if len(sizes) > 1:
        (n, one), (m, other) = list(sizes.items())[:2]
        seen = f"{n} points in picture {one} and {m} in picture {other}"
        raise FormatError.mismatch(where, "one skeleton", seen, "import them apart")
    n_points = next(iter(sizes), len(names))
    if names and len(names) != n_points:
        raise FormatError(f"{where}: expected {len(names)} points, as many as names, found {n_points}; export it again")
    points = stack_pictures([[p.points for p in found] for found in kept.values()], n_points, where)
    tracks = stack_tracks([[p.track for p in found] for found in kept.values()])
    return PictureTable(names, np.array(list(kept), dtype=np.int64), points, tracks=tracks, **more)


def table_of_files(
    files: Sequence[tuple[Path, int]], people_of: Callable[[Path], Sequence[PicturePerson]], where: str, **more: Any
) -> PictureTable:
    """Return a table of files with the people of one picture each, whose number is given.

    Several files of one picture are of different people. Raises as `people_of` and `table_of_people` do.
    """
    people: dict[int, list[PicturePerson]] = {}
    for path, number in files:
        people.setdefault(number, []).extend(people_of(path))
    notes = ("several files of one picture were taken as several people",) if len(people) < len(files) else ()
    return table_of_people(people, where, notes=notes, **more)


def triples(points: Sequence[Sequence[float]], confidence: Sequence[float] | None = None) -> Array:
    """Return x, y, confidence of points, (n_points, 3), where 0, 0 or a confidence of 0 is an absent point.

    Args:
        points: x and y, and the confidence if it is not given.
        confidence: of each point.
    """
    if not points:
        return np.empty((0, 3))
    values = np.array(points, dtype=np.float64)
    if confidence is not None:
        values = np.column_stack([values[:, :2], confidence])
    values[(values[:, :2] == 0).all(axis=1) | (values[:, 2] == 0)] = (np.nan, np.nan, 0.0)
    return values


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
