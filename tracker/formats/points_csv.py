"""CSV tables of points in space: a column of frames, perhaps one of times, and x, y, z of each point.

Coordinates are columns NAME_x, NAME_y, NAME_z, or NAME.x, NAME X and so on, in any case; a unit may follow, as in
NAME.x_mm. Other columns, such as errors, are left out. A file without a unit needs one to be said.
"""

import csv
import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.formats.exact_text import exact_text, replace_cells
from tracker.formats.number_rows import MAX_NAMES, NumberRows
from tracker.formats.trc import METRES_BY_WORD, MarkerTable
from tracker.geometry.arrays import Array
from tracker.text_files import TABLE_BYTES, TextKind, read_lines
from tracker.validation import MAX_NUMBER, quoted

_KIND = TextKind("CSV file", TABLE_BYTES, FormatError, "export it again")
_COORDINATE = re.compile(r"(?P<name>.+?)[ _.:-](?P<axis>[xyz])(?:[ _(\[]+(?P<unit>mm|cm|m|in|ft)[)\]]?)?", re.I | re.S)
_FRAMES = ("frame", "frames", "frame#", "frame_number", "sync_index", "fnum", "index", "")
"""Columns of frames, the surest first: an index without a name is only that of the table."""
_TIMES = {"time", "time_s", "time (s)", "timestamp", "seconds", "t"}


def read_points_csv(path: Path, unit_m: float | None, rate: float) -> MarkerTable:
    """Read the points of one person.

    Args:
        path: the file.
        unit_m: metres per unit, if the names of the columns state none.
        rate: rows per second, if there is no column of times.

    Raises:
        FormatError: the file is malformed, or its unit is unknown.
    """
    where = f"CSV file {path}"
    lines = ((n, line) for n, line in enumerate(read_lines(path, _KIND), 1) if line.strip() and line[0] != "#")
    number, head = next(lines, (1, ""))
    try:
        columns = [cell.strip() for cell in next(csv.reader([head]), [])]
    except csv.Error as error:
        raise FormatError(f"{where}, line {number}: {error}; export it again") from error
    names, at, unit = _points_of(columns, f"{where}, line {number}")
    scale = METRES_BY_WORD[unit] if unit else unit_m
    if scale is None:
        raise FormatError(f"{where}, line {number}: expected a unit in the names, found none", Remedy("say_unit"))
    others = {c.lower(): i for i, c in reversed([*enumerate(columns)]) if i not in at}
    frame_at = next((others[name] for name in _FRAMES if name in others), None)
    time_at = next((i for i, c in enumerate(columns) if c.lower() in _TIMES), None)
    chosen = [*([] if time_at is None else [time_at]), *at]
    rows = NumberRows(where, ",", 1 + len(chosen), n_required=1 + (time_at is not None))
    for k, (line, text) in enumerate(lines):
        try:
            cells = next(csv.reader([text]))
        except csv.Error as error:
            raise FormatError(f"{where}, line {line}: {error}; export it again") from error
        if len(cells) != len(columns):
            raise FormatError(
                f"{where}, line {line}: expected {len(columns)} columns, found {len(cells)}; export it again"
            )
        numbers = [str(k) if frame_at is None else cells[frame_at], *(cells[i] for i in chosen)]
        rows.add(",".join(f'"{c}"' if "," in c else c.replace('"', "") for c in numbers), line)
    frames, values = rows.table(MAX_NUMBER)
    times = values[:, 0] if time_at is not None else frames / rate
    points = scale * values[:, int(time_at is not None) :].reshape(len(frames), len(names), 3)
    points[np.isnan(points).any(axis=-1)] = np.nan
    spans = np.diff(times) / np.diff(frames)
    found_rate = float(1 / np.median(spans)) if len(spans) and (spans > 0).all() else rate
    return MarkerTable(names, frames, times, points, found_rate)


def _points_of(columns: list[str], where: str) -> tuple[tuple[str, ...], list[int], str]:
    """Return the names of the points, the columns of their x, y, z, and their unit; empty if they state none.

    Raises:
        FormatError: a coordinate is missing or there twice, units differ, or there is no point.
    """
    found: dict[str, dict[str, int]] = {}
    units = set()
    for i, column in enumerate(columns):
        match = _COORDINATE.fullmatch(column)
        if match is None:
            continue
        axes = found.setdefault(match["name"], {})
        if match["axis"].lower() in axes:
            raise FormatError(f"{where}: expected each column once, found {quoted(column)} twice; rename one")
        axes[match["axis"].lower()] = i
        units.add((match["unit"] or "").lower())
    whole = {name: axes for name, axes in found.items() if len(axes) == 3}
    if not 1 <= len(whole) <= MAX_NAMES or len(whole) < len(found) or len(units) != 1:
        wrong = next((name for name in found if name not in whole), "")
        raise FormatError(
            f"{where}: expected columns NAME_x, NAME_y, NAME_z of 1 to {MAX_NAMES} points in one unit, found "
            f"{f'{quoted(wrong)} without all three' if wrong else quoted(columns[:4])}; rename them"
        )
    return tuple(whole), [axes[a] for axes in whole.values() for a in "xyz"], units.pop()


def patch_points_csv(path: Path, unit_m: float | None, changes: Mapping[int, Array]) -> bytes:
    """Return a file with some points replaced, in its unit; all other bytes stay.

    Args:
        path: the file, which has been read before.
        unit_m: metres per unit, if the file states none.
        changes: positions, (n_points, 3), metres, by row, from 0; points of NaN stay.
    """
    table = read_points_csv(path, unit_m, 1.0)
    exact = exact_text(path.read_bytes())
    head = next(line for line in exact.text.splitlines() if line.strip() and line[0] != "#")
    columns = [cell.strip().lstrip("\ufeff") for cell in next(csv.reader([head]))]
    _, at, unit = _points_of(columns, str(path))
    scale = METRES_BY_WORD[unit] if unit else unit_m
    assert scale is not None
    new = {
        row: {at[i]: float(x / scale) for i, x in enumerate(points.ravel()) if not np.isnan(x)}
        for row, points in changes.items()
    }
    return exact.encoded(replace_cells(exact.text, ",", len(table.frames), new, 7 if scale > 0.1 else 4))
