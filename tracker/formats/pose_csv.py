"""The project's tables of poses: CSV with one row per frame and one column per value of the pose.

    # quadrille poses, version 1
    # model = gavrila22
    # height_m = 1.75
    frame,torso.x_m,torso.y_m,torso.z_m,torso.abduction_deg,...
    0,0.010000000,...

Angles are in degrees (`_deg`), lengths in metres (`_m`); the quaternions of ball joints (`.qw`, `.qx`, `.qy`, `.qz`)
have no unit. Frames are 0-based.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tracker.body.model import BodyModel
from tracker.errors import FormatError
from tracker.files import write_text_atomic
from tracker.geometry.arrays import Array

VERSION = 1

_TITLE = "# quadrille poses, version "
_DIGITS = 9


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
    units = _units(model)
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


def read_pose_table(path: str | Path) -> PoseTable:
    """Read a table of poses.

    Raises:
        FormatError: the file is missing, newer than this program, or malformed; the message has the line.
    """
    path = Path(path)
    try:
        lines = path.read_text("utf-8-sig").splitlines()
    except FileNotFoundError as error:
        raise FormatError(f"pose table {path} not found; check the path") from error
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(f"pose table {path} cannot be read as text: {error}; export it again") from error
    n_head = next((i for i, line in enumerate(lines) if not line.startswith("#")), len(lines))
    head = _read_head(lines[:n_head], path)
    rows = list(csv.reader(lines[n_head:]))
    if not rows or rows[0][:1] != ["frame"]:
        raise FormatError(
            f"pose table {path}, line {n_head + 1}: expected 'frame' as the first column; export it again"
        )
    names, factors = _read_columns(rows[0][1:], path, n_head + 1)
    numbers = [_read_row(row, len(names), path, n_head + 2 + i) for i, row in enumerate(rows[1:]) if row]
    table = np.array(numbers, dtype=np.float64).reshape(len(numbers), 1 + len(names))
    frames = table[:, 0].astype(np.int64)
    if np.any(np.diff(frames) <= 0) or np.any(frames < 0):
        raise FormatError(f"pose table {path}: expected frames from 0 that rise from row to row; sort the rows")
    return PoseTable(head["model"], float(head["height_m"]), names, frames, table[:, 1:] * factors)


def _units(model: BodyModel) -> list[str]:
    """Return the unit of each value as its column's suffix."""
    lengths = {
        model.value_names[v] for v, is_length in zip(model.dof_value, model.dof_is_length, strict=True) if is_length
    }
    quaternions = {f"{j.name}.{q}" for j in model.joints if j.kind == "ball" for q in ("qw", "qx", "qy", "qz")}
    return ["_m" if n in lengths else "" if n in quaternions else "_deg" for n in model.value_names]


def _read_head(lines: list[str], path: Path) -> dict[str, str]:
    version = lines[0].removeprefix(_TITLE).strip() if lines and lines[0].startswith(_TITLE) else ""
    if not version.isdigit():
        raise FormatError(f"{path} is not a table of poses: expected '{_TITLE}{VERSION}' as its first line")
    if int(version) > VERSION:
        raise FormatError(
            f"pose table {path} has version {version}, this program reads up to {VERSION}; upgrade quadrille"
        )
    head = {k.strip(): v.strip() for k, _, v in (line[1:].partition("=") for line in lines[1:])}
    try:
        if float(head["height_m"]) > 0 and head["model"]:
            return head
    except (KeyError, ValueError):
        pass
    raise FormatError(
        f"pose table {path}: expected '# model = NAME' and '# height_m = METRES' below its first line; export it again"
    )


def _read_columns(columns: list[str], path: Path, line: int) -> tuple[tuple[str, ...], list[float]]:
    names, factors = [], []
    for column in columns:
        if column.endswith("_deg"):
            names.append(column.removesuffix("_deg"))
            factors.append(float(np.radians(1.0)))
        elif column.endswith("_m"):
            names.append(column.removesuffix("_m"))
            factors.append(1.0)
        elif column.endswith((".qw", ".qx", ".qy", ".qz")):
            names.append(column)
            factors.append(1.0)
        else:
            raise FormatError(
                f"pose table {path}, line {line}: column '{column}' has no unit, expected it to end in _deg or _m "
                "(or .qw, .qx, .qy, .qz); rename it"
            )
    return tuple(names), factors


def _read_row(row: list[str], n_values: int, path: Path, line: int) -> list[float]:
    try:
        numbers = [float(x) for x in row]
    except ValueError as error:
        raise FormatError(f"pose table {path}, line {line}: expected numbers, found {error}; correct it") from error
    if len(numbers) != 1 + n_values or not np.all(np.isfinite(numbers)) or numbers[0] != int(numbers[0]):
        raise FormatError(
            f"pose table {path}, line {line}: expected a whole frame number and {n_values} finite values, "
            f"found {','.join(row)[:60]}; correct it"
        )
    return numbers
