"""Read tables of joints: rows of each frame, or of each point of a frame; people in columns, in rows or alone."""

from array import array
from collections.abc import Mapping
from itertools import chain
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.formats.delimited import Delimited, read_delimited
from tracker.formats.joint_tables.columns import Columns, ColumnsOf
from tracker.formats.number_rows import MAX_NAMES, MAX_TIME, NumberRows, check_size
from tracker.formats.trc import METRES_BY_WORD, MarkerTable, mask_missing
from tracker.geometry.arrays import Array, IntArray
from tracker.text_files import LOST
from tracker.validation import MAX_NUMBER, quoted

Series: TypeAlias = Mapping[tuple[str, str], tuple[IntArray, int]]
"""Rows and number of the coordinates of each point, by person and name."""


class _Rows(NamedTuple):
    """The rows of a table."""

    numbers: NumberRows
    """Frame, perhaps time, and the coordinates of all points."""
    keys: list[tuple[str, ...]]
    """Cells that name person, point and groups; each once."""
    key_of: IntArray
    """Number of the key of each row, (n,)."""


def read_table(columns_of: ColumnsOf, path: Path, unit_m: float | None, rate: float) -> list[MarkerTable]:
    """Read the points of the people of a table.

    Args:
        columns_of: takes the header of the program that wrote it.
        path: the file.
        unit_m: metres per unit, if the file states none.
        rate: rows per second, if the file states none.

    Raises:
        FormatError: the file is malformed, or its unit is unknown.
    """
    table = read_delimited(path)
    columns, where = columns_of(table), table.where
    scale = METRES_BY_WORD.get(columns.unit.lower(), unit_m)
    if scale is None:
        raise FormatError(f"{where}: expected a unit in the names, found none", Remedy("say_unit"))
    rows, rate = _read_rows(table, columns), columns.rate or rate
    limits = {2: MAX_TIME} if columns.time is not None else {}
    is_keyed = columns.person is not None or columns.name is not None
    frames, values = (rows.numbers.numbers if is_keyed else rows.numbers.table)(MAX_NUMBER, limits)
    frames = frames - columns.first
    times = _seconds(values[:, 0], columns, where) if columns.time is not None else None
    if is_keyed and columns.frame is None:
        if times is None:
            raise FormatError(f"{where}: expected a column of frames, such as 'frame', found none; export it with one")
        frames = np.unique(times, return_inverse=True)[1].astype(np.int64)
    points = scale * values[:, len(limits) :].reshape(len(frames), len(columns.points), 3)
    notes = (*columns.notes, *mask_missing(points))
    series = _series(rows, columns, where)
    if any(LOST in text for key in series for text in key):
        raise FormatError(f"{where}: expected UTF-8 text in names, found other bytes; save the file as UTF-8")
    tables = []
    for person in dict.fromkeys(who for who, _ in series):
        own = {name: at for (who, name), at in series.items() if who == person}
        placed = frames, np.arange(len(frames)), points
        if is_keyed or len(own) < len(series):
            placed = _placed(own, frames, points, rows.numbers)
        numbers, first, of_person = placed
        stamps = None if times is None else times[first]
        stamps, found = _timed(numbers, stamps, rate, where)
        tables.append(MarkerTable(tuple(own), numbers, stamps, of_person, columns.rate or found, None, notes, person))
    return tables


def _read_rows(table: Delimited, columns: Columns) -> _Rows:
    named = [i for i in (columns.person, columns.name, *columns.groups) if i is not None]
    chosen = [*([] if columns.time is None else [columns.time]), *chain(*columns.points.values())]
    last = max(*chosen, *named, columns.frame or 0)
    rows = NumberRows(table.where, ",", 1 + len(chosen), n_required=1)
    keys: dict[tuple[str, ...], int] = {}
    key_of, marks, n = array("q"), set[str](), -1
    for line, cells in chain([] if columns.begun is None else [columns.begun], table.rows):
        if not any(cells):
            if columns.ends_blank:
                break
            n += bool(cells)  # a row of separators is a frame without points
            continue
        n += 1
        if columns.n_columns and len(cells) != columns.n_columns:
            raise FormatError(
                f"{table.where}, line {line}: expected {columns.n_columns} columns, found {len(cells)}; export it again"
            )
        cells += [""] * (last + 1 - len(cells))
        key_of.append(keys.setdefault(tuple(cells[i] for i in named), len(keys)))
        numbers = [str(n) if columns.frame is None else cells[columns.frame], *(cells[i] for i in chosen)]
        text = ("," if table.separator == "," else "\t").join(numbers)
        if table.separator != ",":
            marks |= {",", "."} & {*text}
            text = text.replace(",", ".").replace("\t", ",")
        elif text.count(",") >= len(numbers):
            text = ",".join(f'"{c}"' for c in (c.replace('"', "") for c in numbers))
        if len(marks) > 1:
            raise FormatError(
                f"{table.where}, line {line}: expected points or commas in decimal numbers, found both; export it "
                "again with one of them"
            )
        rows.add(text, line)
        if len(keys) > MAX_NAMES:
            raise FormatError(
                f"{table.where}, line {line}: expected at most {MAX_NAMES} points of people, found more; export fewer"
            )
    return _Rows(rows, [*keys], np.frombuffer(key_of, dtype=np.int64))


def _series(rows: _Rows, columns: Columns, where: str) -> Series:
    """Return the rows of each point, by person and name; a name of several groups is named after all but the first.

    Raises:
        FormatError: a point has no name.
    """
    order = np.argsort(rows.key_of, kind="stable")
    ends = np.searchsorted(rows.key_of[order], np.arange(len(rows.keys) + 1))
    found: dict[tuple[str, str], tuple[IntArray, int]] = {}
    for i, key in enumerate(rows.keys):
        cells = iter(key)
        who, point = (next(cells) if column is not None else "" for column in (columns.person, columns.name))
        for number, (own_who, own_point) in enumerate(columns.points):
            person, name = who or own_who, point or own_point
            if (person, name) in found:
                name = ".".join([*cells, name])
            if not name:
                raise FormatError(
                    f"{rows.numbers.place(int(order[ends[i]]))}: expected the name of a point, found none"
                )
            found[person, name] = order[ends[i] : ends[i + 1]], number
    return found


def _placed(
    own: Mapping[str, tuple[IntArray, int]], frames: IntArray, points: Array, numbers: NumberRows
) -> tuple[IntArray, IntArray, Array]:
    """Return the frames of a person, the first row of each, and the points, (n_frames, n_points, 3); NaN where absent.

    Raises:
        FormatError: two rows are of one point and frame, or the person has too many values.
    """
    rows = np.unique(np.concatenate([*{id(at): at for at, _ in own.values()}.values()]))
    found, first = np.unique(frames[rows], return_index=True)
    check_size((len(found), len(own), 3), "the table")
    out = np.full((len(found), len(own), 3), np.nan)
    for i, (name, (at, number)) in enumerate(own.items()):
        order = np.argsort(frames[at], kind="stable")
        twice = np.flatnonzero(np.diff(frames[at][order]) == 0)
        if len(twice):
            row = int(at[order[int(twice[0]) + 1]])
            raise FormatError(
                f"{numbers.place(row)}: expected one row of {quoted(name)} in each frame, found two in frame "
                f"{frames[row]}; tell people apart by a column 'person'"
            )
        out[np.searchsorted(found, frames[at]), i] = points[at, number]
    return found, rows[first], out


def _seconds(times: Array, columns: Columns, where: str) -> Array | None:
    """Return times in seconds; None if there are none. Unix time is known by its size: some 1e9 s.

    Raises:
        FormatError: some rows have a time and some have none.
    """
    if np.isnan(times).all():
        return None
    if np.isnan(times).any():
        raise FormatError(f"{where}: expected a time in each row, found rows without one; leave the column empty")
    largest = float(np.abs(times).max())
    power = next((k for k in (3, 2, 1) if largest > 10.0 ** (8 + 3 * k)), 0)
    return times * (columns.second if columns.second is not None else 10.0 ** (-3 * power))


def _timed(frames: IntArray, times: Array | None, rate: float, where: str) -> tuple[Array, float]:
    """Return times of rows, s, and rows per second; those of `rate` if there are no times.

    Raises:
        FormatError: the times rise by more than a second from frame to frame.
    """
    if times is None:
        return frames / rate, rate
    spans = np.diff(times) / np.diff(frames)
    if not len(spans) or not (spans > 0).all():
        return times, rate
    step = float(np.median(spans))
    if step > 1:
        raise FormatError(
            f"{where}: expected times in seconds, found steps of {step:g} from frame to frame; name their unit, such "
            "as time_ms"
        )
    mean = float(times[-1] - times[0]) / int(frames[-1] - frames[0])  # exact, but of a gap without a number
    return times, 1 / (mean if abs(mean / step - 1) < 0.01 else step)
