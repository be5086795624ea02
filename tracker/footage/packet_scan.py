"""List the frames of a video from its packets, a hundred times faster than decoding."""

import time
from collections.abc import Callable
from typing import NamedTuple

import av
import numpy as np
from av.container import InputContainer
from av.video.frame import VideoFrame
from av.video.stream import VideoStream

from tracker.errors import RecordingError
from tracker.footage.frame_index import Index
from tracker.footage.frame_rates import LONG_INTERVAL
from tracker.footage.video_decoder import VideoDecoder

_CHECKED_FRAMES = 16
"""Number of frames whose time stamps are compared with the decoder's, enough for any order of B-frames to show."""
_RATE_JITTER = 0.2
"""The rate is variable if intervals between frames differ by more than this share of the median interval."""
_EVERY_PACKETS = 4000
"""Number of packets between two reports."""
_BREATH_PACKETS = 100
"""Number of packets after which other threads get a turn: the page's requests need the same interpreter."""
_BREATH_S = 0.0005
"""Length of such a turn, s; one that waits for the interpreter takes it at once."""


class PacketScan(NamedTuple):
    """The progress of listing a video."""

    frames: Index
    """The frames listed: all that are shown up to the last of them, so that their numbers are final."""
    share: float
    """Share of the file that has been read, 0 to 1."""


class TimeStamps(NamedTuple):
    """Start and regularity of the time stamps of a video."""

    start_s: float
    """Stamp of the first frame, s."""
    jitter: float
    """Largest distance of a stamp from the straight line through all, as a share of the interval between frames; 0
    where it is below a tick."""
    n_gaps: int
    """Number of intervals in which a frame may be missing: those longer than `LONG_INTERVAL`."""
    usual_rate: float
    """Frame rate without these gaps, 1/s; 0 of fewer than three frames."""


def list_frames(container: InputContainer, where: str, report: Callable[[PacketScan], None] | None = None) -> Index:
    """List the frames of the first video stream.

    A packet holds no frame that is shown before its decoding time, and packets come in decoding order. All frames shown
    before the current packet's decoding time are therefore known, and are reported on the way.

    Args:
        container: of the video, at its beginning.
        where: names the video in messages.
        report: called regularly with the progress; an exception that it raises ends the listing.

    Raises:
        RecordingError: the video is truncated, or has no usable time stamps.
        av.FFmpegError: it cannot be read.
    """
    stream = container.streams.video[0]
    position: dict[int, int] = {}
    shown: list[int] = []
    keys: list[int] = []
    end, count, damaged = 0, 0, False
    for packet in container.demux(stream):
        if not packet.size:
            continue
        if packet.pts is None:
            raise RecordingError(f"{where} has frames without time stamps, so they cannot be found; convert it to MP4")
        if packet.is_keyframe:
            keys.append(packet.pts)
        position[packet.pts] = count
        count += 1
        # Frames cut off by an edit list are needed to decode others, but never shown. Frames before the first key
        # frame, in the order of the file or of display, are not shown either: they depend on missing frames.
        if keys and not packet.is_discard and packet.pts >= keys[0]:
            shown.append(packet.pts)
        end = max(end, packet.pts + (packet.duration or 0))
        damaged = damaged or packet.is_corrupt
        if report and count % _BREATH_PACKETS == 0:
            time.sleep(_BREATH_S)
        if report and count % _EVERY_PACKETS == 0 and packet.dts is not None:
            share = 0.0 if packet.pos is None else packet.pos / max(1, container.size)
            report(PacketScan(_sorted(shown, keys, position, packet.dts), min(share, 1.0)))
    index = _sorted(shown, keys, position, None)
    if not len(index.pts):
        raise RecordingError(f"{where} has no frames; record or convert it again")
    if len(np.unique(index.pts)) != len(index.pts):
        raise RecordingError(f"{where} has frames with the same time stamp; convert it to MP4")
    if damaged or _promises_more(container, stream, end):
        raise RecordingError(
            f"{where} is truncated: its header promises more than the {len(index.pts)} frames that it holds; "
            "copy or convert it again"
        )
    return index


def check_order(index: Index, decoder: VideoDecoder, where: str) -> VideoFrame:
    """Check that a decoder shows the first frames in the order of their time stamps; return the first.

    A stream without B-frames keeps the order of its packets: there the first frame is enough.

    Args:
        index: of the video, not empty.
        decoder: of the video, at its beginning.
        where: names the video in messages.

    Raises:
        RecordingError: the order differs.
    """
    first = None
    for expected in index.pts[: _CHECKED_FRAMES if decoder.has_b_frames else 1]:
        frame = next(decoder.frames, None)
        if frame is None or frame.pts != expected:
            raise RecordingError(
                f"{where} has time stamps that do not follow the order of its frames, as AVI files with B-frames have; "
                "convert it to MP4"
            )
        first = first or frame
    assert first is not None
    return first


def rate_of(index: Index, declared: float, tick_s: float) -> tuple[float, bool]:
    """Return the mean frame rate, 1/s, and whether it is constant; `declared` is the header's, 0 for none."""
    intervals = np.diff(index.pts)
    if not len(intervals):
        return declared or 1.0, True
    mean = float(1 / (intervals.mean() * tick_s))
    usual = np.median(intervals)
    # Coarse ticks (a millisecond in Matroska) shift single frames by up to one tick.
    constant = bool(np.all(np.abs(intervals - usual) <= max(_RATE_JITTER * usual, 1)))
    # The header's rate is exact; the mean over a short clip is rounded to ticks.
    return (declared if constant and abs(declared / mean - 1) < 0.005 else mean), constant


def time_stamps_of(index: Index, tick_s: float) -> TimeStamps:
    """Return start and regularity of the time stamps of a video; `tick_s` is their unit, s."""
    start_s, intervals = float(index.pts[0]) * tick_s, np.diff(index.pts)
    if len(intervals) < 2:
        return TimeStamps(start_s, 0.0, 0, 0.0)
    ticks, k = (index.pts - index.pts[0]).astype(np.float64), np.arange(len(index.pts))
    slope, ahead = np.polyfit(k, ticks, 1)
    apart = float(np.abs(ticks - (slope * k + ahead)).max())
    # Of intervals that alternate, the median may be the shorter; the mean over all is drawn out by gaps.
    usual = max(np.median(intervals), intervals.mean())
    usual = intervals[intervals <= LONG_INTERVAL * usual].mean()
    n_gaps = int((intervals > LONG_INTERVAL * usual).sum())
    return TimeStamps(start_s, apart / slope if apart > 1 else 0.0, n_gaps, float(1 / (usual * tick_s)))


def _sorted(shown: list[int], keys: list[int], position: dict[int, int], before: int | None) -> Index:
    """Build the index of the frames shown before a time stamp; of all frames for None."""
    pts, key_pts = np.array(sorted(shown), dtype=np.int64), np.array(sorted(keys), dtype=np.int64)
    if before is not None:
        pts, key_pts = pts[pts < before], key_pts[key_pts < before]
    return Index(pts, position, key_pts)


def _promises_more(container: InputContainer, stream: VideoStream, end: int) -> bool:
    """Return whether the header lists frames that the file lacks; `end` is the end of the last one, ticks."""
    if "mp4" in container.format.name:
        # The durations here do not help, because an edit list may skip frames.
        return any(e.pos + e.size > container.size for e in stream.index_entries)
    if container.duration is None or len(container.streams) > 1:
        return False  # the file's duration may be that of its sound
    missing_s = container.duration / av.time_base - end * float(stream.time_base or 0)
    return missing_s > LONG_INTERVAL / float(stream.average_rate or 1)
