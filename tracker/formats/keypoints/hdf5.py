"""Read HDF5 files (SLEAP, NWB, DeepLabCut) in a process of their own.

The HDF5 library hangs on some damaged files, or ends the process that reads them. So another process reads a file,
within a time limit, and hands back plain arrays.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import msgspec
import numpy as np

from tracker.errors import FormatError, Remedy
from tracker.files import check_regular
from tracker.formats.keypoints.picture_table import PictureTable

SECONDS = 300.0
"""Time that a file may take, s. To load sleap-io takes 2 s; damaged files may take for ever."""


class VideoHead(msgspec.Struct):
    """The key points of one video, but for the arrays."""

    video: str
    names: tuple[str, ...]
    notes: tuple[str, ...] = ()


class ReadAnswer(msgspec.Struct):
    """The answer of the process that reads a file."""

    videos: tuple[VideoHead, ...] = ()
    error: str = ""
    """Sentence on why it cannot be read; empty if it can."""
    remedy: str = ""


def read_hdf5_apart(path: Path) -> list[tuple[Path, PictureTable]]:
    """Read the key points of each video of a file, with the video's path.

    Raises:
        FormatError: the file is malformed, a package is not installed, or the reading process fails or takes too long.
    """
    where = f"file {path}"
    try:
        check_regular(path)
        with tempfile.TemporaryDirectory() as folder:
            return _answer(path, Path(folder))
    except subprocess.TimeoutExpired as error:
        raise FormatError(
            f"{where} cannot be read: it took over {error.timeout:.0f} s, as damaged files do; export it again"
        ) from error
    except OSError as error:
        raise FormatError(f"{where} cannot be read: {error.strerror or error}; check the path") from error


def _answer(path: Path, folder: Path) -> list[tuple[Path, PictureTable]]:
    root = str(Path(__file__).resolve().parents[3])
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))}
    words = [sys.executable, "-m", "tracker.formats.keypoints.hdf5_process", str(path.resolve()), str(folder)]
    subprocess.run(words, env=environment, timeout=SECONDS, capture_output=True, check=False, stdin=subprocess.DEVNULL)
    try:
        answer = msgspec.json.decode((folder / "answer.json").read_bytes(), type=ReadAnswer)
    except (OSError, msgspec.DecodeError) as error:
        raise FormatError(f"file {path} cannot be read: its library failed; export it again") from error
    if answer.error:
        raise FormatError(answer.error, Remedy("install_import") if answer.remedy else None)
    out = []
    for i, video in enumerate(answer.videos):
        with np.load(folder / f"{i}.npz", allow_pickle=False) as arrays:
            table = PictureTable(video.names, arrays["numbers"], arrays["points"], notes=video.notes)
        out.append((Path(video.video), table))
    return out
