"""Replace numbers at their places in a text file, a table or JSON, and leave every other byte as it is."""

import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import accumulate
from typing import Any, TypeAlias

from tracker.formats.text_files import BYTE_ORDER_MARKS

Span: TypeAlias = tuple[int, int]
"""Begin and end of a place in a text."""
CellValues: TypeAlias = Mapping[int, Mapping[int, float]]
"""Numbers of a table by row and column, both from 0; NaN leaves a cell empty."""
_CELL = re.compile(r'((?:"(?:[^"]|"")*"|[^,"])*)(?:,|$)')
_TOKEN = re.compile(r'[ \t\n\r]*("(?:[^"\\]|\\.)*"|[\[\]{}:,]|[^\s"\[\]{}:,]+)', re.DOTALL)
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")

PIXEL_DECIMALS = 3
"""Fewest decimals of pixels that are replaced: a thousandth of one, as COCO is written."""


@dataclass(frozen=True)
class SpanList:
    """A list of JSON."""

    items: list[Any]
    """Its items: a `Span` for a number, a `SpanList`, a dict, or None for text, true, false and null."""
    end: int
    """Place of its closing bracket."""


class TextPatch:
    """A text file that has been read before, some places of which are replaced."""

    def __init__(self, data: bytes) -> None:
        """Decode a file; a mark of the byte order stays a character, bytes of no text become surrogates."""
        self._encoding = next((name for mark, name in BYTE_ORDER_MARKS if data.startswith(mark)), "utf-8")
        self.text = data.decode(self._encoding, "surrogateescape")
        self._new: dict[Span, str] = {}

    def encoded(self) -> bytes:
        """Return the changed file."""
        parts, at = [], 0
        for (start, end), value in sorted(self._new.items()):
            parts += [self.text[at:start], value]
            at = end
        return "".join([*parts, self.text[at:]]).encode(self._encoding, "surrogateescape")

    def old(self, span: Span) -> str:
        """Return the text that was at a place."""
        return self.text[slice(*span)]

    def replace(self, span: Span, value: str) -> None:
        """Replace a place."""
        self._new[span] = value

    def replace_number(self, span: Span, value: float, digits: int) -> None:
        """Replace a number by one with as many decimals, at least `digits`."""
        self.replace(span, number_like(value, self.old(span), digits))

    def append(self, to: SpanList, item: str) -> None:
        """Add an item at the end of a list."""
        before = self._new.get((to.end, to.end), "")
        self.replace((to.end, to.end), before + (", " if before or to.items else "") + item)

    def replace_cells(self, separator: str, n_rows: int, new: CellValues, digits: int) -> None:
        """Replace numbers of a table, each with as many decimals as before; short rows are filled up.

        Args:
            separator: of its columns.
            n_rows: number of its rows, the last lines that are not blank.
            new: the numbers.
            digits: fewest decimals.
        """
        lines = self._lines(n_rows)
        for number, values in new.items():
            start, end = lines[number]
            cells = _cells(self.text[start:end], separator, start)
            usual = next((text for text in map(self.old, reversed(cells)) if "." in text), "")
            for column in values.keys() & {*range(len(cells))}:
                old = self.old(cells[column])
                self.replace(cells[column], number_like(values[column], old if "." in old else usual, digits))
            more = [number_like(values.get(i, float("nan")), usual, digits) for i in range(len(cells), max(values) + 1)]
            if more:
                self.replace((end, end), "".join(separator + text for text in more))

    def replace_words(self, n_rows: int, new: CellValues, digits: int) -> None:
        """Replace numbers that are apart by blanks, as `replace_cells` does; one that is written as before stays."""
        lines = self._lines(n_rows)
        for number, values in new.items():
            words = [match.span() for match in re.compile(r"\S+").finditer(self.text, *lines[number])]
            for column, value in values.items():
                if float(number_like(value, self.old(words[column]), digits)) != float(self.old(words[column])):
                    self.replace_number(words[column], value, digits)

    def _lines(self, n_rows: int) -> list[Span]:
        """Return the last lines that are not blank."""
        return [match.span() for match in re.finditer(r"[^\r\n]+", self.text) if match[0].strip()][-n_rows:]

    def json_spans(self) -> Any:
        """Return the structure of JSON, with a `Span` for each number and a `SpanList` for each list."""
        root: list[Any] = []
        stack: list[tuple[Any, str | None]] = [(root, None)]
        for match in _TOKEN.finditer(self.text, int(self.text.startswith("\ufeff"))):  # after a mark of the byte order
            token, (holder, key) = match[1], stack[-1]
            if token in "]}":
                stack.pop()
                if token == "]":
                    outer, name = stack[-1]
                    _put(outer, name, SpanList(holder, match.start(1)), replace_last=True)
            elif token in "{[":
                inner: Any = {} if token == "{" else []
                _put(holder, key, inner)
                stack.append((inner, None))
            elif token == ",":
                stack[-1] = (holder, None)
            elif token[0] == '"' and isinstance(holder, dict) and key is None:
                stack[-1] = (holder, json.loads(token))
            elif token != ":":
                _put(holder, key, match.span(1) if _NUMBER.fullmatch(token) else None)
        return root[0]


def _put(holder: Any, key: str | None, value: Any, replace_last: bool = False) -> None:
    if isinstance(holder, dict):
        holder[key] = value
    elif replace_last:
        holder[-1] = value
    else:
        holder.append(value)


def _cells(line: str, separator: str, start: int) -> list[Span]:
    """Return the places of the cells of a line that begins at a place."""
    if separator == "," and '"' in line:
        found = [(start + match.start(1), start + match.end(1)) for match in _CELL.finditer(line)]
        return found if line.endswith(",") else found[:-1]
    lengths = [len(cell) for cell in line.split(separator)]
    begins = accumulate((n + len(separator) for n in lengths[:-1]), initial=start)
    return [(begin, begin + n) for begin, n in zip(begins, lengths, strict=True)]


def number_like(value: float, old: str, digits: int) -> str:
    """Return a number with as many decimals as an old one of the same file has, at least `digits`; empty for NaN."""
    decimals = old.strip().partition(".")[2]
    return "" if value != value else f"{value:.{max(len(decimals) if decimals.isdigit() else 0, digits)}f}"
