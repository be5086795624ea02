"""Read HDF5 files (SLEAP, NWB, DeepLabCut) in a process of their own, and replace points in them.

The HDF5 library hangs on some damaged files, or ends the process that reads them. So another process reads a file,
within limits of time and memory, and hands back plain arrays.
"""

import os
import shutil
import subprocess
import tempfile
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.files import check_regular
from tracker.formats.keypoints.picture_table import PictureTable
from tracker.formats.keypoints.point_changes import Changes
from tracker.formats.number_rows import MAX_VALUES
from tracker.system import own_module

CHANGES, PATCHED = "changes.npz", "patched"
"""Names of the file of changes to a file of key points, and of the copy that gets them, without its suffix."""


class ReadingLimits(NamedTuple):
    """Limits of the process that reads a file."""

    seconds: float
    """To load sleap-io takes 2 s; damaged files may take for ever."""
    memory_bytes: int
    """Addresses that it may take up, where the system can limit them: room for the largest table a few times."""


LIMITS = ReadingLimits(300.0, 16 * np.dtype(float).itemsize * MAX_VALUES)
"""Tables of the largest size take 0.3 GB, and are held up to five times; libraries take up 0.5 GB."""

_REMEDIES = {"install": Remedy("install_extra", extra="import"), "other format": Remedy("export_other_format")}


class VideoHead(msgspec.Struct):
    """The key points of one video, but for the arrays."""

    video: str
    names: tuple[str, ...]
    notes: tuple[str, ...] = ()
    is_by_hand: bool = False


class ReadAnswer(msgspec.Struct):
    """The answer of the process that reads a file."""

    videos: tuple[VideoHead, ...] = ()
    error: str = ""
    """Sentence on why it cannot be read; empty if it can."""
    remedy: str = ""
    """One of `_REMEDIES`; empty if there is none."""


def read_hdf5_apart(path: Path) -> list[tuple[Path, PictureTable]]:
    """Read the key points of each video of a file, with the video's path.

    Raises:
        FormatError: the file is malformed, a package is not installed, or the reading process fails or takes too long.
    """
    with _folder_for(path) as folder:
        out = []
        for i, video in enumerate(_answer(path, folder).videos):
            with np.load(folder / f"{i}.npz", allow_pickle=False) as arrays:
                numbers, points, tracks = arrays["numbers"], arrays["points"], arrays["tracks"]
            more = {"notes": video.notes, "is_by_hand": video.is_by_hand}
            table = PictureTable(video.names, numbers, points, tracks=tracks if tracks.size else None, **more)
            out.append((Path(video.video), table))
        return out


def patch_hdf5_apart(path: Path, changes: Mapping[int, Changes]) -> bytes:
    """Return a file with points of some rows replaced, by the number of the video; all other numbers stay.

    Raises:
        FormatError: points of such a file cannot be replaced, or a table has no columns left for a new person; else as
            `read_hdf5_apart`.
    """
    flat = [
        (video, row, person, values)
        for video, rows in changes.items()
        for row, people in rows.items()
        for person, values in people
    ]
    *numbers, values = zip(*flat, strict=True)
    with _folder_for(path) as folder:
        np.savez(folder / CHANGES, numbers=np.array(numbers), values=np.stack(values))
        copy = folder / (PATCHED + path.suffix.lower())
        shutil.copyfile(path, copy)
        _answer(path, folder)
        return copy.read_bytes()


@contextmanager
def _folder_for(path: Path) -> Generator[Path, None, None]:
    """Make a temporary folder for a file and its answer; errors within become sentences."""
    where = f"file {path}"
    try:
        check_regular(path)
        with tempfile.TemporaryDirectory() as folder:
            yield Path(folder)
    except subprocess.TimeoutExpired as error:
        found = f"it took over {error.timeout:.0f} s, as damaged files do"
        raise FormatError(f"{where} cannot be read: {found}; export it again") from error
    except OSError as error:
        raise FormatError(f"{where} cannot be read: {error.strerror or error}; check the path") from error


def _answer(path: Path, folder: Path) -> ReadAnswer:
    """Run the other process on a file, and return its answer from the folder."""
    root = str(Path(__file__).resolve().parents[3])
    # Each thread of a library for matrices would take up addresses, which are limited.
    environment = os.environ | dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    environment |= {"PYTHONPATH": os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))}
    words = [*own_module("tracker.formats.keypoints.hdf5_process"), str(path.resolve()), str(folder)]
    subprocess.run(
        words, env=environment, timeout=LIMITS.seconds, capture_output=True, check=False, stdin=subprocess.DEVNULL
    )
    try:
        answer = msgspec.json.decode((folder / "answer.json").read_bytes(), type=ReadAnswer)
    except (OSError, msgspec.DecodeError) as error:
        raise FormatError(f"file {path} cannot be read: its library failed; export it again") from error
    if answer.error:
        raise FormatError(answer.error, _REMEDIES.get(answer.remedy))
    return answer
