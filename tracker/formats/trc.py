"""TRC files (OpenSim, Pose2Sim, Cortex): the tracks of named points in 3-D.

Tab-separated: three lines of header, one of point names (each above its X, Y, Z), one of X1 Y1 Z1 ..., and rows of
Frame#, Time and coordinates. Lengths are in the header's Units. Blank coordinates are missing points, written as empty
fields, spaces or NaN. Some writers leave a blank line below the header; some drop the tabs at the end of a row.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tracker.errors import FormatError
from tracker.files import write_text_atomic
from tracker.geometry.arrays import Array

_METRES = {"m": 1.0, "meters": 1.0, "metres": 1.0, "cm": 0.01, "mm": 0.001, "millimeters": 0.001}


@dataclass(frozen=True, eq=False)
class MarkerTable:
    """Positions of named points over time."""

    names: tuple[str, ...]
    """Names of the points, (m,)."""
    frames: NDArray[np.int64]
    """Frame of each row, relative to the first row, (n,)."""
    times: Array
    """Time of each row, s, (n,)."""
    points: Array
    """Positions, (n, m, 3), metres; NaN where missing."""
    rate: float
    """Rows per second according to the header."""

    def __post_init__(self) -> None:
        n, m = len(self.frames), len(self.names)
        assert self.frames.shape == self.times.shape == (n,)
        assert self.points.shape == (n, m, 3), (self.points.shape, n, m)


def read_trc(path: str | Path) -> MarkerTable:
    """Read a TRC file.

    Raises:
        FormatError: the file is missing or malformed; the message has the line.
    """
    path = Path(path)
    try:
        lines = path.read_text("utf-8-sig").splitlines()
    except FileNotFoundError as error:
        raise FormatError(f"TRC file {path} not found; check the path") from error
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(f"TRC file {path} cannot be read as text: {error}; export it again") from error
    if len(lines) < 5 or not lines[0].startswith("PathFileType"):
        raise FormatError(f"{path} is not a TRC file: expected 'PathFileType' at its start; export it as TRC")
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    scale = _scale(header, path)
    names = tuple(n.strip() for n in lines[3].split("\t")[2:] if n.strip())
    if not names or len(set(names)) != len(names):
        raise FormatError(f"TRC file {path}, line 4: expected point names, each once, found {list(names)}; rename them")
    rows = [_row(line, number, len(names), path) for number, line in enumerate(lines[5:], 6) if line.strip()]
    if not rows:
        raise FormatError(f"TRC file {path} has no rows of coordinates; export it again")
    table = np.array(rows)
    frames = table[:, 0].astype(np.int64)
    if np.any(np.diff(frames) <= 0):
        raise FormatError(f"TRC file {path}: expected Frame# to rise from row to row; sort the rows and remove doubles")
    points = table[:, 2:].reshape(len(rows), len(names), 3) * scale
    # A point with a missing coordinate is missing.
    points[np.isnan(points).any(axis=-1)] = np.nan
    return MarkerTable(names, frames - frames[0], table[:, 1], points, _rate(header, path))


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

    Args:
        path: the file.
        names: names of the points, (m,).
        points: positions, (n, m, 3), metres; NaN where missing.
        rate: frames per second.
        frames: frame of each row, from 0, ascending; by default every frame from 0. Frame# is one more. If the first is
            not 0, a blank row for frame 0 comes first, because readers count from the first row.
        units: of the lengths in the file.
    """
    path = Path(path)
    frames = np.arange(len(points)) if frames is None else np.asarray(frames)
    assert points.shape == (len(frames), len(names), 3)
    if len(frames) and frames[0] != 0:
        frames = np.concatenate([[0], frames])
        points = np.concatenate([np.full((1, len(names), 3), np.nan), points])
    scale, digits = (1.0, 7) if units == "m" else (1000.0, 4)
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate:.10g}\t{rate:.10g}\t{len(frames)}\t{len(names)}\t{units}\t{rate:.10g}\t1\t{len(frames)}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, len(names) + 1) for axis in "XYZ"),
        "",
    ]
    for frame, row in zip(frames.tolist(), points, strict=True):
        cells = ["" if np.isnan(x) else f"{x * scale:.{digits}f}" for x in row.ravel()]
        lines.append("\t".join([str(frame + 1), f"{frame / rate:.6f}", *cells]))
    write_text_atomic(path, "\n".join(lines) + "\n")


def _scale(header: dict[str, str], path: Path) -> float:
    units = header.get("Units", "").strip()
    if units.lower() not in _METRES:
        raise FormatError(
            f"TRC file {path}, line 3: expected Units to be one of {', '.join(_METRES)}, found '{units}'; correct it"
        )
    return _METRES[units.lower()]


def _rate(header: dict[str, str], path: Path) -> float:
    try:
        rate = float(header["DataRate"])
    except (KeyError, ValueError):
        rate = 0.0
    if not (np.isfinite(rate) and rate > 0):
        raise FormatError(
            f"TRC file {path}, line 3: expected a DataRate above 0, found '{header.get('DataRate', '')}'; correct it"
        )
    return rate


def _row(line: str, number: int, n_points: int, path: Path) -> list[float]:
    fields = [f.strip() for f in line.split("\t")]
    while len(fields) > 2 + 3 * n_points and not fields[-1]:
        fields.pop()
    fields += [""] * (2 + 3 * n_points - len(fields))
    if len(fields) > 2 + 3 * n_points:
        raise FormatError(
            f"TRC file {path}, line {number}: expected {2 + 3 * n_points} columns for {n_points} points, "
            f"found {len(fields)}; export it again"
        )
    try:
        row = [float(f) if f else np.nan for f in fields]
        if not (np.isfinite(row[:2]).all() and row[0] == int(row[0])):
            raise ValueError(f"no frame and time: {fields[:2]}")
    except ValueError as error:
        raise FormatError(f"TRC file {path}, line {number}: expected numbers, found {error}; correct it") from error
    return row
