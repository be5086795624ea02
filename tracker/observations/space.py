"""Place points in space at the frames of a session, and check them against its cameras."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.formats.file_axes import remap_axes
from tracker.formats.joint_maps import JointMap, guess_joint_map, read_joint_map
from tracker.formats.number_rows import check_size
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array
from tracker.observations.observed import ObservedJoints
from tracker.observations.placing import short_list
from tracker.observations.readers import SPACE_FORMATS
from tracker.observations.request import ImportRequest
from tracker.session.clocks import Placement, place_rows, row_places
from tracker.session.session import Session


class PlacedPoints(NamedTuple):
    """Points in space at the frames of a session."""

    joints: ObservedJoints
    joint_map: JointMap
    row_frames: tuple[Array, ...]
    """Frame of each row of each file, (n_rows,)."""


def read_space(
    session: Session, request: ImportRequest, format_name: str, paths: Sequence[Path]
) -> tuple[PlacedPoints, list[FormatError], list[str]]:
    """Read one file for each person; return the points, what contradicts the session, and notes.

    Raises:
        FormatError: a file is malformed, its rows may lie at several frames, or files have different points.
    """
    given = read_joint_map(request.joint_map) if request.joint_map is not None else None
    declared = tuple({c.declared_fps for c in session.cameras if c.declared_fps is not None})
    known = Placement(session.n_frames, declared, request.first_frame, request.clock)
    tables, notes, problems = list[MarkerTable](), list[str](), list[FormatError]()
    rows = list[Array]()
    for path in paths:
        where = f"{SPACE_FORMATS[format_name].program} file {path}"
        read = remap_axes(SPACE_FORMATS[format_name].read(path, request.unit_m, session.fps), request.axes)
        if tables and tables[0].names != read.names:
            raise FormatError(f"{where}: expected the points of {paths[0].name}, found others; import them apart")
        placed = place_rows(read, where, session.fps, known)
        tables.append(placed)
        notes += [f"{path.name}: {note}" for note in placed.notes]
        is_resampled = len(placed.frames) != len(read.frames)
        rows.append(row_places(read, where, session.fps, known) if is_resampled else placed.frames.astype(np.float64))
        is_chosen = request.first_frame is not None or request.clock is not None
        wrong, gaps = _outside(placed, where, session.n_frames, is_chosen)
        problems += wrong
        notes += [f"{path.name}: {note}" for note in gaps]
    names = tables[0].names
    check_size((session.n_frames, len(tables), len(names), 3), str(paths[0]))
    joints_world = np.full((session.n_frames, len(tables), len(names), 3), np.nan)
    for k, table in enumerate(tables):
        inside = (table.frames >= 0) & (table.frames < session.n_frames)
        joints_world[table.frames[inside], k] = table.points[inside]
    try:
        joint_map = given or guess_joint_map(names, paths[0].name)
    except FormatError as error:
        joint_map = JointMap("unknown", {})
        problems.append(error)
    missing = [m for m in (given.markers.values() if given else ()) if m not in names]
    if missing and given:
        problems.append(
            FormatError(
                f"{paths[0]} has no point '{missing[0]}', which the joint map {given.name} names; expected one of "
                f"{', '.join(names)}"
            )
        )
    problems += _not_seen(joints_world, session)
    return PlacedPoints(ObservedJoints(names, request.people, joints_world), joint_map, tuple(rows)), problems, notes


def _outside(placed: MarkerTable, where: str, n_frames: int, is_chosen: bool) -> tuple[list[FormatError], list[str]]:
    """Return that rows lie outside of the session, unless the user placed them, and which frames have no row."""
    first, last = int(placed.frames[0]), int(placed.frames[-1])
    inside = (placed.frames >= 0) & (placed.frames < n_frames)
    missing = np.setdiff1d(np.arange(n_frames), placed.frames)
    notes = [f"no rows for frames {short_list(missing)}; the points are absent there"] if len(missing) else []
    if inside.all() or (is_chosen and inside.any()):
        left_out = [f"{(~inside).sum()} rows lie outside of the session and were left out"] * (not inside.all())
        return [], notes + left_out
    wrong = f"{where}: expected rows of frames 0 to {n_frames - 1}, found frames {first} to {last}"
    return [FormatError(wrong, Remedy("choose_first_frame", frames="N"))], notes


def _not_seen(joints_world: Array, session: Session) -> list[FormatError]:
    """Return that most points lie in no pictures of two cameras, as in other axes, units or another world."""
    points = joints_world[np.isfinite(joints_world).all(axis=-1)]
    if not len(points):
        return [FormatError("expected points of some frame, found none; check the file")]
    points = points[:: max(1, len(points) // 10_000)]
    n_views = np.zeros(len(points), dtype=np.int64)
    for source in session.cameras:
        px = source.camera.pinhole.project(points)
        known = np.isfinite(px).all(axis=-1)
        n_views[known] += source.camera.is_filmed(px[known])
    seen = n_views >= min(2, len(session.cameras))
    if 2 * seen.sum() >= len(points):
        return []
    middle = ", ".join(f"{x:.2f}" for x in np.median(points, axis=0))
    return [
        FormatError(
            f"expected points that two cameras show, found {seen.mean():.0%} in pictures, around {middle} m",
            Remedy("check_world_of_file"),
        )
    ]
