"""Place points in space at the frames of a session."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.errors import FormatError, Remedy, SessionError
from tracker.formats.joint_maps import JointMap, guess_joint_map, joint_map_of_size, read_joint_map
from tracker.formats.joint_tables.table_reading import by_subject
from tracker.formats.number_rows import check_size
from tracker.formats.trc import MarkerTable, remap_axes
from tracker.geometry.arrays import Array
from tracker.interchange.observations.observed import ObservedJoints
from tracker.interchange.observations.placing import short_list
from tracker.interchange.observations.plans import ImportRequest
from tracker.interchange.observations.readers import SPACE_FORMATS
from tracker.session.clocks import Placement, place_rows, row_places
from tracker.session.session import Session
from tracker.validation import same_form


class PlacedPoints(NamedTuple):
    """Points in space at the frames of a session."""

    joints: ObservedJoints
    joint_map: JointMap
    row_frames: tuple[Array, ...]
    """Frame of each row of each person, (n_rows,)."""
    places: tuple[Path, ...]
    """File or folder of each person."""


def read_space(
    session: Session, request: ImportRequest, format_name: str, paths: Sequence[Path]
) -> tuple[PlacedPoints, list[FormatError], list[str]]:
    """Read the points of each person; return them, what contradicts the session, and notes.

    Raises:
        FormatError: a file is malformed, its rows may lie at several frames, or files have different points.
    """
    given = read_joint_map(request.joint_map) if request.joint_map is not None else None
    read, notes = _of_people(session, request, format_name, paths, given)
    declared = tuple({c.declared_fps for c in session.cameras if c.declared_fps is not None})
    known = Placement(session.n_frames, declared, request.first_frame, request.clock)
    problems, rows, tables = list[FormatError](), list[Array](), list[MarkerTable]()
    for path, table in read:
        where = f"{SPACE_FORMATS[format_name].program} file {path}"
        turned = remap_axes(table, request.axes, may_mirror=True)
        placed = place_rows(turned, where, session.fps, known)
        tables.append(placed)
        is_resampled = len(placed.frames) != len(turned.frames)
        rows.append(row_places(turned, where, session.fps, known) if is_resampled else placed.frames.astype(np.float64))
        is_chosen = request.first_frame is not None or request.clock is not None
        wrong, gaps = _outside(placed, where, session.n_frames, is_chosen)
        problems += wrong
        notes += [f"{path.name}: {note}" for note in (*placed.notes, *gaps)]
    names, joints_world = _assembled(tables, session.n_frames, str(paths[0]))
    try:
        names, joint_map = name_points(names, given, paths[0].name)
    except FormatError as error:
        joint_map = JointMap("unknown", {})
        problems.append(error)
    problems += given.missing(names, f"{paths[0]} has no point") if given else []
    if not np.isfinite(joints_world).all(axis=-1).any():
        problems.append(FormatError("expected points of some frame, found none; check the file"))
    joints = ObservedJoints(names, request.people, joints_world)
    found = PlacedPoints(joints, joint_map, tuple(rows), tuple(path for path, _ in read))
    return found, problems, [*dict.fromkeys(notes)]


def _of_people(
    session: Session, request: ImportRequest, format_name: str, paths: Sequence[Path], given: JointMap | None
) -> tuple[list[tuple[Path, MarkerTable]], list[str]]:
    """Return the points of each person of the request, with their file, and notes: by name, else in order.

    Raises:
        FormatError: a file is malformed, or two files have different points.
        SessionError: there are other people.
    """
    asked = tuple(given.markers.values()) if given else ()
    found = SPACE_FORMATS[format_name].read(paths, request.unit_m, session.fps)
    found = [(path, own) for path, table in found for own in by_subject(table, asked)]
    names = [same_form(table.person).casefold() for _, table in found]
    wanted = [same_form(person).casefold() for person in request.people]
    notes = []
    is_named = len({*names}) == len(names)
    if is_named and {*wanted} <= {*names}:
        left_out = [table.person for (_, table), name in zip(found, names, strict=True) if name not in wanted]
        notes = [f"the points of {', '.join(left_out)} are left out"] * bool(left_out)
        found = [found[names.index(name)] for name in wanted]
    elif len(found) != len(wanted):
        listed = f" people ({', '.join(table.person for _, table in found)[:60]})" if any(names) else ""
        problem = (
            f"expected one file of points in space for each person ({', '.join(request.people)}), found {len(found)}"
            f"{listed} in {paths[0].name if len(paths) == 1 else f'{len(paths)} files'}"
        )
        if len(found) > len(session.people):
            raise SessionError(f"{problem}; make a session of as many people, or export one person alone")
        raise SessionError(problem, Remedy("name_people_of_files"))
    else:
        free = [i for i, name in enumerate(names) if not (is_named and name in wanted)]
        order = [names.index(name) if is_named and name in names else free.pop(0) for name in wanted]
        others = [(found[i], person) for i, person in zip(order, request.people, strict=True) if names[i] not in wanted]
        notes = [f"{path.name}: {table.person} is taken for {p}" for (path, table), p in others if table.person]
        found = [found[i] for i in order]
    first_path, first = found[0]
    for path, table in found:
        if path != first_path and table.names != first.names:
            raise FormatError(f"{path}: expected the points of {first_path.name}, found others; import them apart")
    return found, notes


def _assembled(tables: Sequence[MarkerTable], n_frames: int, source: str) -> tuple[tuple[str, ...], Array]:
    """Return the names of the points, those that are numbers in their order, and the points of all people by frame."""
    names = [*dict.fromkeys(name for table in tables for name in table.names)]
    if all(re.fullmatch("0|[1-9][0-9]{0,2}", name) for name in names):
        numbers = sorted(map(int, names))
        # Caliscope numbers hands and faces from 100, 200 and so on; other points that are missing are filled in.
        body = numbers if 99 in numbers else [n for n in numbers if n < 100] or numbers
        names = [*map(str, [*range(1 + body[-1]), *numbers[len(body) :]])]
    check_size((n_frames, len(tables), len(names), 3), source)
    joints_world = np.full((n_frames, len(tables), len(names), 3), np.nan)
    for k, table in enumerate(tables):
        inside = (table.frames >= 0) & (table.frames < n_frames)
        columns = [names.index(name) for name in table.names]
        joints_world[table.frames[inside, None], k, columns] = table.points[inside]
    return tuple(names), joints_world


def name_points(names: tuple[str, ...], given: JointMap | None, source: str) -> tuple[tuple[str, ...], JointMap]:
    """Return the names of the points and their convention; points that are numbered from 0 are known by their number.

    Raises:
        FormatError: no convention is known.
    """
    if names[:1] != ("0",) or not all(map(str.isdecimal, names)):
        return names, given or guess_joint_map(names, source)
    n_body = next((k for k, name in enumerate(names) if name != str(k)), len(names))
    if n_body in (75, 543, 553):  # MediaPipe's body, before hands and perhaps a face of 468 or 478 points
        n_body = 33
    found = given if given is not None and given.points else joint_map_of_size(n_body, source)
    n_named = len(found.points)
    return (found.points + names[n_named:] if n_named in (n_body, len(names)) else names), given or found


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
