"""The index of a video's frames, cached on the disk: listing the packets of a long video takes seconds."""

import hashlib
import os
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tracker.geometry.arrays import DAMAGED_ARRAYS

VERSION = 1
"""Version of the stored lists; with another one they are made again."""


class Index(NamedTuple):
    """The frames of a video according to its packets, without decoding."""

    pts: NDArray[np.int64]
    """Presentation time stamps of the frames that are shown, ascending, (n_frames,)."""
    position: dict[int, int]
    """Index in the file of the packet with each presentation time stamp."""
    key_pts: NDArray[np.int64]
    """Presentation time stamps of the frames at which decoding can start, ascending."""


def file_version_key(path: Path) -> str:
    """Return a text that identifies a version of a file: its path, size and time of change."""
    stat = path.stat()
    return f"{path.resolve()}|{stat.st_size}|{stat.st_mtime_ns}"


def load(video: Path, folder: Path | None) -> Index | None:
    """Load the cached index of a video; None if there is none, or the video has changed since.

    Args:
        video: the file.
        folder: where indices are cached; None for no cache.
    """
    if folder is None:
        return None
    try:
        with np.load(_place(video, folder)) as cached:
            if str(cached["stamp"]) != file_version_key(video) or int(cached["version"]) != VERSION:
                return None
            every = cached["every"].tolist()
            return Index(cached["pts"], {pts: i for i, pts in enumerate(every)}, cached["key_pts"])
    except DAMAGED_ARRAYS:  # missing or incomplete: list the packets again
        return None
    except SystemError:  # Python 3.11 may fail to parse the header of an array while another thread parses one
        return None


def save(video: Path, folder: Path | None, index: Index) -> None:
    """Cache the index of a video. If that fails, the video is listed again next time."""
    if folder is None:
        return
    place = _place(video, folder)
    unfinished = place.with_name(f".{place.name}.{os.getpid()}.unfinished")
    every = np.array(sorted(index.position, key=index.position.__getitem__), dtype=np.int64)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with unfinished.open("wb") as file:
            np.savez_compressed(
                file, version=VERSION, stamp=file_version_key(video), pts=index.pts, every=every, key_pts=index.key_pts
            )
        unfinished.replace(place)
    except OSError:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)


def _place(video: Path, folder: Path) -> Path:
    name = hashlib.sha256(str(video.resolve()).encode()).hexdigest()[:24]
    return folder / f"{name}.npz"
