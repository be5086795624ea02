"""Columns of tables of joints by their meaning, found from the header of each program.

A function takes the rows of the header from the rows of a file, so that the first row of numbers comes next.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import TypeAlias

from tracker.errors import FormatError
from tracker.formats.delimited import Delimited, TableLine
from tracker.formats.number_rows import MAX_NAMES
from tracker.validation import FrameRate, check, quoted

Triple: TypeAlias = tuple[int, int, int]
"""Columns of x, y and z."""
COORDINATE = re.compile(
    r"(?:(?P<name>.+?)[ _.:-])?(?P<axis>[xyz])(?:_coord)?(?:[ _(\[]+(?P<unit>mm|cm|m|in|ft)[)\]]?)?", re.I | re.S
)
_FRAMES = ("frame", "frames", "frame#", "frame_number", "frame_index", "sync_index", "fnum", "index", "")
"""Columns of frames, the surest first: an index without a name is only that of the table."""
_TIME = re.compile(r"(?:frame_)?(?:time|timestamp|seconds|t)s?(?:[ _(\[]+(?P<unit>s|ms|us|ns)(?:econds)?[)\]]?)?")
_SECONDS = ("s", "ms", "us", "ns")
"""Units of time, each a thousandth of the one before."""
_PEOPLE = ("person", "subject", "individual", "person_id", "subject_id", "track_id")
NAMES = ("keypoint", "keypoint_id", "point_id", "bodypart", "marker", "joint", "landmark", "keypoint_name", "name")
_GROUPS = ("trajectory", "model")


@dataclass(frozen=True)
class Columns:
    """Columns of a table."""

    points: Mapping[tuple[str, str], Triple]
    """By person and point; either is empty where a column names it."""
    frame: int | None = None
    """Column of frame numbers; None for rows that are counted from 0."""
    time: int | None = None
    second: float | None = None
    """Seconds per unit of time; None if its name does not tell."""
    unit: str = ""
    """Unit of lengths, a word; empty if the file states none."""
    rate: float | None = None
    """Rows per second; None if the file does not tell."""
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
    where = f"{table.where}, line {line}"
    lower = [cell.lower() for cell in cells]
    matches = [(i, m) for i, cell in enumerate(cells) if (m := COORDINATE.fullmatch(cell))]
    bare = [(i, m) for i, m in matches if m["name"] is None]
    name_at = next((lower.index(name) for name in NAMES if name in lower and bare), None)
    found = [(i, m) for i, m in matches if m["name"] is not None] if name_at is None else bare
    points = _triples([(("", m["name"] or ""), m["axis"].lower(), i, cells[i]) for i, m in found], where)
    units = {(m["unit"] or "").lower() for _, m in found}
    if not points or len(units) != 1:
        raise FormatError(
            f"{where}: expected columns NAME_x, NAME_y, NAME_z of 1 to {MAX_NAMES} points in one unit, found "
            f"{quoted(cells[:4])}; export positions of joints"
        )
    taken = {i for i, _ in found}
    others = {c: i for i, c in reversed([*enumerate(lower)]) if i not in taken}
    time_at, time = next(((i, m) for c, i in others.items() if (m := _TIME.fullmatch(c))), (None, None))
    return Columns(
        points,
        next((others[name] for name in _FRAMES if name in others), None),
        time_at,
        1000.0 ** -_SECONDS.index(time["unit"]) if time and time["unit"] else None,
        units.pop(),
        person=next((others[name] for name in _PEOPLE if name in others), None),
        name=name_at,
        groups=tuple(others[name] for name in _GROUPS if name in others and name_at is not None),
        n_columns=len(cells),
    )


def stacked_columns(table: Delimited) -> Columns:
    """Return the columns of DeepLabCut, below scorer, individuals, bodyparts and coords, and of JARVIS, below names."""
    rows: list[TableLine] = []
    for row in table.filled:
        rows.append(row)
        if {"x", "y", "z"} <= {cell.lower() for cell in row.cells}:
            break
    where = f"{table.where}, line {rows[-1].line if rows else 1}"
    labels = {row.cells[0].lower(): row.cells for row in rows}
    is_labelled = "coords" in labels
    names = labels.get("bodyparts") if is_labelled else rows[0].cells if len(rows) == 2 else None
    if names is None:
        raise FormatError(f"{where}: expected names above x, y and z, found no such header; export it again")
    axes = rows[-1].cells
    points = stacked_points(names, axes, where, labels.get("individuals", ()))
    return Columns(points, 0 if is_labelled else None, n_columns=len(axes))


def motive_columns(table: Delimited) -> Columns:
    """Return the columns of a CSV of OptiTrack Motive: positions of markers and bones.

    Raises:
        FormatError: it has none, as one of rigid bodies alone.
    """
    rows: list[TableLine] = []
    for row in table.filled:
        rows.append(row)
        if row.cells[0].lower() == "frame":
            break
    where = f"{table.where}, line {rows[-1].line if rows else 1}"
    at = next((i for i, row in enumerate(rows) if {"Marker", "Bone", "Rigid Body"} & {*row.cells}), len(rows))
    if len(rows) < at + 3:
        raise FormatError(f"{where}: expected the header of Motive down to a row 'Frame', found none; export it again")
    kinds, names, what, axes = (rows[i].cells for i in (at, at + 1, -2, -1))
    bones = {name for kind, name in zip(kinds, names, strict=False) if kind == "Bone"}
    axes = [
        axis
        if (kind == "Bone" or (kind == "Marker" and name not in bones and "unlabeled" not in name.lower()))
        and quantity == "Position"
        else ""
        for kind, name, quantity, axis in zip(kinds, names, what, axes, strict=False)
    ]
    found = sorted({*kinds} - {"", "Type"})
    if not any(axes):
        raise FormatError(
            f"{table.where}: expected positions of labelled markers or bones, found {', '.join(found)}; export "
            "markers or the bones of a skeleton from Motive"
        )
    head = [cell.lower() for cell in rows[0].cells]
    facts = dict(zip(head[::2], rows[0].cells[1::2], strict=False))
    rate = facts.get("export frame rate") or facts.get("capture frame rate")
    notes = tuple(f"columns of {kind} of Motive are left out" for kind in found if kind not in ("Marker", "Bone"))
    points = stacked_points(names, axes, where)
    unit = facts.get("length units", "")
    return Columns(points, 0, 1, 1.0, unit, _rate(rate), n_columns=len(kinds), notes=notes)


def nexus_columns(table: Delimited) -> Columns:
    """Return the columns of the trajectories in an ASCII file of Vicon Nexus.

    Raises:
        FormatError: it has none, as one of devices or model outputs alone.
    """
    sections = []
    for row in table.rows:
        if (len([c for c in row.cells if c]) == 1 and row.cells[0].isalpha()) or row.cells[:1] == ["Model Outputs"]:
            sections.append(row.cells[0])
        if sections[-1:] == ["Trajectories"]:
            break
    else:
        raise FormatError(
            f"{table.where}: expected the section Trajectories, found {', '.join(sections) or 'none'}; export the "
            "trajectories from Nexus"
        )
    rate, names, axes, units = [*islice(table.filled, 4), *[TableLine(0, [""])] * 4][:4]
    where = f"{table.where}, line {axes.line}"
    found = {unit for axis, unit in zip(axes.cells, units.cells, strict=False) if axis in ("X", "Y", "Z")}
    points = stacked_points(names.cells, axes.cells, where)
    unit = found.pop() if len(found) == 1 else ""
    return Columns(points, 0, None, None, unit, _rate(rate.cells[0]), first=1, ends_blank=True)


def qualisys_columns(table: Delimited) -> Columns:
    """Return the columns of a TSV file of Qualisys Track Manager, in millimetres.

    Raises:
        FormatError: it has no markers, as one of rigid bodies.
    """
    facts: dict[str, list[str]] = {}
    first = None
    for first in table.filled:
        if re.fullmatch(r"[A-Z_]+", first.cells[0]) is None:
            break
        facts.setdefault(first.cells[0], first.cells[1:])
    names = [name for name in facts.get("MARKER_NAMES", ()) if name]
    if not names or first is None:
        raise FormatError(
            f"{table.where}: expected MARKER_NAMES and rows of 3D data, found {', '.join(facts)[:60]}; export the 3D "
            "data of labelled markers from Qualisys Track Manager"
        )
    where = f"{table.where}, line {first.line}"
    is_head = first.cells[0].lower() == "frame"
    start = 2 if is_head or len([c for c in first.cells if c]) >= 3 * len(names) + 2 else 0
    triples = [
        (("", name), axis, start + 3 * i + k, name) for i, name in enumerate(names) for k, axis in enumerate("xyz")
    ]
    points, rate = _triples(triples, where), _rate((facts.get("FREQUENCY") or [""])[0])
    own = (0, 1, 1.0) if start else (None, None, None)
    return Columns(points, *own, "mm", rate, begun=None if is_head else first)


def stacked_points(
    names: Sequence[str], axes: Sequence[str], where: str, people: Sequence[str] = ()
) -> dict[tuple[str, str], Triple]:
    """Return the columns of points whose names stand above x, y, z: above each, or above the first alone."""
    out, name = [], ""
    for i, axis in enumerate(axes):
        name = (names[i] if i < len(names) else "") or name
        if axis.lower() in ("x", "y", "z") and name:
            out.append(((people[i] if i < len(people) else "", name), axis.lower(), i, f"{name} {axis}"))
    if not out:
        raise FormatError(f"{where}: expected names of points above x, y and z, found none; export it again")
    return _triples(out, where)


def _triples(coordinates: Sequence[tuple[tuple[str, str], str, int, str]], where: str) -> dict[tuple[str, str], Triple]:
    """Return the columns of each point, from the point, axis, column and title of each coordinate.

    Raises:
        FormatError: a coordinate is missing or there twice, or there are too many points or none.
    """
    found: dict[tuple[str, str], dict[str, int]] = {}
    for point, axis, column, title in coordinates:
        axes = found.setdefault(point, {})
        if axis in axes:
            raise FormatError(f"{where}: expected each column once, found {quoted(title)} twice; rename one")
        axes[axis] = column
    wrong = next((name for (_, name), axes in found.items() if len(axes) < 3), None)
    if wrong is not None:
        raise FormatError(
            f"{where}: expected x, y and z of each point, found {quoted(wrong)} without all three; add them"
        )
    if len(found) > MAX_NAMES:
        raise FormatError(f"{where}: expected at most {MAX_NAMES} points, found {len(found)}; export fewer")
    return {point: (axes["x"], axes["y"], axes["z"]) for point, axes in found.items()}


def _rate(text: str | None) -> float | None:
    """Return the rate that a header states, 1/s; None if it states none."""
    try:
        return float(check(float(text or ""), FrameRate, "", FormatError))
    except (ValueError, FormatError):
        return None
