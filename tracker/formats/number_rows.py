"""Lines of a delimited table as cells, and as rows of numbers: a frame number first, equally many columns in each.

Separator and quotes are found.
"""

import csv
import re
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import NDArray

from tracker.errors import FormatError
from tracker.formats.text_files import TABLE_BYTES, TextKind, read_lines
from tracker.geometry.arrays import Array
from tracker.validation import MAX_FRAMES, quoted

_KIND = TextKind("table", TABLE_BYTES, FormatError, "export it again")
_SEPARATORS = "\t;,"
_SKIPPED = ("#", "sep=")
"""Beginnings of comments, and of Excel's name for the separator."""


class TableLine(NamedTuple):
    """A line of a table."""

    line: int
    """Its number in the file, from 1."""
    cells: list[str]
    """Without spaces around them; none of a blank line."""


class Delimited(NamedTuple):
    """A delimited table."""

    where: str
    """Names the file in messages."""
    separator: str
    rows: Iterator[TableLine]
    """All lines but comments; taken once."""

    @property
    def filled(self) -> Iterator[TableLine]:
        """Rows that are not blank, taken from all."""
        return (row for row in self.rows if any(row.cells))


def read_delimited(path: Path, kind: TextKind = _KIND, separator: str | None = None) -> Delimited:
    """Read the lines of a table one by one; with a given separator, no line is a comment.

    Raises:
        FormatError: the file is missing or no text, or a line is malformed; the message has the line.
    """
    where, skipped = f"{kind.name} {path}", () if separator else _SKIPPED
    separator = separator or _separator(read_lines(path, kind))
    return Delimited(where, separator, _rows(where, separator, read_lines(path, kind), skipped))


def head_cells(lines: Sequence[str]) -> list[list[str]]:
    """Return the cells of the first lines of a file that are not blank; none of another kind of file."""
    try:
        return [line.cells for line in _rows("", _separator(lines), lines) if any(line.cells)]
    except FormatError:
        return []


def _separator(lines: Iterable[str]) -> str:
    """Return the separator of which the first line with any has most."""
    for line in lines:
        most = max(_SEPARATORS, key=line.count)
        if most in line and not line.startswith("#"):
            return most
    return ","


def _rows(where: str, separator: str, lines: Iterable[str], skipped: tuple[str, ...] = _SKIPPED) -> Iterator[TableLine]:
    for number, line in enumerate(lines, 1):
        if line.startswith(skipped):
            continue
        cells = split_cells(line, separator, f"{where}, line {number}")
        yield TableLine(number, [cell.strip() for cell in cells] if line.strip(" \r") else [])


def split_cells(line: str, separator: str, place: str) -> list[str]:
    """Return the cells of a line, without quotes around them; `place` is that of the line in messages.

    Raises:
        FormatError: it is malformed.
    """
    is_plain = '"' not in line and len(line) <= csv.field_size_limit()
    try:
        return line.split(separator) if is_plain else next(csv.reader([line], delimiter=separator))
    except csv.Error as error:
        raise FormatError(f"{place}: {error}; export it again") from error


MAX_VALUES = 40_000_000
"""Largest number of values of a table, 320 MB: an hour of 30 points at 120 Hz."""
MAX_TIME = float(np.iinfo(np.int64).max)
"""Largest time of a file in any unit: Unix time in nanoseconds, which programs hold in 64 bits."""
MAX_NAMES = 2000
"""Largest number of points or columns that the head of a table names: some twenty bodies of 100 values."""
_MISSING = {
    "", "nan", "-nan", "+nan", "n/a", "#n/a", "na", "null", "none", "-", "--", "1.#qnan", "-1.#qnan", "1.#ind",
    "-1.#ind", "1.#snan", "-nan(ind)", "nan(ind)", "nan(snan)",
}  # fmt: skip
"""Words for a missing value, in lower case: of spreadsheets, of Python, R and MATLAB, and of Microsoft's C library."""
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+(e[+-]?\d+)?", re.I)
_NUMBERS = msgspec.json.Decoder(list[float])


def check_size(shape: tuple[int, ...], where: str) -> None:
    """Check that an array is not too large; `where` names the file.

    Raises:
        FormatError: it is.
    """
    if np.prod([float(n) for n in shape]) > MAX_VALUES:
        raise FormatError(f"{where}: expected at most {MAX_VALUES} values, found more; read fewer frames or people")


class NumberRows:
    """Collects the rows of a table; checks each as it comes, so that no small file takes much memory."""

    def __init__(self, where: str, separator: str, n_columns: int, n_required: int) -> None:
        """Begin a table.

        Args:
            where: kind and path of the file, for messages.
            separator: of the columns, a tab or comma.
            n_columns: number of columns.
            n_required: number of columns, from the first, that are not blank in any row. Others may be: NaN.
        """
        self._where, self._separator = where, separator
        self._n_columns, self._n_required = n_columns, n_required
        self._values = array("d")
        self._lines = array("q")

    def add(self, text: str, line: int) -> None:
        """Add a row; `line` is its number in the file, from 1.

        Raises:
            FormatError: the row has another number of columns or is not numbers, or the table is too large.
        """
        row = self._complete_row(text)
        where = f"{self._where}, line {line}"
        self._append(row or self._numbers(split_cells(text, self._separator, where), line), line)

    def add_cells(self, cells: Sequence[str], line: int) -> None:
        """Add a row of cells; see `add`."""
        self._append(self._complete_row(self._separator.join(cells)) or self._numbers(cells, line), line)

    def _append(self, row: list[float], line: int) -> None:
        if not (row[0].is_integer() and abs(row[0]) <= MAX_FRAMES):
            expected = f"a whole frame number of at most {MAX_FRAMES} first"
            raise FormatError.mismatch(f"{self._where}, line {line}", expected, f"{row[0]:g}", "correct it")
        if len(self._values) + self._n_columns > MAX_VALUES:
            expected = f"at most {MAX_VALUES} values"
            raise FormatError.mismatch(f"{self._where}, line {line}", expected, "more", "cut it in pieces")
        self._values.frombytes(np.array(row).tobytes())
        self._lines.append(line)

    def _complete_row(self, text: str) -> list[float] | None:
        """Parse a row without blanks, twice as fast as `_numbers`; None if it needs a closer look."""
        if self._separator != ",":
            if "," in text:
                return None
            text = text.replace(self._separator, ",")
        try:
            row = _NUMBERS.decode(f"[{text}]")
        except msgspec.DecodeError:
            return None
        return row if len(row) == self._n_columns else None

    def _numbers(self, fields: Sequence[str], line: int) -> list[float]:
        where = f"{self._where}, line {line}"
        try:
            row = [np.nan if f.strip().lower() in _MISSING else float(f) for f in fields]
        except ValueError as error:
            wrong = next(f for f in fields if not _is_number(f))
            raise FormatError(f"{where}: {not_a_number(wrong)}") from error
        if not self._n_required <= len(row) <= self._n_columns:
            raise FormatError(f"{where}: expected {self._n_columns} columns, found {len(row)}; export it again")
        return row + [np.nan] * (self._n_columns - len(row))

    def table(self, limit: float, limits: Mapping[int, float] | None = None) -> tuple[NDArray[np.int64], Array]:
        """Return numbers as `numbers` does, of rows whose frames rise.

        Raises:
            FormatError: as `numbers` does, or the frames do not rise.
        """
        frames, values = self.numbers(limit, limits)
        falls = np.flatnonzero(np.diff(frames) <= 0)
        if len(falls):
            row = int(falls[0]) + 1
            advice = "give each person or take a file of its own"
            expected = "frame numbers that rise from row to row"
            raise FormatError.mismatch(self.place(row), expected, f"{frames[row]} after {frames[row - 1]}", advice)
        return frames, values

    def place(self, row: int) -> str:
        """Return the file and line of a row, for messages."""
        return f"{self._where}, line {self._lines[row]}"

    def numbers(self, limit: float, limits: Mapping[int, float] | None = None) -> tuple[NDArray[np.int64], Array]:
        """Return the frame numbers, (n,), and the other columns, (n, n_columns - 1), which the caller may change.

        Args:
            limit: largest absolute value.
            limits: other ones of some columns, by their number from 1.

        Raises:
            FormatError: there is no row, or a value is infinite, beyond its limit, or missing where it is required.
        """
        if not self._lines:
            raise FormatError(f"{self._where} has no rows of numbers; export it again")
        table = np.frombuffer(self._values).reshape(len(self._lines), self._n_columns)
        frames, values = table[:, 0].astype(np.int64), table[:, 1:]
        for i, column in enumerate(values.T, 2):  # by column: a mask of all would take much memory
            most = (limits or {}).get(i, limit)
            wrong = ~(np.abs(column) <= most)
            if i > self._n_required:
                wrong &= ~np.isnan(column)
            if wrong.any():
                row = int(np.argmax(wrong))
                expected = f"a finite number within {most:g}"
                raise FormatError.mismatch(f"{self.place(row)}, column {i}", expected, f"{column[row]:g}", "correct it")
        return frames, values


def not_a_number(field: str) -> str:
    """Return what was expected and found, and what to do, of text that is no number."""
    if _DECIMAL_COMMA.fullmatch(field.strip()):
        return (
            f"expected a point in decimal numbers, found a comma in {quoted(field)}; export it again with the number "
            "format of English"
        )
    return f"expected numbers, found {quoted(field)}; correct it"


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return field.strip().lower() in _MISSING
    return True
