"""Columns of tables of joints by their meaning, found from the header of each program.

A function takes the lines of the header from those of the file, so that the first row of numbers comes next.
"""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, zip_longest
from typing import TypeAlias

from tracker.errors import FormatError
from tracker.formats.number_rows import MAX_NAMES, Delimited, TableLine
from tracker.geometry.lengths import METRES_BY_WORD
from tracker.validation import quoted

Triple: TypeAlias = tuple[int, int, int]
"""Columns of x, y and z."""
Points: TypeAlias = Mapping[tuple[str, str], Triple]
"""Columns of points by person and name; either is empty where a column has it."""
COORDINATE = re.compile(
    r"(?:(?:body_)?(?P<name>.+?)[ _.:-])?(?P<axis>[xyz])(?:_coord)?(?:[ _(\[]+(?P<unit>mm|cm|m|in|ft)[)\]]?)?",
    re.I | re.S,
)
_FRAMES = ("frame", "frames", "frame#", "frame_number", "frame_index", "sync_index", "fnum", "index", "")
"""Columns of frames, the surest first: an index without a name is only that of the table."""
_TIME = re.compile(r"(?:frame_)?(?:time|timestamp|seconds|t)s?(?:[ _(\[]+(?P<unit>s|ms|us|ns)(?:econds)?[)\]]?)?")
_SECONDS = ("s", "ms", "us", "ns")
"""Units of time, each a thousandth of the one before."""
_PEOPLE = ("person", "subject", "individual", "person_id", "subject_id", "track_id")
NAMES = ("keypoint", "keypoint_id", "point_id", "bodypart", "marker", "joint", "landmark", "keypoint_name", "name")
_GROUPS = ("trajectory", "model")
_NUMBERED = "its points are numbers; the table of Caliscope whose name ends in _labelled.csv has their names"


@dataclass(frozen=True)
class Columns:
    """Columns of a table."""

    points: Points
    """Of x, y and z."""
    frame: int | None = None
    """Column of frame numbers; None for rows that are counted from 0."""
    time: int | None = None
    """Column of times; None without one."""
    unit: str = ""
    """Unit of lengths, a word; empty if the file states none."""
    rate: str = ""
    """Rows per second, a number; empty if the file does not tell."""
    second: float | None = None
    """Seconds per unit of time; None if it is seconds or Unix time."""
    person: int | None = None
    """Column of people; None if there is none."""
    name: int | None = None
    """Column of names of points, in tables with a row for each point; None for a row for each frame."""
    groups: tuple[int, ...] = ()
    """Columns of groups of points, such as the model of body or hand, in which a name may come again."""
    n_columns: int = 0
    """Number of columns of each row; 0 if rows may be shorter than the header."""
    first: int = 0
    """Number of the first frame of a recording."""
    ends_blank: bool = False
    """Whether a blank line ends the table."""
    begun: TableLine | None = None
    """First row of numbers, if it was taken to find the end of the header."""
    notes: tuple[str, ...] = ()
    """Sentences on columns that are left out."""


ColumnsOf: TypeAlias = Callable[[Delimited], Columns]


def named_columns(table: Delimited) -> Columns:
    """Return the columns of a table of one header row: NAME_x, NAME_y, NAME_z, or x, y, z beside a column of names."""
    line, cells = next(table.filled, TableLine(1, []))
    where, lower = f"{table.where}, line {line}", [cell.lower() for cell in cells]
    matches = [(i, m) for i, cell in enumerate(cells) if (m := COORDINATE.fullmatch(cell))]
    bare = [(i, m) for i, m in matches if m["name"] is None]
    name = next((lower.index(name) for name in NAMES if name in lower and bare), None)
    found = [(i, m) for i, m in matches if m["name"] is not None] if name is None else bare
    points = _triples(((("", m["name"] or ""), m["axis"], i) for i, m in found), cells, where)
    units = {(m["unit"] or "").lower() for _, m in found}
    if not points or len(units) != 1:
        advice = "export positions of joints as one of the tables that docs/log/observations.md lists"
        expected = f"columns NAME_x, NAME_y, NAME_z of 1 to {MAX_NAMES} points in one unit"
        raise FormatError.mismatch(where, expected, quoted(cells[:4]), advice)
    others = {c: i for i, c in reversed([*enumerate(lower)]) if i not in dict(found)}
    time, unit = next(((i, m["unit"]) for c, i in others.items() if (m := _TIME.fullmatch(c))), (None, None))
    frame, person = (next((others[c] for c in names if c in others), None) for names in (_FRAMES, _PEOPLE))
    groups = tuple(others[c] for c in _GROUPS if c in others and name is not None)
    second = 1000 ** -_SECONDS.index(unit) if unit else None
    begun = next(table.rows, None)  # perhaps a row of units
    below = {cell.lower().strip("()[]") for i, cell in enumerate(begun.cells if begun else ()) if i in dict(found)}
    if below < {*METRES_BY_WORD} and len(below) == 1:
        units, begun = below, None
    notes = [_NUMBERED] * (name is not None and {"sync_index", "point_id"} <= {*lower})
    if time is not None and begun is not None and ":" in "".join(begun.cells[time : time + 1]):
        notes.append(f"its column {cells[time]} has clock times, which are left out")
        time = None
    return Columns(
        points, frame, time, units.pop(), "", second, person, name, groups, len(cells), begun=begun, notes=tuple(notes)
    )


def stacked_columns(table: Delimited) -> Columns:
    """Return the columns of DeepLabCut, below scorer, individuals, bodyparts and coords, and of JARVIS, below names."""
    rows, where = _head(table, lambda cells: {"x", "y", "z"} <= {*map(str.lower, cells)})
    labels = {row.cells[0].lower(): row.cells for row in rows}
    is_labelled, axes = "coords" in labels, rows[-1].cells
    names = labels.get("bodyparts", []) if is_labelled else rows[0].cells
    points = _stacked_points(names, axes, where, labels.get("individuals", []))
    return Columns(points, 0 if is_labelled else None, n_columns=len(axes))


def motive_columns(table: Delimited) -> Columns:
    """Return the columns of a CSV of OptiTrack Motive: positions of markers and bones.

    Raises:
        FormatError: it has none, as one of rigid bodies alone.
    """
    rows, where = _head(table, lambda cells: cells[0] == "Frame")
    at = next((i for i, row in enumerate(rows) if {"Marker", "Bone", "Rigid Body"} & {*row.cells}), 0)
    kinds, names, what, axes = (rows[i].cells for i in (at, min(at + 1, len(rows) - 1), max(len(rows) - 2, 0), -1))
    bones = {name for kind, name in zip(kinds, names, strict=False) if kind == "Bone"}
    markers = {name for name in names if name not in bones and not name.lower().startswith("unlabeled")}
    chosen = [
        quantity == "Position" and (kind == "Bone" or (kind == "Marker" and name in markers))
        for kind, name, quantity in zip(kinds, names, what, strict=False)
    ]
    found = [kind for kind in dict.fromkeys(kinds) if kind not in ("", "Type", "Marker", "Bone")]
    if not any(chosen):
        advice = "export markers or the bones of a skeleton from Motive"
        expected = "positions of labelled markers or bones"
        raise FormatError.mismatch(table.where, expected, ", ".join(found)[:60] or "none", advice)
    facts = dict(zip(rows[0].cells[::2], rows[0].cells[1::2], strict=False))
    rate = facts.get("Export Frame Rate") or facts.get("Capture Frame Rate", "")
    points = _stacked_points(names, [a if c else "" for a, c in zip(axes, chosen, strict=False)], where)
    notes = tuple(f"columns of {kind} of Motive are left out" for kind in found)
    return Columns(points, 0, 1, facts.get("Length Units", ""), rate, 1.0, n_columns=len(kinds), notes=notes)


def nexus_columns(table: Delimited) -> Columns:
    """Return the columns of the trajectories in an ASCII file of Vicon Nexus.

    Raises:
        FormatError: it has none, as one of devices or model outputs alone.
    """
    rows, _ = _head(table, lambda cells: cells[0] == "Trajectories")
    if rows[-1].cells[0] != "Trajectories":
        sections = [row.cells[0] for row in rows if row.cells[0][:1].isalpha() and not any(row.cells[1:])]
        advice = "export the trajectories from Nexus"
        raise FormatError.mismatch(table.where, "the section Trajectories", ", ".join(sections)[:60], advice)
    rate, names, axes, units = [*islice(table.filled, 4), *[TableLine(0, [""])] * 4][:4]
    found = {unit for axis, unit in zip(axes.cells, units.cells, strict=False) if axis in ("X", "Y", "Z")}
    points = _stacked_points(names.cells, axes.cells, f"{table.where}, line {axes.line}")
    return Columns(points, 0, None, "".join([*found][:1]), rate.cells[0], first=1, ends_blank=True)


def qualisys_columns(table: Delimited) -> Columns:
    """Return the columns of a TSV file of Qualisys Track Manager, in millimetres.

    Raises:
        FormatError: it has no markers, as one of rigid bodies.
    """
    rows, where = _head(table, lambda cells: re.fullmatch("[A-Z_]+", cells[0]) is None)
    facts = {cells[0]: cells[1:] for _, cells in rows[:-1]}
    names = [name for name in facts.get("MARKER_NAMES", ()) if name]
    if not names:
        advice = "export the 3D data of labelled markers from Qualisys Track Manager"
        raise FormatError.mismatch(table.where, "MARKER_NAMES and rows of 3D data", ", ".join(facts)[:60], advice)
    is_head = rows[-1].cells[0] == "Frame"
    start = 2 if is_head or len(rows[-1].cells) >= 3 * len(names) + 2 else 0
    axes = ["", ""][:start] + ["x", "y", "z"] * len(names)
    points = _stacked_points(["", ""][:start] + [name for name in names for _ in "xyz"], axes, where)
    frame, time = (0, 1) if start else (None, None)
    rate = "".join(facts.get("FREQUENCY", ())[:1])
    return Columns(points, frame, time, "mm", rate, 1.0, begun=None if is_head else rows[-1])


def _head(table: Delimited, is_last: Callable[[list[str]], bool]) -> tuple[list[TableLine], str]:
    """Take the lines of a header up to its last; return those that are not blank, and the place of the last."""
    rows = []
    for row in table.filled:
        rows.append(row)
        if is_last(row.cells):
            break
    rows = rows or [TableLine(1, [""])]
    return rows, f"{table.where}, line {rows[-1].line}"


def _stacked_points(names: Sequence[str], axes: Sequence[str], where: str, people: Sequence[str] = ()) -> Points:
    """Return the columns of points whose names stand above x, y, z: above each, or above the first alone."""
    out, name = [], ""
    for i, axis in enumerate(axes):
        name = (names[i] if i < len(names) else "") or name
        if axis.lower() in ("x", "y", "z") and name:
            out.append(((people[i] if i < len(people) else "", name), axis, i))
    if not out:
        raise FormatError(f"{where}: expected names of points above x, y and z, found none; export it again")
    return _triples(out, [f"{name} {axis}" for name, axis in zip_longest(names, axes)], where)


def _triples(coordinates: Iterable[tuple[tuple[str, str], str, int]], titles: Sequence[str], where: str) -> Points:
    """Return the columns of each point, from the point, axis and column of each coordinate, and the titles of columns.

    Raises:
        FormatError: a coordinate is missing or there twice, or there are too many points.
    """
    found: dict[tuple[str, str], dict[str, int]] = {}
    for point, axis, column in coordinates:
        if found.setdefault(point, {}).setdefault(axis.lower(), column) != column:
            raise FormatError(f"{where}: expected each column once, found {quoted(titles[column])} twice; rename one")
    for (_, name), axes in found.items():
        if len(axes) < 3:
            raise FormatError(f"{where}: expected x, y and z of each point, found {quoted(name)} without all three")
    if len(found) > MAX_NAMES:
        raise FormatError(f"{where}: expected at most {MAX_NAMES} points, found {len(found)}; export fewer")
    return {point: (axes["x"], axes["y"], axes["z"]) for point, axes in found.items()}
