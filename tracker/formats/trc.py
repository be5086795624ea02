"""TRC files (OpenSim, Pose2Sim, Cortex): the tracks of named points in 3-D.

Tab-separated: three lines of header, one of point names (each above its X, Y, Z), one of X1 Y1 Z1 ..., and rows of
Frame#, Time and coordinates. Lengths are in the header's Units. Blank coordinates are missing points, written as empty
fields, spaces or NaN. Some writers leave a blank line below the header; some drop the tabs at the end of a row.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tracker.errors import FormatError
from tracker.files import write_text_atomic
from tracker.formats.number_rows import NumberRows
from tracker.geometry.arrays import Array
from tracker.text_files import LOST, TextKind, read_lines, refuse_lost
from tracker.validation import MAX_FRAMES, FrameRate, check, quoted

METRES_BY_WORD = {
    word: metres
    for words, metres in (
        ("m meter meters metre metres", 1.0),
        ("cm centimeter centimeters centimetre centimetres", 0.01),
        ("mm millimeter millimeters millimetre millimetres", 0.001),
        ("in inch inches", 0.0254),
        ("ft foot feet", 0.3048),
    )
    for word in words.split()
}
"""Metres per unit, by the words that OpenSim (`Units`) and others write, in any case."""
_KIND = TextKind("TRC file", 1_000_000_000, FormatError, "export it again")
_MAX_POINTS = 1000
_MAX_COORDINATE = 1e9
"""Largest coordinate and time of a file, in its own units."""


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
    """Sentences on how the rows of a file were placed at frames of a session."""

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
    lines = read_lines(Path(path), _KIND)
    head = list(islice(lines, 5))
    if len(head) < 5 or not head[0].startswith("PathFileType"):
        raise FormatError(f"{path} is not a TRC file: expected 'PathFileType' at its start; export it as TRC")
    keys = [key.strip().lower() for key in head[1].split("\t")]
    header = dict(zip(keys, head[2].split("\t"), strict=False))
    if _is_row(head[4]):
        raise FormatError(f"{where}, line 5: expected X1, Y1, Z1, ..., found a row of numbers; export it again")
    scale = _scale(header, where)
    rate = check(_number(header.get("datarate")), FrameRate, f"{where}, line 3, DataRate", FormatError)
    names = tuple(n.strip() for n in head[3].split("\t")[2:] if n.strip())
    if LOST in head[3]:  # in the first line there is a path, which nobody needs
        refuse_lost(list(names), f"{where}, line 4", _KIND)
    if not 1 <= len(names) <= _MAX_POINTS or len(set(names)) != len(names):
        raise FormatError(
            f"{where}, line 4: expected 1 to {_MAX_POINTS} point names, each once, found {quoted(list(names))}; "
            "rename them"
        )
    rows = NumberRows(where, "\t", 2 + 3 * len(names), n_required=2)
    for number, line in enumerate(lines, 6):
        if text := line.rstrip():  # some writers end rows with tabs, some drop them
            rows.add(text, number)
    frames, values = rows.table(_MAX_COORDINATE)
    values[:, 1:] *= scale  # the three-dimensional view would be scaled in a copy
    points = values[:, 1:].reshape(len(frames), len(names), 3)
    # A point with a missing coordinate is missing.
    points[np.isnan(points).any(axis=-1)] = np.nan
    return MarkerTable(names, frames, values[:, 0], points, rate, _whole(header.get("origdatastartframe")))


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
    scale, digits = (1.0, 7) if units == "m" else (1000.0, 4)
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


def _is_row(line: str) -> bool:
    """Return whether a line begins with a number, as rows do and headers do not."""
    return isinstance(_number(line.partition("\t")[0].strip()), float)


def _scale(header: dict[str, str], where: str) -> float:
    units = header.get("units", "").strip()
    if units.lower() not in METRES_BY_WORD:
        raise FormatError(
            f"{where}, line 3: expected Units to be m, cm, mm, in, ft or a whole word such as millimeters, found "
            f"{quoted(units)}; correct it"
        )
    return METRES_BY_WORD[units.lower()]


def _whole(text: str | None) -> int | None:
    """Return a header's whole number; None if it is none, or no frame number."""
    number = _number(text)
    if isinstance(number, float) and number.is_integer() and abs(number) <= MAX_FRAMES:
        return int(number)
    return None


def _number(text: str | None) -> float | str | None:
    """Return a header's number; its text if it is none."""
    try:
        return float(text or "")
    except ValueError:
        return text
