"""DeepLabCut's tables of key points, CSV and HDF5, which Lightning Pose writes too: one file for each camera.

The head of a CSV has the rows scorer, individuals (of several animals), bodyparts and coords (x, y, likelihood). The
first column of a row is the number of the picture, or the path of the picture, whose name has its number: such rows are
labels of a person. The Ensemble Kalman Smoother (EKS) adds coords of its own.
"""

import io
import pickle
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path, PurePath
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.errors import FormatError
from tracker.formats.keypoints.picture_names import picture_names
from tracker.formats.keypoints.picture_table import (
    Changes,
    PersonChanges,
    PictureTable,
    placed_points,
    stack_tracks,
    text_of,
)
from tracker.formats.number_rows import MAX_NAMES, NumberRows, TableLine, check_size, read_delimited
from tracker.formats.text_patch import PIXEL_DECIMALS, TextPatch
from tracker.geometry.arrays import Array, IntArray
from tracker.validation import MAX_NUMBER, quoted

_KIND = text_of("DeepLabCut")
_HEAD = ("scorer", "individuals", "bodyparts", "coords")
_COORDINATES = ("x", "y", "likelihood")
_NUMBER = re.compile(r"([0-9]+)(?:\.0*)?")


class _Column(NamedTuple):
    """The head of a column."""

    individual: str
    point: str
    coordinate: str


def is_deeplabcut(head: Sequence[str]) -> bool:
    """Return whether the first lines of a CSV are those of DeepLabCut's key points in pictures."""
    words = [[cell.strip().strip('"').lower() for cell in re.split("[,;]", line)] for line in head]
    return bool(words) and words[0][0] == "scorer" and not any(row[0] == "coords" and "z" in row for row in words)


def read_deeplabcut_csv(path: Path) -> PictureTable:
    """Read a CSV.

    Raises:
        FormatError: the file is missing or malformed; the message has the line.
    """
    where = f"DeepLabCut file {path}"
    lines = _filled(path)
    columns, n_index, row = _read_head(lines, where)
    rows, is_of_names = NumberRows(where, ",", 1 + len(columns), n_required=1), False
    while row is not None:
        line, cells = row
        if len(cells) != n_index + len(columns):
            raise FormatError.mismatch(f"{where}, line {line}", f"{n_index + len(columns)} columns", len(cells))
        number = _picture_number(cells[:n_index], f"{where}, line {line}")
        is_of_names = is_of_names or not _NUMBER.fullmatch(cells[n_index - 1])
        rows.add_cells([str(number), *cells[n_index:]], line)
        row = next(lines, None)
    numbers, values = rows.table(MAX_NUMBER)
    return _table(columns, numbers, values, where, is_of_names)


def is_deeplabcut_hdf5(path: Path) -> bool:
    """Return whether an HDF5 file is a table of pandas. It needs h5py, which raises for a damaged file."""
    import h5py

    with h5py.File(path, "r") as file:
        return any("non_index_axes" in item.attrs for item in file.values())


def read_deeplabcut_hdf5(path: Path) -> PictureTable:
    """Read a table that pandas wrote, in its `table` format. It needs h5py.

    Raises:
        FormatError: the file is of another kind. h5py raises other errors for a damaged file.
    """
    where = f"DeepLabCut file {path}"
    import h5py

    with h5py.File(path, "r") as file:
        _, rows, columns, blocks = _pandas_table(file, where)
    values = np.concatenate(blocks, axis=1).astype(np.float64)
    if values.shape[1] != len(columns):
        raise FormatError(f"{where}: expected {len(columns)} columns, found {values.shape[1]}; export it as CSV")
    names = [_text(i) for i in rows["index"].tolist()]
    numbers = np.array([_picture_number([name], where) for name in names], dtype=np.int64)
    if (np.diff(numbers) <= 0).any() or not (np.abs(values[np.isfinite(values)]) <= MAX_NUMBER).all():
        raise FormatError(f"{where}: expected rows in order and numbers within {MAX_NUMBER:g}; export it again")
    return _table(columns, numbers, values, where, not all(map(_NUMBER.fullmatch, names)))


def _pandas_table(file: Any, where: str) -> tuple[Any, NDArray[np.void], list[_Column], list[NDArray[Any]]]:
    """Return the table of pandas in a file, its rows, the heads of its columns, and views of their blocks."""
    groups = [g for g in file.values() if "table" in g and "non_index_axes" in g.attrs]
    if len(groups) != 1:
        raise FormatError(f"{where}: expected one table of pandas, found {len(groups)}; export it as CSV")
    ((_, heads),) = _Plain(io.BytesIO(bytes(groups[0].attrs["non_index_axes"]))).load()
    columns = [_column(head, where) for head in heads]
    table = groups[0]["table"]
    check_size((len(table), max(len(columns), table.dtype.itemsize // np.dtype(float).itemsize)), where)
    rows = table[:]
    blocks = [name for name in rows.dtype.names if name.startswith("values_block_")]
    return table, rows, columns, [rows[name].reshape(len(rows), -1) for name in blocks]


class _Plain(pickle.Unpickler):
    """Reads lists, tuples, text and numbers, and nothing that could run code."""

    def find_class(self, module: str, name: str) -> Any:
        """Refuse all classes and functions."""
        raise FormatError(f"expected plain names of columns, found {quoted(f'{module}.{name}')}; export it as CSV")


def _text(value: Any) -> str:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _column(head: Any, where: str) -> _Column:
    words = [_text(w) for w in head] if isinstance(head, tuple | list) else []
    if len(words) not in (3, 4):
        raise FormatError(f"{where}: expected scorer, body part and coordinate of a column, found {quoted(head)}")
    return _Column(words[1] if len(words) == 4 else "", words[-2], words[-1])


def _read_head(lines: Iterator[TableLine], where: str) -> tuple[list[_Column], int, TableLine | None]:
    """Return the columns, the number of columns of the index, and the first row of numbers.

    Raises:
        FormatError: the head is incomplete, or names too many points.
    """
    head: dict[str, list[str]] = {}
    row = next(lines, None)
    while row is not None and row.cells[0].lower() in _HEAD:
        head[row.cells[0].lower()] = row.cells
        row = next(lines, None)
    if not {"bodyparts", "coords"} <= head.keys() or len({len(cells) for cells in head.values()}) != 1:
        instead = "semicolons between cells" if row is not None and ";" in row[1][0] else "none"
        expected = "the rows scorer, bodyparts and coords of equal length at its start"
        advice = "export it again, with commas between cells"
        raise FormatError.mismatch(where, expected, ", ".join(head) or instead, advice)
    n_index = 1
    while n_index < len(head["coords"]) and not head["coords"][n_index]:
        n_index += 1  # labels of pictures have folder and file in columns of their own
    individuals = head.get("individuals", [""] * len(head["coords"]))
    columns = [
        _Column(i, p, c)
        for i, p, c in zip(individuals[n_index:], head["bodyparts"][n_index:], head["coords"][n_index:], strict=True)
    ]
    if not 1 <= len(columns) <= 3 * MAX_NAMES:
        raise FormatError(f"{where}: expected 1 to {3 * MAX_NAMES} columns, found {len(columns)}; export it again")
    return columns, n_index, row


def _filled(path: Path) -> Iterator[TableLine]:
    """Return the lines of a CSV that are not blank."""
    return (row for row in read_delimited(path, _KIND, ",").rows if row.cells)


def _picture_number(cells: Sequence[str], where: str) -> int:
    """Return the number of a picture: the only cell, or the number in the name of a file."""
    last = cells[-1]
    whole = _NUMBER.fullmatch(last)
    (found,) = picture_names([whole[1] if whole else PurePath(last.replace("\\", "/")).stem])
    if found is None:
        raise FormatError(f"{where}: expected the number of a picture, or a name with one, found {quoted(last)}")
    return found.number


def _table(columns: Sequence[_Column], numbers: IntArray, values: Array, where: str, is_of_names: bool) -> PictureTable:
    """Sort the columns by person, point and coordinate; other coordinates are left out with a note.

    Args:
        columns: their heads.
        numbers: of the pictures, (n,).
        values: of the columns, (n, n_columns).
        where: names the file.
        is_of_names: whether rows have names of pictures, not their numbers.

    Raises:
        FormatError: a column is there twice, or x or y is missing.
    """
    own = [i for i, c in enumerate(columns) if c.coordinate in _COORDINATES]
    others = list(dict.fromkeys(c.coordinate for c in columns if c.coordinate not in _COORDINATES))
    if "z" in others or not own or len(set(columns)) < len(columns):
        found = "z" if "z" in others else others[0] if others else "a column twice"
        raise FormatError.mismatch(where, "each x, y and likelihood once", quoted(found), "import key points in 2-D")
    individuals, names = ([*dict.fromkeys(words)] for words in list(zip(*columns, strict=True))[:2])
    check_size((len(numbers), len(individuals), len(names), 3), where)
    points = np.full((len(numbers), len(individuals), len(names), 3), np.nan)
    for i in own:
        column = columns[i]
        at = individuals.index(column.individual), names.index(column.point), _COORDINATES.index(column.coordinate)
        points[:, at[0], at[1], at[2]] = values[:, i]
    absent = ~np.isfinite(points[..., :2]).all(axis=-1)
    points[absent] = (np.nan, np.nan, 0.0)
    has_likelihood, notes = any(columns[i].coordinate == "likelihood" for i in own), []
    if not has_likelihood:
        points[~absent, 2] = np.nan
    if others:
        notes.append(f"columns {', '.join(others[:3])}{' and others' if len(others) > 3 else ''} were left out")
        if has_likelihood and not (points[..., 2] > 0).any():
            points[~absent, 2] = 1.0
            notes.append("likelihoods are 0 throughout, which stands for none: the points were taken as certain")
    tracks = stack_tracks([individuals] * len(numbers))
    is_by_hand = is_of_names and not has_likelihood
    return PictureTable(tuple(names), numbers, points, notes=tuple(notes), tracks=tracks, is_by_hand=is_by_hand)


def patch_deeplabcut_csv(path: Path, changes: Mapping[int, Changes]) -> bytes:
    """Return a file, which has been read before, with points of rows of its only camera replaced; other bytes stay."""
    columns, n_index, _ = _read_head(_filled(path), str(path))
    found = _new_cells(columns, changes[0]).items()
    new = {row: {n_index + i: value for i, value in cells.items()} for row, cells in found}
    patch = TextPatch(path.read_bytes())
    patch.replace_cells(",", len(read_deeplabcut_csv(path).numbers), new, PIXEL_DECIMALS)
    return patch.encoded()


def patch_deeplabcut_hdf5(path: Path, changes: Changes) -> None:
    """Replace points of some rows in a table of pandas, which has been read before. It needs h5py."""
    import h5py

    with h5py.File(path, "r+") as file:
        table, rows, columns, values = _pandas_table(file, str(path))
        ends = np.cumsum([v.shape[1] for v in values])
        for row, cells in _new_cells(columns, changes).items():
            for column, value in cells.items():
                block = int(np.searchsorted(ends, column, side="right"))
                values[block][row, column - ends[block]] = value
        table[:] = rows


def _new_cells(columns: Sequence[_Column], changes: Changes) -> dict[int, dict[int, float]]:
    """Return the numbers that change, by row and column; NaN for the position of an absent point."""
    individuals, names = ([*dict.fromkeys(words)] for words in list(zip(*columns, strict=True))[:2])
    at, every = {column: i for i, column in enumerate(columns)}, range(len(individuals))
    problem = f"expected columns for a person who was not found, found those of {len(individuals)} others alone"

    def places(_: int, people: PersonChanges) -> tuple[Sequence[int], Sequence[int]]:
        return every, sorted({*every} - {k for k, _ in people})

    new: dict[int, dict[int, float]] = {}
    for row, person, point, xyc in placed_points(changes, places, problem):
        for coordinate, value in zip(_COORDINATES, xyc, strict=True):
            if (column := at.get(_Column(individuals[person], names[point], coordinate))) is not None:
                new.setdefault(row, {})[column] = value
    return new
