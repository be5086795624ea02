"""Stretches of a long recording: where it is cut, and under which names its people were found.

A recording is cut where everybody has a keyframe; the stretches on both sides share that frame. Where there is none,
they share a second of frames, on which their tracks are compared and joined (`tracker.batch.join`).
"""

from collections.abc import Collection
from math import ceil

import msgspec

from tracker.estimation.tracking.pose_errors import OFF_M


class RecordingStretch(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Frames of a recording that one worker tracks."""

    number: int
    """In the order of time."""
    first: int
    """Its first frame."""
    last: int
    """Its last frame."""
    names: tuple[int, ...] = ()
    """Of several people: for each in their order, who it is that is found under their name, as a position in that
    order. Empty where they are found under their own names."""

    @property
    def key(self) -> str:
        """Name of its files."""
        return "-".join([f"{self.number:03d}", *map(str, self.names)])


class Division(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A long recording whose people were found, and its stretches."""

    frames: tuple[int, int, int]
    """The frames to track: first, end and step."""
    people: tuple[int, ...]
    """Indices of the people to track."""
    start: int
    """Frame of their first poses, on which everybody bears the right name."""
    stretches: tuple[RecordingStretch, ...]
    seconds: float = 0.0
    """Time that finding, acquiring and joining took so far, by the clock."""
    cpu_seconds: float = 0.0
    """Processor time of that."""

    @property
    def range(self) -> range:
        """The frames to track."""
        return range(*self.frames)


class SeamRow(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A frame at which two stretches were joined."""

    frame: int
    """The first frame of the later stretch."""
    person: str
    apart_mm: float
    """How far the two tracks lie apart there, the largest of the limb joints, mm."""

    @property
    def is_over(self) -> bool:
        """Whether it is over the tolerance: so far apart, a limb is off in one of the two tracks."""
        return self.apart_mm > 1000 * OFF_M


def n_stretches(n_frames: int, length: int) -> int:
    """Return into how many stretches of at least some length a recording is cut where it has no keyframes."""
    return max(1, n_frames // length) if length else 1


def divide(frames: range, keyframes: Collection[int], length: int, fps: float) -> tuple[RecordingStretch, ...]:
    """Cut frames into stretches.

    A cut is moved by up to half of the length to the nearest keyframe.

    Args:
        frames: to track.
        keyframes: frames on which everybody has one.
        length: of a stretch at least, in frames that are tracked; 0 for a single stretch.
        fps: frame rate, 1/s; without a keyframe, two stretches share the frames of a second.
    """
    marked = [i for i, frame in enumerate(frames) if frame in keyframes]
    half = min(ceil(fps / frames.step / 2), length // 2)
    out, begin, at = list[RecordingStretch](), 0, 0
    while (n := n_stretches(len(frames) - at, length)) > 1:
        wanted = at + (len(frames) - at) // n
        near = min(marked, key=lambda i: abs(i - wanted), default=None)
        if near is not None and abs(near - wanted) <= length // 2:
            at = end = near
            following = near
        else:
            at, end, following = wanted, wanted + half - 1, wanted - half
        out.append(RecordingStretch(len(out), frames[begin], frames[end]))
        begin = following
    return (*out, RecordingStretch(len(out), frames[begin], frames[-1]))
