"""Place the pictures of a file at frames of a session, by their numbers."""

from collections.abc import Mapping

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.footage.frame_rates import same_clock
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.geometry.arrays import Array, IntArray
from tracker.session.clocks import listed_frames
from tracker.session.session import Session


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
    for name, table in tables.items():
        if table.rate is not None and not same_clock(table.rate, session.fps):
            wanted = f"pictures at the {session.fps:g} per second of the session"
            found = f"{table.rate:g} per second in the file"
            here = f"camera '{name}'"
            problems.append(FormatError.mismatch(here, wanted, found, Remedy("export_at_rate", fps=f"{session.fps:g}")))
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
