"""The table of all layouts of joints in space that are known, and points replaced in a table.

`docs/log/observations.md` lists it.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TypeAlias

import numpy as np

from tracker.errors import FormatError
from tracker.formats.joint_tables import columns as head
from tracker.formats.joint_tables.columns import named_columns
from tracker.formats.joint_tables.scenes import Scenes, is_array, is_easymocap, is_panoptic, read_array, read_scenes
from tracker.formats.joint_tables.table_reading import read_table
from tracker.formats.number_rows import read_delimited
from tracker.formats.observation_layout import ObservationLayout, Sample
from tracker.formats.text_patch import TextPatch
from tracker.formats.trc import MarkerTable
from tracker.formats.unread import unread
from tracker.geometry.arrays import Array
from tracker.geometry.lengths import METRES_BY_WORD

JointLayout: TypeAlias = ObservationLayout[Scenes]
_SECTIONS = {"trajectories", "devices", "model outputs", "joints", "segments", "events"}
"""Sections of an ASCII file of Vicon Nexus, in lower case."""


def _in_head(*tests: Callable[[list[str]], bool]) -> Callable[[Sample], bool]:
    """Return a function for whether each of the first lines of a table passes its test, in lower case."""

    def recognizes(sample: Sample) -> bool:
        rows = [[cell.lower() for cell in cells] for cells in sample.cells]
        return len(rows) >= len(tests) and all(test(row) for test, row in zip(tests, rows, strict=False))

    return recognizes


def _begins(word: str) -> Callable[[Sample], bool]:
    return _in_head(lambda cells: cells[0].startswith(word))


def _is_deeplabcut(sample: Sample) -> bool:
    return any(cells[0].lower() == "coords" and "z" in cells for cells in sample.cells[:4])


def _of_each(read: Callable[[Path, float | None, float], list[MarkerTable]]) -> Callable[..., Scenes]:
    """Return a reader of files, each with the points of one or several people."""
    return lambda paths, unit_m, rate: [(path, table) for path in paths for table in read(path, unit_m, rate)]


def _table(columns_of: head.ColumnsOf) -> Callable[..., Scenes]:
    return _of_each(partial(read_table, columns_of))


def _is_long(cells: list[str]) -> bool:
    return not {*head.NAMES}.isdisjoint(cells) and not {"z", "z_coord", "z_m", "z_mm"}.isdisjoint(cells)


def _has_z(cells: list[str]) -> bool:
    return any(m["axis"] == "z" for m in map(head.COORDINATE.fullmatch, cells) if m)


# fmt: off
WIDE: JointLayout = ObservationLayout(
    "anipose, FreeMoCap, Caliscope (wide), our own tables and others", "a `.csv` or `.tsv`, of several people with a "
    "column `person`", "columns `NAME_x`, `NAME_y`, `NAME_z`, perhaps with a unit",
    _in_head(_has_z), _table(head.named_columns))
SCENES: tuple[JointLayout, ...] = (
    ObservationLayout("EasyMocap", "a `.json` for each frame", "`keypoints3d` of people", is_easymocap, read_scenes),
    ObservationLayout("CMU Panoptic (`hdPose3d`)", "a `.json` for each frame, cm", "`bodies`",
        is_panoptic, read_scenes))
LAYOUTS: tuple[JointLayout, ...] = (
    ObservationLayout("OptiTrack Motive", "a `.csv`", "`Format Version` first; markers and bones",
        _begins("format version"), _table(head.motive_columns)),
    ObservationLayout("Vicon Nexus (ASCII)", "a `.csv`", "the section `Trajectories`, or another one of Nexus first",
        _in_head(lambda cells: {*cells} - {""} <= _SECTIONS), _table(head.nexus_columns)),
    ObservationLayout("Qualisys Track Manager", "a `.tsv`, mm", "`NO_OF_FRAMES` first, then `MARKER_NAMES`",
        _begins("no_of_"), _table(head.qualisys_columns)),
    ObservationLayout("DeepLabCut 3-D, Lightning Pose and EKS (`multicam_3d_results.csv`)", "a `.csv`",
        "rows `scorer`, `bodyparts` and `coords` with z", _is_deeplabcut, _table(head.stacked_columns)),
    ObservationLayout("JARVIS (`data3D.csv`)", "a `.csv`", "names above x, y, z and confidence",
        _in_head(any, lambda cells: {"z"} < {*cells} <= {"x", "y", "z", "confidence"}), _table(head.stacked_columns)),
    ObservationLayout("FreeMoCap (tidy), Caliscope (`xyz_TRACKER.csv`)", "a `.csv`", "columns `frame` or `sync_index`, "
        "`keypoint` or `point_id`, and x, y, z", _in_head(_is_long), _table(head.named_columns)),
    WIDE, *SCENES,
    ObservationLayout("arrays of body-model networks (SMPL, SMPL-X, MHR)", "a `.npy` or `.npz`",
        "shape (frames, joints, 3) or (frames, people, joints, 3)", is_array, _of_each(read_array)))
"""In the order in which they are tried."""
# fmt: on


NOT_READ = unread("joints")
"""Files that are known by name alone."""


def find_layout(sample: Sample) -> JointLayout | None:
    """Return the layout of a file by its content; None if it is of none that is read."""
    return next((layout for layout in LAYOUTS if layout.recognizes(sample)), None)


def read_joint_files(paths: Sequence[Path], unit_m: float | None, rate: float) -> Scenes:
    """Read files of joints in space; several are of one person each, or of one frame each.

    Raises:
        FormatError: one is malformed, or states no unit where none is given.
    """
    first = find_layout(Sample(paths[0]))
    if first in SCENES:
        return read_scenes(paths, unit_m, rate)
    layouts = [(path, find_layout(Sample(path)) or WIDE) for path in paths]
    return [found for path, layout in layouts for found in layout.read([path], unit_m, rate)]


def patch_table(path: Path, unit_m: float | None, changes: Mapping[int, Array]) -> bytes:
    """Return a file with some points replaced, in its unit; all other bytes stay.

    Args:
        path: the file, which has been read before.
        unit_m: metres per unit, if the file states none.
        changes: positions, (n_points, 3), metres, by row, from 0; points of NaN stay.

    Raises:
        FormatError: it is of another layout, or has decimal commas.
    """
    layout, table, patch = find_layout(Sample(path)), read_delimited(path), TextPatch(path.read_bytes())
    columns = named_columns(table) if layout is WIDE else None
    if columns is None or columns.person is not None or (table.separator != "," and "," in patch.text):
        expected = "a table with a row for each frame of one person and points in decimal numbers, the one layout"
        found = layout.program if layout else "another"
        advice = "export the poses as TRC or CSV"
        raise FormatError.mismatch(path, f"{expected} into which points are written back", found, advice)
    (found,) = read_table(named_columns, path, unit_m, 1.0)
    scale = METRES_BY_WORD.get(columns.unit, unit_m)
    assert scale is not None
    at = [i for triple in columns.points.values() for i in triple]
    new = {
        row: {i: float(x / scale) for i, x in zip(at, points.ravel(), strict=True) if not np.isnan(x)}
        for row, points in changes.items()
    }
    patch.replace_cells(table.separator, len(found.frames), new, 7 if scale > 0.1 else 4)
    return patch.encoded()
