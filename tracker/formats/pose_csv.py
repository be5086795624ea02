"""The project's tables of poses: CSV with one row per frame and one column per value of the pose.

    # quadrille poses, version 1
    # model = gavrila22
    # height_m = 1.75
    frame,torso.x_m,torso.y_m,torso.z_m,torso.abduction_deg,...
    0,0.010000000,...

Angles are in degrees (`_deg`), lengths in metres (`_m`); the quaternions of ball joints (`.qw`, `.qx`, `.qy`, `.qz`)
have no unit. Frames are 0-based.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.errors import FormatError
from tracker.files import write_text_atomic
from tracker.formats.number_rows import MAX_NAMES, NumberRows
from tracker.formats.text_files import TABLE_BYTES, TextKind, read_lines, refuse_lost
from tracker.geometry.arrays import Array
from tracker.validation import MAX_NUMBER, Name, check_version, quoted

VERSION = 1
"""Version of the tables; a newer one is refused."""

_TITLE = "# quadrille poses, version "
_DIGITS = 9
"""Decimals of a value, so that a pose is read back to 1e-9 rad or m."""
_KIND = TextKind("pose table", TABLE_BYTES, FormatError, "export it again")
_FACTORS = {"_deg": float(np.radians(1.0)), "_m": 1.0, ".qw": 1.0, ".qx": 1.0, ".qy": 1.0, ".qz": 1.0}
"""Suffixes of the columns, and what their values are multiplied by."""


class _Head(msgspec.Struct):
    """The comments at the start of a table."""

    model: Name
    height_m: Annotated[float, Meta(gt=0, le=100)]


@dataclass(frozen=True, eq=False)
class PoseTable:
    """Poses of one person over time."""

    model: str
    """Name of the body model."""
    height_m: float
    """Body height of the model, metres."""
    value_names: tuple[str, ...]
    """Names of the values, (n_values,), as `BodyModel.value_names`."""
    frames: NDArray[np.int64]
    """Frame of each row, 0-based, ascending, (n,)."""
    values: Array
    """Poses, (n, n_values), radians and metres."""

    def values_for(self, model: BodyModel) -> Array | None:
        """Return the poses in the order of a model's values, (n, n_values); None if the model has other values."""
        if set(self.value_names) != set(model.value_names):
            return None
        return self.values[:, [self.value_names.index(n) for n in model.value_names]]


def write_pose_table(
    path: str | Path, model: BodyModel, values: Array, frames: Sequence[int] | NDArray[np.int64] | None = None
) -> None:
    """Write poses, exact to a nanometre and a billionth of a degree; `read_pose_table` reads them back.

    Args:
        path: the file.
        model: the body model that the values belong to.
        values: poses, (n, n_values), radians and metres.
        frames: frame of each row, ascending, (n,); by default from 0.
    """
    frames = np.arange(len(values)) if frames is None else np.asarray(frames)
    assert np.shape(values) == (len(frames), len(model.value_names))
    units = value_units(model)
    factors = [np.degrees(1.0) if u == "_deg" else 1.0 for u in units]
    lines = [
        f"{_TITLE}{VERSION}",
        f"# model = {model.name}",
        f"# height_m = {model.height_m:.9g}",
        ",".join(["frame", *(n + u for n, u in zip(model.value_names, units, strict=True))]),
    ]
    for frame, row in zip(frames.tolist(), np.asarray(values) * factors, strict=True):
        lines.append(",".join([str(frame), *(f"{x:.{_DIGITS}f}" for x in row)]))
    write_text_atomic(Path(path), "\n".join(lines) + "\n")


def is_pose_table(path: Path) -> bool:
    """Return whether a file is a table of poses, which begins with comments; tables of joints have none."""
    return path.suffix.lower() == ".csv" and next(read_lines(path, _KIND), "").startswith("#")


def read_pose_table(path: str | Path) -> PoseTable:
    """Read a table of poses.

    Raises:
        FormatError: the file is missing, newer than this program, or malformed; the message has the line.
    """
    where = f"pose table {path}"
    lines = read_lines(Path(path), _KIND)
    comments = []
    for first in lines:
        if not first.startswith("#"):
            break
        comments.append(first)
    else:
        first = ""
    head = _read_head(comments, where)
    n_head = len(comments)
    columns = [column.strip('"') for column in first.split(",")]
    if columns[0] != "frame":
        raise FormatError(f"{where}, line {n_head + 1}: expected 'frame' as the first column; export it again")
    names, factors = _read_columns(columns[1:], f"{where}, line {n_head + 1}")
    rows = NumberRows(where, ",", len(columns), n_required=len(columns))
    for number, line in enumerate(lines, n_head + 2):
        if line.strip():
            rows.add(line, number)
    frames, values = rows.table(MAX_NUMBER)
    if frames[0] < 0:
        raise FormatError(f"{where}: expected frames from 0, found {frames[0]}; correct it")
    values *= factors
    return PoseTable(head.model, head.height_m, names, frames, values)


def value_units(model: BodyModel) -> list[str]:
    """Return the unit of each value of a pose as its column's suffix: `_m`, `_deg` or none."""
    lengths = {
        model.value_names[v] for v, is_length in zip(model.dof_value, model.dof_is_length, strict=True) if is_length
    }
    quaternions = {f"{j.name}.{q}" for j in model.joints if j.kind == "ball" for q in ("qw", "qx", "qy", "qz")}
    return ["_m" if n in lengths else "" if n in quaternions else "_deg" for n in model.value_names]


def _read_head(lines: Sequence[str], where: str) -> _Head:
    version = lines[0].removeprefix(_TITLE).strip() if lines and lines[0].startswith(_TITLE) else ""
    if not re.fullmatch("[0-9]{1,9}", version):
        raise FormatError(f"{where} is not a table of poses: expected '{_TITLE}{VERSION}' as its first line")
    check_version({"version": int(version)}, VERSION, where, FormatError)
    head = {k.strip(): v.strip() for k, _, v in (line[1:].partition("=") for line in lines[1:])}
    refuse_lost(head, where, _KIND)
    try:
        return msgspec.convert(head, _Head, strict=False)
    except msgspec.ValidationError as error:
        expected = "'# model = NAME' and '# height_m = METRES' below its first line"
        raise FormatError(f"{where}: expected {expected}; export it again") from error


def _read_columns(columns: Sequence[str], where: str) -> tuple[tuple[str, ...], list[float]]:
    names, factors = [], []
    refuse_lost(list(columns), where, _KIND)
    for column in columns:
        unit = next((u for u in _FACTORS if column.endswith(u)), None)
        if unit is None:
            raise FormatError(
                f"{where}: column {quoted(column)} has no unit, expected it to end in _deg or _m "
                "(or .qw, .qx, .qy, .qz); rename it"
            )
        names.append(column.removesuffix(unit) if unit.startswith("_") else column)
        factors.append(_FACTORS[unit])
    if not 1 <= len(names) <= MAX_NAMES or len(set(names)) < len(names):
        raise FormatError.mismatch(where, f"1 to {MAX_NAMES} columns of values, each once", quoted(names))
    return tuple(names), factors
