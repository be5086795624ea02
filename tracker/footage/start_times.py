"""Clocks that a camera writes into its video: time code, GPS time of GoPro's telemetry, and creation time.

Time codes number pictures (SMPTE ST 12-1). The drop-frame form leaves out numbers, so that it keeps the time of day at
rates of television: 2 of 30 or 4 of 60 at the start of each minute, except each tenth.
GoPro's telemetry is GPMF: nested items of a key, a type, a size and a count, padded to four bytes.
"""

import re
import struct
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import NamedTuple

import av
from av.container import InputContainer

from tracker.errors import RecordingError
from tracker.footage.chapters import chapter_files
from tracker.footage.frame_rates import nominal_rate
from tracker.footage.video_decoder import open_container

TIME_CODE, GPS_TIME, CREATION_TIME = "time code", "GPS time", "creation time"
_GPS9 = struct.Struct(">7i2H")
"""Latitude, longitude, altitude, two speeds, days since 2000, thousandths of a second since midnight, dilution, fix."""


class StartTime(NamedTuple):
    """The time of the first picture of a video, by one of its clocks."""

    source: str
    """One of the names above."""
    text: str
    """As a person reads it: `10:00:00;05`."""
    seconds: float
    """Since midnight by a time code, since 1970 by another clock."""
    step_s: float
    """Resolution, s."""
    period_s: float = float("inf")
    """Time after which the clock begins again, s."""
    may_count_pairs: bool = False
    """Whether a time code may count each two pictures as one, as some cameras do above 30 per second."""


def read_start_times(path: Path, where: str) -> tuple[StartTime, ...]:
    """Read the clocks of a video or of its first chapter; none of images, or of a file that cannot be read.

    Args:
        path: of the footage.
        where: names it in messages.
    """
    try:
        if path.is_dir():
            path = next(iter(chapter_files(path)), path)
        with open_container(path, where) as container:
            rate = float(container.streams.video[0].average_rate or 0) if container.streams.video else 0.0
            found = (_time_code(container, rate), _gps_time(container), _creation_time(container))
    except (av.FFmpegError, RecordingError, OSError):
        return ()
    return tuple(start for start in found if start is not None)


def time_code_frames(text: str, rate: float) -> int | None:
    """Return the number of the picture that a time code names, counted from midnight; None if it names none.

    Args:
        text: `HH:MM:SS:FF`; a semicolon, a comma or a point before the frame marks the drop-frame form.
        rate: at which pictures are counted, 1/s.
    """
    found, whole = (
        re.fullmatch(r"(\d\d):(\d\d):(\d\d)([:;.,])(\d\d)", text.strip(), re.ASCII),
        round(nominal_rate(rate)),
    )
    if found is None:
        return None
    hours, minutes, seconds, frame = (int(found[i]) for i in (1, 2, 3, 5))
    dropped = 0 if found[4] == ":" else whole // 15
    is_left_out = seconds == 0 and minutes % 10 > 0 and frame < dropped
    if hours > 23 or max(minutes, seconds) > 59 or frame >= whole or is_left_out or (dropped and whole % 30):
        return None
    minutes += 60 * hours
    return (60 * minutes + seconds) * whole + frame - dropped * (minutes - minutes // 10)


def _tags(container: InputContainer, name: str) -> Iterator[str]:
    for tags in (container.metadata, *(stream.metadata for stream in container.streams)):
        yield from (value for key, value in tags.items() if key.lower() == name)


def _time_code(container: InputContainer, rate: float) -> StartTime | None:
    for text in _tags(container, "timecode"):
        whole, text = round(nominal_rate(rate)), text.strip()
        frames = time_code_frames(text, rate) if 0 < whole <= 100 else None  # frames have two digits
        last = time_code_frames(f"23:59:59{text[8:9]}{whole - 1:02}", rate)
        if frames is not None and last is not None:
            in_pairs = whole >= 48 and int(text[-2:]) < whole / 2
            return StartTime(TIME_CODE, text, frames / rate, 1 / rate, (last + 1) / rate, in_pairs)
    return None


def _creation_time(container: InputContainer) -> StartTime | None:
    for text in _tags(container, "creation_time"):
        try:
            time = datetime.fromisoformat(text)
        except ValueError:
            continue
        if time.year > 1980:  # a clock that was never set shows the first year of its count
            seconds = time.replace(tzinfo=time.tzinfo or UTC).timestamp()
            return StartTime(CREATION_TIME, text, seconds, 1e-3 if time.microsecond else 1.0)
    return None


def _gps_time(container: InputContainer, at_most_s: float = 20.0) -> StartTime | None:
    """Return the start by the GPS times of GoPro's telemetry; their scatter is its resolution.

    One GPS time comes each second. The first ones may come before the satellites are found.
    """
    times: list[float] = []
    for stream in container.streams.data:
        if stream.metadata.get("handler_name", "").strip("\0 \t\x0b") != "GoPro MET" or stream.time_base is None:
            continue
        for packet in container.demux(stream):
            if packet.pts is None:
                continue
            at_s = float(packet.pts * stream.time_base)
            if at_s > at_most_s:
                break
            times += [time - at_s for time in _gps_times(bytes(packet))][:1]
    if not times:
        return None
    seconds = sorted(times)[len(times) // 2]
    step_s = max(times) - min(times) if len(times) > 1 else 1.0
    return StartTime(GPS_TIME, f"{datetime.fromtimestamp(seconds, UTC):%Y-%m-%d %H:%M:%S.%f}", seconds, step_s)


def _gps_times(data: bytes) -> Iterator[float]:
    """Return the GPS times, s since 1970, in a piece of telemetry whose satellites were found."""
    items = dict(_items(data))
    has_fix = int.from_bytes(items.get(b"GPSF", b"\3")) > 0
    try:
        if has_fix and b"GPSU" in items:
            yield datetime.strptime(items[b"GPSU"].decode("ascii"), "%y%m%d%H%M%S.%f").replace(tzinfo=UTC).timestamp()
        elif b"GPS9" in items:
            *_, days, thousandths, _, fix = _GPS9.unpack_from(items[b"GPS9"])
            if fix:
                yield (datetime(2000, 1, 1, tzinfo=UTC) + timedelta(days, milliseconds=thousandths)).timestamp()
    except (ValueError, OverflowError, struct.error):  # damaged, or another layout
        return


def _items(data: bytes, depth: int = 0) -> Iterator[tuple[bytes, bytes]]:
    """Return the keys and values of GPMF, of nested items theirs; a camera nests two levels."""
    at = 0
    while at + 8 <= len(data):
        key, kind, size, count = struct.unpack_from(">4scBH", data, at)
        value = data[at + 8 : at + 8 + size * count]
        if kind == b"\0" and depth < 4:
            yield from _items(value, depth + 1)
        else:
            yield key, value
        at += 8 + (size * count + 3) // 4 * 4
