"""C3D: points over time for biomechanics, written by ezc3d and read back."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.formats.write_only.optional_packages import require
from tracker.geometry.arrays import Array
from tracker.geometry.lengths import METRES_BY_WORD

MAX_FRAME = np.iinfo(np.uint16).max
"""Highest frame number of a C3D file, which stores the first and last one in 16 bits (C3D user guide, header)."""
_RESIDUAL_STEPS = np.iinfo(np.uint8).max
"""Largest residual in its unit, the scale of the file: it is stored in 8 bits (C3D user guide, 3D data)."""


def write_c3d(
    path: Path,
    names: Sequence[str],
    points: Array,
    rate: float,
    *,
    first_frame: int = 0,
    residuals: Array | None = None,
    units: Literal["m", "mm"] = "mm",
) -> None:
    """Write points as C3D, and read them back. Frame numbers count from 1.

    Args:
        path: the file; it ends in `.c3d`.
        names: labels of the points, (m,).
        points: positions, (n, m, 3), metres; NaN where missing.
        rate: frames per second.
        first_frame: frame of the first row, from 0.
        residuals: root mean square error of each point, (n, m), metres; NaN, in the file 0, where not known.
        units: of lengths in the file.

    Raises:
        FormatError: ezc3d is missing, there are too many frames, or the file does not hold what was written.
    """
    n = len(points)
    if first_frame + n > MAX_FRAME:
        expected = f"frame numbers up to {MAX_FRAME:,}, as C3D has"
        raise FormatError.mismatch("", expected, f"{first_frame + n:,}", Remedy("fewer_frames"))
    scale = 1 / METRES_BY_WORD[units]
    values = np.full((4, len(names), n), 1.0)
    values[:3] = scale * points.transpose(2, 1, 0)
    missing = np.isnan(values).any(axis=0)
    known = np.zeros(missing.shape) if residuals is None else scale * np.nan_to_num(residuals.T)
    c3d = require("ezc3d", "C3D").c3d
    file = c3d()
    point = file["parameters"]["POINT"]
    point["LABELS"]["value"], point["DESCRIPTIONS"]["value"] = list(names), list(names)
    point["UNITS"]["value"], point["RATE"]["value"] = [units], [rate]
    point["SCALE"]["value"] = [-float(known.max(initial=0.0)) / _RESIDUAL_STEPS or -1.0]  # negative: points are floats
    file["header"]["points"]["first_frame"] = first_frame
    file["data"]["points"] = values
    file["data"]["meta_points"]["residuals"] = np.where(missing, -1.0, known)[None]
    file.write(str(path))
    _check(c3d(str(path)), values, rate, first_frame)


def _check(found: Any, values: Array, rate: float, first_frame: int) -> None:
    """Check what was read back.

    Args:
        found: the file, of ezc3d.
        values: points as given to it, (4, m, n).
        rate: frames per second.
        first_frame: from 0.

    Raises:
        FormatError: the file holds something else.
    """
    points = found["data"]["points"]
    header = found["header"]["points"]
    if points.shape != values.shape or (header["first_frame"], header["last_frame"]) != (
        first_frame,
        first_frame + values.shape[2] - 1,
    ):
        wanted = f"{values.shape[1]} points on {values.shape[2]} frames from {first_frame} in the C3D file"
        back = f"{points.shape[1]} on {points.shape[2]} from {header['first_frame']}"
        raise FormatError(f"expected {wanted}, read back {back}; choose another format")
    precision = 2 * np.finfo(np.float32).eps
    if not np.allclose(points, values, rtol=precision, atol=1e-6, equal_nan=True) or not np.isclose(
        header["frame_rate"], rate, rtol=precision
    ):
        raise FormatError("expected the points and the rate in the C3D file as written, read back others")
