"""Place the pictures of a file, by their numbers, and points in space at frames of a session."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tracker.errors import FormatError, Remedy, SessionError
from tracker.formats.joint_maps import JointMap, guess_joint_map, joint_map_of_size, read_joint_map
from tracker.formats.joint_tables.layouts import by_subject
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.formats.number_rows import check_size
from tracker.formats.trc import MarkerTable, remap_axes
from tracker.geometry.arrays import Array, IntArray
from tracker.interchange.observations.observed import ObservedJoints
from tracker.interchange.observations.plans import ImportRequest
from tracker.interchange.observations.readers import SPACE_FORMATS
from tracker.session.row_placement import RowPlacement, listed_frames, place_rows, row_places
from tracker.session.session import Session
from tracker.validation import nfc_name


def place_pictures(
    tables: Mapping[str, PictureTable],
    session: Session,
    first_frame: int | None,
    late: Mapping[str, int],
    absent: str = "the points are absent there",
) -> tuple[dict[str, IntArray], list[FormatError], list[str]]:
    """Return the frame of the session of each picture by camera, what contradicts the session, and notes.

    A number counts the pictures of the footage, from 0 or from 1; the offset of a camera is taken off. Points that a
    person set may be in some pictures alone. With
    `first_frame`, the lowest number of all cameras is that frame of the session, and equal numbers are one instant.

    Args:
        tables: key points by camera, or pictures without any.
        session: its cameras and number of frames.
        first_frame: the user's choice; None for none.
        late: frames by which the key points of a camera are late, by name; the user's choice.
        absent: consequence of a picture that is missing, for the note.

    Raises:
        FormatError: `late` names another camera.
    """
    if unknown := [name for name in late if name not in session.camera_names]:
        known = ", ".join(session.camera_names)
        raise FormatError(f"expected offsets of the cameras {known}, found one of '{unknown[0]}'; correct the name")
    offsets = {c.camera.name: c.offset for c in session.cameras}
    lowest = min((int(t.numbers[0]) for t in tables.values() if len(t.numbers)), default=0)
    problems: list[FormatError] = []
    notes: list[str] = []
    if first_frame is not None:
        frames = {name: table.numbers - lowest + first_frame for name, table in tables.items()}
        notes.append(f"picture {lowest} of the files was placed at frame {first_frame}, as chosen")
        labels = {name: table for name, table in tables.items() if table.is_by_hand}
        if labels and lowest != first_frame and not _wrong_lengths(labels, session, 0):
            notes[-1] += ", though the numbers of the labels are those of the footage"
    else:
        base = _base(tables, session, lowest)
        if base:
            notes.append("the files count pictures from 1: number 1 is the first picture of the footage")
        elif any(table.is_by_hand for table in tables.values()):
            notes.append("labels were placed by the numbers of their pictures, of which 0 is the first of the footage")
        frames = {name: table.numbers - base - offsets[name] for name, table in tables.items()}
        problems += _wrong_lengths(tables, session, base)
    frames = {name: placed - late.get(name, 0) for name, placed in frames.items()}
    notes += [f"camera '{name}': {n} frames were taken off, as chosen" for name, n in late.items() if n]
    for name, placed in frames.items():
        inside = (placed >= 0) & (placed < session.n_frames)
        span = np.setdiff1d(np.arange(placed[0], placed[-1] + 1), placed) if len(placed) else placed
        missing = span[(span >= 0) & (span < session.n_frames)]
        if len(missing):
            notes.append(f"camera '{name}': no picture for frames {short_list(missing)}; {absent}")
        if (first_frame is not None or late.get(name)) and not inside.all():
            notes.append(f"camera '{name}': {(~inside).sum()} pictures lie outside of the session and were left out")
        if not inside.any():
            expected = f"pictures of frames 0 to {session.n_frames - 1}"
            problems.append(FormatError.mismatch(f"camera '{name}'", expected, "none", Remedy("place_first_picture")))
    return frames, problems, notes


def rescaled(points_px: Array, given: tuple[int, int], wanted: tuple[int, int]) -> Array:
    """Return points, (..., 2), of pictures of one size, px, in the pixels of another; a size of 1, 1 is normalized.

    Pixel borders stay aligned, as in OpenCV's resize; normalized points count from the border.
    """
    borders = [0.0 if size == (1, 1) else 0.5 for size in (given, wanted)]
    return np.asarray((points_px + borders[0]) * (np.array(wanted) / np.array(given)) - borders[1])


def _base(tables: Mapping[str, PictureTable], session: Session, lowest: int) -> int:
    """Return the number of the first picture of the footage, 0 or 1: 1 if the last number lies beyond it otherwise."""
    if lowest != 1:
        return 0
    lengths = footage_lengths(session)
    return int(any(len(t.numbers) and int(t.numbers[-1]) == lengths[name] for name, t in tables.items()))


def footage_lengths(session: Session) -> dict[str, int]:
    """Return the number of pictures of each camera's footage."""
    return {
        c.camera.name: c.footage_frames if c.footage_frames is not None else session.n_frames + c.offset
        for c in session.cameras
    }


def _wrong_lengths(tables: Mapping[str, PictureTable], session: Session, base: int) -> list[FormatError]:
    """Return what contradicts the length of the footage: numbers from `base` on, one for each picture, are expected."""
    lengths, problems = footage_lengths(session), []
    for name, table in tables.items():
        first, last = (int(table.numbers[0]), int(table.numbers[-1])) if len(table.numbers) else (0, -1)
        end = base + lengths[name] - 1
        if (first, last) == (base, end) or ((table.is_by_hand or table.is_of_video) and base <= first <= last <= end):
            continue
        expected = f"the {lengths[name]} pictures of the footage, numbers {base} to {base + lengths[name] - 1}"
        found = f"numbers {first} to {last} ({len(table.numbers)} pictures)"
        problems.append(FormatError.mismatch(f"camera '{name}'", expected, found, Remedy("place_first_picture")))
    return problems


def short_list(frames: IntArray) -> str:
    """List frames as ranges, the first few of many."""
    text = listed_frames(frames.tolist())
    return text if len(text) <= 60 else f"{text[:57]}..."


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
    known = RowPlacement(session.n_frames, declared, request.first_frame, request.clock)
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
    names = [nfc_name(table.person).casefold() for _, table in found]
    wanted = [nfc_name(person).casefold() for person in request.people]
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
