"""Tables of motion for pandas and spreadsheets: CSV with one row for each person and frame, and one line of names.

The first columns are person, frame, time_s, status, source, keyframe, calibration, earlier_calibration, cost_px and
cost_CAMERA_px for each camera. Then comes one column for each quantity, with its unit as suffix: _m, _mm, _deg;
components of quaternions have none. A missing value is an empty cell, which pandas reads as NaN.
"""

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from tracker.files import write_text_atomic

_DIGITS = 7
"""Decimals of a value: a tenth of a micrometre."""


@dataclass(frozen=True)
class MotionRow:
    """A person in a frame."""

    person: str
    frame: int
    time_s: float
    status: str = ""
    """Status of the pose as its tracker assessed it; empty without a pose or an assessment."""
    source: str = ""
    """The most manual source of its values; empty without a pose."""
    is_keyframe: bool | None = None
    """None without a pose."""
    calibration: int | None = None
    """Revision of the calibration that the pose was made with; None without a pose."""
    is_earlier: bool | None = None
    """Whether that is another one than the session's present calibration; None without a pose."""
    costs_px: Sequence[float | None] = ()
    """Mean cost, then the cost of each view, px; empty where unknown."""
    values: Sequence[float] = ()
    """The quantities, in the order of the columns; empty without a pose. NaN is a missing value."""


def write_motion_csv(
    path: str | Path, cameras: Sequence[str], columns: Sequence[str], rows: Iterable[MotionRow]
) -> None:
    """Write a table.

    Args:
        path: the file.
        cameras: names of the session's cameras.
        columns: names of the quantities, with their units.
        rows: in the order of the file.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    costs = ["cost_px", *(f"cost_{camera}_px" for camera in cameras)]
    names = ["person", "frame", "time_s", "status", "source", "keyframe", "calibration", "earlier_calibration"]
    table.writerow([*names, *costs, *columns])
    for row in rows:
        calibration = "" if row.calibration is None else row.calibration
        cells = [row.person, row.frame, f"{row.time_s:.6f}", row.status, row.source, _flag(row.is_keyframe)]
        cells += [calibration, _flag(row.is_earlier)]
        table.writerow([*cells, *_cells(row.costs_px, len(costs)), *_cells(row.values, len(columns))])
    write_text_atomic(Path(path), text.getvalue())


def _flag(value: bool | None) -> str:
    return "" if value is None else str(value).lower()


def _cells(numbers: Sequence[float | None], count: int) -> list[str]:
    """Format numbers; missing ones, and all up to `count`, are empty."""
    found = ["" if x is None or x != x else f"{x:.{_DIGITS}f}" for x in numbers]
    return found + [""] * (count - len(found))
