"""People in space without a table: JSON files of a frame each (EasyMocap, CMU Panoptic), and arrays of NumPy.

Arrays are those of body-model networks: (frames, joints, 3) or (frames, people, joints, 3). Shape and type are read
from the header before anything is allocated; nothing is unpickled.
"""

import re
import zipfile
from collections import defaultdict
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Annotated, TypeAlias

import msgspec
import numpy as np
from numpy.lib import format as npy

from tracker.errors import FormatError, Remedy
from tracker.files import open_regular
from tracker.formats.number_rows import MAX_NAMES, check_size
from tracker.formats.observation_layout import Sample
from tracker.formats.text_files import DOCUMENT_BYTES, TextKind, read_json
from tracker.formats.trc import MarkerTable, mask_missing
from tracker.geometry.arrays import DAMAGED_ARRAYS, Array, IntArray
from tracker.geometry.lengths import METRES_BY_WORD
from tracker.validation import MAX_FRAMES, Number, check, quoted

Scenes: TypeAlias = list[tuple[Path, MarkerTable]]
"""The points of each person, with the file or folder that they are from."""
_KIND = TextKind("file of people in space", DOCUMENT_BYTES, FormatError, "export it again")


class _Person(msgspec.Struct):
    id: Annotated[int, msgspec.Meta(ge=-MAX_FRAMES, le=MAX_FRAMES, description="the number of a person")]
    keypoints3d: Annotated[list[list[Number]], msgspec.Meta(max_length=MAX_NAMES)] = []
    joints19: Annotated[list[Number], msgspec.Meta(max_length=MAX_NAMES)] = []


class _Scene(msgspec.Struct):
    bodies: list[_Person]


def is_easymocap(sample: Sample) -> bool:
    """Return whether a file is of EasyMocap's keypoints3d; a frame without people is known by its folder."""
    data = sample.data
    if data == []:
        return sample.path.parent.name == "keypoints3d"
    return isinstance(data, list) and isinstance(data[0], dict) and "keypoints3d" in data[0]


def is_panoptic(sample: Sample) -> bool:
    """Return whether a file is of CMU Panoptic's hdPose3d."""
    bodies = sample.data.get("bodies") if isinstance(sample.data, dict) else None
    return isinstance(bodies, list) and not any(isinstance(b, dict) and "joints" in b for b in bodies)  # of AlphaPose


def read_scenes(paths: Sequence[Path], unit_m: float | None, rate: float) -> Scenes:
    """Read the people of a folder of files; a person is absent in the files that do not have him or her.

    Args:
        paths: the files.
        unit_m: metres per unit of EasyMocap; CMU Panoptic has centimetres.
        rate: frames per second.

    Raises:
        FormatError: a file is malformed, or two are of one frame.
    """
    folder = paths[0].parent
    scale = METRES_BY_WORD["cm"] if is_panoptic(Sample(paths[0])) else unit_m
    if scale is None:
        raise FormatError(f"{folder}: expected the unit of the lengths, found none", Remedy("say_unit"))
    people: dict[int, dict[int, Array]] = defaultdict(dict)
    frames: dict[int, Path] = {}
    for path in paths:
        named = re.search(r"\d{1,9}$", path.stem)
        if named is None or frames.setdefault(int(named[0]), path) != path:
            raise FormatError(f"expected names that end in the number of the frame, each once, found {path}; rename it")
        for person in _people(path):
            people[person.id][int(named[0])] = _points(person, path)
    numbers = np.array(sorted(frames), dtype=np.int64)
    sizes = {len(points) for found in people.values() for points in found.values()}
    if len(sizes) != 1:
        expected = "equally many points of people in all files"
        raise FormatError(f"{folder}: expected {expected}, found {sorted(sizes) or 'none'}")
    check_size((len(people), len(numbers), *sizes, 4), str(folder))
    tables = []
    for name, found in sorted(people.items()):
        points = np.full((len(numbers), *sizes, 4), np.nan)
        points[np.searchsorted(numbers, [*found])] = [*found.values()]
        tables.append((folder, unnamed_table(points, numbers, scale, rate, str(name))))
    return tables


def unnamed_table(points: Array, frames: IntArray, scale: float, rate: float, person: str) -> MarkerTable:
    """Return points, (n, m, 3) or with confidence (n, m, 4), named by their numbers; absent without confidence."""
    out = scale * points[..., :3]
    out[~np.isfinite(out).all(axis=-1) | (points[..., 3:] <= 0).any(axis=-1)] = np.nan
    names = tuple(map(str, range(points.shape[1])))
    return MarkerTable(names, frames, frames / rate, out, rate, None, tuple(mask_missing(out)), person)


def _people(path: Path) -> list[_Person]:
    data, where = read_json(path, _KIND), f"{_KIND.name} {path}"
    if isinstance(data, dict):
        return check(data, _Scene, where, FormatError).bodies
    return check(data, list[_Person], where, FormatError)


def _points(person: _Person, path: Path) -> Array:
    """Return x, y, z and confidence of the points of a person, (n_points, 4)."""
    if not person.keypoints3d and not person.joints19:
        raise FormatError.mismatch(path, "19 joints of CMU Panoptic", "none", "take the folder hdPose3d_stage1_coco19")
    rows = person.keypoints3d or [person.joints19[i : i + 4] for i in range(0, len(person.joints19), 4)]
    if {*map(len, rows)} not in ({3}, {4}):
        raise FormatError(f"{path}: expected x, y, z and confidence of each point, found other rows; export it again")
    points = np.array(rows, dtype=np.float64)
    return np.column_stack([points, np.ones(len(points))])[:, :4]


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
