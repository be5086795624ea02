"""Place the rows of a joint file at frames of a session, by Frame#, Time, DataRate and OrigDataStartFrame.

Files count frames from 0 or from 1, and may begin within the recording. Programs round rates; cut files keep or restart
their numbers and times. A reading on which these agree is taken. A contradiction is refused with its readings,
and `RowPlacement` decides. Rows at another rate are resampled.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal, NamedTuple

import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.footage.frame_rates import DROP, LONG_INTERVAL, RATE_TOLERANCE, nominal_rate, same_clock, usual_rate
from tracker.formats.number_rows import MAX_VALUES
from tracker.formats.trc import MarkerTable
from tracker.geometry.arrays import Array, IntArray
from tracker.validation import MAX_FRAMES

Clock = Literal["frames", "time"]

_BLOCK = 10_000
"""Number of frames that are resampled together. A table of 60,000 frames and 30 points takes 1.7 times the memory of
the result; with half and double the number 1.4 and 2.4 times, all at once 5.1 times."""
AGREE = 0.35
"""Difference of Frame# and Time, frames, at which both still name one frame: less than half, so that counting from 0
and from 1 stay apart. Stamps in hundredths of a second are off by up to 0.3 at 60 per second."""
_ROWS_OF_COARSE_STAMPS = 24
"""Number of rows from which the mean of rounded stamps is as good as exact ones: at 96 per second, the rounding of
hundredths of a second comes back after so many frames."""
_MATTERS = 0.5
"""Difference between two readings, frames of the session, from which they place a row at different frames."""
_NEAR = 0.1
"""Relative difference up to which a file's rate may be the session's, written wrongly: 24 for 25, 30 for 29.5. Marker
systems that are not synchronized with video run at other rates: 100 to 240 per second."""
_EXACT = 1e-3
"""Distance from a whole frame at which a row lies on the frame: times have six digits, rates up to ten."""


class RowPlacement(NamedTuple):
    """Facts and choices that place rows, beside the file's own numbers."""

    n_frames: int | None = None
    """Number of frames of the session; None if unknown."""
    declared_rates: Sequence[float] = ()
    """Rates that the session's videos declare where they are not the session's, 1/s."""
    first_frame: int | None = None
    """Frame of the session at which the first row lies, by the user's choice."""
    clock: Clock | None = None
    """By the user's choice: each Frame# is a frame of the session, or rows lie at their Time."""


def place_rows(table: MarkerTable, where: str, fps: float, known: RowPlacement | None = None) -> MarkerTable:
    """Place the rows of a file at frames of a session; rows at another rate are resampled linearly by time.

    Args:
        table: as the file has it, `frames` being its Frame#.
        where: names the file in messages.
        fps: frame rate of the session, 1/s.
        known: facts of the session and choices of the user.

    Returns:
        The rows with frames of the session, ascending; they may lie outside of it. `notes` says how they were placed.

    Raises:
        FormatError: the file can be read in several ways that matter, or the resampled table would be too large.
    """
    rows = row_places(table, where, fps, known)
    placed, is_chosen = _on_frames(table, rows, fps), known is not None and known.first_frame is not None
    return replace(placed, notes=(*table.notes, *_notes(table, rows, placed, fps, is_chosen)))


def row_places(table: MarkerTable, where: str, fps: float, known: RowPlacement | None = None) -> Array:
    """Return the frame of the session at which each row of a file lies, (n_rows,), fractional at another rate.

    Arguments and errors are those of `place_rows`.
    """
    known = known or RowPlacement()
    if known.clock == "time":
        if not (np.diff(table.times) > 0).all():
            raise FormatError(f"{where}: expected Time that rises from row to row", Remedy("count_frames"))
        if known.first_frame is None and _has_own_clock(table, fps, known.n_frames):
            raise FormatError(
                f"{where}: Time begins at {table.times[0]:.6g} s, beyond the frames of the session",
                Remedy("choose_first_frame", frames="N"),
            )
        start = table.times[0] * fps if known.first_frame is None else known.first_frame
        return start + (table.times - table.times[0]) * fps
    rates = _stamped_rates(table)
    ratio = _frames_per_number(table, where, fps, rates, known)
    start = known.first_frame
    if start is None:
        start = _first_number(table, where, rates, ratio, known.n_frames) * ratio
    return start + ratio * (table.frames - table.frames[0])


def _stamped_rates(table: MarkerTable) -> list[float]:
    """Return the rates, 1/s, that agree with the stamps and with DataRate, best first; stamps that are all equal agree.

    A rate of television may be rounded in DataRate alone. Few or coarse stamps agree with both.
    """
    numbers, seconds = table.frames - table.frames[0], table.times - table.times[0]
    nominal = nominal_rate(table.rate)
    rates = sorted({r for r in (table.rate, nominal, nominal / DROP) if same_clock(r, table.rate)})
    if len(seconds) > 1 and not seconds.any():
        return rates
    apart = {r: float(np.abs(seconds - numbers / r).max()) for r in rates}
    rounding, least = _rounding_s(table), min(apart.values())
    agreeing = [r for r in rates if apart[r] <= least + rounding and (apart[r] - rounding) * r < _MATTERS]
    return sorted(agreeing, key=apart.__getitem__)


def _rounding_s(table: MarkerTable) -> float:
    """Return how far the stamps of a file may be off by rounding or cutting, s."""
    # Doubles of Unix time are exact to 0.2 microseconds.
    seconds = table.times if table.times[0] < MAX_FRAMES else np.round(table.times - table.times[0], 6)
    for digits in (1, 2, 3):
        if np.allclose(seconds, np.round(seconds, digits), rtol=0, atol=1e-7):
            steps = 10**digits / table.rate
            return 0.0 if abs(steps - round(steps)) < 1e-6 * steps else 10.0**-digits
    return 1e-6


def _frames_per_number(
    table: MarkerTable, where: str, fps: float, rates: Sequence[float], known: RowPlacement
) -> float:
    """Return how many frames of the session one step of Frame# is.

    Raises:
        FormatError: DataRate contradicts Time or the footage, and nobody has decided.
    """
    if known.clock == "frames":
        return 1.0
    n, seconds = int(table.frames[-1] - table.frames[0]), float(table.times[-1] - table.times[0])
    if not rates:
        is_counted = same_clock(table.rate, fps) or (seconds > 0 and same_clock(n / seconds, fps))
        if known.first_frame is not None and is_counted:
            return 1.0
        raise FormatError(
            f"{where}: DataRate and Time disagree: {n} frames at DataRate {table.rate:g} last {n / table.rate:.3f} s, "
            f"by Time {seconds:.3f} s",
            _choose_clock(fps),
        )
    ratio = nominal_rate(fps) / nominal_rate(rates[0])
    last = float(table.frames[-1])
    if abs(ratio - 1) <= RATE_TOLERANCE or abs(ratio - 1) * max(abs(last), n) <= _MATTERS:
        return 1.0
    covers_all = known.n_frames is not None and n + 1 == known.n_frames
    leads_beyond = known.n_frames is not None and last <= known.n_frames < last * ratio - 1
    is_declared = any(same_clock(table.rate, declared) for declared in known.declared_rates)
    if not (covers_all or leads_beyond or is_declared or abs(ratio - 1) <= _NEAR):
        return ratio
    if known.first_frame is not None:
        return 1.0
    raise FormatError(
        f"{where}: its {len(table.frames)} rows may be frames of the session at {usual_rate(fps):g} per second, "
        f"or {table.rate:g} per second as its DataRate says",
        _choose_clock(fps),
    )


def _choose_clock(fps: float) -> Remedy:
    return Remedy("choose_clock", fps=f"{fps:.6g}")


def _first_number(table: MarkerTable, where: str, rates: Sequence[float], ratio: float, n_frames: int | None) -> int:
    """Return the number of the first row, counted from 0 in the file's frames.

    Raises:
        FormatError: Frame#, Time and OrigDataStartFrame leave several ways open.
    """
    number, origin = int(table.frames[0]), table.origin
    last = None if n_frames is None else round(n_frames / ratio)
    readings = _numbered(number) if _has_own_clock(table, table.rate, last) else _readings(table, rates)
    if n_frames is not None and readings.keys() == {number, number - 1}:
        # Counted from 0, the last row of a file that counts from 1 lies one frame beyond the footage.
        span = int(table.frames[-1]) - number
        inside = {at: words for at, words in readings.items() if (at + span) * ratio <= n_frames - 1 + _EXACT}
        readings = inside if len(inside) == 1 else readings
    elif n_frames is not None and readings.keys() == {number} and number > 0 and int(table.frames[-1]) == n_frames:
        readings[number - 1] = f"Frame# {number} and Time count from 1, since the last row lies beyond the footage"
    chosen = next(iter(readings))
    if len(readings) == 1 and origin is not None and origin > number and origin not in (chosen, chosen + 1):
        readings[origin] = f"OrigDataStartFrame {origin}"
    frames = {at: round(at * ratio) for at in readings}
    if len(set(frames.values())) == 1:
        return chosen
    listed = " or ".join(f"frame {frames[at]} ({words})" for at, words in readings.items())
    raise FormatError(
        f"{where}: its first row may be {listed}, counted from 0 as in the page",
        Remedy("choose_first_frame", frames=" or ".join(str(frames[at]) for at in readings)),
    )


def _has_own_clock(table: MarkerTable, rate: float, n_frames: int | None) -> bool:
    """Return whether Time counts from elsewhere, such as Unix time or that of day: beyond all frames, unlike Frame#."""
    start = float(table.times[0]) * rate
    is_beyond = start > (MAX_FRAMES if n_frames is None else n_frames)
    return is_beyond and abs(start - table.frames[0]) > 1 + _MATTERS


def _numbered(number: int) -> dict[int, str]:
    """Return the numbers that the first row may have, counted from 0, by its Frame# alone; files begin at 0 or 1."""
    if number in (0, 1):
        return {0: f"Frame# {number}"}
    return {number: f"Frame# {number}, counted from 0", number - 1: f"Frame# {number}, counted from 1"}


def _readings(table: MarkerTable, rates: Sequence[float]) -> dict[int, str]:
    """Return the numbers that the first row may have, counted from 0 in the file's frames, and why."""
    number, time_s, origin = int(table.frames[0]), float(table.times[0]), table.origin
    stamps = f"Time {time_s:.6g} s"
    seconds = float(table.times[-1] - time_s)
    if not rates and seconds > 0:  # the stamps may be right among themselves
        rates = [float(table.frames[-1] - number) / seconds]
    if not rates or (len(table.times) > 1 and seconds == 0):
        by_number = {number: f"Frame# {number}, counted from 0", number - 1: f"Frame# {number}, counted from 1"}
        by_number = by_number if number else {0: "Frame# 0"}
        return by_number if time_s == 0 else {round(time_s * table.rate): stamps} | by_number
    # The mean over many rows has less of the rounding than the first stamp.
    by_time = [float((table.times * rate - (table.frames - number)).mean()) for rate in rates]
    rounding = _rounding_s(table) * rates[0]
    is_coarse = rounding > AGREE and len(table.times) < _ROWS_OF_COARSE_STAMPS
    agree = AGREE + rounding * is_coarse
    by_second = {round(by_time[0]): stamps} if is_coarse else {}
    if any(abs(number - 1 - at) <= agree for at in by_time):
        by_second[number - 1] = f"Frame# {number}, counted from 1, and {stamps}"
    if any(abs(number - at) <= agree for at in by_time):
        by_second[number] = f"Frame# {number} and {stamps}, counted from 0"
        # Files that are counted from 1 in both are common; OrigDataStartFrame tells how a cut file counts.
        if number == 1 or (number > 1 and origin not in (None, 0, number)):
            by_second[number - 1] = f"Frame# {number} and {stamps}, counted from 1"
    if by_second.keys() & {number, number - 1}:
        return by_second
    return {number: f"Frame# {number}", round(by_time[0]): stamps}


def _on_frames(table: MarkerTable, rows: Array, fps: float) -> MarkerTable:
    """Return a table of whole frames; `rows` has the frame of each row, fractional, (n,).

    A position is missing in the gaps between rows, and where it is missing in either of the two rows around it.

    Raises:
        FormatError: the resampled table would be too large.
    """
    whole = np.round(rows).astype(np.int64)
    if np.abs(rows - whole).max() <= _EXACT and (len(rows) < 2 or np.diff(whole).min() > 0):
        is_finer = len(rows) > 1 and round(float(np.diff(table.frames).min())) < np.diff(whole).min()
        if not is_finer:
            return replace(table, frames=whole, times=whole / fps, rate=fps)
    first, last = int(np.ceil(rows[0] - _EXACT)), int(np.floor(rows[-1] + _EXACT))
    n_frames = last - first + 1
    if n_frames * table.points[0].size > MAX_VALUES:
        raise FormatError(
            f"expected at most {MAX_VALUES} values at {fps:g} frames per second, found {n_frames} frames of "
            f"{len(table.names)} points; correct the file's DataRate, or cut it to the frames to compare"
        )
    if n_frames < 1:
        raise FormatError(f"expected rows at frames of the session, found all between frames {last} and {first}")
    frames, points = np.arange(first, last + 1), np.empty((n_frames, *table.points.shape[1:]))
    for start in range(0, n_frames, _BLOCK):
        block = slice(start, start + _BLOCK)
        points[block] = _interpolated(rows, table.points, frames[block])
    return replace(table, frames=frames, times=frames / fps, points=points, rate=fps)


def _interpolated(rows: Array, points: Array, frames: IntArray) -> Array:
    """Interpolate points, (n, m, 3), that belong to fractional frames `rows`, (n,), to whole frames, (k, m, 3)."""
    after = np.clip(np.searchsorted(rows, frames - _EXACT), 1, len(rows) - 1) if len(rows) > 1 else 0 * frames
    before = np.maximum(after - 1, 0)
    span = np.maximum(rows[after] - rows[before], 1e-12)
    weight = np.clip((frames - rows[before]) / span, 0.0, 1.0)
    weight[np.abs(frames - rows[before]) <= _EXACT] = 0.0
    weight[np.abs(frames - rows[after]) <= _EXACT] = 1.0
    usual = float(np.median(np.diff(rows))) if len(rows) > 1 else 1.0
    is_gap = (span > LONG_INTERVAL * usual) & (weight > 0) & (weight < 1)
    weight, first, second = weight[:, None, None], points[before], points[after]
    times = np.where(weight <= 0, first, np.where(weight >= 1, second, first + weight * (second - first)))
    times[is_gap] = np.nan
    return np.asarray(times)


def _notes(table: MarkerTable, rows: Array, placed: MarkerTable, fps: float, is_chosen: bool) -> tuple[str, ...]:
    """Say how rows were placed where it is not one row for each frame from 0 on at the session's rate."""
    notes = []
    number, time_s, first = int(table.frames[0]), float(table.times[0]), float(rows[0])
    begins_at_0 = first == 0 and (time_s == 0 or (number == 0 and abs(time_s) * fps <= 1 + AGREE))
    if is_chosen or not begins_at_0:
        notes.append(f"the first row of the file, Frame# {number} at {time_s:.3f} s, is frame {first:.6g}")
    if placed.points is not table.points:
        notes.append(f"the file was resampled from {table.rate:.6g} to {fps:.6g} frames per second")
    elif abs(table.rate / fps - 1) > RATE_TOLERANCE:
        notes.append(f"its DataRate, {table.rate:.6g}, was taken for the session's {fps:.6g}: each row is a frame")
    return tuple(notes)


def listed_frames(frames: Sequence[int]) -> str:
    """List frames as ranges: `3, 10 to 19`."""
    numbers = np.asarray(frames)
    runs = np.split(numbers, np.flatnonzero(np.diff(numbers) != 1) + 1)
    return ", ".join(f"{run[0]}" if len(run) == 1 else f"{run[0]} to {run[-1]}" for run in runs)
