"""One camera of a session: its calibration and the paths of its images."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import floor
from pathlib import Path
from typing import Literal, NamedTuple, get_args

from tracker.geometry.cameras import Camera

PathKind = Literal["footage", "background", "masks"]


class LostFrames(NamedTuple):
    """Frames that a camera did not record."""

    since: int
    """First frame of the session whose picture is later for it."""
    n: int
    """Number of frames; negative where the camera recorded pictures twice."""


@dataclass(frozen=True)
class Clock:
    """The clock of a camera against that of the session, besides the whole frames of `CameraSource.offset`.

    The picture shown on frame k was taken at the time k + `ahead(k)`, in frames of the session.
    """

    ahead_frames: float = 0.0
    """Frames by which the picture of frame 0 was taken later than frame 0; negative if earlier."""
    rate: float = 0.0
    """Change of that from one frame to the next, frames; as a pure number it is the same in seconds per second."""
    lost: tuple[LostFrames, ...] = ()
    """In the order of the frames."""

    def offset_frames(self, frame: float) -> float:
        """Return by how many frames the picture of a frame was taken later than the frame."""
        return self.ahead_frames + self.rate * frame + sum(lost.n for lost in self.lost if frame >= lost.since)

    def nearest(self, frame: int, n_frames: int) -> int:
        """Return the frame, of so many, whose picture was taken nearest to the time of a frame."""
        found = []
        for first, end in pairwise((0, *(min(lost.since, n_frames) for lost in self.lost), n_frames)):
            if first < end:  # Between two losses the time of the picture is a straight line over the frames.
                ahead = self.offset_frames(first) - self.rate * first
                found.append(min(max(first, floor((frame - ahead) / (1 + self.rate) + 0.5)), end - 1))
        return min(found, key=lambda k: abs(k + self.offset_frames(k) - frame))

    def with_lost(self, more: LostFrames) -> "Clock":
        """Return the clock of a camera that lost more frames."""
        n = {lost.since: lost.n for lost in self.lost}
        n[more.since] = n.get(more.since, 0) + more.n
        return replace(self, lost=tuple(LostFrames(since, n[since]) for since in sorted(n) if n[since]))

    def is_in_step(self, n_frames: int) -> bool:
        """Return whether the picture of each frame, of so many, is the nearest one to its time."""
        turns = {0, n_frames // 2, n_frames - 1, *(k for lost in self.lost for k in (lost.since - 1, lost.since))}
        return all(self.nearest(k, n_frames) == k for k in turns if 0 <= k < n_frames)


@dataclass(frozen=True, eq=False)
class CameraSource:
    """A camera with its footage, background and masks."""

    camera: Camera
    footage: Path
    """Video file, or folder of images; absolute."""
    background: Path | None = None
    """Image, video, or folder of images of the empty scene in original pixels; absolute."""
    masks: Path | None = None
    """Folder of %06d.png by video frame: 0 background, 255 anyone, 1..K person K; original pixels; absolute."""
    offset: int = 0
    """Frame k of the session is frame k + offset of the footage; not negative."""
    declared_fps: float | None = None
    """Frame rate that the video declares where it is not the session's, as for high-speed footage, 1/s."""
    footage_frames: int | None = None
    """Number of frames of the footage where frames at its end are left out because other cameras lack them."""
    clock: Clock = Clock()
    """Time of the pictures below a frame, and its drift."""

    @property
    def paths(self) -> dict[PathKind, Path]:
        """Paths of its footage, background and masks; of those that it has."""
        kinds: tuple[PathKind, ...] = get_args(PathKind)
        return {kind: path for kind in kinds if (path := getattr(self, kind)) is not None}

    @property
    def start_frames(self) -> float:
        """Frame of the footage, with its fraction, at the time of frame 0 of the session."""
        return self.offset - self.clock.ahead_frames

    def starting_at(self, start_frames: float, rate: float | None = None) -> "CameraSource":
        """Return the camera with its nearest whole frame as offset and the rest in its clock.

        Args:
            start_frames: see the property.
            rate: drift of the clock, see `Clock`; unchanged by default.
        """
        offset = whole_frames(start_frames)
        # Fractions are typed with some digits: 2 - 2.4 would leave -0.3999999999999999.
        ahead = round(float(offset - start_frames), 9)
        clock = replace(self.clock, ahead_frames=ahead, rate=self.clock.rate if rate is None else rate)
        return replace(self, offset=offset, clock=clock)

    def with_lost_in_footage(self, lost: Sequence[LostFrames]) -> "CameraSource":
        """Return the camera with frames that it lost, given by the frames of its footage."""
        rows = tuple(LostFrames(row.since - self.offset, row.n) for row in lost if row.since > self.offset)
        return replace(self, clock=replace(self.clock, lost=rows))


def ahead_frames(cameras: Sequence[CameraSource], shown: Sequence[int], k: int) -> tuple[float, ...]:
    """Return by how many frames the picture that each camera shows was taken later than frame k; see `Clock`."""
    return tuple(c.clock.offset_frames(at) + at - k for c, at in zip(cameras, shown, strict=True))


def whole_frames(start_frames: float) -> int:
    """Return the nearest whole frame; frame 0 within a frame before it, since footage has none earlier."""
    return 0 if -1 < start_frames < 0 else round(start_frames)


class MissingFile(NamedTuple):
    """A file or folder that a session names and that is not there."""

    camera: str
    kind: PathKind
    path: Path


def missing_files(cameras: Sequence[CameraSource]) -> tuple[MissingFile, ...]:
    """Return what a session names and is not there, by camera; opens none of its files."""
    named = ((s.camera.name, kind, path) for s in cameras for kind, path in s.paths.items())
    return tuple(MissingFile(*found) for found in named if not found[-1].exists())
