"""JSON files of a frame each with the people of a scene: EasyMocap's keypoints3d and CMU Panoptic's hdPose3d."""

import re
from collections import defaultdict
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeAlias

import msgspec
import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.formats.number_rows import MAX_NAMES, check_size
from tracker.formats.observation_layout import Sample
from tracker.formats.trc import MarkerTable, mask_missing
from tracker.geometry.arrays import Array, IntArray
from tracker.text_files import DOCUMENT_BYTES, TextKind, read_json
from tracker.validation import MAX_FRAMES, Number, check

_KIND = TextKind("file of people in space", DOCUMENT_BYTES, FormatError, "export it again")
_Identity: TypeAlias = Annotated[int, msgspec.Meta(ge=-MAX_FRAMES, le=MAX_FRAMES, description="the number of a person")]
PointsOf: TypeAlias = Callable[[Any, str], dict[int, Array]]
"""Returns x, y, z and confidence of the people of a file, (n_points, 4), by number, from its data and name."""


class _MocapPerson(msgspec.Struct):
    id: _Identity
    keypoints3d: Annotated[list[list[Number]], msgspec.Meta(min_length=1, max_length=MAX_NAMES)]


class _PanopticPerson(msgspec.Struct):
    id: _Identity
    joints19: Annotated[list[Number], msgspec.Meta(min_length=76, max_length=76, description="4 numbers of 19 joints")]


class _Panoptic(msgspec.Struct):
    bodies: list[_PanopticPerson]


def is_easymocap(sample: Sample) -> bool:
    """Return whether a file is of EasyMocap's keypoints3d; a frame without people is known by its folder."""
    data = sample.data
    if data == []:
        return sample.path.parent.name == "keypoints3d"
    return isinstance(data, list) and isinstance(data[0], dict) and "keypoints3d" in data[0]


def easymocap_points(data: Any, where: str) -> dict[int, Array]:
    """Return the people of a file of EasyMocap's keypoints3d."""
    found = {}
    for person in check(data, list[_MocapPerson], where, FormatError):
        widths = {len(point) for point in person.keypoints3d}
        if len(widths) > 1 or not widths <= {3, 4}:
            raise FormatError(
                f"{where}: expected x, y, z and confidence of each point, found other rows; export it again"
            )
        points = np.array(person.keypoints3d, dtype=np.float64)
        found[person.id] = np.column_stack([points, np.ones(len(points))])[:, :4]
    return found


def is_panoptic(sample: Sample) -> bool:
    """Return whether a file is of CMU Panoptic's hdPose3d."""
    return isinstance(sample.data, dict) and "bodies" in sample.data


def panoptic_points(data: Any, where: str) -> dict[int, Array]:
    """Return the people of a file of CMU Panoptic's hdPose3d, in centimetres."""
    return {
        person.id: np.array(person.joints19, dtype=np.float64).reshape(-1, 4)
        for person in check(data, _Panoptic, where, FormatError).bodies
    }


def read_scenes(
    points_of: PointsOf, unit_m: float | None, paths: Sequence[Path], given_m: float | None, rate: float
) -> list[tuple[Path, MarkerTable]]:
    """Read the people of a folder of files; a person is absent in the files that do not have him or her.

    Args:
        points_of: reads the data of a file.
        unit_m: metres per unit of the program; None if it fixes none.
        paths: the files.
        given_m: metres per unit that the user gave.
        rate: frames per second.

    Raises:
        FormatError: a file is malformed, or two are of one frame.
    """
    scale = unit_m or given_m
    if scale is None:
        raise FormatError(f"{paths[0].parent}: expected the unit of the lengths, found none", Remedy("say_unit"))
    people: dict[int, dict[int, Array]] = defaultdict(dict)
    files: dict[int, Path] = {}
    for path in paths:
        named = re.search(r"(\d{1,9})$", path.stem)
        frame = int(named[1]) if named else -1
        if frame < 0 or frame in files:
            raise FormatError(
                f"expected names that end in the number of the frame, each once, found {path.name}; leave it out or "
                "rename it"
            )
        files[frame] = path
        for number, points in points_of(read_json(path, _KIND), f"{_KIND.name} {path}").items():
            people[number][frame] = points
    frames = np.array(sorted(files), dtype=np.int64)
    tables = []
    for number, found in sorted(people.items()):
        sizes = {len(points) for points in found.values()}
        if len(sizes) > 1:
            raise FormatError(f"{paths[0].parent}: expected equally many points in all files, found {sorted(sizes)}")
        check_size((len(people), len(frames), *sizes, 4), str(paths[0].parent))
        table = np.full((len(frames), *sizes, 4), np.nan)
        table[np.searchsorted(frames, [*found])] = [*found.values()]
        tables.append((paths[0].parent, unnamed_table(table, frames, scale, rate, str(number))))
    if not tables:
        raise FormatError(f"{paths[0].parent}: expected people in some file, found none; check the folder")
    return tables


def unnamed_table(points: Array, frames: IntArray, scale: float, rate: float, person: str) -> MarkerTable:
    """Return points, (n, m, 3) or with confidence (n, m, 4), named by their numbers; absent without confidence."""
    out = scale * points[..., :3]
    out[~np.isfinite(out).all(axis=-1) | (points[..., 3:] <= 0).any(axis=-1)] = np.nan
    names = tuple(map(str, range(points.shape[1])))
    return MarkerTable(names, frames, frames / rate, out, rate, None, tuple(mask_missing(out)), person)
