"""C3D files of motion capture: points in space, by the optional package ezc3d."""

import struct
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.formats.keypoints.hdf5 import foreign_reader
from tracker.formats.keypoints.picture_table import check_size
from tracker.formats.number_rows import MAX_NAMES
from tracker.formats.trc import METRES_BY_WORD, MarkerTable
from tracker.geometry.arrays import Array
from tracker.validation import MAX_FRAMES, MAX_NUMBER, FrameRate, check, quoted

_MAX_FRAMES_OF_HEADER = 65_535
"""Largest number of frames that the header of a C3D file can hold (c3d.org, 16-bit words)."""


def read_c3d(path: Path, unit_m: float | None) -> MarkerTable:
    """Read the points of a file; `frames` are those of its header, counted from 0.

    Args:
        path: the file.
        unit_m: metres per unit, if the file states none.

    Raises:
        FormatError: ezc3d is not installed, or the file is malformed, cut off, or has no points.
    """
    where = f"C3D file {path}"
    with foreign_reader(path, where, "ezc3d"):
        import ezc3d

        data = ezc3d.c3d(str(path))
        labels = [str(name).strip() for name in data["parameters"]["POINT"]["LABELS"]["value"]]
        n_parts = 2
        while extra := data["parameters"]["POINT"].get(f"LABELS{n_parts}"):
            labels += [str(name).strip() for name in extra["value"]]
            n_parts += 1
        units = str(next(iter(data["parameters"]["POINT"]["UNITS"]["value"]), "")).strip()
        rate, first = float(data["header"]["points"]["frame_rate"]), int(data["header"]["points"]["first_frame"])
        last = int(data["header"]["points"]["last_frame"])
        values = np.asarray(data["data"]["points"], dtype=np.float64)  # (4, n_points, n_frames)
    if values.ndim != 3 or not 1 <= values.shape[1] <= MAX_NAMES or not values.shape[2]:
        raise FormatError(f"{where}: expected 1 to {MAX_NAMES} points, found an array of {values.shape}; export again")
    n_points, n_frames = values.shape[1:]
    check_size((n_frames, n_points, 3), where)
    names = tuple(labels[:n_points])
    if len(names) != n_points or len(set(names)) != n_points or not all(names):
        raise FormatError(f"{where}: expected a name for each of {n_points} points, found {quoted(labels)}; label them")
    if not 0 <= first <= MAX_FRAMES:
        raise FormatError(f"{where}: expected a first frame up to {MAX_FRAMES}, found {first}; export it again")
    if units.lower() not in METRES_BY_WORD and unit_m is None:
        raise FormatError(f"{where}: expected POINT:UNITS to be mm or m, found {quoted(units)}", Remedy("say_unit"))
    scale = METRES_BY_WORD.get(units.lower(), unit_m or 1.0)
    points = np.transpose(values[:3], (2, 1, 0)) * scale
    points[~(np.abs(points) <= MAX_NUMBER).all(axis=-1)] = np.nan
    points[(points == 0).all(axis=-1)] = np.nan  # a missing point, besides its negative residual
    frames = np.arange(first, first + n_frames)
    rate = float(check(rate, FrameRate, f"{where}, frame rate", FormatError))
    notes = list[str]()
    if last - first + 1 > n_frames or n_frames == _MAX_FRAMES_OF_HEADER:
        notes.append(f"it has {n_frames} frames, and its header {last - first + 1}: check that it is complete")
    return MarkerTable(names, frames, frames / rate, points, rate, None, tuple(notes))


def patch_c3d(path: Path, unit_m: float | None, changes: Mapping[int, Array]) -> bytes:
    """Return a file with some points replaced, in its unit; all other bytes stay (c3d.org, "The C3D file format").

    Args:
        path: the file, which has been read before.
        unit_m: metres per unit, if the file states none.
        changes: positions, (n_points, 3), metres, by row, from 0; points of NaN stay.

    Raises:
        FormatError: its numbers are those of a DEC or SGI computer.
    """
    data = bytearray(path.read_bytes())
    parameters = _BLOCK_BYTES * (data[0] - 1)
    if data[parameters + 3] != _INTEL:
        raise FormatError(f"C3D file {path}: expected numbers in Intel's order, found others; import it converted")
    n_points, n_analog = struct.unpack_from("<hh", data, 2)
    (scale,), (block,) = struct.unpack_from("<f", data, 12), struct.unpack_from("<H", data, 16)
    is_real = scale < 0
    kind, size = ("<3f", 4) if is_real else ("<3h", 2)
    stride = size * (4 * n_points + n_analog)
    per_unit = (1.0 if is_real else scale) * _metres(path, unit_m)
    for row, points in changes.items():
        for i, point in enumerate(points):
            if np.isnan(point).any():
                continue
            at = _BLOCK_BYTES * (block - 1) + row * stride + 4 * size * i
            values = (point / per_unit).tolist()
            struct.pack_into(kind, data, at, *(values if is_real else map(round, values)))
            residual = struct.unpack_from(f"<{kind[-1]}", data, at + 3 * size)[0]
            if residual < 0:  # it was missing
                struct.pack_into(f"<{kind[-1]}", data, at + 3 * size, 0)
    return bytes(data)


def _metres(path: Path, unit_m: float | None) -> float:
    import ezc3d

    units = str(next(iter(ezc3d.c3d(str(path))["parameters"]["POINT"]["UNITS"]["value"]), "")).strip().lower()
    return METRES_BY_WORD.get(units, unit_m or 1.0)


_BLOCK_BYTES, _INTEL = 512, 84
"""Length of a block, and the code of Intel's order of bytes (c3d.org)."""
