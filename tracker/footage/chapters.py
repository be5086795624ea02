"""A recording that a camera has cut into files, its chapters, as the footage of one camera."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from tracker.errors import RecordingError
from tracker.footage.frame_rates import same_rate
from tracker.footage.image_file import IMAGE_SUFFIXES
from tracker.footage.image_folder import natural_order
from tracker.footage.packet_scan import TimeStamps
from tracker.geometry.arrays import Image, IntArray

VIDEO_SUFFIXES = (".mp4", ".mov", ".mkv", ".avi", ".webm")
"""By which files of a folder are taken for videos."""
_GOPRO = re.compile(r"(?P<codec>G[HXLS]|GP)(?P<chapter>[0-9]{2})(?P<recording>[0-9]{4})|GOPR(?P<first>[0-9]{4})", re.I)
"""Names of GoPro's chapters: GX010042, GX020042; of older cameras GOPR0042, GP010042."""
_NUMBERED = re.compile(r"((?:C|MVI_|DJI_)(?:[0-9]+_)??)([0-9]{4,5})(_D)?", re.I)
"""Names of files of Sony, Canon and DJI: C0001, MVI_0001, DJI_0001, DJI_20240311142530_0001_D."""


class Chapter(Protocol):
    """A video file, as `VideoFile` is."""

    path: Path
    size: tuple[int, int]
    is_mirrored: bool
    fps: float
    has_constant_rate: bool
    stamps: TimeStamps | None
    version: int

    @property
    def n_frames(self) -> int: ...  # noqa: D102
    @property
    def key_frames(self) -> IntArray: ...  # noqa: D102
    @property
    def listed_share(self) -> float | None: ...  # noqa: D102
    def read(self, k: int) -> Image | None: ...  # noqa: D102
    def wait_for(self, k: int) -> None: ...  # noqa: D102
    def look_again(self) -> None: ...  # noqa: D102
    def close(self) -> None: ...  # noqa: D102


class ChapteredVideo:
    """A folder of video files that follow one another. Frames are counted through all of them."""

    def __init__(self, path: Path, camera: str, chapters: Sequence[Chapter]) -> None:
        """Join videos.

        Args:
            path: the folder.
            camera: name of its camera, for messages.
            chapters: its files in order, opened, at least one.

        Raises:
            RecordingError: their pictures differ in size or rate.
        """
        self.path, self.chapters, self._where = path, tuple(chapters), f"camera '{camera}': folder of videos {path}"
        first = self.chapters[0]
        self.size, self.is_mirrored = first.size, first.is_mirrored
        for other in self.chapters[1:]:
            if other.size != first.size or not same_rate(other.fps, first.fps):
                raise RecordingError(
                    f"{self._where}: expected chapters of one recording, {first.size[0]}x{first.size[1]} pixels at "
                    f"{first.fps:g} per second, found {other.size[0]}x{other.size[1]} at {other.fps:g} in "
                    f"{other.path.name}; leave only the files of one recording in it"
                )

    @property
    def fps(self) -> float:
        """Frame rate, 1/s."""
        return self.chapters[0].fps

    @property
    def has_constant_rate(self) -> bool:
        """Whether all intervals between frames are equal within each file."""
        return all(c.has_constant_rate for c in self.chapters)

    @property
    def stamps(self) -> TimeStamps | None:
        """Time stamps: the start of the first file, the worst regularity of all; None while frames are being listed."""
        stamps = [c.stamps for c in self.chapters if c.stamps is not None]
        if len(stamps) < len(self.chapters):
            return None
        return stamps[0]._replace(jitter=max(s.jitter for s in stamps), n_gaps=sum(s.n_gaps for s in stamps))

    @property
    def version(self) -> int:
        """Number of times that a file was opened again because it had changed."""
        return sum(c.version for c in self.chapters)

    @property
    def n_frames(self) -> int:
        """Number of frames; while files are being listed, up to the end of the first list that is not complete."""
        n = 0
        for chapter in self.chapters:
            share = chapter.listed_share
            n += chapter.n_frames
            if share is not None:
                break
        return n

    @property
    def key_frames(self) -> IntArray:
        """Frames listed so far that are decoded alone, ascending, (n,)."""
        firsts = np.cumsum([0, *(c.n_frames for c in self.chapters[:-1])])
        keys = np.concatenate([c.key_frames + first for c, first in zip(self.chapters, firsts, strict=True)])
        return keys[keys < self.n_frames]

    @property
    def listed_share(self) -> float | None:
        """Share of the files that has been listed, 0 to 1; None when all is.

        Raises:
            RecordingError: listing a file has failed.
        """
        shares = [c.listed_share for c in self.chapters]
        if all(share is None for share in shares):
            return None
        return sum(1.0 if share is None else share for share in shares) / len(shares)

    def read(self, k: int) -> Image | None:
        """Decode frame k, (H, W, 3) RGB; None if the frame is damaged.

        Raises:
            RecordingError: as `VideoFile.read`.
        """
        at = k
        for chapter in self.chapters if k >= 0 else ():
            chapter.wait_for(at)
            if at < chapter.n_frames:
                return chapter.read(at)
            at -= chapter.n_frames
        raise RecordingError(f"{self._where}: expected a frame from 0 to {self.n_frames - 1}, found {k}")

    def look_again(self) -> None:
        """Open files again that have changed.

        Raises:
            RecordingError: as `VideoFile.look_again`.
        """
        for chapter in self.chapters:
            chapter.look_again()

    def close(self) -> None:
        """Release the files."""
        for chapter in self.chapters:
            chapter.close()


def chapter_files(folder: Path) -> list[Path]:
    """Return the videos of a folder in the order of a recording's chapters; none if it has images too, or no video."""
    files = [f for f in folder.iterdir() if not f.name.startswith(".")]
    if any(f.suffix.lower() in IMAGE_SUFFIXES for f in files):
        return []
    return sorted((f for f in files if f.suffix.lower() in VIDEO_SUFFIXES and f.is_file()), key=_order)


def next_chapter(path: Path) -> Path | None:
    """Return the file beside a video that continues it by its name, as GoPro, Sony, Canon and DJI number files."""
    parts = _GOPRO.fullmatch(path.stem)
    if parts is not None and parts["first"]:
        stem = f"GP01{parts['first']}"
    elif parts is not None:
        stem = f"{parts['codec']}{int(parts['chapter']) + 1:02}{parts['recording']}"
    elif (number := _NUMBERED.fullmatch(path.stem)) is not None:
        stem = f"{number[1]}{int(number[2]) + 1:0{len(number[2])}}{number[3] or ''}"
    else:
        return None
    following = path.with_name(stem + path.suffix)
    return following if following.is_file() else None


def _order(path: Path) -> list[tuple[int, int | str]]:
    """Return a sort key: GoPro's recordings and chapters, else digits as numbers."""
    parts = _GOPRO.fullmatch(path.stem)
    if parts is not None:
        return [(0, int(parts["recording"] or parts["first"])), (0, int(parts["chapter"] or 0))]
    return natural_order(path)
