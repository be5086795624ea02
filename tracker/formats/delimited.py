"""Lines of a delimited table as cells: separator and quotes are found."""

import csv
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from tracker.errors import FormatError
from tracker.formats.text_files import TABLE_BYTES, TextKind, read_lines

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
