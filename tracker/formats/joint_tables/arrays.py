"""Arrays of NumPy with the joints of body-model networks: (frames, joints, 3) or (frames, people, joints, 3).

Shape and type are read from the header before anything is allocated; nothing is unpickled.
"""

import zipfile
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np
from numpy.lib import format as npy

from tracker.errors import FormatError, Remedy
from tracker.files import open_regular
from tracker.formats.joint_tables.scenes import unnamed_table
from tracker.formats.number_rows import MAX_NAMES, check_size
from tracker.formats.observation_layout import Sample
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import DAMAGED_ARRAYS, Array
from tracker.validation import quoted

_EXPECTED = "an array (frames, joints, 3) or (frames, people, joints, 3) of numbers"


def is_array(sample: Sample) -> bool:
    """Return whether a file is an array of NumPy, or an archive of some."""
    return sample.path.suffix.lower() in (".npy", ".npz")


def read_array(path: Path, unit_m: float | None, rate: float) -> list[MarkerTable]:
    """Read the joints of each person of an array, or of the only array of joints in an archive.

    Raises:
        FormatError: the file is damaged, has no such array or several, or its unit is not known.
    """
    where = f"array {path}"
    if unit_m is None:
        raise FormatError(f"{where}: expected the unit of its lengths, which arrays never state", Remedy("say_unit"))
    points = _joints(path, where).astype(np.float64)
    by_person = points[:, None] if points.ndim == 3 else points
    frames = np.arange(len(points), dtype=np.int64)
    return [
        unnamed_table(np.ascontiguousarray(by_person[:, k]), frames, unit_m, rate, str(k) if points.ndim == 4 else "")
        for k in range(by_person.shape[1])
    ]


def _joints(path: Path, where: str) -> Array:
    """Return the array of joints of a file. Raises as `read_array` does."""
    try:
        with _members(path) as members:
            shapes = {name: _shape(stream) for name, stream in members}
        joints = [name for name, shape in shapes.items() if shape]
        if len(joints) != 1:
            found = f"{', '.join(joints)}" if joints else f"none in {quoted([*shapes])}"
            advice = "save the joints in space as the only one of this shape"
            raise FormatError.mismatch(where, _EXPECTED, found, advice)
        check_size(shapes[joints[0]], where)
        with _members(path) as members:
            return next(npy.read_array(stream, allow_pickle=False) for name, stream in members if name == joints[0])
    except DAMAGED_ARRAYS as error:
        raise FormatError(f"{where} cannot be read: {error}; save it again with numpy.save") from error


@contextmanager
def _members(path: Path) -> Generator[Iterator[tuple[str, IO[bytes]]]]:
    """Yield the names and streams of the arrays of a file."""
    with open_regular(path) as file:
        if zipfile.is_zipfile(file):
            with zipfile.ZipFile(file) as archive:
                yield ((i.filename.removesuffix(".npy"), archive.open(i)) for i in archive.infolist())
        else:
            file.seek(0)
            yield iter([(path.name, file)])


def _shape(stream: IO[bytes]) -> tuple[int, ...]:
    """Return the shape by the header of an array of joints; empty for another array."""
    if npy.read_magic(stream) != (1, 0):  # headers of later versions may have gigabytes
        return ()
    shape, _, dtype = npy.read_array_header_1_0(stream)
    # An array that ends in 3, 3 is one of rotations.
    is_joints = len(shape) in (3, 4) and shape[-1] in (3, 4) and 3 < shape[-2] <= MAX_NAMES and 0 not in shape
    return shape if is_joints and dtype.kind in "fiu" else ()
