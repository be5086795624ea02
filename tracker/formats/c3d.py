"""C3D files of motion capture: points in space (c3d.org, "The C3D file format").

A header of 512 bytes, a section of named parameters, and frames of points and analog values. Numbers are those of
Intel, DEC or SGI computers, coordinates are reals or scaled whole numbers. It is read here because the library ezc3d
ends the process on some damaged files.
"""

import struct
from collections.abc import Iterator, Mapping
from enum import IntEnum
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.files import IrregularFileError, read_regular
from tracker.formats.number_rows import MAX_NAMES, check_size
from tracker.formats.text_files import TABLE_BYTES
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array
from tracker.geometry.lengths import METRES_BY_WORD
from tracker.validation import MAX_NUMBER, FrameRate, check, quoted

_BLOCK_BYTES = 512
"""Length of a block of the file (c3d.org)."""


class _Order(IntEnum):
    """Codes of the computers whose numbers a file has (c3d.org)."""

    INTEL = 84
    DEC = 85
    SGI = 86


class _Layout(NamedTuple):
    """The header of a file."""

    n_points: int
    n_analog: int
    """Analog values per frame."""
    first: int
    """First frame, as the file counts."""
    n_promised: int
    """Number of frames by the header."""
    scale: float
    """Units per step of whole numbers; negative for reals."""
    data_at: int
    """First byte of the first frame."""
    rate: float
    order: int
    """Order of bytes: `_Order.INTEL`, `_Order.DEC` or `_Order.SGI`."""
    parameters: Mapping[str, tuple[str, ...]]
    """Texts by GROUP:NAME."""

    @property
    def stride(self) -> int:
        """Length of a frame, bytes."""
        return (4 if self.scale < 0 else 2) * (4 * self.n_points + self.n_analog)


def read_c3d(path: Path, unit_m: float | None) -> MarkerTable:
    """Read the points of a file.

    Args:
        path: the file.
        unit_m: metres per unit, if the file states none.

    Raises:
        FormatError: the file is malformed, or has no points or no unit.
    """
    where = f"C3D file {path}"
    data = _read(path, where)
    found = _layout(data, where)
    n_bytes = len(data) - found.data_at
    n_frames = min(found.n_promised, n_bytes // found.stride)
    if n_frames < 1:
        raise FormatError(f"{where}: expected frames of points, found none; copy or export it again")
    check_size((n_frames, found.n_points, 4), where)
    names = _names(found, where)
    per_unit = _metres(found, unit_m, where) * (1.0 if found.scale < 0 else found.scale)
    values = _values(data, found, n_frames)
    points = per_unit * values[..., :3]
    points[~(np.abs(points) <= MAX_NUMBER).all(axis=-1)] = np.nan
    points[(values[..., 3] < 0) | (points == 0).all(axis=-1)] = np.nan  # a missing point
    frames = max(found.first - 1, 0) + np.arange(n_frames)  # a file counts from 1
    n_there = n_frames
    if n_bytes - n_frames * found.stride >= max(found.stride, _BLOCK_BYTES):  # more than what fills the last block
        n_there = n_bytes // found.stride
    notes = []
    if n_there != found.n_promised:
        notes.append(f"its header promises {found.n_promised} frames, it has {n_there}")
    return MarkerTable(names, frames, frames / found.rate, points, found.rate, None, tuple(notes))


def patch_c3d(path: Path, unit_m: float | None, changes: Mapping[int, Array]) -> bytes:
    """Return a file with some points replaced, in its unit; all other bytes stay.

    Args:
        path: the file, which has been read before.
        unit_m: metres per unit, if the file states none.
        changes: positions, (n_points, 3), metres, by row, from 0; points of NaN stay.

    Raises:
        FormatError: its numbers are those of a DEC computer, or too small for a point.
    """
    where = f"C3D file {path}"
    data = bytearray(_read(path, where))
    found = _layout(bytes(data), where)
    if found.order == _Order.DEC:
        raise FormatError(f"{where}: expected numbers of Intel or SGI computers, found DEC's; import it converted")
    is_real = found.scale < 0
    order, kind, size = "<" if found.order == _Order.INTEL else ">", "f" if is_real else "h", 4 if is_real else 2
    per_unit = _metres(found, unit_m, where) * (1.0 if is_real else found.scale)
    for row, points in changes.items():
        for i, point in enumerate(points):
            if np.isnan(point).any():
                continue
            at = found.data_at + row * found.stride + 4 * size * i
            values = (point / per_unit).tolist()
            if not is_real and max(map(abs, values)) > np.iinfo(np.int16).max:
                raise FormatError(f"{where}: expected points that its 16-bit numbers reach; use real ones")
            struct.pack_into(f"{order}3{kind}", data, at, *(values if is_real else map(round, values)))
            if struct.unpack_from(f"{order}{kind}", data, at + 3 * size)[0] < 0:  # it was missing
                struct.pack_into(f"{order}{kind}", data, at + 3 * size, 0)
    return bytes(data)


def _read(path: Path, where: str) -> bytes:
    try:
        data = read_regular(path, TABLE_BYTES)
    except IrregularFileError as error:
        raise FormatError(f"{where} cannot be read: {error.strerror}; export it again") from error
    except OSError as error:
        raise FormatError(f"{where} cannot be read: {error}; check the path") from error
    if not _BLOCK_BYTES <= len(data) <= TABLE_BYTES or data[1] != 0x50:  # the mark of C3D
        raise FormatError(f"{where} is not a C3D file, or it is too short or too long; export it again")
    return data


def _layout(data: bytes, where: str) -> _Layout:
    """Return the header of a file.

    Raises:
        FormatError: it contradicts itself.
    """
    parameters_at = _BLOCK_BYTES * (data[0] - 1)
    order = data[parameters_at + 3] if parameters_at > 0 and parameters_at + 4 <= len(data) else 0
    if order not in list(_Order):
        raise FormatError(f"{where}: expected the section of parameters, found none; copy or export it again")
    whole = ">" if order == _Order.SGI else "<"
    n_points, n_analog, first, last = struct.unpack_from(f"{whole}4H", data, 2)
    (block,) = struct.unpack_from(f"{whole}H", data, 16)
    scale, rate = (float(_reals(data[at : at + 4], order)[0]) for at in (12, 20))
    if not 1 <= n_points <= MAX_NAMES or last < first or not block >= 1 or not 0 < abs(scale) <= MAX_NUMBER:
        found = f"{n_points} points in frames {first} to {last}"
        raise FormatError.mismatch(where, f"1 to {MAX_NAMES} points in frames that rise", found)
    check(rate, FrameRate, f"{where}, frame rate", FormatError)
    texts = dict(_texts(data, parameters_at + 4, whole))
    return _Layout(
        n_points, n_analog, first, last - first + 1, scale, _BLOCK_BYTES * (block - 1), rate, order, texts
    )  # fmt: skip


def _texts(data: bytes, at: int, whole: str) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield the parameters that are texts, as GROUP:NAME and their lines; a damaged rest is left out."""
    groups: dict[int, str] = {}
    records: list[tuple[int, str, int]] = []
    while at + 4 <= len(data):
        length, group = struct.unpack_from("bb", data, at)
        if length == 0:
            break
        after = at + 2 + abs(length)
        name = data[at + 2 : after].decode("ascii", "replace").upper()
        if after + 2 > len(data):
            break
        (step,) = struct.unpack_from(f"{whole}H", data, after)
        if group < 0:
            groups[-group] = name
        else:
            records.append((group, name, after + 2))
        if step == 0:
            break
        at = after + step
    for group, name, start in records:
        yield f"{groups.get(group, '')}:{name}", _lines(data, start)


def _lines(data: bytes, at: int) -> tuple[str, ...]:
    """Return the lines of a parameter of text; none for numbers."""
    if at + 2 > len(data) or struct.unpack_from("b", data, at)[0] != -1:
        return ()
    n_dims = data[at + 1]
    dims = data[at + 2 : at + 2 + n_dims]
    width, n_lines = (dims[0] if dims else 1), int(np.prod([float(n) for n in dims[1:]]))
    start = at + 2 + n_dims
    if start + width * n_lines > len(data):
        return ()
    lines = (data[start + i * width : start + (i + 1) * width] for i in range(n_lines))
    return tuple(line.decode("utf-8", "replace").strip(" \0") for line in lines)


def _names(found: _Layout, where: str) -> tuple[str, ...]:
    labels = list(found.parameters.get("POINT:LABELS", ()))
    n_part = 2
    while more := found.parameters.get(f"POINT:LABELS{n_part}"):  # a parameter holds 255
        labels += more
        n_part += 1
    names = tuple(labels[: found.n_points])
    if len(set(names)) != found.n_points or not all(n and n.isprintable() and "\ufffd" not in n for n in names):
        expected = f"a name for each of {found.n_points} points, each once"
        raise FormatError.mismatch(where, expected, quoted(list(names)), "label them")
    return names


def _metres(found: _Layout, unit_m: float | None, where: str) -> float:
    """Return the metres per unit of a file."""
    units = " ".join(found.parameters.get("POINT:UNITS", ())).strip()
    metres = METRES_BY_WORD.get(units.lower(), unit_m)
    if metres is None:
        raise FormatError(f"{where}: expected POINT:UNITS to be mm or m, found {quoted(units)}", Remedy("say_unit"))
    return metres


def _values(data: bytes, found: _Layout, n_frames: int) -> Array:
    """Return x, y, z and residual of the points, (n_frames, n_points, 4), in steps or units of the file."""
    block = data[found.data_at : found.data_at + n_frames * found.stride]
    if found.scale < 0:
        rows = _reals(block, found.order)
    else:
        rows = np.frombuffer(block, ">i2" if found.order == _Order.SGI else "<i2").astype(np.float64)
    return rows.reshape(n_frames, -1)[:, : 4 * found.n_points].reshape(n_frames, found.n_points, 4)


def _reals(data: bytes, order: int) -> Array:
    """Return the reals of some bytes; DEC's have their halves exchanged and are four times as large."""
    if order == _Order.DEC:
        halves = np.frombuffer(data, "<u2").reshape(-1, 2)[:, ::-1]
        return np.ascontiguousarray(halves).view("<f4")[:, 0].astype(np.float64) / 4
    return np.frombuffer(data, "<f4" if order == _Order.INTEL else ">f4").astype(np.float64)
