"""Read a text file so that what is not changed is written back byte for byte."""

import codecs
import re
from collections.abc import Mapping
from typing import NamedTuple

_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32-le"),  # begins as UTF-16's
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
_CELL = re.compile(r'((?:"(?:[^"]|"")*"|[^,"])*)(?:,|$)')

PIXEL_DECIMALS = 3
"""Fewest decimals of pixels that are replaced: a thousandth of one, as COCO is written."""


class ExactText(NamedTuple):
    """A text with the encoding of its file; a byte order mark stays a character, other bytes become surrogates."""

    text: str
    encoding: str

    def encoded(self, text: str) -> bytes:
        """Return a changed text in the encoding of the file."""
        return text.encode(self.encoding, "surrogateescape")


def exact_text(data: bytes) -> ExactText:
    """Decode the bytes of a file that has been read before."""
    encoding = next((name for mark, name in _MARKS if data.startswith(mark)), "utf-8")
    return ExactText(data.decode(encoding, "surrogateescape"), encoding)


def replace_cells(text: str, separator: str, n_rows: int, new: Mapping[int, Mapping[int, float]], digits: int) -> str:
    """Return a table with some numbers replaced, each with as many decimals as before; short rows are filled up.

    Args:
        text: of the table.
        separator: of its columns.
        n_rows: number of its rows, the last lines that are not blank.
        new: numbers by row and column, both from 0; NaN leaves a cell empty.
        digits: fewest decimals.
    """
    lines, rows = _table_rows(text, n_rows)
    for number, cells in new.items():
        row = _cells(lines[rows[number]], separator)
        row += [""] * (max(cells) + 1 - len(row))
        usual = next((cell for cell in reversed(row) if "." in cell), "")
        for column, value in cells.items():
            row[column] = number_like(value, row[column] if "." in row[column] else usual, digits)
        lines[rows[number]] = separator.join(row)
    return "".join(lines)


def replace_words(text: str, n_rows: int, new: Mapping[int, Mapping[int, float]], digits: int) -> str:
    """Return a table whose columns are apart by blanks with some numbers replaced, as `replace_cells` does.

    A number that is written as before stays byte for byte.
    """
    lines, rows = _table_rows(text, n_rows)
    for number, cells in new.items():
        parts = re.split(r"(\s+)", lines[rows[number]])
        words = [i for i, part in enumerate(parts) if part and not part.isspace()]
        for column, value in cells.items():
            old = parts[words[column]]
            written = number_like(value, old, digits)
            parts[words[column]] = old if float(written) == float(old) else written
        lines[rows[number]] = "".join(parts)
    return "".join(lines)


def _table_rows(text: str, n_rows: int) -> tuple[list[str], list[int]]:
    """Return the lines of a text with what ends them between, and which are the last ones that are not blank."""
    lines = re.split("(\r\n|\n|\r)", text)
    return lines, [i for i in range(0, len(lines), 2) if lines[i].strip()][-n_rows:]


def _cells(line: str, separator: str) -> list[str]:
    if separator == "," and '"' in line:
        cells = _CELL.findall(line)
        return cells if line.endswith(",") else cells[:-1]
    return line.split(separator)


def number_like(value: float, old: str, digits: int) -> str:
    """Return a number with as many decimals as an old one of the same file has, at least `digits`; empty for NaN."""
    decimals = old.strip().partition(".")[2]
    return "" if value != value else f"{value:.{max(len(decimals) if decimals.isdigit() else 0, digits)}f}"
