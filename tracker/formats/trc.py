"""TRC files (OpenSim, Pose2Sim, Cortex): the tracks of named points in 3-D, and the axes of such a file.

Tab-separated: three lines of header, one of point names (each above its X, Y, Z), one of X1 Y1 Z1 ..., and rows of
Frame#, Time and coordinates. Lengths are in the header's Units. Blank coordinates are missing points, written as empty
fields, spaces or a word such as NaN. Some writers leave blank lines in or below the header; some drop the tabs at the
end of a row.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, permutations, product
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from tracker.errors import FormatError, Remedy
from tracker.files import write_text_atomic
from tracker.formats.number_rows import MAX_NAMES, MAX_TIME, NumberRows, not_a_number
from tracker.formats.text_files import LOST, TABLE_BYTES, TextKind, read_lines, refuse_lost
from tracker.formats.text_patch import TextPatch
from tracker.geometry.arrays import Array
from tracker.geometry.lengths import METRES_BY_WORD
from tracker.validation import MAX_FRAMES, MAX_NUMBER, FrameRate, check, quoted

_KIND = TextKind("TRC file", TABLE_BYTES, FormatError, "export it again")
_Line: TypeAlias = tuple[int, str]
"""Number of a line in its file, from 1, and its text with its end."""


@dataclass(frozen=True, eq=False)
class MarkerTable:
    """Positions of named points over time."""

    names: tuple[str, ...]
    """Names of the points, (m,)."""
    frames: NDArray[np.int64]
    """Frame of each row, (n,): Frame# as `read_trc` finds it, frames of a session once the rows are placed."""
    times: Array
    """Time of each row, s, (n,)."""
    points: Array
    """Positions, (n, m, 3), metres; NaN where missing."""
    rate: float
    """Rows per second according to the header."""
    origin: int | None = None
    """OrigDataStartFrame of a file; None if it has none."""
    notes: tuple[str, ...] = ()
    """Sentences on what is odd about a file, and on how its rows were placed at frames of a session."""
    person: str = ""
    """Name of the person in the file; empty if it has none."""

    def __post_init__(self) -> None:
        n, m = len(self.frames), len(self.names)
        assert self.frames.shape == self.times.shape == (n,)
        assert self.points.shape == (n, m, 3), (self.points.shape, n, m)


def read_trc(path: str | Path) -> MarkerTable:
    """Read a TRC file.

    Raises:
        FormatError: the file is missing or malformed; the message has the line.
    """
    where = f"TRC file {path}"
    head, lines = _read_head(enumerate(read_lines(Path(path), _KIND, keep_ends=True), 1))
    if len(head) < 5 or not head[0][1].startswith("PathFileType"):
        raise FormatError(f"{path} is not a TRC file: expected 'PathFileType' at its start; export it as TRC")
    (_, (_, keys), (n_values, cells), (n_names, points_line), (n_axes, axes)) = head
    header = {k.strip().lower(): v.strip() for k, v in zip(keys.split("\t"), cells.split("\t"), strict=False)}
    if _is_row(axes):
        raise FormatError(f"{where}, line {n_axes}: expected X1, Y1, Z1, ..., found a row of numbers; export it again")
    scale = _scale(header, f"{where}, line {n_values}")
    rate = _rate(header.get("datarate"), f"{where}, line {n_values}, DataRate")
    promised = _whole(header.get("numframes"))
    names = _names(points_line, f"{where}, line {n_names}")
    frames, values = _read_rows(lines, where, 2 + 3 * len(names), promised)
    values[:, 1:] *= scale  # the three-dimensional view would be scaled in a copy
    points = values[:, 1:].reshape(len(frames), len(names), 3)
    notes = list[str]()
    if promised is not None and len(frames) < promised:
        notes.append(f"its header promises {promised} rows, and it has {len(frames)}: check that it is complete")
    notes += mask_missing(points)
    origin = _whole(header.get("origdatastartframe"))
    return MarkerTable(names, frames, values[:, 0], points, rate, origin, tuple(notes))


def mask_missing(points: Array) -> list[str]:
    """Make points, (n, m, 3), NaN that miss a coordinate or lie at 0, 0, 0; return the note on the latter."""
    points[np.isnan(points).any(axis=-1)] = np.nan
    is_zero = (points == 0).all(axis=-1)
    if not is_zero.any() or is_zero.all():
        return []
    points[is_zero] = np.nan
    return [f"{is_zero.sum()} of its points lie at 0, 0, 0 exactly, as missing ones: they are left out"]


def write_trc(
    path: str | Path,
    names: Sequence[str],
    points: Array,
    rate: float,
    *,
    frames: Sequence[int] | NDArray[np.int64] | None = None,
    units: Literal["m", "mm"] = "m",
) -> None:
    """Write a TRC file, exact to a tenth of a micrometre; `read_trc` reads it back.

    Frame# counts from 1 as in OpenSim, Time from 0, so that both together tell the frame.

    Args:
        path: the file.
        names: names of the points, (m,).
        points: positions, (n, m, 3), metres; NaN where missing.
        rate: frames per second.
        frames: frame of each row, from 0, ascending; by default every frame from 0. Frame# is one more.
        units: of the lengths in the file.
    """
    path = Path(path)
    frames = np.arange(len(points)) if frames is None else np.asarray(frames)
    assert points.shape == (len(frames), len(names), 3)
    first = int(frames[0]) + 1 if len(frames) else 1
    scale, digits = 1 / METRES_BY_WORD[units], 7 if units == "m" else 4
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate:.10g}\t{rate:.10g}\t{len(frames)}\t{len(names)}\t{units}\t{rate:.10g}\t{first}\t{len(frames)}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, len(names) + 1) for axis in "XYZ"),
        "",
    ]
    for frame, row in zip(frames.tolist(), points, strict=True):
        cells = ["" if np.isnan(x) else f"{x * scale:.{digits}f}" for x in row.ravel()]
        # OpenSim counts no empty cell at the end of a row unless a tab follows it.
        end = "" if cells and cells[-1] else "\t"
        lines.append("\t".join([str(frame + 1), f"{frame / rate:.6f}", *cells]) + end)
    write_text_atomic(path, "\n".join(lines) + "\n")


def _read_head(lines: Iterator[_Line]) -> tuple[list[_Line], Iterator[_Line]]:
    """Return the first five lines that are not blank, and the others; a blank line may stand for the names of axes."""
    head: list[_Line] = []
    is_after_blank = False
    for number, line in lines:
        if len(head) == 4 and is_after_blank and _is_row(line):
            return [*head, (number - 1, "")], chain([(number, line)], lines)
        is_after_blank = not line.strip()
        if not is_after_blank:
            head.append((number, line.rstrip("\r\n")))
        if len(head) == 5:
            break
    return head, lines


def _names(line: str, where: str) -> tuple[str, ...]:
    """Return the names of the points.

    Raises:
        FormatError: there is none, there are too many, or two are equal.
    """
    if "\t" not in line:
        raise FormatError(f"{where}: expected columns separated by tabs, found {quoted(line)}; export it again as TRC")
    names = tuple(n.strip() for n in line.split("\t")[2:] if n.strip())
    if LOST in line:  # in the first line there is a path, which nobody needs
        refuse_lost(list(names), where, _KIND)
    if not 1 <= len(names) <= MAX_NAMES or len(set(names)) != len(names):
        expected = f"1 to {MAX_NAMES} point names, each once"
        raise FormatError.mismatch(where, expected, quoted(list(names)), "rename them")
    return names


def _read_rows(
    lines: Iterator[_Line], where: str, n_columns: int, n_promised: int | None
) -> tuple[NDArray[np.int64], Array]:
    """Return the frame numbers, (n,), and the other columns, (n, n_columns - 1).

    Args:
        lines: below the header.
        where: names the file in messages.
        n_columns: number of columns.
        n_promised: NumFrames of the header; None if it has none.

    Raises:
        FormatError: a row is malformed, or the file ends within one.
    """
    rows = NumberRows(where, "\t", n_columns, n_required=2)
    n_rows = 0
    for number, line in lines:
        if not (text := line.rstrip()):
            continue
        n_rows += 1
        n_found = line.count("\t") + 1
        if not line.endswith("\n") and (n_found < n_columns or n_rows < (n_promised or 0)):
            of_rows = f" of {n_promised}" if n_promised else ""
            cut = f"after {n_found} of {n_columns} columns in row {n_rows}{of_rows}, so that it may be cut off"
            advice = "copy or export it again, or end the line if it is complete"
            place = f"{where}, line {number}"
            raise FormatError.mismatch(place, "the end of a line", f"that of the file, {cut}", advice)
        rows.add(text, number)  # some writers end rows with tabs, some drop them
    return rows.table(MAX_NUMBER, {2: MAX_TIME})


def _rate(text: str | None, where: str) -> float:
    """Return a header's frame rate.

    Raises:
        FormatError: it is none, or has a decimal comma.
    """
    number = _number(text)
    if isinstance(number, str) and "," in number:
        raise FormatError(f"{where}: {not_a_number(number)}")
    return float(check(number, FrameRate, where, FormatError))


def _is_row(line: str) -> bool:
    """Return whether a line begins with a number, as rows do and headers do not."""
    return isinstance(_number(line.partition("\t")[0].strip()), float)


def _scale(header: dict[str, str], where: str) -> float:
    units = header.get("units", "").strip()
    if units.lower() not in METRES_BY_WORD:
        expected = "Units to be m, cm, mm, in, ft or a whole word such as millimeters"
        raise FormatError.mismatch(where, expected, quoted(units), "correct it")
    return METRES_BY_WORD[units.lower()]


def _whole(text: str | None) -> int | None:
    """Return a header's whole number; None if it is none, or no frame number."""
    number = _number(text)
    if isinstance(number, float) and number.is_integer() and abs(number) <= MAX_FRAMES:
        return int(number)
    return None


def stated_rate(text: str) -> float | None:
    """Return the frame rate that a header states; None if it states none."""
    number = _number(text)
    return number if isinstance(number, float) and 0 < number <= MAX_FRAMES else None


def _number(text: str | None) -> float | str | None:
    """Return a header's number; its text if it is none."""
    try:
        return float(text or "")
    except ValueError:
        return text


def patch_trc(path: Path, changes: Mapping[int, Array]) -> bytes:
    """Return a file with some points replaced, in its unit; all other bytes stay.

    Args:
        path: the file, which has been read before.
        changes: positions, (n_points, 3), metres, by row, from 0; points of NaN stay.
    """
    table = read_trc(path)
    patch = TextPatch(path.read_bytes())
    head = [line for line in patch.text.splitlines() if line.strip()][:3]
    header = {k.strip().lower(): v for k, v in zip(head[1].split("\t"), head[2].split("\t"), strict=False)}
    scale = 1 / _scale(header, str(path))
    new = {
        row: {2 + i: float(x) for i, x in enumerate((scale * points).ravel()) if not np.isnan(x)}
        for row, points in changes.items()
    }
    digits = 7 if scale < 10 else 4  # a tenth of a micrometre, as `write_trc` has it
    patch.replace_cells("\t", len(table.frames), new, digits)
    return patch.encoded()


def remap_axes(table: MarkerTable, axes: str, may_mirror: bool = False) -> MarkerTable:
    """Express a file's points in the session's axes.

    Args:
        table: the points in the file's axes.
        axes: which of the file's axes are the session's x, y and z, e.g. `x,-z,y` for a file whose y points up.
        may_mirror: whether axes that mirror the world are accepted: of a file in left-handed axes, whose points are
            examined afterwards.

    Raises:
        FormatError: not three different axes, or they mirror the world.
    """
    if is_mirrored(axes) and not may_mirror:
        raise FormatError(f"the axes {axes} would mirror the world, left to right", Remedy("turn_axis"))
    return replace(table, points=table.points @ axes_matrix(axes).T)


def axes_matrix(axes: str) -> Array:
    """Return the matrix, (3, 3), that maps a file's coordinates to axes such as `x,-z,y`; it may mirror.

    Raises:
        FormatError: not three different axes.
    """
    matrix = np.zeros((3, 3))
    words = [w.strip() for w in axes.split(",")]
    for row, word in enumerate(words[:3]):
        if word.lstrip("+-") in ("x", "y", "z"):
            matrix[row, "xyz".index(word[-1])] = -1.0 if word.startswith("-") else 1.0
    if len(words) != 3 or abs(np.linalg.det(matrix)) != 1:
        raise FormatError(f"expected three different axes such as x,-z,y, found '{axes}'", Remedy("name_axes"))
    return matrix


def axis_conventions() -> Iterator[str]:
    """Yield the 48 ways to map axes to axes as words such as `x,-z,y`; half of them mirror."""
    for order, signs in product(permutations("xyz"), product(("", "-"), repeat=3)):
        yield ",".join(f"{sign}{axis}" for sign, axis in zip(signs, order, strict=True))


def is_mirrored(axes: str) -> bool:
    """Return whether axes such as `x,z,y` mirror the world, left to right."""
    return bool(np.linalg.det(axes_matrix(axes)) < 0)
