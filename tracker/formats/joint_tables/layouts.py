"""The table of all layouts of joints in space that are known, and how tables are read and points replaced in one.

Tables have rows of each frame, or of each point of a frame; people in columns, in rows or alone.
`docs/log/observations.md` lists the layouts.
"""

from array import array
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.formats.joint_tables import columns as head
from tracker.formats.joint_tables.columns import Columns, ColumnsOf, named_columns
from tracker.formats.joint_tables.scenes import Scenes, is_array, is_easymocap, is_panoptic, read_array, read_scenes
from tracker.formats.number_rows import MAX_NAMES, MAX_TIME, Delimited, NumberRows, check_size, read_delimited
from tracker.formats.observation_layout import ObservationLayout, Sample, unread
from tracker.formats.text_files import LOST
from tracker.formats.text_patch import TextPatch
from tracker.formats.trc import MarkerTable, mask_missing, stated_rate
from tracker.geometry.arrays import Array, IntArray
from tracker.geometry.lengths import METRES_BY_WORD
from tracker.validation import MAX_NUMBER, quoted

Series: TypeAlias = Mapping[str, tuple[IntArray, int]]
"""Rows and number of the coordinates of each point of a person, by name."""


class _Rows(NamedTuple):
    """The rows of a table."""

    numbers: NumberRows
    """Frame, perhaps time, and the coordinates of all points."""
    keys: list[tuple[str, ...]]
    """Cells that name person, point and groups; each once."""
    key_of: IntArray
    """Number of the key of each row, (n,)."""


def read_table(columns_of: ColumnsOf, path: Path, unit_m: float | None, rate: float) -> list[MarkerTable]:
    """Read the points of the people of a table.

    Args:
        columns_of: takes the header of the program that wrote it.
        path: the file.
        unit_m: metres per unit, if the file states none.
        rate: rows per second, if the file states none.

    Raises:
        FormatError: the file is malformed, or its unit is unknown.
    """
    table = read_delimited(path)
    columns, where = columns_of(table), table.where
    scale = METRES_BY_WORD.get(columns.unit.lower(), unit_m)
    if scale is None:
        raise FormatError(f"{where}: expected a unit in the names, found none", Remedy("say_unit"))
    rows = _read_rows(table, columns)
    is_keyed = columns.person is not None or columns.name is not None
    limits = {2: MAX_TIME} if columns.time is not None else {}
    frames, values = (rows.numbers.numbers if is_keyed else rows.numbers.table)(MAX_NUMBER, limits)
    frames, times = frames - columns.first, values[:, 0] if limits else np.full(len(frames), np.nan)
    if is_keyed and columns.frame is None:
        if np.isnan(times).any():
            raise FormatError(f"{where}: expected a column of frames, such as 'frame', found none; export it with one")
        frames = np.unique(times, return_inverse=True)[1].astype(np.int64)
    points = scale * values[:, len(limits) :].reshape(len(frames), len(columns.points), 3)
    notes, stated = (*columns.notes, *mask_missing(points)), stated_rate(columns.rate)
    tables, people = list[MarkerTable](), _people(rows, columns)
    for person, series in people.items():
        numbers, first, placed = frames, np.arange(len(frames)), points
        if is_keyed or len(people) > 1:
            numbers, first, placed = _placed(series, frames, points, rows.numbers)
        stamps, found = _timed(numbers, times[first], columns.second, stated or rate, where)
        tables.append(MarkerTable(tuple(series), numbers, stamps, placed, stated or found, None, notes, person))
    return tables


def _read_rows(table: Delimited, columns: Columns) -> _Rows:
    named = [i for i in (columns.person, columns.name, *columns.groups) if i is not None]
    chosen = [*([] if columns.time is None else [columns.time]), *chain(*columns.points.values())]
    last, is_comma = max(*chosen, *named, columns.frame or 0), table.separator == ","
    rows = NumberRows(table.where, ",", 1 + len(chosen), n_required=1)
    keys: dict[tuple[str, ...], int] = {}
    key_of, marks, n = array("q"), set[str](), -1
    for line, cells in chain([] if columns.begun is None else [columns.begun], table.rows):
        if not any(cells):
            if columns.ends_blank:
                break
            n += bool(cells)  # a row of separators is a frame without points
            continue
        n += 1
        place = f"{table.where}, line {line}"
        if len(cells) != (columns.n_columns or len(cells)):
            raise FormatError(f"{place}: expected {columns.n_columns} columns, found {len(cells)}; export it again")
        cells += [""] * (last + 1 - len(cells))
        key_of.append(keys.setdefault(tuple(cells[i] for i in named), len(keys)))
        numbers = [str(n) if columns.frame is None else cells[columns.frame], *(cells[i] for i in chosen)]
        if not is_comma:
            marks |= {",", "."} & {*"".join(numbers)}
            numbers = [cell.replace(",", ".") for cell in numbers]
        if len(marks) > 1:
            raise FormatError(f"{place}: expected points or commas in decimal numbers, found both; keep one of them")
        if len(keys) > MAX_NAMES:
            raise FormatError(f"{place}: expected at most {MAX_NAMES} points of people, found more; export fewer")
        rows.add_cells(numbers, line)
    return _Rows(rows, [*keys], np.frombuffer(key_of, dtype=np.int64))


def _people(rows: _Rows, columns: Columns) -> Mapping[str, Series]:
    """Return the points of each person; a name of several groups is named after all but the first.

    Raises:
        FormatError: a point has no name, or one of another encoding.
    """
    order = np.argsort(rows.key_of, kind="stable")
    ends = np.searchsorted(rows.key_of[order], np.arange(len(rows.keys) + 1))
    people: dict[str, dict[str, tuple[IntArray, int]]] = {}
    for i, key in enumerate(rows.keys):
        cells = iter(key)
        who, point = (next(cells) if column is not None else "" for column in (columns.person, columns.name))
        for number, (own_who, own_point) in enumerate(columns.points):
            series, name = people.setdefault(who or own_who, {}), point or own_point
            if name in series:
                name = ".".join([*cells, name])
            if not name or LOST in who + name:
                place = rows.numbers.place(int(order[ends[i]]))
                raise FormatError(f"{place}: expected the name of a point in UTF-8, found {quoted(name)}; name it")
            series[name] = order[ends[i] : ends[i + 1]], number
    return people


def _placed(series: Series, frames: IntArray, points: Array, numbers: NumberRows) -> tuple[IntArray, IntArray, Array]:
    """Return the frames of a person, the first row of each, and the points, (n_frames, n_points, 3); NaN where absent.

    Raises:
        FormatError: two rows are of one point and frame, or the person has too many values.
    """
    rows = np.unique(np.concatenate([*{id(at): at for at, _ in series.values()}.values()]))
    found, first = np.unique(frames[rows], return_index=True)
    check_size((len(found), len(series), 3), "the table")
    out = np.full((len(found), len(series), 3), np.nan)
    for i, (name, (at, number)) in enumerate(series.items()):
        _, once = np.unique(frames[at], return_index=True)
        if len(once) < len(at):
            row = int(np.setdiff1d(at, at[once])[0])
            expected = f"one row of {quoted(name)} in each frame"
            advice = "tell people apart by a column 'person'"
            raise FormatError.mismatch(numbers.place(row), expected, f"two in frame {frames[row]}", advice)
        out[np.searchsorted(found, frames[at]), i] = points[at, number]
    return found, rows[first], out


def _timed(frames: IntArray, times: Array, second: float | None, rate: float, where: str) -> tuple[Array, float]:
    """Return times of rows, s, and rows per second; those of `rate` if there are no times.

    Unix time in milliseconds and below is known by its size: in seconds it is some 1e9.

    Raises:
        FormatError: some rows have a time and some have none, or times rise by more than a second from frame to frame.
    """
    if np.isnan(times).all():
        return frames / rate, rate
    if np.isnan(times).any():
        raise FormatError(f"{where}: expected a time in each row, found rows without one; leave the column empty")
    power = next((k for k in (3, 2, 1) if np.abs(times).max() > 10 ** (8 + 3 * k)), 0)
    times = times * (second or 1000**-power)
    spans = np.diff(times) / np.diff(frames)
    if not len(spans) or not (spans > 0).all():
        return times, rate
    step, mean = float(np.median(spans)), float(times[-1] - times[0]) / int(frames[-1] - frames[0])
    if step > 1:
        found = f"steps of {step:g} from frame to frame"
        raise FormatError.mismatch(where, "times in seconds", found, "name their unit, such as time_ms")
    return times, 1 / (mean if abs(mean / step - 1) < 0.01 else step)  # the mean is exact, but of a gap in the times


def by_subject(table: MarkerTable, kept: Sequence[str] = ()) -> list[MarkerTable]:
    """Return a table for each subject, with names without prefixes; all in one if no two subjects have equal names.

    Args:
        table: the points of a file.
        kept: names that are asked for as they stand.
    """
    groups: dict[str, list[int]] = {}
    for i, name in enumerate(table.names):
        groups.setdefault(name.rpartition(":")[0], []).append(i)
    subjects = {prefix: columns for prefix, columns in groups.items() if prefix}
    if table.person or not subjects or any(name in kept for name in table.names):
        return [table]
    plain = [name.rpartition(":")[2] for name in table.names]
    largest = max(subjects, key=lambda prefix: len(subjects[prefix]))
    own = {plain[i] for i in subjects[largest]}
    people = [p for p, columns in subjects.items() if p == largest or own & {plain[i] for i in columns}]
    if len(people) == 1:
        names = [plain[i] if i in subjects[largest] else name for i, name in enumerate(table.names)]
        is_once = len(set(names)) == len(names)
        return [replace(table, names=tuple(names), person=largest) if is_once else table]
    rest = [table.names[columns[0]] for prefix, columns in groups.items() if prefix not in people]
    notes = (f"points of no person, such as {rest[0]}, are left out",) if rest else ()
    table = replace(table, notes=(*table.notes, *notes))
    parts = [(person, subjects[person]) for person in people]
    return [
        replace(table, names=tuple(plain[i] for i in own), points=table.points[:, own], person=person)
        for person, own in parts
    ]


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
