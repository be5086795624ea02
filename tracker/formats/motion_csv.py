"""Tables of motion for pandas and spreadsheets: CSV with one row for each person and frame, and one line of names.

The first columns are person, frame, time_s, status, source, keyframe, calibration, earlier_calibration, cost_px and
cost_CAMERA_px for each camera. Then comes one column for each quantity, with its unit as suffix: _m, _mm, _deg;
components of quaternions have none. A missing value is an empty cell, which pandas reads as NaN.
"""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from tracker.files import write_text_atomic

PROVENANCE = ("status", "source", "keyframe", "calibration_revision", "earlier_calibration")
"""Columns of what is known of a pose, as other files name it; `calibration_revision` is called `calibration` here."""
_DIGITS = 7
"""Decimals of a value: a tenth of a micrometre."""


@dataclass(frozen=True)
class MotionRow:
    """A person in a frame."""

    person: str
    frame: int
    time_s: float
    provenance: Mapping[str, str | bool | int] = field(default_factory=dict)
    """Values of the columns `PROVENANCE`, perhaps with others; empty without a pose."""
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
    known_columns = [name.removesuffix("_revision") for name in PROVENANCE]
    table.writerow(["person", "frame", "time_s", *known_columns, *costs, *columns])
    for row in rows:
        known = [row.provenance.get(key, "") for key in PROVENANCE]
        flags = [str(value).lower() if isinstance(value, bool) else value for value in known]
        cells = [*flags, *_cells(row.costs_px, len(costs)), *_cells(row.values, len(columns))]
        table.writerow([row.person, row.frame, f"{row.time_s:.6f}", *cells])
    write_text_atomic(Path(path), text.getvalue())


def _cells(numbers: Sequence[float | None], count: int) -> list[str]:
    """Format numbers; missing ones, and all up to `count`, are empty."""
    found = ["" if x is None or x != x else f"{x:.{_DIGITS}f}" for x in numbers]
    return found + [""] * (count - len(found))
