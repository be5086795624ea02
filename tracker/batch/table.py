"""The table of recordings without sessions: a CSV file, also as spreadsheet programs write it."""

import csv
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from fnmatch import fnmatch
from functools import partial
from io import StringIO
from pathlib import Path
from typing import NamedTuple

from tracker.errors import TrackerError
from tracker.files import entries_below, paths_in
from tracker.formats.text_files import DOCUMENT_BYTES, LOST, TextKind, read_text
from tracker.session.assemble import NewSession
from tracker.validation import FilePath, FileStem, check

_KIND = TextKind("table", DOCUMENT_BYTES, TrackerError)
_COLUMNS = ("name", "calibration", "videos", "background", "people", "height", "fps")
_REQUIRED = ("name", "calibration", "videos")
_SEPARATORS = ",;\t"
"""Between cells; a spreadsheet program writes that of its language."""
_MANY = ";"
"""Separates several values in a cell."""


@dataclass(frozen=True)
class Footage:
    """A recording that has no session yet: a row of the table."""

    calibration: str
    videos: tuple[str, ...]
    background: str | None = None
    people: tuple[str, ...] = ("person",)
    height_m: float | None = None
    fps: float | None = None

    def request(self, session: str) -> NewSession:
        """Return the request for its session, by the path of that folder."""
        return NewSession(
            Path(session),
            Path(self.calibration),
            [Path(video) for video in self.videos],
            background=None if self.background is None else Path(self.background),
            people=self.people,
            heights=self.height_m,
            fps=self.fps,
        )


class Problem(NamedTuple):
    """The reason why a recording cannot be tracked."""

    name: str
    """Of the recording, or its place in the table."""
    error: TrackerError


@dataclass(frozen=True)
class Table:
    """The recordings of a table."""

    footage: Mapping[str, Footage]
    """By name."""
    problems: tuple[Problem, ...]
    """Of the rows that cannot be used."""
    unread: tuple[str, ...]
    """Names of the columns that mean nothing to this program, such as remarks."""


def read_table(path: Path) -> Table:
    """Read a table. Rows that cannot be used are problems of the result.

    Raises:
        TrackerError: it is not a table, or its columns are wrong.
    """
    header, lines = _cells(path)
    columns = _columns(path, header)
    footage, problems = dict[str, Footage](), list[Problem]()
    for number, line in lines:
        try:
            name, found = _row(header, [cell.strip() for cell in line], path.parent)
            if name in footage:
                raise TrackerError(f"expected a name of its own, found '{name}' a second time; give it another name")
            footage[name] = found
        except TrackerError as error:
            problems.append(Problem(f"table {path}, line {number}", error))
    return Table(footage, tuple(problems), tuple(columns))


def matches(base: Path, pattern: str) -> list[Path]:
    """Return the files and folders that a pattern such as `foot/*.avi` names, in order; `**` is any folder below.

    Raises:
        TrackerError: a folder cannot be read, or has too much in it.
    """
    paths = {base}
    for part in Path(pattern).parts:
        folders = [path for path in paths if os.path.isdir(path)]
        if part == "**":
            below = (e for f in folders for e in entries_below(f, TrackerError, passes_unreadable=True))
            paths = {*folders, *(Path(e.path) for e in below if e.is_dir(follow_symlinks=False))}
        elif set("*?[") & {*part}:
            accepts = partial(fnmatch, pat=part)
            paths = {path for folder in folders for path in paths_in(folder, TrackerError, accepts)}
        else:
            paths = {path for folder in folders if os.path.exists(path := folder / part)}
    return sorted(paths)


def _cells(path: Path) -> tuple[list[str], Iterator[tuple[int, list[str]]]]:
    """Return the names of the columns, in small letters, and the rows that have a value, with their line numbers."""
    text = read_text(path, _KIND)
    if re.match("sep=.\r?\n", text, re.IGNORECASE):  # for spreadsheet programs
        text = text[text.index("\n") :]

    def read(separator: str) -> Iterator[tuple[int, list[str]]]:
        rows = csv.reader(StringIO(text, newline=""), delimiter=separator)
        try:
            yield from ((rows.line_num, row) for row in rows if any(cell.strip() for cell in row))
        except csv.Error as error:
            raise TrackerError(f"table {path}, line {rows.line_num}: {error}; save it as CSV again") from error

    def header(separator: str) -> list[str]:
        return [cell.strip().casefold() for cell in next(read(separator), (0, list[str]()))[1]]

    separator = max(_SEPARATORS, key=lambda s: len({*header(s)} & {*_COLUMNS}))
    rows = read(separator)
    next(rows, None)  # the header
    return header(separator), rows


def _columns(path: Path, header: Sequence[str]) -> list[str]:
    """Return the columns that are not read.

    Raises:
        TrackerError: one is missing, there are two of a name, or one seems misspelt.
    """
    wrong = [c for c in _COLUMNS if header.count(c) > 1] or [c for c in _REQUIRED if c not in header]
    unread = [c for c in header if c and c not in _COLUMNS]
    absent = [c for c in _COLUMNS if c not in header]
    wrong = wrong or [c for c in unread if get_close_matches(c, absent, 1, 0.7)]
    if wrong:
        raise TrackerError(
            f"table {path}: expected columns {', '.join(_COLUMNS)}, of which {', '.join(_REQUIRED)} are needed; found "
            f"{', '.join(header)[:200] or 'none'}; correct '{wrong[0]}'"
        )
    return unread


def _row(header: Sequence[str], line: Sequence[str], base: Path) -> tuple[str, Footage]:
    """Return the name and the footage of a recording; paths begin at a folder.

    Raises:
        TrackerError: a cell is wrong.
    """
    if lost := [c for k, c in enumerate(line) if c and (k >= len(header) or not header[k])]:
        raise TrackerError(
            f"expected a cell for each of {len(header)} columns, found '{lost[0][:100]}' after them; put several "
            'videos into quotes, as "a.avi;b.avi"'
        )
    cells = {k: v for k, v in zip(header, line, strict=False) if v and k in _COLUMNS}
    if missing := [c for c in _REQUIRED if c not in cells]:
        raise TrackerError(f"expected a value as '{missing[0]}', found none; fill it in")
    if odd := [c for c in cells.values() if LOST in c]:
        raise TrackerError(f"expected UTF-8 text, found '{odd[0][:100]}'; save the table as CSV UTF-8")
    name = cells["name"]
    check(name, FileStem, "the name of a folder", TrackerError)
    if name.startswith("."):
        raise TrackerError(f"expected a name that can be a folder's, found '{name}'; give it another name")

    def several(key: str) -> list[str]:
        return [part.strip() for part in cells.get(key, "").split(_MANY) if part.strip()]

    videos = [str(video) for text in several("videos") for video in _videos(base, text)]
    background = str(_place(base, cells["background"])) if "background" in cells else None
    footage = Footage(
        str(_place(base, cells["calibration"])), tuple(videos), background, tuple(several("people")) or ("person",),
        _number(cells, "height"), _number(cells, "fps"),
    )  # fmt: skip
    for path in (footage.calibration, *footage.videos, *([background] if background else [])):
        check(path, FilePath, "a path", TrackerError)
    return name, footage


def _place(base: Path, text: str) -> Path:
    """Return the path that a cell names, also where another system wrote it with backslashes."""
    return base / text if (base / text).exists() else base / _with_slashes(text)


def _with_slashes(text: str) -> str:
    return text.replace("\\", "/") if os.sep == "/" else text


def _videos(base: Path, text: str) -> list[Path]:
    """Return the files that a path or a pattern names.

    Raises:
        TrackerError: a pattern names none.
    """
    place = _place(base, text)
    if not set("*?[") & {*text} or place.exists():
        return [place]
    if not (found := matches(base, _with_slashes(text))):
        raise TrackerError(f"expected videos at '{text}', found none; correct the path")
    return found


def _number(cells: Mapping[str, str], key: str) -> float | None:
    text = cells.get(key)
    try:
        return None if text is None else float(text.replace(",", ".") if "." not in text else text)
    except ValueError:
        raise TrackerError(f"expected a number as '{key}', found '{text}'; correct it") from None
